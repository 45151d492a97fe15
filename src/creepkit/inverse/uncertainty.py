"""Intervals: Laplace's approximation with the covariance of residuals, and what the data leave undetermined.

The curvature of the log-likelihood, with autocorrelated residuals whitened by their covariance, plus a weak
Gaussian prior of the variance of each parameter's bounds; intervals are 95 %.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.objective import Residuals
from creepkit.inverse.search import Box
from creepkit.language import CreepLaw

Z95 = 1.959963984540054


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


def laplace(residuals: Residuals, factor: Floats, box: Box) -> Floats:
    """Posterior covariance of u, (parameters, parameters)."""
    assert residuals.jacobian is not None
    white = np.linalg.solve(factor, residuals.jacobian)[residuals.present]
    information = white.T @ white + np.diag(12.0 / box.width**2)
    return np.asarray(np.linalg.inv(information))


def estimates(law: CreepLaw, coordinates: Coordinates, u: Floats, covariance: Floats) -> tuple[Estimate, ...]:
    """Intervals of the author's parameters."""
    theta = coordinates.theta(u)
    to_theta = coordinates.jacobian(u)
    sd = np.sqrt(np.diag(to_theta @ covariance @ to_theta.T))
    found = []
    for (name, param), value, spread in zip(law.table.items(), theta, sd, strict=True):
        low, high = (param.to_internal(b) for b in param.bounds)
        a, b = max(value - Z95 * spread, low), min(value + Z95 * spread, high)
        a, b = min(a, value), max(b, value)
        middle, bottom, top = (param.from_internal(float(v)) for v in (value, a, b))
        verdict = _verdict(float(value), float(spread), low, high)
        found.append(Estimate(name, middle, bottom, top, param.unit, verdict))
    return tuple(found)


def _verdict(value: float, sd: float, low: float, high: float) -> str:
    if 2 * Z95 * sd >= 0.8 * (high - low):
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
