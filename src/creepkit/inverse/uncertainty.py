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
from creepkit.inverse.covariance import covariance, effective_sample_size, cholesky_factors
from creepkit.inverse.effects import NuisanceParameters
from creepkit.inverse.residuals import Residuals
from creepkit.inverse.restricted import scaled_inverse
from creepkit.inverse.scatter import NoiseModel
from creepkit.inverse.search.box import Bounds
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


def interval_quantile(freedom: float) -> float:
    """Half width of a 95 % interval in standard deviations."""
    return float(student.ppf(0.975, max(freedom, 1.0)))


def laplace_covariance(
    residuals: Residuals, working_noise: NoiseModel, noise_model: NoiseModel, bounds: Bounds, nuisance_parameters: NuisanceParameters, *, rate_known: bool = False
) -> tuple[Floats, float]:
    """Posterior covariance of x = (u, e), (unknowns, unknowns), and its degrees of freedom.

    rate_known : the scatter of the rate between tests was given and not estimated from them.
    """
    assert residuals.jacobian is not None
    count, tests = bounds.width.size - nuisance_parameters.size, len(residuals.values)
    covariance_factor = cholesky_factors(residuals, working_noise)
    whitened = np.linalg.solve(covariance_factor, residuals.jacobian)
    weighted = np.linalg.solve(np.swapaxes(covariance_factor, 1, 2), whitened)
    prior = np.diag(np.concatenate([12.0 / bounds.width[:count] ** 2, nuisance_parameters.precision]))
    inverse_normal_matrix = scaled_inverse(np.einsum("tfp,tfq->pq", whitened, whitened) + prior)

    def meat(source: NoiseModel) -> Floats:
        c = covariance(residuals, source)
        return np.asarray(np.einsum("tfp,tfg,tgq->pq", weighted, c, weighted, optimize=True))

    without_rate = replace(noise_model, rate=0.0)
    within_meat = meat(without_rate)
    within = inverse_normal_matrix @ (within_meat + prior) @ inverse_normal_matrix
    between = inverse_normal_matrix @ (meat(noise_model) - within_meat) @ inverse_normal_matrix
    determined = (residuals.jacobian[residuals.present][:, :count] != 0).any(axis=0)
    parameters = max(int(determined.sum()), 1)
    freedoms = max(tests - parameters, 1.0), max(effective_sample_size(residuals, without_rate) - parameters, 1.0)
    if rate_known:
        freedoms = (1e9, freedoms[1])
    else:
        between *= tests / freedoms[0]
    between_share = np.diag(between)[:count] / np.maximum(np.diag(between + within)[:count], 1e-300)
    mean_between_share = float(between_share[determined].sum() / parameters)
    return within + between, 1.0 / (mean_between_share**2 / freedoms[0] + (1 - mean_between_share) ** 2 / freedoms[1])


def normal_matrix(residuals: Residuals, working_noise: NoiseModel) -> Floats:
    """J' W J of x = (u, e), (unknowns, unknowns)."""
    assert residuals.jacobian is not None
    whitened = np.linalg.solve(cholesky_factors(residuals, working_noise), residuals.jacobian)
    return np.asarray(np.einsum("tfp,tfq->pq", whitened, whitened))


def marginal_log_likelihood(log_likelihood: float, normal_matrix: Floats, e: Floats, nuisance_parameters: NuisanceParameters) -> float:
    """Log-likelihood with the unknowns of tests integrated out, by Laplace's approximation.

    curve : J' W J of x. A prior without end counts as one of the width of the unknown's limits.
    """
    if not nuisance_parameters.size:
        return log_likelihood
    sd = np.minimum(nuisance_parameters.sd, (nuisance_parameters.high - nuisance_parameters.low) / np.sqrt(12.0))
    scaled_normal_matrix = normal_matrix[-nuisance_parameters.size :, -nuisance_parameters.size :] * np.outer(sd, sd) + np.eye(nuisance_parameters.size)
    prior_residuals = (e - nuisance_parameters.mean) * np.sqrt(nuisance_parameters.precision)
    return float(log_likelihood - 0.5 * (prior_residuals**2).sum() - 0.5 * np.linalg.slogdet(scaled_normal_matrix)[1])


def parameter_estimates(
    law: CreepLaw, coordinates: Coordinates, u: Floats, covariance: Floats, quantile: float
) -> tuple[Estimate, ...]:
    """Intervals of the author's parameters, `wide` standard deviations to each side."""
    theta = coordinates.theta(u)
    to_theta = coordinates.jacobian(u)
    sd = np.sqrt(np.diag(to_theta @ covariance @ to_theta.T))
    results = []
    for (name, param), value, standard_deviation in zip(law.table.items(), theta, sd, strict=True):
        low, high = (param.to_internal(b) for b in param.bounds)
        value = min(max(value, low), high)
        value = low if value - low < 1e-9 * (high - low) else high if high - value < 1e-9 * (high - low) else value
        a, b = max(value - quantile * standard_deviation, low), min(value + quantile * standard_deviation, high)
        middle, bottom, top = (param.from_internal(float(v)) for v in (value, a, b))
        verdict = _verdict(float(value), float(quantile * standard_deviation), low, high)
        results.append(Estimate(name, middle, bottom, top, param.unit, verdict))
    return tuple(results)


def _verdict(value: float, half: float, low: float, high: float) -> str:
    if 2 * half >= 0.8 * (high - low):
        return "not determined"
    if min(value - low, high - value) <= 1e-4 * (high - low):
        return "at its bound"
    return "determined"


def delta_method(
    function: Callable[[Floats], Floats], point: Floats, covariance: Floats, step: float = 1e-4
) -> tuple[Floats, Floats]:
    """Value and standard deviation of functions of u, by the delta method with central differences.

    function : u (parameters,) -> (...,); returns two arrays of that shape.
    """
    sd = np.sqrt(np.diag(covariance))
    columns = []
    for k in range(point.size):
        step_vector = np.zeros(point.size)
        step_vector[k] = step * max(sd[k], 1e-8)
        columns.append((function(point + step_vector) - function(point - step_vector)) / (2 * step_vector[k]))
    derivatives = np.stack(columns, axis=-1)
    return function(point), np.sqrt(np.einsum("...i,ij,...j->...", derivatives, covariance, derivatives))
