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
from creepkit.inverse.scatter import NoiseModel

_JITTER = 1e-10


def covariance(residuals: Residuals, noise_model: NoiseModel) -> Floats:
    """(tests, entries, entries); absent entries have unit variance and no company."""
    s, d, present, output = residuals.transform_derivatives, residuals.log_rate_sensitivity, residuals.present, residuals.output_index
    drift, offset = noise_model.per_observation(output, "drift"), noise_model.per_observation(output, "offset") * s
    c = (drift**2)[:, :, None] * np.exp(-time_lags(residuals) / noise_model.per_observation(output, "reach")[:, :, None])
    c += offset[:, :, None] * offset[:, None, :]
    c = np.where(same_output(residuals), c, 0.0) if len(noise_model.outputs) > 1 else c
    c += noise_model.rate**2 * d[:, :, None] * d[:, None, :]
    if residuals.random_effect_sensitivities is not None:
        c += residuals.random_effect_sensitivities @ np.swapaxes(residuals.random_effect_sensitivities, 1, 2)
    k = np.arange(s.shape[1])
    noise = noise_model.per_observation(output, "noise") * residuals.relative_noise
    c[:, k, k] = c[:, k, k] * (1 + 1e-9) + (noise * s) ** 2 + noise_model.per_observation(output, "misfit") ** 2 + _JITTER
    present_pairs = present[:, :, None] & present[:, None, :]
    c = np.where(present_pairs, c / residuals.test_weights[:, None, None], 0.0)
    c[:, k, k] = np.where(present, c[:, k, k], 1.0)
    return np.asarray(c)


def time_lags(residuals: Residuals) -> Floats:
    """(tests, entries, entries) distances on the clock."""
    t = residuals.correlation_time
    return np.abs(t[:, :, None] - t[:, None, :])


def same_output(residuals: Residuals) -> Bools:
    """(tests, entries, entries) whether two entries are of one output."""
    return np.asarray(residuals.output_index[:, :, None] == residuals.output_index[:, None, :])


def cholesky_factors(residuals: Residuals, noise_model: NoiseModel) -> Floats:
    """Lower Cholesky factors L of the covariance, (tests, entries, entries); L^-1 r is white."""
    return np.asarray(np.linalg.cholesky(covariance(residuals, noise_model)))


def log_likelihood(residuals: Residuals, noise_model: NoiseModel) -> float:
    """Gaussian log-likelihood of the residuals given the scatter."""
    covariance_factor = cholesky_factors(residuals, noise_model)
    whitened = np.linalg.solve(covariance_factor, residuals.values[..., None])[..., 0]
    k = np.arange(covariance_factor.shape[1])
    log_det = 2.0 * np.log(covariance_factor[:, k, k]).sum()
    count = int(residuals.present.sum())
    return float(-0.5 * ((whitened**2).sum() + log_det + count * np.log(2 * np.pi)))


def predicted_random_effects(residuals: Residuals, noise_model: NoiseModel) -> tuple[Floats, Floats]:
    """Best linear prediction of each test's own offsets, (tests, outputs), and ln rate factor, (tests,)."""
    unweighted = residuals.with_test_weights(np.ones(len(residuals.values)))
    weighted = np.linalg.solve(covariance(unweighted, noise_model), -residuals.values[..., None])[..., 0]
    weighted_sensitivity = residuals.transform_derivatives * weighted
    offsets = [
        s.offset**2 * np.where(residuals.output_index == k, weighted_sensitivity, 0.0).sum(axis=1)
        for k, s in enumerate(noise_model.outputs.values())
    ]
    return np.stack(offsets, axis=1), noise_model.rate**2 * (residuals.log_rate_sensitivity * weighted).sum(axis=1)


def effective_sample_size(residuals: Residuals, noise_model: NoiseModel) -> float:
    """Number of independent observations that carry the same information on a common mean as all frames together."""
    without_offset = noise_model
    for output in noise_model.outputs:
        without_offset = without_offset.with_output(output, offset=0.0)
    c = covariance(residuals, without_offset)
    k = np.arange(c.shape[1])
    sd = np.sqrt(c[:, k, k])
    correlation = c / (sd[:, :, None] * sd[:, None, :])
    ones = residuals.present.astype(float)
    weights = np.linalg.solve(correlation, ones[..., None])[..., 0]
    return float(np.clip((ones * weights).sum(), len(ones), ones.sum()))
