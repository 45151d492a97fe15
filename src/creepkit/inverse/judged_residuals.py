"""What a law leaves of the tests under noise that is known without it, each test with its own rate, life and offset.

With r the residuals at the optimum, made linear in the unknowns and in the random effects of tests, and C0 the
covariance of the known noise, of offsets and of the scatter between tests, the unknowns and effects that minimise
r' C0^-1 r are taken out; what is left is judged reading by reading.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import lsq_linear

from creepkit.arrays import Bools, Floats
from creepkit.inverse.composite_predictor import prediction_errors_of
from creepkit.inverse.identification import Identification
from creepkit.inverse.iterative_estimation import linearised
from creepkit.inverse.known_noise import KnownNoise
from creepkit.inverse.noise_covariance import CovarianceFactor, predicted_random_effects
from creepkit.inverse.noise_model import NoiseModel, OutputNoise, Residuals
from creepkit.inverse.observation_vector import RUPTURE_OUTPUT, ObservationVector
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.variance_components import LinearisedProblem, LinearSolution


@dataclass(frozen=True, eq=False)
class JudgedResiduals:
    """What is left of every observation; only those where `known.judged` count.

    residuals : at the optimum, with the random effects of tests. known : the noise they are judged by.
    deviation : (tests, observations) predicted less measured, in the output's unit, offsets, rates and lives of tests
        taken out.
    contributions, marginal : (tests, observations) to chi-square, that of all outputs together and that of the output
        alone.
    share_of_freedom : degrees of freedom of one observation.
    """

    residuals: Residuals
    known: KnownNoise
    deviation: Floats
    contributions: Floats
    marginal: Floats
    share_of_freedom: float

    def reduced_chi_square(self, mask: Bools) -> float:
        """Chi-square of some observations over their degrees of freedom; NaN of none. mask : (tests, observations)."""
        counted = mask & self.known.judged
        if not counted.any():
            return float("nan")
        return float(self.contributions[counted].sum()) / (self.share_of_freedom * float(counted.sum()))


def judged_residuals(
    problem: LeastSquaresProblem,
    linear: LinearisedProblem,
    noise_model: NoiseModel,
    predictor_errors: Mapping[str, float],
    known: KnownNoise,
) -> JudgedResiduals | None:
    """What is left at the optimum of a problem; None where no noise is known.

    linear : the problem made linear there. noise_model : of its estimate, for offsets and scatter between tests.
    predictor_errors : {output: standard deviation} of what the predictor is wrong by, in the output's unit.
    """
    observations = problem.observations
    linear = _with_scatter_of_lives(linear, observations, noise_model)
    known = known.where(linear.residuals.offset_sensitivity > 0)
    if not known.judged.any():
        return None
    residuals = _of_judged(linear.residuals, known)
    independent = _independent_noise(observations, known, noise_model, predictor_errors)
    judged_problem = replace(linear, residuals=residuals)
    solution = _within_bounds(judged_problem, CovarianceFactor.of_residuals(residuals, independent))
    return JudgedResiduals(
        linear.residuals,
        known,
        _white_part(residuals, solution, independent),
        solution.residuals * solution.weighted_residuals,
        _marginal_contributions(residuals, solution, independent),
        _freedom(judged_problem, solution) / float(known.judged.sum()),
    )


def life_sensitivity(residuals: Residuals, observations: ObservationVector) -> Floats:
    """(tests, observations) -, derivative of the residuals of frames to ln of the rupture life; 0 of other tests.

    Specimens of one alloy that creep alike still break at different times, and the last part of their curves moves with
    the life. Along a curve whose creep ends in a damage that grows at a rate of its own, such as

        e = A t_r lambda [1 - (1 - t / t_r)^(1 / lambda)]

    a life longer by a factor exp(b) moves the time at which a strain is reached by (1 - 1/s) b in ln t, with
    s = d ln e / d ln t: not at all in steady creep, where s = 1, and by all of b at rupture, where s is infinite. A
    rate that scatters moves the whole curve by one amount in ln t, and the orthogonal residual of the frame by
    L = sqrt(2) s / sqrt(1 + s^2); with that, a life moves it by L - sqrt(2 - L^2).
    """
    shift = np.clip(residuals.log_rate_sensitivity, 0.0, np.sqrt(2.0))
    effect = np.maximum(shift - np.sqrt(np.maximum(2.0 - shift**2, 0.0)), 0.0)
    return np.where(observations.followed_frames & residuals.present, effect, 0.0)


def _with_scatter_of_lives(
    linear: LinearisedProblem, observations: ObservationVector, noise_model: NoiseModel
) -> LinearisedProblem:
    """The linear problem with the scatter of lives, as estimated of rupture times, as a random effect of each test."""
    scatter = noise_model[RUPTURE_OUTPUT].misfit if RUPTURE_OUTPUT in noise_model.outputs else 0.0
    effect = scatter * life_sensitivity(linear.residuals, observations)
    if not effect.any():
        return linear
    known = linear.residuals.random_effect_sensitivities
    columns = [*([] if known is None else [known]), effect[..., None]]
    residuals = replace(linear.residuals, random_effect_sensitivities=np.concatenate(columns, axis=-1))
    return replace(linear, residuals=residuals)


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


def judged_residuals_of(fit: Identification) -> JudgedResiduals | None:
    """The same of an identification with its histories, as its adequacy was judged; None where no noise is known."""
    problem = fit.least_squares_problem
    linear = fit.linearised or linearised(problem, fit.x, problem.residuals(fit.x))
    linear = at_own_rates(problem, linear, fit.noise_model)
    error = fit.numerical_error
    errors = prediction_errors_of(problem.predictor) if error is None else error.remaining
    known = KnownNoise.of_histories(problem.observations, fit.histories)
    return judged_residuals(problem, linear, fit.noise_model, errors, known)


def _of_judged(residuals: Residuals, known: KnownNoise) -> Residuals:
    """The residuals of observations that are judged, tests of equal weight; the others are not there."""
    judged = residuals.where(known.judged & residuals.present)
    return replace(judged, test_weights=np.ones(len(known.sd)), relative_noise=known.sd)


def _independent_noise(
    observations: ObservationVector, known: KnownNoise, noise_model: NoiseModel, predictor_errors: Mapping[str, float]
) -> NoiseModel:
    """Known noise (relative to one unit of the output), the predictor's error, and offsets and scatter of tests."""
    outputs = {}
    for name, transform in zip(observations.outputs, observations.transforms, strict=True):
        scale = getattr(transform, "scale", None)
        drift = predictor_errors.get(name, 0.0) / scale if scale else 0.0
        outputs[name] = OutputNoise(1.0, offset=noise_model[name].offset, drift=drift, correlation_length=1.0)
    return NoiseModel(outputs, noise_model.rate)


def _marginal_contributions(residuals: Residuals, solution: LinearSolution, noise_model: NoiseModel) -> Floats:
    """(tests, observations) whose sum over an output is its own chi-square.

    That of outputs whose noise is correlated is not a sum of theirs: each is then taken as if it alone were known.
    """
    if residuals.shared_noise is None:
        return solution.residuals * solution.weighted_residuals
    out = np.zeros_like(solution.residuals)
    for position in range(len(noise_model.outputs)):
        mask = residuals.present & (residuals.output_index == position)
        factor = CovarianceFactor.of_residuals(replace(residuals, present=mask), noise_model)
        out[mask] = factor.whiten(solution.residuals)[mask] ** 2
    return out


def _within_bounds(linear: LinearisedProblem, factor: CovarianceFactor) -> LinearSolution:
    """The optimum of the linear problem within its bounds, or the point itself where the step gains nothing."""
    solution, residuals = linear.solve(factor), linear.residuals
    present = residuals.present
    columns = np.concatenate([linear.jacobian, residuals.values[..., None]], axis=-1)
    whitened = factor.whiten(columns)[present]
    root_prior = np.sqrt(linear.precision[linear.free])
    matrix = np.concatenate([whitened[:, :-1], np.diag(root_prior)])
    target = -np.concatenate([whitened[:, -1], root_prior * linear.prior_residual[linear.free]])
    scale = np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
    low, high = linear.step_bounds[:, linear.free] * scale
    step = lsq_linear(matrix / scale, target, bounds=(np.minimum(low, -1e-12), np.maximum(high, 1e-12))).x / scale
    moved = residuals.values + linear.jacobian @ step
    candidates = [(values, factor.inverse_times(values)) for values in (moved, residuals.values)]
    values, weighted = min(candidates, key=lambda pair: float((pair[0] * pair[1]).sum()))
    return replace(solution, residuals=values, weighted_residuals=weighted)


def _freedom(linear: LinearisedProblem, solution: LinearSolution) -> float:
    """Observations less the unknowns that they determine: n - p + tr(M P), with M the covariance and P the priors."""
    prior = linear.precision[linear.free]
    determined = prior.size - float((np.diag(solution.covariance) * prior).sum())
    return max(float(linear.residuals.present.sum()) - determined, 1.0)


def _white_part(residuals: Residuals, solution: LinearSolution, noise_model: NoiseModel) -> Floats:
    """(tests, observations) what is left in the output's unit once offsets and rates of tests are taken out."""
    white = residuals.white_covariance_times(solution.weighted_residuals, noise_model)
    return np.asarray(white / np.where(residuals.offset_sensitivity > 0, residuals.offset_sensitivity, 1.0))
