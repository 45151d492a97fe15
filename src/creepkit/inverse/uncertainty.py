"""Intervals: Laplace's approximation with correlated residuals, and what the data leave undetermined.

Values minimise r' W r with the working covariance W^-1; residuals really have the covariance C. With J = dr/du the
covariance of the values is H^-1 (J'W C W J + P) H^-1, the sandwich, with H = J'WJ + P and P a weak Gaussian prior of
the variance of each parameter's bounds: what the data do not touch keeps the width of its bounds. Unknowns of tests
(thickness and so on) stand in x beside the parameters, with their own priors in P, so that the intervals of the law
hold their uncertainty. Intervals are 95 %.

Sizes of scatter come from the same few tests: with T tests and K parameters the part that the scatter between tests
contributes is scaled by T/(T - K) and has T - K degrees of freedom, the rest those of its independent frames;
Satterthwaite's formula joins them to the freedom of Student's quantile. A parameter that moves nothing that was
measured fits nothing, and does not count.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import t as student

from creepkit.arrays import Floats
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.covariance import covariance, effective_size, whitener
from creepkit.inverse.effects import Unknowns
from creepkit.inverse.residuals import Residuals
from creepkit.inverse.restricted import inverse
from creepkit.inverse.scatter import Scatter
from creepkit.inverse.search.box import Box
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


def quantile(freedom: float) -> float:
    """Half width of a 95 % interval in standard deviations."""
    return float(student.ppf(0.975, max(freedom, 1.0)))


def laplace(
    residuals: Residuals, working: Scatter, scatter: Scatter, box: Box, unknowns: Unknowns, *, rate_known: bool = False
) -> tuple[Floats, float]:
    """Posterior covariance of x = (u, e), (unknowns, unknowns), and its degrees of freedom.

    rate_known : the scatter of the rate between tests was given and not estimated from them.
    """
    assert residuals.jacobian is not None
    count, tests = box.width.size - unknowns.size, len(residuals.values)
    factor = whitener(residuals, working)
    white = np.linalg.solve(factor, residuals.jacobian)
    weighted = np.linalg.solve(np.swapaxes(factor, 1, 2), white)
    prior = np.diag(np.concatenate([12.0 / box.width[:count] ** 2, unknowns.precision]))
    inner = inverse(np.einsum("tfp,tfq->pq", white, white) + prior)

    def meat(source: Scatter) -> Floats:
        c = covariance(residuals, source)
        return np.asarray(np.einsum("tfp,tfg,tgq->pq", weighted, c, weighted, optimize=True))

    alone = replace(scatter, rate=0.0)
    own = meat(alone)
    within = inner @ (own + prior) @ inner
    between = inner @ (meat(scatter) - own) @ inner
    touched = (residuals.jacobian[residuals.present][:, :count] != 0).any(axis=0)
    fitted = max(int(touched.sum()), 1)
    free = max(tests - fitted, 1.0), max(effective_size(residuals, alone) - fitted, 1.0)
    if rate_known:
        free = (1e9, free[1])
    else:
        between *= tests / free[0]
    share = np.diag(between)[:count] / np.maximum(np.diag(between + within)[:count], 1e-300)
    part = float(share[touched].sum() / fitted)
    return within + between, 1.0 / (part**2 / free[0] + (1 - part) ** 2 / free[1])


def curvature(residuals: Residuals, working: Scatter) -> Floats:
    """J' W J of x = (u, e), (unknowns, unknowns)."""
    assert residuals.jacobian is not None
    white = np.linalg.solve(whitener(residuals, working), residuals.jacobian)
    return np.asarray(np.einsum("tfp,tfq->pq", white, white))


def marginal(likelihood: float, curve: Floats, e: Floats, unknowns: Unknowns) -> float:
    """Log-likelihood with the unknowns of tests integrated out, by Laplace's approximation.

    curve : J' W J of x. A prior without end counts as one of the width of the unknown's limits.
    """
    if not unknowns.size:
        return likelihood
    sd = np.minimum(unknowns.sd, (unknowns.high - unknowns.low) / np.sqrt(12.0))
    own = curve[-unknowns.size :, -unknowns.size :] * np.outer(sd, sd) + np.eye(unknowns.size)
    distance = (e - unknowns.mean) * np.sqrt(unknowns.precision)
    return float(likelihood - 0.5 * (distance**2).sum() - 0.5 * np.linalg.slogdet(own)[1])


def estimates(
    law: CreepLaw, coordinates: Coordinates, u: Floats, posterior: Floats, wide: float
) -> tuple[Estimate, ...]:
    """Intervals of the author's parameters, `wide` standard deviations to each side."""
    theta = coordinates.theta(u)
    to_theta = coordinates.jacobian(u)
    sd = np.sqrt(np.diag(to_theta @ posterior @ to_theta.T))
    found = []
    for (name, param), value, spread in zip(law.table.items(), theta, sd, strict=True):
        low, high = (param.to_internal(b) for b in param.bounds)
        value = min(max(value, low), high)
        value = low if value - low < 1e-9 * (high - low) else high if high - value < 1e-9 * (high - low) else value
        a, b = max(value - wide * spread, low), min(value + wide * spread, high)
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
    function: Callable[[Floats], Floats], u: Floats, posterior: Floats, step: float = 1e-4
) -> tuple[Floats, Floats]:
    """Value and standard deviation of functions of u, by the delta method with central differences.

    function : u (parameters,) -> (...,); returns two arrays of that shape.
    """
    sd = np.sqrt(np.diag(posterior))
    columns = []
    for k in range(u.size):
        h = np.zeros(u.size)
        h[k] = step * max(sd[k], 1e-8)
        columns.append((function(u + h) - function(u - h)) / (2 * h[k]))
    slope = np.stack(columns, axis=-1)
    return function(u), np.sqrt(np.einsum("...i,ij,...j->...", slope, posterior, slope))
