"""Iterative estimation: parameters given the noise model, and the noise model given the residuals, in turn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.errors_of_tests import errors_of_tests, with_errors
from creepkit.inverse.noise_covariance import CovarianceFactor, predicted_random_effects
from creepkit.inverse.noise_model import NoiseModel, Residuals
from creepkit.inverse.nuisance_parameters import NuisanceParameters
from creepkit.inverse.perturbation import Perturbation
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.search.local_refinement import IterationCallback, Minimum, Tolerances
from creepkit.inverse.variance_components import (
    BOUND_TOLERANCE,
    LinearisedProblem,
    restricted_log_likelihood,
    scaled_inverse,
)
from creepkit.inverse.working_noise import WorkingNoiseEstimator, robust_test_weights, with_single_value_weight

PRIOR_STEPS = 30
"""Steps of the estimate of prior standard deviations in each round; they cost no simulation."""


LIKELIHOOD_TOLERANCE = 1e-5
"""Relative change of a chi-square that ends a refinement by likelihood: some thousandth of one, well inside an interval
and above what the steps of a solver leave."""


MOST_ERROR_STEPS, ERROR_STEP = 4, 0.02
"""Steps of values under the errors of tests, and the largest one left out, in standard deviations."""


CONVERGED_GAIN = 0.02
"""Gain of the log-likelihood, and change of a test's weight, that ends the rounds."""


@dataclass(frozen=True)
class IterationLimits:
    """How long to refine: rounds, and steps of least squares with their tolerance in each."""

    rounds: int = 8
    steps: int = 40
    tolerance: float = 1e-8


APPROXIMATE_LIMITS = IterationLimits(rounds=2, steps=8, tolerance=1e-3)
"""For a predictor on the way to another."""


SIMULATION_LIMITS = IterationLimits(rounds=5, steps=25, tolerance=1e-6)
"""For predictors with a reduced-order model: solvers are smooth to about that."""


@dataclass(frozen=True)
class EstimationResult:
    """The end of an iterative estimation: values and working noise that agree, and their log-likelihood.

    problem : with the priors of nuisance parameters as they were estimated; minimum : its optimum; residuals : there,
    with the weights of tests; linearised : the problem made linear there. x : (unknowns,) the values: the optimum, from
    where errors of tests move those by likelihood; errors : that were in the covariance.
    """

    problem: LeastSquaresProblem
    minimum: Minimum
    residuals: Residuals
    working_noise: NoiseModel
    log_likelihood: float
    linearised: LinearisedProblem
    x: Floats
    errors: tuple[Perturbation, ...] = ()


def estimate_iteratively(
    problem: LeastSquaresProblem,
    x: Floats,
    working_estimator: WorkingNoiseEstimator,
    limits: IterationLimits,
    progress: IterationCallback | None,
    working_noise: NoiseModel | None = None,
) -> EstimationResult:
    """Values and working noise in turn from x (unknowns,), (u, e); the best round.

    working_noise : from which to begin, if it is known already.
    """
    robust, best = working_estimator.settings.test_loss == "student", None
    residuals = problem.residuals(x)
    working_noise = working_noise or working_estimator.starting_noise(len(problem.histories))
    for round_index in range(limits.rounds):
        previous_weights = residuals.test_weights
        test_weights = robust_test_weights(residuals, working_noise) if robust else previous_weights
        residuals = residuals.with_test_weights(test_weights)
        linear = linearised(problem, x, residuals)
        working_noise = working_estimator.estimate(residuals, working_noise, linear)
        if (
            best is not None
            and working_estimator.by_likelihood
            and _expected_gain(linear, working_noise) < CONVERGED_GAIN
        ):
            break
        problem = problem.with_covariance(_covariance_factor(problem, residuals, working_noise, working_estimator))
        tolerance = max(limits.tolerance, LIKELIHOOD_TOLERANCE) if working_estimator.by_likelihood else limits.tolerance
        minimum = problem.minimise(x, tolerances=Tolerances(limits.steps, tolerance))
        x = minimum.x
        residuals = problem.residuals(x).with_test_weights(test_weights)
        current = _round_result(problem, minimum, residuals, working_noise)
        problem = current.problem
        if progress is not None:
            progress("round", round_index + 1, limits.rounds)
        gain = np.inf if best is None else current.log_likelihood - best.log_likelihood
        best = current if best is None or gain > 0 or robust else best
        if abs(gain) < CONVERGED_GAIN and np.abs(test_weights - previous_weights).max() < CONVERGED_GAIN:
            break
    assert best is not None
    return best


def under_errors_of_tests(result: EstimationResult) -> EstimationResult:
    """An estimate by likelihood with its values under the covariance that holds the errors of tests.

    By Gauss-Newton steps from the optimum without them, with errors and residuals made linear at each, and every test
    about a rate of its own: where readings are far more exact than rates are alike, residuals are not linear in these.
    """
    problem, linear, noise = result.problem, result.linearised, result.working_noise
    if problem.settings.weights != "likelihood" or not problem.settings.included_errors:
        return result
    for step in range(MOST_ERROR_STEPS):
        about = at_own_rates(problem, linear, noise)
        errors = errors_of_tests(problem, linear.x, about, noise)
        result = replace(result, errors=errors) if step == 0 else result
        solution = about.solve(CovarianceFactor.of_residuals(with_errors(about, errors).residuals, noise))
        x = linear.x.copy()
        x[linear.free] += solution.step
        x = problem.bounds.clip(x)
        if (np.abs(x - linear.x)[linear.free] <= ERROR_STEP * np.sqrt(np.diag(solution.covariance))).all():
            break
        residuals = problem.residuals(x).with_test_weights(result.residuals.test_weights)
        assert residuals.jacobian is not None
        if not (np.isfinite(residuals.values).all() and np.isfinite(residuals.jacobian).all()):
            break
        linear = replace(linearised(problem, x, residuals), free=linear.free)
    return replace(result, x=linear.x)


NOTEWORTHY_FACTOR = 0.03
"""Of ln rate of a test, from which on its curve is simulated with that factor: what is linear in it no longer holds."""


def at_own_rates(problem: LeastSquaresProblem, linear: LinearisedProblem, noise_model: NoiseModel) -> LinearisedProblem:
    """The linear problem with every test about a rate of its own, by which a law is judged."""
    log_factors = predicted_random_effects(linear.residuals, noise_model)[1]
    return linear if np.abs(log_factors).max() < NOTEWORTHY_FACTOR else at_rates(problem, linear, log_factors)


def at_rates(problem: LeastSquaresProblem, linear: LinearisedProblem, log_factors: Floats) -> LinearisedProblem:
    """The linear problem about rates of tests with factors; log_factors : (tests,) their ln.

    As `linear`, which is about the law's rates, where some rate has no coefficient or nothing is predicted there.
    """
    if not problem.coordinates.every_rate_has_coefficient:
        return linear
    there = problem.residuals_at_rates(linear.x, log_factors)
    values = there.values - log_factors[:, None] * there.log_rate_sensitivity
    finite = np.isfinite(values).all() and there.jacobian is not None and np.isfinite(there.jacobian).all()
    residuals = replace(
        there, values=values, present=linear.residuals.present, test_weights=linear.residuals.test_weights
    )
    return replace(linear, residuals=residuals) if finite else linear


def _covariance_factor(
    problem: LeastSquaresProblem,
    residuals: Residuals,
    working_noise: NoiseModel,
    working_estimator: WorkingNoiseEstimator,
) -> CovarianceFactor:
    """The covariance under which the values of a round are found."""
    fitting_noise = (
        working_noise
        if working_estimator.by_likelihood
        else with_single_value_weight(working_noise, problem.observations)
    )
    # A stopped test that says nothing here may say something a step further.
    return CovarianceFactor.of_residuals(replace(residuals, present=problem.observations.present), fitting_noise)


def _expected_gain(linear: LinearisedProblem, working_noise: NoiseModel) -> float:
    """Growth of the log-likelihood, to first order, if the values moved to the optimum under this noise."""
    residuals = linear.residuals
    factor = CovarianceFactor.of_residuals(residuals, working_noise)
    chi_square = (factor.whiten(residuals.values) ** 2).sum() + (linear.precision * linear.prior_residual**2).sum()
    return 0.5 * float(chi_square - linear.solve(factor).chi_square)


def linearised(problem: LeastSquaresProblem, x: Floats, residuals: Residuals) -> LinearisedProblem:
    """The problem made linear at x (unknowns,), (u, e): weak priors of the bounds on u, their own on e."""
    nuisances, bounds, count = problem.nuisance_parameters, problem.bounds, problem.parameter_count
    precision = np.concatenate([12.0 / bounds.width[:count] ** 2, nuisances.precision])
    prior_residual = np.concatenate([np.zeros(count), x[count:] - nuisances.mean[: x.size - count]])
    tolerance = BOUND_TOLERANCE * bounds.width
    free = (x > bounds.lower + tolerance) & (x < bounds.upper - tolerance)
    return LinearisedProblem(
        residuals, precision, prior_residual, free, np.stack([bounds.lower - x, bounds.upper - x]), x
    )


def _round_result(
    problem: LeastSquaresProblem, minimum: Minimum, residuals: Residuals, working_noise: NoiseModel
) -> EstimationResult:
    """The end of a round, with the prior standard deviations that its residuals show."""
    nuisances = problem.nuisance_parameters
    if any(n.sd is None for n in nuisances.nuisances):
        assert residuals.jacobian is not None
        whitened = CovarianceFactor.of_residuals(residuals, working_noise).whiten(residuals.jacobian)
        nuisances = _with_prior_sd(nuisances, np.einsum("tfp,tfq->pq", whitened, whitened), minimum.x)
        problem = problem.with_nuisances(nuisances)
    linear = linearised(problem, minimum.x, residuals)
    # The optimum under weights is none of the noise model: that it is flat in the law's parameters says nothing for it.
    by_likelihood = problem.settings.weights == "likelihood"
    integrated = np.arange(minimum.x.size) >= (0 if by_likelihood else problem.parameter_count)
    likelihood = restricted_log_likelihood(linear, working_noise, integrated)
    return EstimationResult(problem, minimum, residuals, working_noise, likelihood, linear, minimum.x)


def _with_prior_sd(nuisance_parameters: NuisanceParameters, normal_matrix: Floats, x: Floats) -> NuisanceParameters:
    """Expectation and maximisation in turn, on the problem made linear at its optimum x.

    At the optimum the gradient of the data is that of the prior, P (x - mean); with another P the linear problem moves
    x to where both agree again.
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


def starting_point(
    nuisance_parameters: NuisanceParameters, u: Floats, known_values: Mapping[tuple[str, str], float]
) -> Floats:
    """(unknowns,) x = (u, e), from u (parameters,); e is as known, {(key, owner): value}, or at the prior means."""
    parameters = zip(nuisance_parameters.nuisances, nuisance_parameters.owners, nuisance_parameters.mean, strict=True)
    return np.concatenate([u, [known_values.get((n.key, member), float(mean)) for n, member, mean in parameters]])
