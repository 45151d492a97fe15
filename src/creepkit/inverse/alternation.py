"""Values given the scatter, scatter given the values, in turn until the likelihood no longer grows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.covariance import log_likelihood, cholesky_factors
from creepkit.inverse.effects import NuisanceParameters
from creepkit.inverse.objective import ResidualFunction
from creepkit.inverse.residuals import Residuals
from creepkit.inverse.restricted import BOUND_TOLERANCE, LinearisedProblem, scaled_inverse, inverse_covariances, restricted_log_likelihood
from creepkit.inverse.scatter import NoiseModel
from creepkit.inverse.search.box import Bounds
from creepkit.inverse.search.refining import Minimum, IterationCallback, bounded_least_squares
from creepkit.inverse.uncertainty import normal_matrix, marginal_log_likelihood
from creepkit.inverse.weighting import WorkingNoise, with_rupture_weight, robust_test_weights

PRIOR_STEPS = 30
"""Steps of the estimate of unknown spreads in each round; they cost no simulation."""
LIKELIHOOD_TOLERANCE = 1e-5
"""Relative change of a chi-square that ends a refinement by likelihood: some thousandth of one, well inside an interval
and above what the steps of a solver leave."""
CONVERGED_GAIN = 0.02
"""Gain of the log-likelihood, and change of a test's weight, that ends the rounds."""


@dataclass(frozen=True)
class IterationLimits:
    """How long to refine: rounds, and steps of least squares with their tolerance in each."""

    rounds: int = 8
    steps: int = 40
    tolerance: float = 1e-8


APPROXIMATE_LIMITS = IterationLimits(rounds=3, steps=15, tolerance=1e-4)
"""For a predictor on the way to another."""
SIMULATION_LIMITS = IterationLimits(rounds=5, steps=25, tolerance=1e-6)
"""For predictors with a stand-in: solvers are smooth to about that."""


@dataclass(frozen=True)
class EstimationResult:
    """Where values and working scatter agree: the optimum, its residuals, spreads of unknowns, and the likelihood."""

    minimum: Minimum
    residuals: Residuals
    working_noise: NoiseModel
    nuisance_parameters: NuisanceParameters
    log_likelihood: float
    linearised: LinearisedProblem | None = None


def estimate_iteratively(
    residual_function: ResidualFunction, bounds: Bounds, x: Floats, working_estimator: WorkingNoise, limits: IterationLimits, progress: IterationCallback | None,
    working_noise: NoiseModel | None = None,
) -> EstimationResult:  # fmt: skip
    """Refine from x = (u, e); the best round. working : where the scatter begins, if it is known already."""
    robust, best = working_estimator.settings.test_loss == "student", None
    residuals, working_noise = residual_function.evaluate(x), working_noise or working_estimator.starting_noise(len(residual_function.histories))
    for round_index in range(limits.rounds):
        previous_weights = residuals.test_weights
        test_weights = robust_test_weights(residuals, working_noise) if robust else previous_weights
        residuals = residuals.with_test_weights(test_weights)
        working_noise = working_estimator.estimate(residuals, working_noise, linearised(residual_function, bounds, x, residuals))
        # A stopped test that says nothing here may say something a step further.
        all_observations = replace(residuals, present=residual_function.observations.present)
        if best is not None and working_estimator.by_likelihood and _expected_gain(residual_function, bounds, x, residuals, working_noise) < CONVERGED_GAIN:
            break
        fitting_noise = working_noise if working_estimator.by_likelihood else with_rupture_weight(working_noise, residual_function.observations)
        covariance_factor = cholesky_factors(all_observations, fitting_noise)
        tolerance = max(limits.tolerance, LIKELIHOOD_TOLERANCE) if working_estimator.by_likelihood else limits.tolerance
        minimum = bounded_least_squares(
            residual_function, bounds, covariance_factor, x, loss=working_estimator.settings.loss, max_steps=limits.steps, tolerance=tolerance
        )
        x = minimum.u
        residuals = residual_function.evaluate(x).with_test_weights(test_weights)
        current = _round_result(residual_function, bounds, minimum, residuals, working_noise, working_estimator.by_likelihood)
        residual_function.nuisance_parameters = current.nuisance_parameters
        if progress is not None:
            progress("round", round_index + 1, limits.rounds)
        gain = np.inf if best is None else current.log_likelihood - best.log_likelihood
        best = current if best is None or gain > 0 or robust else best
        if abs(gain) < CONVERGED_GAIN and np.abs(test_weights - previous_weights).max() < CONVERGED_GAIN:
            break
    assert best is not None
    residual_function.nuisance_parameters = best.nuisance_parameters
    return best


def _expected_gain(residual_function: ResidualFunction, bounds: Bounds, x: Floats, residuals: Residuals, working_noise: NoiseModel) -> float:
    """By how much the log-likelihood of values would grow, to first order, if they moved to where the scatter asks."""
    linear = linearised(residual_function, bounds, x, residuals)
    inverses, _ = inverse_covariances(residuals, working_noise)
    chi_square = np.einsum("te,tef,tf->", residuals.values, inverses, residuals.values)
    chi_square += (linear.precision * linear.prior_residual**2).sum()
    return 0.5 * float(chi_square - linear.solve(inverses).chi_square)


def linearised(residual_function: ResidualFunction, bounds: Bounds, x: Floats, residuals: Residuals) -> LinearisedProblem:
    """The problem made linear at x = (u, e): weak priors of the bounds on u, their own on e."""
    law_parameters = x.size - residual_function.nuisance_parameters.size
    precision = np.concatenate([12.0 / bounds.width[:law_parameters] ** 2, residual_function.nuisance_parameters.precision])
    prior_residual = np.concatenate([np.zeros(law_parameters), x[law_parameters:] - residual_function.nuisance_parameters.mean[: x.size - law_parameters]])
    tolerance = BOUND_TOLERANCE * bounds.width
    free = (x > bounds.lower + tolerance) & (x < bounds.upper - tolerance)
    return LinearisedProblem(residuals, precision, prior_residual, free, np.stack([bounds.lower - x, bounds.upper - x]))


def _round_result(
    residual_function: ResidualFunction, bounds: Bounds, minimum: Minimum, residuals: Residuals, working_noise: NoiseModel, restricted: bool
) -> EstimationResult:
    """The round's end, with the spreads of unknowns that its residuals show."""
    if restricted:
        residual_function.nuisance_parameters = _with_estimated_priors(residual_function.nuisance_parameters, residuals, working_noise, minimum.u)
        linear = linearised(residual_function, bounds, minimum.u, residuals)
        likelihood = restricted_log_likelihood(linear, working_noise)
        return EstimationResult(minimum, residuals, working_noise, residual_function.nuisance_parameters, likelihood, linear)
    nuisance_parameters, likelihood = residual_function.nuisance_parameters, log_likelihood(residuals, working_noise)
    if not nuisance_parameters.size:
        return EstimationResult(minimum, residuals, working_noise, nuisance_parameters, likelihood)
    information = normal_matrix(residuals, working_noise)
    nuisance_parameters = _with_estimated_priors(nuisance_parameters, residuals, working_noise, minimum.u)
    e = minimum.u[-nuisance_parameters.size :]
    return EstimationResult(minimum, residuals, working_noise, nuisance_parameters, marginal_log_likelihood(likelihood, information, e, nuisance_parameters))


def _with_estimated_priors(nuisance_parameters: NuisanceParameters, residuals: Residuals, working_noise: NoiseModel, x: Floats) -> NuisanceParameters:
    """The unknowns with those of their spreads estimated that are to be."""
    if all(n.sd is not None for n in nuisance_parameters.nuisances):
        return nuisance_parameters
    return _with_prior_sd(nuisance_parameters, normal_matrix(residuals, working_noise), x)


def _with_prior_sd(nuisance_parameters: NuisanceParameters, normal_matrix: Floats, x: Floats) -> NuisanceParameters:
    """Expectation and maximisation in turn, on the problem made linear at its optimum x.

    At the optimum the pull of the data is that of the prior, P (x - mean); with another P the linear problem moves x
    to where both agree again.
    """
    count = nuisance_parameters.size
    prior_force = np.zeros(x.size)
    prior_force[-count:] = nuisance_parameters.precision * (x[-count:] - nuisance_parameters.mean)
    for _ in range(PRIOR_STEPS):
        prior = np.zeros(x.size)
        prior[-count:] = nuisance_parameters.precision
        variance = scaled_inverse(normal_matrix + np.diag(prior + 1e-12 * np.diag(normal_matrix)))
        target = np.zeros(x.size)
        target[-count:] = prior[-count:] * (nuisance_parameters.mean - x[-count:])
        e = (x + variance @ (prior_force + target))[-count:]
        nuisance_parameters = nuisance_parameters.with_prior_sd(e, np.diag(variance)[-count:])
    return nuisance_parameters


def starting_point(nuisance_parameters: NuisanceParameters, u: Floats, known_values: Mapping[tuple[str, str], float]) -> Floats:
    """x = (u, e) with the unknowns of tests where they are known, {(kind, member): value}, else at their means."""
    parameters = zip(nuisance_parameters.nuisances, nuisance_parameters.owners, nuisance_parameters.mean, strict=True)
    return np.concatenate([u, [known_values.get((n.kind, member), float(mean)) for n, member, mean in parameters]])
