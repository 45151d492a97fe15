"""How residuals of creep tests scatter: sources with a standard deviation each.

Residuals are not independent: one test creeps twice as fast as its twin and stays so, a model that bends wrongly is
wrong for decades of time on end. The covariance of one test's residuals, all outputs of it together, is

    C = noise^2 S S + misfit^2 I + offset^2 s s' + rate^2 d d' + drift^2 exp(-|c - c'| / reach)

with s = dg/dy (S its diagonal): `noise` of each frame (in the output's unit), `misfit` of each frame on the scale,
`offset` of the whole curve (loading strain), `rate` scatter between tests (d = derivative to ln of a factor on the
creep rate: heat-to-heat scatter) and `drift`, an Ornstein-Uhlenbeck process for what the law cannot follow and what
the instrument wanders, on the clock c: ln t for strains that span decades, time itself for other outputs.
Each output has sizes of its own and shares none of them with another; the rate of a test moves all its outputs.

Values are estimated with `working` scatter alone (noise, misfit, offset): every frame pulls with the same weight, so
that a law which cannot bend as the data do still runs through the middle of them. Their intervals use the whole
covariance; by likelihood (see inverse.restricted) the values do too. A test of little trust has its covariance divided
by it.
"""

from __future__ import annotations

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.inverse.residuals import Residuals
from creepkit.inverse.scatter import Scatter

_JITTER = 1e-10


def covariance(residuals: Residuals, scatter: Scatter) -> Floats:
    """(tests, entries, entries); absent entries have unit variance and no company."""
    s, d, present, output = residuals.slopes, residuals.rate_effect, residuals.present, residuals.output
    drift, offset = scatter.at(output, "drift"), scatter.at(output, "offset") * s
    c = (drift**2)[:, :, None] * np.exp(-lags(residuals) / scatter.at(output, "reach")[:, :, None])
    c += offset[:, :, None] * offset[:, None, :]
    c = np.where(company(residuals), c, 0.0) if len(scatter.outputs) > 1 else c
    c += scatter.rate**2 * d[:, :, None] * d[:, None, :]
    if residuals.known is not None:
        c += residuals.known @ np.swapaxes(residuals.known, 1, 2)
    k = np.arange(s.shape[1])
    noise = scatter.at(output, "noise") * residuals.loudness
    c[:, k, k] = c[:, k, k] * (1 + 1e-9) + (noise * s) ** 2 + scatter.at(output, "misfit") ** 2 + _JITTER
    both = present[:, :, None] & present[:, None, :]
    c = np.where(both, c / residuals.trust[:, None, None], 0.0)
    c[:, k, k] = np.where(present, c[:, k, k], 1.0)
    return np.asarray(c)


def lags(residuals: Residuals) -> Floats:
    """(tests, entries, entries) distances on the clock."""
    t = residuals.clock
    return np.abs(t[:, :, None] - t[:, None, :])


def company(residuals: Residuals) -> Bools:
    """(tests, entries, entries) whether two entries are of one output."""
    return np.asarray(residuals.output[:, :, None] == residuals.output[:, None, :])


def whitener(residuals: Residuals, scatter: Scatter) -> Floats:
    """Lower Cholesky factors L of the covariance, (tests, entries, entries); L^-1 r is white."""
    return np.asarray(np.linalg.cholesky(covariance(residuals, scatter)))


def log_likelihood(residuals: Residuals, scatter: Scatter) -> float:
    """Gaussian log-likelihood of the residuals given the scatter."""
    factor = whitener(residuals, scatter)
    white = np.linalg.solve(factor, residuals.values[..., None])[..., 0]
    k = np.arange(factor.shape[1])
    log_det = 2.0 * np.log(factor[:, k, k]).sum()
    count = int(residuals.present.sum())
    return float(-0.5 * ((white**2).sum() + log_det + count * np.log(2 * np.pi)))


def expected_effects(residuals: Residuals, scatter: Scatter) -> tuple[Floats, Floats]:
    """Best linear prediction of each test's own offsets, (tests, outputs), and ln rate factor, (tests,)."""
    plain = residuals.trusting(np.ones(len(residuals.values)))
    weighted = np.linalg.solve(covariance(plain, scatter), -residuals.values[..., None])[..., 0]
    pull = residuals.slopes * weighted
    offsets = [
        s.offset**2 * np.where(residuals.output == k, pull, 0.0).sum(axis=1)
        for k, s in enumerate(scatter.outputs.values())
    ]
    return np.stack(offsets, axis=1), scatter.rate**2 * (residuals.rate_effect * weighted).sum(axis=1)


def effective_size(residuals: Residuals, scatter: Scatter) -> float:
    """Number of independent observations that carry the same information on a common mean as all frames together."""
    quiet = scatter
    for output in scatter.outputs:
        quiet = quiet.changed(output, offset=0.0)
    c = covariance(residuals, quiet)
    k = np.arange(c.shape[1])
    sd = np.sqrt(c[:, k, k])
    correlation = c / (sd[:, :, None] * sd[:, None, :])
    ones = residuals.present.astype(float)
    weights = np.linalg.solve(correlation, ones[..., None])[..., 0]
    return float(np.clip((ones * weights).sum(), len(ones), ones.sum()))
