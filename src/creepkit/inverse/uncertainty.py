"""Intervals: Laplace's approximation with correlated residuals, and what the data leave undetermined.

Values minimise r' W r with the working covariance W^-1; residuals really have the covariance C. With J = dr/du the
covariance of the values is (J'WJ)^-1 J'W C W J (J'WJ)^-1, the sandwich, joined with a weak Gaussian prior of the
variance of each parameter's bounds. Intervals are 95 %. Sizes of scatter come from the same data: with N effectively
independent frames (about one a test when tests differ) and K parameters the covariance is scaled by N/(N - K) and
quantiles are Student's with N - K degrees of freedom.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from creepkit.arrays import Floats
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.objective import Residuals
from creepkit.inverse.search import Box
from creepkit.language import CreepLaw


@dataclass(frozen=True)
class Estimate:
    """One parameter: value, 95 % interval in the author's unit, and a verdict.

    verdict : "determined", "at its bound", or "not determined" (the interval fills four fifths of the bounds).
    """

    name: str
    value: float
    low: float
    high: float
    unit: str
    verdict: str


def quantile(size: float, count: int) -> float:
    """Half width of a 95 % interval in standard deviations, for `size` independent frames and `count` parameters."""
    return float(student.ppf(0.975, max(size - count, 1.0)))


def laplace(residuals: Residuals, working: Floats, whole: Floats, box: Box, size: float) -> Floats:
    """Posterior covariance of u, (parameters, parameters).

    working, whole : (tests, frames, frames) Cholesky factors of the working and of the whole covariance.
    """
    assert residuals.jacobian is not None
    count = box.width.size
    white = np.linalg.solve(working, residuals.jacobian)
    weighted = np.linalg.solve(np.swapaxes(working, 1, 2), white)
    root = np.swapaxes(whole, 1, 2) @ weighted
    bread = np.einsum("tfp,tfq->pq", white, white) + 1e-12 * np.diag(1.0 / box.width**2)
    meat = np.einsum("tfp,tfq->pq", root, root) * max(size, 1.0) / max(size - count, 1.0)
    scale = np.sqrt(np.diag(bread))
    inner = np.linalg.pinv(bread / np.outer(scale, scale), hermitian=True, rcond=1e-13) / np.outer(scale, scale)
    free = inner @ meat @ inner
    prior = np.diag(box.width**2 / 12.0)
    return np.asarray(prior - prior @ np.linalg.solve(prior + free, prior))


def estimates(law: CreepLaw, coordinates: Coordinates, u: Floats, covariance: Floats, wide: float) -> tuple[Estimate, ...]:
    """Intervals of the author's parameters, `wide` standard deviations to each side."""
    theta = coordinates.theta(u)
    to_theta = coordinates.jacobian(u)
    sd = np.sqrt(np.diag(to_theta @ covariance @ to_theta.T))
    found = []
    for (name, param), value, spread in zip(law.table.items(), theta, sd, strict=True):
        low, high = (param.to_internal(b) for b in param.bounds)
        a, b = max(value - wide * spread, low), min(value + wide * spread, high)
        a, b = min(a, value), max(b, value)
        middle, bottom, top = (param.from_internal(float(v)) for v in (value, a, b))
        verdict = _verdict(float(value), float(wide * spread), low, high)
        found.append(Estimate(name, middle, bottom, top, param.unit, verdict))
    return tuple(found)


def _verdict(value: float, half: float, low: float, high: float) -> str:
    if 2 * half >= 0.8 * (high - low):
        return "not determined"
    if min(value - low, high - value) <= 1e-4 * (high - low):
        return "at its bound"
    return "determined"


def band(
    function: Callable[[Floats], Floats], u: Floats, covariance: Floats, step: float = 1e-4
) -> tuple[Floats, Floats]:
    """Value and standard deviation of functions of u, by the delta method with central differences.

    function : u (parameters,) -> (...,); returns two arrays of that shape.
    """
    sd = np.sqrt(np.diag(covariance))
    columns = []
    for k in range(u.size):
        h = np.zeros(u.size)
        h[k] = step * max(sd[k], 1e-8)
        columns.append((function(u + h) - function(u - h)) / (2 * h[k]))
    slope = np.stack(columns, axis=-1)
    return function(u), np.sqrt(np.einsum("...i,ij,...j->...", slope, covariance, slope))
