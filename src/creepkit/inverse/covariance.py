"""How residuals of creep tests scatter: sources with a standard deviation each, found from the data.

Residuals on the log scale are not independent: one test creeps twice as fast as its twin and stays so, a model that
bends wrongly is wrong for decades of time on end. The covariance of one test's residuals is

    C = noise^2 S S + misfit^2 I + offset^2 s s' + rate^2 d d' + drift^2 exp(-|ln t - ln t'| / reach)

with s = dg/dy (S its diagonal): `noise` of each frame (in the output's unit), `misfit` of each frame on the log scale,
`offset` of the whole curve (loading strain), `rate` scatter between tests (d = derivative to ln of a factor on the
creep rate: heat-to-heat scatter) and `drift`, an Ornstein-Uhlenbeck process in ln t for what the law cannot follow.

Values are estimated with `working` scatter alone (noise, misfit, offset): every frame pulls with the same weight, so
that a law which cannot bend as the data do still runs through the middle of them. Their intervals use the whole
covariance. Sizes are those of largest marginal likelihood (a first-order mixed-effects model, Pinheiro & Bates
(2000), Mixed-Effects Models in S and S-PLUS, ch. 7).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
from scipy.optimize import minimize

from creepkit.arrays import Floats
from creepkit.inverse.objective import Residuals
from creepkit.records import Nuisance

LONGEST = 3.0
"""Longest reach of the drift in ln t, a factor 20 in time: what lasts longer is scatter of the rate."""
ASSUMED_RATE = 0.3
"""Scatter of ln rate between tests that is assumed when fewer than three of them can show it."""
_JITTER = 1e-10
SOURCES = ("noise", "misfit", "offset", "rate", "drift", "reach")


@dataclass(frozen=True)
class Scatter:
    """Standard deviations of the sources of scatter.

    noise, offset : in the output's unit; misfit, rate, drift : in ln strain or ln rate; reach : in ln t.
    """

    noise: float
    misfit: float = 0.0
    offset: float = 0.0
    rate: float = 0.0
    drift: float = 0.0
    reach: float = 1.0

    def to_dict(self) -> dict[str, float]:
        """Plain numbers by name."""
        return {k: float(v) for k, v in asdict(self).items()}


def covariance(residuals: Residuals, log_times: Floats, scatter: Scatter) -> Floats:
    """(tests, frames, frames); absent frames have unit variance and no company."""
    s, present = residuals.slopes, residuals.present
    d = np.zeros_like(s) if residuals.rate_effect is None else residuals.rate_effect
    lag = np.abs(log_times[:, :, None] - log_times[:, None, :])
    c = scatter.drift**2 * np.exp(-lag / scatter.reach)
    c += scatter.offset**2 * s[:, :, None] * s[:, None, :] + scatter.rate**2 * d[:, :, None] * d[:, None, :]
    k = np.arange(s.shape[1])
    c[:, k, k] = c[:, k, k] * (1 + 1e-9) + (scatter.noise * s) ** 2 + scatter.misfit**2 + _JITTER
    both = present[:, :, None] & present[:, None, :]
    c = np.where(both, c, 0.0)
    c[:, k, k] = np.where(present, c[:, k, k], 1.0)
    return np.asarray(c)


def whitener(residuals: Residuals, log_times: Floats, scatter: Scatter) -> Floats:
    """Lower Cholesky factors L of the covariance, (tests, frames, frames); L^-1 r is white."""
    return np.asarray(np.linalg.cholesky(covariance(residuals, log_times, scatter)))


def log_likelihood(residuals: Residuals, log_times: Floats, scatter: Scatter) -> float:
    """Gaussian log-likelihood of the residuals given the scatter."""
    factor = whitener(residuals, log_times, scatter)
    white = np.linalg.solve(factor, residuals.values[..., None])[..., 0]
    k = np.arange(factor.shape[1])
    log_det = 2.0 * np.log(factor[:, k, k]).sum()
    count = int(residuals.present.sum())
    return float(-0.5 * ((white**2).sum() + log_det + count * np.log(2 * np.pi)))


def expected_effects(residuals: Residuals, log_times: Floats, scatter: Scatter) -> tuple[Floats, Floats]:
    """Best linear prediction of each test's own offset and ln rate factor, (tests,) each; 0 where unknown."""
    c = covariance(residuals, log_times, scatter)
    weighted = np.linalg.solve(c, -residuals.values[..., None])[..., 0]
    effect = np.zeros_like(residuals.slopes) if residuals.rate_effect is None else residuals.rate_effect
    offset = scatter.offset**2 * (residuals.slopes * weighted).sum(axis=1)
    return offset, scatter.rate**2 * (effect * weighted).sum(axis=1)


def effective_size(residuals: Residuals, log_times: Floats, scatter: Scatter) -> float:
    """Number of independent observations that carry the same information on a common mean as all frames together."""
    c = covariance(residuals, log_times, replace(scatter, offset=0.0))
    k = np.arange(c.shape[1])
    sd = np.sqrt(c[:, k, k])
    correlation = c / (sd[:, :, None] * sd[:, None, :])
    ones = residuals.present.astype(float)
    weights = np.linalg.solve(correlation, ones[..., None])[..., 0]
    return float(np.clip((ones * weights).sum(), len(ones), ones.sum()))


def working_guess(noise: float, floor: float, nuisances: Sequence[Nuisance]) -> Scatter:
    """Working scatter assumed before anything was fitted: frames wrong by a third, offsets of the scale's floor."""
    return Scatter(noise=max(noise, 1e-3 * floor), misfit=0.3, offset=_size(nuisances, "offset", floor))


def full_guess(working: Scatter, nuisances: Sequence[Nuisance]) -> Scatter:
    """Where the estimate of the whole scatter begins."""
    rate = _size(nuisances, "rate", ASSUMED_RATE)
    return replace(working, misfit=0.3 * working.misfit, rate=rate, drift=0.5 * working.misfit, reach=1.0)


def _size(nuisances: Sequence[Nuisance], kind: str, default: float) -> float:
    """Zero unless the nuisance is there; its prior if it has one."""
    sizes = [default if n.sd is None else n.sd for n in nuisances if n.kind == kind]
    return sizes[0] if sizes else 0.0


def estimated(residuals: Residuals, log_times: Floats, start: Scatter, nuisances: Sequence[Nuisance]) -> Scatter:
    """The scatter of largest likelihood, beginning from `start`.

    Sources at zero or with a given prior stay, and so does the noise, which was measured from frame to frame.
    """
    given = {"noise", *(n.kind for n in nuisances if n.sd is not None)}
    free = [name for name in SOURCES if getattr(start, name) > 0 and name not in given]
    typical = float(np.median(1.0 / np.maximum(residuals.slopes[residuals.present], 1e-12)))
    low, high = {"offset": 1e-5 * typical, "reach": 0.05}, {"offset": typical, "reach": LONGEST}

    def scatter_at(x: Floats) -> Scatter:
        return replace(start, **{n: float(v) for n, v in zip(free, np.exp(x), strict=True)})

    def cost(x: Floats) -> float:
        return -log_likelihood(residuals, log_times, scatter_at(x))

    bounds = [(np.log(low.get(n, 1e-4)), np.log(high.get(n, 5.0))) for n in free]
    x0 = np.array([np.clip(np.log(getattr(start, n)), *b) for n, b in zip(free, bounds, strict=True)])
    found = minimize(cost, x0, method="L-BFGS-B", bounds=bounds, options={"maxiter": 60, "ftol": 1e-7})
    return scatter_at(found.x)
