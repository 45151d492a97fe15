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
from creepkit.inverse.iterative_estimation import at_own_rates, linearised
from creepkit.inverse.known_noise import KnownNoise
from creepkit.inverse.noise_covariance import CovarianceFactor
from creepkit.inverse.noise_model import NoiseModel, OutputNoise, Residuals
from creepkit.inverse.observation_vector import RUPTURE_OUTPUT, ObservationVector
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.residuals import life_sensitivity
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


def _with_scatter_of_lives(
    linear: LinearisedProblem, observations: ObservationVector, noise_model: NoiseModel
) -> LinearisedProblem:
    """The linear problem with the scatter of lives, as estimated of rupture times, as a random effect of each test."""
    scatter = noise_model[RUPTURE_OUTPUT].misfit if RUPTURE_OUTPUT in noise_model.outputs else 0.0
    effect = scatter * life_sensitivity(linear.residuals, observations)
    if not effect.any():
        return linear
    return replace(linear, residuals=linear.residuals.with_effects(effect[..., None]))


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
