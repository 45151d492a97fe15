"""Judging a law: chi-square of its residuals under noise that was not estimated from its misfit.

With r the residuals at the optimum under C0, the covariance of the noise that histories state (or that neighbouring
frames of each test show), of offsets and of scatter between tests,

    chi2 = r' C0^-1 r

has chi-square's distribution with n less the estimated unknowns degrees of freedom if the law is right and the noise
white; where the noise was estimated from nu frames, chi2 over its degrees of freedom has that of F. It is taken of all
outputs together and of each, and the least probability times their number is the p-value (Bonferroni). Below 0.3 % the
law leaves a model discrepancy: what must be added to the noise for the same chi-square. Offsets and the scatter of
rates were estimated from the same tests; a scatter beyond a factor of 2.7, or that bends over the stress, is misfit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from scipy.optimize import lsq_linear
from scipy.stats import f

from creepkit.arrays import Floats
from creepkit.inverse.adequacy import LARGEST_SCATTER, TREND_SIGNIFICANCE, Adequacy, OutputAdequacy
from creepkit.inverse.known_noise import KnownNoise
from creepkit.inverse.largest_deviation import largest_deviation
from creepkit.inverse.noise_covariance import CovarianceFactor, predicted_random_effects
from creepkit.inverse.noise_model import NoiseModel, OutputNoise, Residuals
from creepkit.inverse.observation_vector import ObservationVector
from creepkit.inverse.outlying_tests import outlying_tests
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.reference_conditions import reference_stresses
from creepkit.inverse.scatter_of_lives import with_scatter_of_lives
from creepkit.inverse.unmodelled_effects import UnmodelledEffect, with_random_effects
from creepkit.inverse.variance_components import LinearisedProblem, LinearSolution
from creepkit.records import History, is_logarithmic

SIGNIFICANCE = 0.003
"""p-value below which a law does not explain the tests: three standard deviations of a normal one."""

FEWEST_TREND_TESTS = 5
"""Tests from which on rates are tested for a bend over the stress."""

JUDGED_SCATTER = 1e-4
"""Of ln rate between tests: less is what a simulation rounds, not what a test shows."""


def adequacy_of(
    problem: LeastSquaresProblem,
    linear: LinearisedProblem,
    noise_model: NoiseModel,
    predictor_errors: Mapping[str, float],
    histories: Sequence[History],
    known: KnownNoise | None = None,
) -> Adequacy:
    """The adequacy of a law at the optimum of a problem.

    linear : the problem made linear there. noise_model : of its estimate, for offsets and scatter between tests.
    predictor_errors : {output: standard deviation} of what the predictor is wrong by, in the output's unit.
    histories : with all frames. known : the noise that these show, where it was found before.
    """
    observations = problem.observations
    linear = with_scatter_of_lives(linear, observations, noise_model)
    known = (known or KnownNoise.of_histories(observations, histories)).where(linear.residuals.offset_sensitivity > 0)
    if not known.judged.any():
        nan = float("nan")
        nothing = Adequacy("cannot be judged", (), nan, 0.0, nan, nan, None, not_judged=observations.outputs)
        return replace(nothing, few_frames=known.few_frames)
    residuals = _of_judged(linear.residuals, known)
    independent = _independent_noise(observations, known, noise_model, predictor_errors)
    judged_problem = replace(linear, residuals=residuals)
    solution = _within_bounds(judged_problem, CovarianceFactor.of_residuals(residuals, independent))
    white = _white_part(residuals, solution, independent)
    share_of_freedom = _freedom(judged_problem, solution) / float(known.judged.sum())
    contributions = solution.residuals * solution.weighted_residuals
    marginal = _marginal_contributions(residuals, solution, independent)
    outputs = []
    for position, name in enumerate(observations.outputs):
        mask = known.judged & (observations.output_index == position)
        if not mask.any():
            continue
        freedom = share_of_freedom * float(mask.sum())
        reduced = float(marginal[mask].sum()) / freedom
        p_value = known.chance_of_larger(reduced, share_of_freedom, mask)
        noise = float(np.median(known.sd[mask]))
        # In its unit from the deviations themselves: their share of chi-square is another where noise varies.
        square = float((white[mask] ** 2).mean()) / share_of_freedom * max(1.0 - 1.0 / reduced, 0.0)
        discrepancy = float(np.sqrt(square))
        source: Literal["stated", "estimated"] = "stated" if observations.stated[position] else "estimated"
        outputs.append(OutputAdequacy(name, int(mask.sum()), noise, source, reduced, p_value, discrepancy))
    freedom = share_of_freedom * float(known.judged.sum())
    reduced = float(contributions[known.judged].sum()) / freedom
    pooled = known.chance_of_larger(reduced, share_of_freedom, known.judged)
    p_values = [pooled, *(o.p_value for o in outputs)] if len(outputs) > 1 else [pooled]
    p_value = min(1.0, len(p_values) * min(p_values))
    # Outputs that are each within chance may be beyond it together: all of them have then left something.
    alone = any(o.p_value < SIGNIFICANCE for o in outputs)
    left = [p_value < SIGNIFICANCE and (o.p_value < SIGNIFICANCE or not alone) for o in outputs]
    outputs = [o if kept else replace(o, discrepancy=0.0) for o, kept in zip(outputs, left, strict=True)]
    scatter, trend, outlying = _scatter_of_rates(problem, linear.residuals, noise_model)
    scattered = scatter > LARGEST_SCATTER or trend < TREND_SIGNIFICANCE or bool(outlying)
    explained = p_value >= SIGNIFICANCE and not scattered
    return Adequacy(
        "explains" if explained else "leaves a discrepancy",
        tuple(outputs),
        reduced,
        freedom,
        p_value,
        _correlation(noise_model),
        largest_deviation(observations, known, white, histories),
        rate_scatter=scatter,
        rate_trend_p_value=trend,
        expected_chi_square=known.expected(share_of_freedom, known.judged),
        outlying=outlying,
    )


def adequacy_with_remedies(
    problem: LeastSquaresProblem,
    linear: LinearisedProblem,
    noise_model: NoiseModel,
    predictor_errors: Mapping[str, float],
    histories: Sequence[History],
    effects: Sequence[UnmodelledEffect],
) -> Adequacy:
    """The same, with those of the unmodelled effects named with which the law would explain the tests."""
    known = KnownNoise.of_histories(problem.observations, histories)
    adequacy = adequacy_of(problem, linear, noise_model, predictor_errors, histories, known)
    if not adequacy.rejects:
        return adequacy
    remedies = [
        effect.description
        for effect in effects
        if adequacy_of(
            problem, with_random_effects(linear, [effect]), noise_model, predictor_errors, histories, known
        ).explains
    ]
    return replace(adequacy, remedies=tuple(remedies))


def _scatter_of_rates(
    problem: LeastSquaresProblem, residuals: Residuals, noise_model: NoiseModel
) -> tuple[float, float, tuple[tuple[str, float], ...]]:
    """Standard deviation of ln rate between tests, p-value of a bend of it over stress; 0 and 1 for none; and outliers.

    The scatter was estimated from the same tests: a law that misses the dependence on stress makes it, and it then
    bends over the stress. The p-value is that of the square of ln stress in a regression (F test). Of tests that lie
    outside of all others the names and factors are given; scatter and bend are then those of the others.
    """
    if not noise_model.rate > 0:
        return 0.0, 1.0, ()
    rates = predicted_random_effects(residuals, noise_model)[1]
    outside = outlying_tests(rates)
    outlying = tuple((problem.histories[k].name, float(np.exp(rates[k]))) for k in np.flatnonzero(outside))
    stresses = np.log([float(np.median(reference_stresses(h, problem.predictor))) for h in problem.histories])[~outside]
    rates = rates[~outside]
    scatter = float(rates.std(ddof=1)) if outlying else noise_model.rate
    if np.std(rates) < JUDGED_SCATTER or len(rates) < FEWEST_TREND_TESTS or np.unique(stresses.round(3)).size < 3:
        return scatter, 1.0, outlying
    x = stresses - stresses.mean()
    squares = [
        float(((rates - design @ np.linalg.lstsq(design, rates, rcond=None)[0]) ** 2).sum())
        for design in (np.stack([x**k for k in range(degree + 1)], axis=1) for degree in (1, 2))
    ]
    freedom = len(rates) - 3
    ratio = (squares[0] - squares[1]) / max(squares[1] / freedom, 1e-300)
    return scatter, float(f.sf(ratio, 1.0, freedom)), outlying


def _of_judged(residuals: Residuals, known: KnownNoise) -> Residuals:
    """The residuals of observations that are judged, tests of equal weight; the others are not there."""
    assert residuals.jacobian is not None
    mask = known.judged & residuals.present
    return replace(
        residuals,
        values=np.where(mask, residuals.values, 0.0),
        jacobian=np.where(mask[..., None], residuals.jacobian, 0.0),
        offset_sensitivity=np.where(mask, residuals.offset_sensitivity, 0.0),
        log_rate_sensitivity=np.where(mask, residuals.log_rate_sensitivity, 0.0),
        present=mask,
        test_weights=np.ones(len(mask)),
        relative_noise=known.sd,
    )


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


def _correlation(noise_model: NoiseModel) -> float:
    from creepkit.inverse.noise_model import NEGLIGIBLE_DISCREPANCY
    from creepkit.inverse.observation_vector import LINEAR_COORDINATE_LENGTH

    if not noise_model.discrepancy > NEGLIGIBLE_DISCREPANCY:
        return float("nan")
    decades = any(is_logarithmic(name) for name in noise_model.outputs)
    return noise_model.discrepancy_length / (1.0 if decades else LINEAR_COORDINATE_LENGTH)


def _white_part(residuals: Residuals, solution: LinearSolution, noise_model: NoiseModel) -> Floats:
    """(tests, observations) what is left in the output's unit once offsets and rates of tests are taken out."""
    white = residuals.white_covariance_times(solution.weighted_residuals, noise_model)
    return np.asarray(white / np.where(residuals.offset_sensitivity > 0, residuals.offset_sensitivity, 1.0))
