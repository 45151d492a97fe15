"""identify: one law over all tests, stresses and temperatures, with intervals, provenance and notes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from creepkit.arrays import Floats, single_threaded_blas
from creepkit.errors import CreepkitError, FitError
from creepkit.inverse.bounds import MOST_WIDENINGS, check_bounds, widened, widened_notes, with_determined
from creepkit.inverse.compared_tests import compared_tests, compares_rupture_times
from creepkit.inverse.composite_predictor import predictors_for_law, through_for_law
from creepkit.inverse.defect_correction import (
    NumericalError,
    correct_defect,
    shift_of_values,
    with_cheaper_predictor,
    with_correction_at_frames,
)
from creepkit.inverse.goodness_of_fit import pooled_errors, pooled_log_strain_rms, test_fits
from creepkit.inverse.history_checks import suspect_frames_note
from creepkit.inverse.identification import Identification
from creepkit.inverse.identification_notes import domain_notes, fitted_ranges, identification_notes, provenance_of
from creepkit.inverse.iterative_estimation import (
    APPROXIMATE_LIMITS,
    EXACT_LIMITS,
    SIMULATION_LIMITS,
    EstimationResult,
    IterationLimits,
    at_reported_values,
    estimate_iteratively,
    judged_at,
    starting_point,
    within_bounds,
)
from creepkit.inverse.judging import Judge
from creepkit.inverse.kept_fits import kept_where_asked
from creepkit.inverse.noise_covariance import CovarianceFactor, effective_sample_size, predicted_random_effects
from creepkit.inverse.noise_model import NoiseModel, autocorrelated_components
from creepkit.inverse.nuisance_parameters import nuisance_estimates_of
from creepkit.inverse.nuisance_plausibility import implausible_nuisances
from creepkit.inverse.perturbations import (
    covariances_of_values_with_errors,
    errors_of_tests,
    perturbations,
    with_derivatives_to_lengths,
    with_expected_scatter,
)
from creepkit.inverse.prediction_failures import FAILED, tests_without_prediction
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.rate_explanations import RateExplanations
from creepkit.inverse.search.local_refinement import IterationCallback
from creepkit.inverse.search.multistart import SearchOutcome, StartingEstimate, initial_search
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.single_values import LawAtTests, contradicting_values
from creepkit.inverse.uncertainty.importance_sampling import needs_samples, with_samples
from creepkit.inverse.uncertainty.laplace_approximation import (
    covariance_of_values,
    freedom_of_intervals,
    parameter_estimates,
    positive_semidefinite,
)
from creepkit.inverse.uncertainty.rate_scatter import rate_scatter
from creepkit.inverse.working_noise import UNRELATED_RATES, WorkingNoiseEstimator
from creepkit.language import CreepLaw
from creepkit.records import History, Predictor, Status, is_length_nuisance

MOST_CORRECTIONS, SMALL_SHIFT = 3, 0.5
"""How often a predictor is corrected, and the shift of values, in standard deviations, up to which once is enough."""


REFIT_ROUNDS = 2
"""Rounds of an estimate that begins near its end."""


CLEARLY = 1.2
"""Times SHAPE_MISFIT, beyond which a law misses the shape of curves whatever the last steps of its estimate are."""


DESCRIBING_LIMITS = APPROXIMATE_LIMITS._replace(rounds=8)
"""For values by frames of equal weight, which follow the noise that is found slowly."""


@kept_where_asked
def identify(
    law: CreepLaw,
    histories: Sequence[History],
    using: Predictor | Mapping[str, Predictor],
    *,
    settings: IdentificationSettings | None = None,
    through: Predictor | None = None,
    start: StartingEstimate | None = None,
    progress: IterationCallback | None = None,
) -> Identification:
    """Identify the parameters of `law` from `histories` by a global search, then by their likelihood.

    using : predictor, such as the specimen that ck.specimen("uniaxial") returns, or {specimen: predictor} where
        histories are of several. One that offers a reduced-order model is searched with it and then refined.
    through : a cheaper predictor, such as a surrogate, in which the minima of the search are refined before `using`:
        values and intervals are those of `using`.
    A surrogate that does not know this class of laws is replaced by its specimen, or left out; a note says so.
    start : an estimate to begin from instead of a global search.
    The posterior is not sampled; see sampled_where_needed().
    """
    settings = settings or IdentificationSettings()
    using, through, notes = predictors_for_law(law, using, through)
    histories, left_out = compared_tests(law, histories, settings)
    with single_threaded_blas():
        best, outcome, numerical_error = _estimated(law, histories, using, settings, through, start, progress)
        fit = _reported(histories, best, outcome, numerical_error)
        fit = replace(fit, notes=(*left_out, *fit.notes, *widened_notes(law, fit.law), *notes))
        if start is not None and start.values_only:
            return fit
        if settings.weights == "automatic" and (described := describing(fit)) is not fit:
            return described
    return _without_one_test(fit)


def sampled_where_needed(fit: Identification, through: Predictor | None = None) -> Identification:
    """With samples of the posterior where values are at bounds or not determined.

    through : a cheaper predictor that samples are drawn through, as of identify().
    """
    if fit.samples is not None or not needs_samples(fit):
        return fit
    with single_threaded_blas():
        return with_samples(fit, through_for_law(through, fit.law))


def describing(fit: Identification) -> Identification:
    """An identification by likelihood, with values that describe the tests where these contradict the law.

    Where it misses the shape of curves its likelihood is that of the misfit: values are those of frames of equal
    weight.
    """
    adequacy = fit.adequacy
    if fit.settings.weights != "likelihood" or adequacy is None or fit.predictor is None or not adequacy.misses_shape():
        return fit
    start, settings = StartingEstimate.from_identification(fit), replace(fit.settings, weights="equal")
    values = identify(fit.law, fit.histories, fit.predictor, settings=settings, start=start)
    notes = dict.fromkeys((*values.notes, *(note for note in fit.notes if "were not used" in note)))
    return replace(values, notes=tuple(notes), provenance={**fit.provenance, **values.provenance})


def _without_one_test(fit: Identification) -> Identification:
    """Where single tests explain the scatter of rates, what the others say without them, by a refit to them."""
    adequacy = fit.adequacy
    if adequacy is None or not adequacy.explanations or adequacy.explanations[0].kind != "one test":
        return fit
    first, *rest = adequacy.explanations
    others = [h for h in fit.histories if h.name not in first.tests]
    try:
        start = StartingEstimate.from_identification(fit, values_only=True)
        without = identify(fit.law, others, fit.least_squares_problem.predictor, settings=fit.settings, start=start)
    except CreepkitError:
        return fit
    values = {e.name: (e.value, e.low, e.high) for e in without.estimates}
    of_rates = (replace(first, without=values), *rest)
    return replace(fit, adequacy=replace(adequacy, of_rates=of_rates))


def _estimated(
    law: CreepLaw,
    histories: Sequence[History],
    using: Predictor,
    settings: IdentificationSettings,
    through: Predictor | None,
    start: StartingEstimate | None,
    progress: IterationCallback | None,
) -> tuple[EstimationResult, SearchOutcome, NumericalError | None]:
    """The best estimate, where it began, and the error of the predictor there; within bounds as wide as it needs.

    With automatic weights it is by likelihood, unless a first one clearly misses the shape of curves.
    """
    judged = histories if settings.weights == "automatic" else None
    settings = settings if judged is None else replace(settings, weights="likelihood")
    start, noise = start or StartingEstimate(None), None
    problem = LeastSquaresProblem.from_histories(law, histories, using, settings, start.reference)
    if start.u is None:
        outcome = initial_search(problem, through, progress)
    else:
        outcome = SearchOutcome([problem.bounds.of(range(len(law.params))).clip(start.u)], 0)
    known_values = {(n.key, n.owner): n.value for n in start.nuisances}
    starts = [starting_point(problem.nuisance_parameters, u, known_values) for u in outcome.starts]
    how, widenings = EstimationOptions(start.u is not None and start.is_near, through, judged, progress), MOST_WIDENINGS

    def within(law: CreepLaw, stage: Callable[..., Any], found: EstimationResult) -> StageEnd:
        settings, reference = found.problem.settings, problem.coordinates.reference
        of_law = LeastSquaresProblem.from_histories(law, histories, using, settings, reference)
        of_law = replace(of_law, evaluations=problem.evaluations)
        return StageEnd(of_law, *stage(of_law, [found.x], None, how._replace(is_near=True)))

    for stage in (_cheaper_estimate, _last_estimate)[int(through is None or start.u is not None) :]:
        usual = end = StageEnd(problem, *stage(problem, starts, noise, how))
        while widenings and (wider := _wider_law(end.best)) is not None:
            end, widenings = within(wider, stage, end.best), widenings - 1
        if end is not usual and (kept := _law_of_determined(usual, end)).params != end.problem.law.params:
            is_wider = kept.params != usual.problem.law.params  # if not, nor is more told through the last predictor
            end, widenings = (within(kept, stage, usual.best), widenings) if is_wider else (usual, 0)
        if not widenings:  # what waited for wider bounds
            end = end._replace(best=_describing_estimate(end.best, DESCRIBING_LIMITS, how._replace(widens=False)))
        problem, starts, noise = replace(end.problem, settings=end.best.problem.settings), [end.best.x], end.best.noise
    _check_bounds(end.best)
    return end.best, outcome, end.numerical_error


def _wider_law(found: EstimationResult) -> CreepLaw | None:
    """The law within wider bounds, where an estimate needs them."""
    problem = found.problem
    return widened(problem.law, problem.coordinates.theta(found.x[: problem.parameter_count]))


def _law_of_determined(usual: StageEnd, end: StageEnd) -> CreepLaw:
    """The law within those wider bounds that the tests need, by intervals as they are reported."""
    found, estimator = end.best, _working_estimator(end.best.problem, end.numerical_error)
    problem, linear = found.problem, found.linear
    noise = estimator.final(linear, found.noise, problem.parameter_count)
    working_noise = None if estimator.by_likelihood else estimator.weighting(found.noise)
    errors, expected = errors_of_tests(problem, linear, noise), with_expected_scatter(problem, linear, noise)
    by_tests, of_errors, _ = covariances_of_values_with_errors(linear, expected, errors, working_noise)
    u, covariance = np.split(found.x, [problem.parameter_count])[0], by_tests + of_errors
    to_theta = problem.coordinates.jacobian(u)
    deviations = np.sqrt(np.diag(to_theta @ covariance[: u.size, : u.size] @ to_theta.T))
    return with_determined(usual.problem.law, problem.law, problem.coordinates.theta(u), deviations)


def _check_bounds(found: EstimationResult) -> None:
    """FitError where the bounds of the law exclude the data."""
    residuals, count = found.linear.residuals, found.problem.parameter_count
    weighted = CovarianceFactor.of_residuals(residuals, found.noise).inverse_times(residuals.values)
    gradient = np.einsum("te,tep->p", weighted, residuals.jacobian)
    check_bounds(found.problem.bound_penalties, found.x[:count], gradient[:count], found.problem.observations.count)


class EstimationOptions(NamedTuple):
    """How an estimate is made, beside its problem and where it begins.

    is_near : whether it begins near its end. through : a cheaper predictor, which comes first. judged : the tests with
    all frames, where an end that clearly misses the shape of curves goes on with those weights that describe them.
    widens : whether bounds are still widened, before which it waits.
    """

    is_near: bool
    through: Predictor | None
    judged: Sequence[History] | None
    progress: IterationCallback | None
    widens: bool = True


class StageEnd(NamedTuple):
    """The end of a stage of an estimate: its problem, within the bounds of its law, and what the stage returns."""

    problem: LeastSquaresProblem
    best: EstimationResult
    numerical_error: NumericalError | None


def _cheaper_estimate(
    problem: LeastSquaresProblem, starts: Sequence[Floats], noise: NoiseModel | None, how: EstimationOptions
) -> tuple[EstimationResult, NumericalError | None]:
    """The best end of the starts (unknowns,) through the cheaper predictor."""
    assert how.through is not None
    best = _best_of(problem.with_predictor(how.through), starts, APPROXIMATE_LIMITS, how.progress, noise)
    if how.judged is None or problem.settings.weights != "likelihood":
        return best, None
    corrected = with_cheaper_predictor(problem, best.x, how.through)
    known = replace(best, problem=corrected, linear=corrected.linearised(best.x))
    return _describing_estimate(known, DESCRIBING_LIMITS, how), None


def _last_estimate(
    problem: LeastSquaresProblem, starts: Sequence[Floats], noise: NoiseModel | None, how: EstimationOptions
) -> tuple[EstimationResult, NumericalError | None]:
    """The best end of the starts (unknowns,), and the error of the predictor, which is corrected.

    It is corrected where the last estimate begins: at an end of its own, or near one that is known.
    """
    limits = EXACT_LIMITS if problem.predictor.reduced_order_model() is None else SIMULATION_LIMITS
    limits = limits._replace(rounds=REFIT_ROUNDS) if how.is_near else limits
    x, known = starts[0], None
    if not (how.is_near or how.through is not None) or problem.predictor.refined() is None:
        best = _describing_estimate(_best_of(problem, starts, limits, how.progress, noise), limits, how)
        problem, x, noise = best.problem, best.x, best.noise
        limits = limits._replace(rounds=REFIT_ROUNDS)
        if problem.predictor.refined() is None:
            return best, None
    problem = with_derivatives_to_lengths(problem)  # which errors of tests need where it ends
    for _ in range(MOST_CORRECTIONS):
        corrected, error = correct_defect(problem, x)
        if (
            known is not None
            and corrected.correction is not None
            and shift_of_values(best.problem, x, corrected.correction - known) < SMALL_SHIFT
        ):
            break
        numerical_error = error
        best = estimate_iteratively(corrected, x, _working_estimator(corrected, error), limits, how.progress, noise)
        x, noise, known = best.x, best.noise, corrected.correction
        if error is None or known is None:
            break
        numerical_error = replace(error, shift=shift_of_values(best.problem, x, known))
        if numerical_error.shift < SMALL_SHIFT:
            break
    else:
        numerical_error = numerical_error and replace(numerical_error, settled=False)
    return best, numerical_error


def _describing_estimate(found: EstimationResult, limits: IterationLimits, how: EstimationOptions) -> EstimationResult:
    """An estimate by likelihood, or that of frames of equal weight where it clearly misses curves, or rates altogether.

    With rates that share nothing the exponent would be that of the bend of single curves.
    """
    problem, linear, noise = found.problem, found.linear, found.noise
    if how.judged is None or problem.settings.weights != "likelihood" or (how.widens and _wider_law(found)):
        return found
    if noise.rate < UNRELATED_RATES:
        if not autocorrelated_components(noise):  # the curves are followed to a white noise
            return found
        judge = Judge(problem, noise, {} if problem.correction is not None else problem.predictor.error, how.judged)
        if not judge.adequacy(judged_at(problem, linear, noise)).misses_shape(CLEARLY):
            return found
    _check_bounds(found)
    problem = replace(problem.about_rates(found.x, None), settings=replace(problem.settings, weights="equal"))
    return estimate_iteratively(problem, found.x, _working_estimator(problem), limits, how.progress)


def _best_of(
    problem: LeastSquaresProblem,
    starts: Sequence[Floats],
    limits: IterationLimits,
    progress: IterationCallback | None,
    noise: NoiseModel | None = None,
) -> EstimationResult:
    """The likeliest of the estimates from starts (unknowns,); by likelihood the start that is best after one round."""
    estimator = _working_estimator(problem)
    if len(starts) > 1 and estimator.by_likelihood:
        ends = [estimate_iteratively(problem, x, estimator, limits._replace(rounds=1), None, noise) for x in starts]
        best = max(ends, key=lambda end: end.log_likelihood)
        problem, starts, noise = best.problem, [best.x], best.noise
    ends = [estimate_iteratively(problem, x, estimator, limits, progress, noise) for x in starts]
    return max(ends, key=lambda end: end.log_likelihood)


def _working_estimator(
    problem: LeastSquaresProblem, numerical_error: NumericalError | None = None
) -> WorkingNoiseEstimator:
    errors = problem.predictor.error if numerical_error is None else numerical_error.remaining
    return WorkingNoiseEstimator(problem.settings, problem.observations, errors)


def _reported(
    histories: Sequence[History],
    found: EstimationResult,
    search_outcome: SearchOutcome,
    numerical_error: NumericalError | None,
) -> Identification:
    """Noise model, intervals, judgement and goodness of fit, all at the reported values."""
    estimator = _working_estimator(found.problem, numerical_error)
    best = within_bounds(at_reported_values(found) if estimator.by_likelihood else found)
    linear, x, stresses = best.linear, best.x, best.problem.simulated_stresses(best.x)
    problem = best.problem.with_stresses(stresses)
    noise_model = estimator.final(linear, best.noise, problem.parameter_count)
    law, coordinates, count, residuals = problem.law, problem.coordinates, problem.parameter_count, linear.residuals
    u = x[:count]
    working_noise, errors, judged = None, best.errors, linear
    if not estimator.by_likelihood:
        errors, judged = errors_of_tests(problem, linear, noise_model), judged_at(problem, linear, noise_model)
        working_noise = estimator.weighting(best.noise)
    expected = with_expected_scatter(problem, linear, noise_model)
    unmodelled = perturbations(problem, linear, expected, histories, errors, working_noise)
    lengths = [e.residual_change for e in unmodelled if is_length_nuisance(e.kind) and not e.common]
    rates = RateExplanations(problem, judged, noise_model)
    covariance, of_errors, of_common = covariances_of_values_with_errors(linear, expected, errors, working_noise)
    scatter = rate_scatter(problem, linear, noise_model, lengths, of_common)
    prediction = problem.predicted_by(problem.predictor, x, histories)
    if not problem.observations.followed_to_rupture.any():
        problem.evaluations.failures.check(prediction, histories, law.name)
    prediction = with_correction_at_frames(problem, histories, prediction)
    error_covariance = of_errors[:count, :count]
    by_tests_alone = positive_semidefinite(covariance[:count, :count])
    law_covariance = by_tests_alone + error_covariance + rates.second_moment
    estimated = covariance_of_values(linear, noise_model, working_noise)[:count, :count]
    values_of_tests = LawAtTests(coordinates, u, scatter, noise_model, problem.predictor)
    used = compares_rupture_times(law, problem.settings)
    single_values = values_of_tests.compared(histories, without_curves=used)
    random_effects = predicted_random_effects(residuals, expected)
    by_law = replace(problem.about_rates(x, None), stopped=None).residuals(x)
    tests = test_fits(problem, by_law, random_effects, histories, prediction, single_values)
    nuisance_estimates = nuisance_estimates_of(
        problem.nuisance_parameters, x[count:], np.sqrt(np.diag(covariance + of_errors))[count:]
    )
    implausible = implausible_nuisances(problem, random_effects, nuisance_estimates)
    failed = np.isin(prediction.status[0], FAILED) | tests_without_prediction(prediction, histories)[0]
    failed |= (prediction.status[0] != Status.RUPTURED) & [test.misses_readings for test in tests]
    unpredicted = tuple(h.name for h, is_failed in zip(histories, failed, strict=True) if is_failed)
    judge = Judge(problem, noise_model, estimator.predictor_errors, histories)
    adequacy = judge.adequacy(judged)
    adequacy = replace(
        adequacy,
        remedies=judge.remedies(judged, unmodelled) if adequacy.rejects else (),
        of_rates=rates.found,
        outlying=rates.outlying,
        implausible=implausible,
        unpredicted=unpredicted,
        contradicting=contradicting_values(histories, single_values),
    )
    estimates = parameter_estimates(law, coordinates, u, law_covariance)
    return Identification(
        law=law,
        estimates=estimates,
        u=u,
        covariance=law_covariance,
        reference=coordinates.reference,
        noise_model=noise_model,
        rms=pooled_log_strain_rms(tests),
        log_likelihood=best.log_likelihood,
        effective_frames=effective_sample_size(residuals, noise_model),
        freedom=freedom_of_intervals(by_tests_alone, estimated),
        tests=tests,
        ranges=fitted_ranges(problem, stresses),
        settings=problem.settings,
        provenance={**provenance_of(problem, search_outcome.evaluations), **search_outcome.minima},
        errors=pooled_errors(histories, prediction, tests),
        error_covariance=error_covariance if problem.settings.included_errors else None,
        nuisances=nuisance_estimates,
        converged=best.converged,
        adequacy=adequacy,
        numerical_error=numerical_error,
        unmodelled=unmodelled,
        left_out=rates.left_out,
        rate_scatter=scatter,
        notes=(
            *suspect_frames_note(histories),
            *identification_notes(best, nuisance_estimates),
            *domain_notes(prediction, histories),
        ),
        histories=tuple(histories),
        predictor=problem.predictor,
        linearised=linear,
        problem=replace(problem, lengths={}).with_covariance(CovarianceFactor.of_residuals(residuals, noise_model)),
    )


def refit(fit: Identification, histories: Sequence[History]) -> Identification:
    """The same law on other histories, starting where `fit` ended (for cross-validation and resampling).

    Its bounds are those that `fit` ended within: beyond them it would be another law that is validated.
    """
    if fit.predictor is None:
        raise FitError("cannot refit an identification that was loaded from a file without its specimen")
    start, law = StartingEstimate.from_identification(fit), fit.law
    law = law.with_bounds(**{name: param.bounds for name, param in law.table.items()})
    return sampled_where_needed(identify(law, histories, fit.predictor, settings=fit.settings, start=start))
