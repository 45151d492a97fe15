"""Iterative estimation: values given the noise, the noise given residuals, and the rates of tests, in turn.

Where readings are far more exact than rates are alike, residuals are not linear in the rates of tests: by likelihood
they are taken about the rate that each test has, the best linear prediction of the round before. That is the
alternation of Lindstrom & Bates (1990), Biometrics 46, 673; about the law's own rates values are biased and a scatter
of rates is taken for a misfit of the shape. The end is one point: values, covariance, judgement and scatter are all of
the problem made linear there.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.noise_covariance import CovarianceFactor, predicted_random_effects
from creepkit.inverse.noise_model import NoiseModel, Residuals
from creepkit.inverse.nuisance_parameters import NuisanceParameters, Perturbation
from creepkit.inverse.perturbations import errors_of_tests, with_derivatives_to_lengths, with_expected_scatter
from creepkit.inverse.problem import LARGEST_FACTOR, NOTEWORTHY_FACTOR, LeastSquaresProblem
from creepkit.inverse.search.local_refinement import IterationCallback, Tolerances
from creepkit.inverse.variance_components import LinearisedProblem, restricted_log_likelihood, scaled_inverse
from creepkit.inverse.working_noise import WorkingNoiseEstimator

PRIOR_STEPS = 30
"""Steps of the estimate of prior standard deviations in each round; they cost no simulation."""


LIKELIHOOD_TOLERANCE = 1e-5
"""Relative change of a chi-square that ends a refinement by likelihood: some thousandth of one, well inside an interval
and above what the steps of a solver leave."""


MOST_LAST_STEPS, LAST_STEP, MOST_HALVINGS, SHRINKS = 10, 0.05, 4, 0.8
"""Last steps of values by likelihood, the largest one left out, in standard deviations, halvings of each, and its size
over that of the step before from which on values go to and fro, as in a valley along which the errors of tests turn."""


DOUBTFUL_STEP = 0.5
"""Standard deviations of a value, of a step that is left, from which on values have not converged: an interval of 95 %
about a value that is off by so much holds the truth in 92 %."""


CONVERGED_GAIN, SMALL_STEP = 0.02, 0.2
"""Gain of the log-likelihood that ends the rounds; and the step of that gain, half its
square, in standard deviations, which is left to the last steps."""


MOST_RATE_STEPS = 3
"""Steps of the rates of tests at given values."""


class IterationLimits(NamedTuple):
    """Rounds of an estimate, and when least squares end in each."""

    rounds: int
    least_squares: Tolerances


EXACT_LIMITS = IterationLimits(8, Tolerances(max_steps=40, tolerance=1e-8))


APPROXIMATE_LIMITS = IterationLimits(2, Tolerances(max_steps=8, tolerance=1e-3, gain=3e-3))
"""For a predictor on the way to another."""


SIMULATION_LIMITS = IterationLimits(5, Tolerances(max_steps=25, tolerance=1e-6, gain=1e-4))
"""For predictors with a reduced-order model: solvers are smooth to about that tolerance, and a step of that gain is a
tenth of a standard deviation of some hundred readings, of which the next round leaves less."""


@dataclass(frozen=True)
class EstimationResult:
    """The end of an iterative estimation: values and noise that agree, and their log-likelihood.

    problem : with the priors of nuisance parameters, and about the rates of tests, as they were estimated.
    linear : the problem made linear at the values. noise : under which values were found. errors : of tests, that the
    covariance holds beside it. converged : whether the last refinement ended by itself.
    """

    problem: LeastSquaresProblem
    linear: LinearisedProblem
    noise: NoiseModel
    log_likelihood: float
    converged: bool = True
    errors: tuple[Perturbation, ...] = ()

    @property
    def x(self) -> Floats:
        """(unknowns,) the values."""
        return self.linear.x


def estimate_iteratively(
    problem: LeastSquaresProblem,
    x: Floats,
    estimator: WorkingNoiseEstimator,
    limits: IterationLimits,
    progress: IterationCallback | None,
    noise: NoiseModel | None = None,
) -> EstimationResult:
    """Values and noise in turn from x (unknowns,), (u, e); the best round.

    noise : from which to begin, if it is known already.
    """
    by_likelihood = estimator.by_likelihood
    residuals, best, is_near = problem.residuals(x), None, noise is not None
    noise = noise or estimator.starting_noise(len(problem.histories))
    gain, own = LIKELIHOOD_TOLERANCE * by_likelihood, limits.least_squares
    tolerances = replace(own, tolerance=max(own.tolerance, gain), gain=max(own.gain, gain))
    for round_index in range(limits.rounds):
        if by_likelihood and best is not None:
            problem, residuals = about_own_rates(problem, x, residuals, noise)
        problem = problem.about_stopped_tests(x, noise)
        residuals = problem.residuals(x)
        linear = problem.linearised(x, residuals)
        noise = estimator.estimate(linear, noise)
        factor = CovarianceFactor.of_residuals(residuals, estimator.weighting(noise))
        problem = problem.with_covariance(factor)
        if by_likelihood and (is_near or best is not None):
            # the covariance moves with the values: near the end each step is taken under its own
            problem, linear, step = _stepped(problem, linear, factor, noise, SMALL_STEP)
            x, converged = linear.x, step < DOUBTFUL_STEP
        else:
            minimum = problem.minimise(x, tolerances=tolerances)
            x, converged = minimum.x, minimum.converged
        residuals = problem.residuals(x)
        problem = _with_priors_found(problem, residuals, noise, x)
        linear = problem.linearised(x, residuals)
        current = EstimationResult(problem, linear, noise, _log_likelihood(problem, linear, noise), converged)
        if progress is not None:
            progress("round", round_index + 1, limits.rounds)
        gain = np.inf if best is None else current.log_likelihood - best.log_likelihood
        # a likelihood about other rates or ends of tests is another approximation
        moved = best is not None and (
            best.problem.log_factors is not problem.log_factors or best.problem.stopped is not problem.stopped
        )
        best = current if best is None or gain > 0 or moved else best
        if abs(gain) < CONVERGED_GAIN:
            best = replace(best, converged=True)
            break
    assert best is not None
    return best


def at_reported_values(found: EstimationResult) -> EstimationResult:
    """An estimate by likelihood where it is reported, about the rates of tests.

    Values are moved to the optimum under the covariance that holds the errors of tests, by Gauss-Newton steps with
    errors and residuals made linear at each.
    """
    problem, linear, noise = with_derivatives_to_lengths(found.problem), found.linear, found.noise
    free, first, left = linear.free, None, np.inf
    for _ in range(MOST_LAST_STEPS):
        expected = with_expected_scatter(problem, linear, noise)
        problem, residuals = about_own_rates(problem, linear.x, linear.residuals, expected)
        problem = problem.about_stopped_tests(linear.x, expected)
        residuals = problem.residuals(linear.x)
        linear = replace(problem.linearised(linear.x, residuals), free=free)
        errors = errors_of_tests(problem, linear, noise)
        factor = CovarianceFactor.of_residuals(linear.with_errors(errors).residuals, expected)
        found = replace(found, problem=replace(problem, lengths={}), linear=linear, errors=errors)
        first = first or found
        before, (problem, linear, left) = left, _stepped(problem, linear, factor, expected, LAST_STEP)
        if left <= LAST_STEP or linear is found.linear or SHRINKS * before < left < DOUBTFUL_STEP:
            break
    # values that steps drive to and fro are those that they began with
    return replace(found, converged=True) if first is None or left < DOUBTFUL_STEP else replace(first, converged=False)


def _stepped(
    problem: LeastSquaresProblem, linear: LinearisedProblem, factor: CovarianceFactor, noise: NoiseModel, least: float
) -> tuple[LeastSquaresProblem, LinearisedProblem, float]:
    """A step of Gauss and Newton, halved until chi-square falls, and its size in standard deviations.

    The rates of tests move with the values, so that a test whose rate is known creeps on as it was measured: at rates
    that stay a curve that runs away would break, or not begin to. As it is where no halved step lowers chi-square, or
    the step is smaller than `least`.
    """
    solution, free, residuals = linear.solve(factor), linear.free, linear.residuals
    target = linear.x.copy()
    target[free] += solution.step
    x = problem.constrained(linear.x, target, free, solution.covariance)
    size = float((np.abs(x - linear.x)[free] / np.sqrt(np.diag(solution.covariance))).max(initial=0.0))
    for _ in range(MOST_HALVINGS if size > least else 0):
        expected = replace(residuals, values=residuals.values + residuals.jacobian @ (x - linear.x))
        moved = _about_predicted_rates(problem, x, expected, noise)
        there = moved.residuals(x)
        further = replace(moved.linearised(x, there), free=free)
        if is_finite(there) and further.chi_square(factor)[0] < linear.chi_square(factor)[0]:
            return moved, further, size
        x = 0.5 * (x + linear.x)
    return problem, linear, size


def within_bounds(found: EstimationResult) -> EstimationResult:
    """An estimate whose values lie within the bounds of the law, which penalties hold them to but for a little."""
    problem, x = found.problem, found.problem.within_bounds(found.x)
    if np.array_equal(x, found.x):
        return found
    residuals = problem.residuals(x)
    return replace(found, linear=problem.linearised(x, residuals)) if is_finite(residuals) else found


def is_finite(residuals: Residuals) -> bool:
    """Whether residuals and their derivatives are numbers."""
    return bool(np.isfinite(residuals.values).all() and np.isfinite(residuals.jacobian).all())


def judged_at(problem: LeastSquaresProblem, linear: LinearisedProblem, noise: NoiseModel) -> LinearisedProblem:
    """The linear problem about the rates of tests, by which a law is judged; values by weights are about the law's."""
    moved, residuals = about_own_rates(problem, linear.x, linear.residuals, noise)
    return linear if moved is problem else replace(linear, residuals=residuals)


def about_own_rates(
    problem: LeastSquaresProblem, x: Floats, residuals: Residuals, noise: NoiseModel
) -> tuple[LeastSquaresProblem, Residuals]:
    """The problem about the rate that each test has beside the law at x (unknowns,), and its residuals there.

    residuals : of the problem at x. As it is where its rates are those that are predicted.
    """
    for _ in range(MOST_RATE_STEPS):
        moved = _about_predicted_rates(problem, x, residuals, noise)
        there = moved.residuals(x)
        if moved is problem or moved.log_factors is None or not is_finite(there):
            break
        problem, residuals = moved, there
    return problem, residuals


def _about_predicted_rates(
    problem: LeastSquaresProblem, x: Floats, residuals: Residuals, noise: NoiseModel
) -> LeastSquaresProblem:
    """The problem at x (unknowns,) about the rates of tests that residuals show; as it is where these are its own."""
    log_factors = np.clip(predicted_random_effects(residuals, noise).log_factors, -LARGEST_FACTOR, LARGEST_FACTOR)
    known = 0.0 if problem.log_factors is None else problem.log_factors
    return problem.about_rates(x, log_factors) if np.abs(log_factors - known).max() >= NOTEWORTHY_FACTOR else problem


def _log_likelihood(problem: LeastSquaresProblem, linear: LinearisedProblem, noise: NoiseModel) -> float:
    # The optimum under weights is none of the noise model: that it is flat in the law's parameters says nothing for it.
    by_likelihood = problem.settings.weights == "likelihood"
    integrated = np.arange(linear.x.size) >= (0 if by_likelihood else problem.parameter_count)
    return restricted_log_likelihood(linear, noise, integrated) + linear.residuals.stopped.log_likelihood


def _with_priors_found(
    problem: LeastSquaresProblem, residuals: Residuals, noise: NoiseModel, x: Floats
) -> LeastSquaresProblem:
    """The problem with the prior standard deviations that residuals at x (unknowns,) show."""
    nuisances = problem.nuisance_parameters
    if all(n.sd is not None for n in nuisances.nuisances):
        return problem
    whitened = CovarianceFactor.of_residuals(residuals, noise).whiten(residuals.jacobian)
    return problem.with_nuisances(_with_prior_sd(nuisances, np.einsum("tfp,tfq->pq", whitened, whitened), x))


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
