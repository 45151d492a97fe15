"""identify: one law over all tests, stresses and temperatures, with intervals, provenance and notes."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from importlib.metadata import version
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from creepkit import registry
from creepkit.arrays import Floats, single_threaded_blas
from creepkit.errors import FitError
from creepkit.inverse.bound_penalties import BoundPenalties, check_bounds
from creepkit.inverse.composite_predictor import predict, reduced_order_model_of
from creepkit.inverse.goodness_of_fit import (
    TestFit,
    compare_rupture_times,
    goodness_of_tests,
    pooled_errors,
    pooled_log_strain_rms,
)
from creepkit.inverse.identification import Identification
from creepkit.inverse.iterative_estimation import (
    APPROXIMATE_LIMITS,
    SIMULATION_LIMITS,
    EstimationResult,
    IterationLimits,
    estimate_iteratively,
    starting_point,
    with_rupture_weight,
)
from creepkit.inverse.noise_model import (
    ASSUMED_RATE_SD,
    MINIMUM_TESTS,
    NoiseModel,
    cholesky_factors,
    effective_sample_size,
    initial_noise_model,
    predicted_random_effects,
)
from creepkit.inverse.nuisance_parameters import NuisanceEstimate, NuisanceParameters
from creepkit.inverse.observation_vector import usable_frames
from creepkit.inverse.problem import IdentificationProblem
from creepkit.inverse.reference_conditions import ReferencePoint, reference_end_strain, reference_stresses
from creepkit.inverse.residuals import ResidualFunction
from creepkit.inverse.search.cost_function import GlobalSearch
from creepkit.inverse.search.local_refinement import IterationCallback
from creepkit.inverse.search.multistart import EQUAL_PREDICTIONS, EQUAL_REDUCED_ORDER_PREDICTIONS, MultiStart, distinct
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.uncertainty.laplace_approximation import (
    interval_quantile,
    laplace_covariance,
    parameter_estimates,
    restricted_covariance,
)
from creepkit.inverse.variance_components import estimate_variance_components
from creepkit.language import CreepLaw, temperature
from creepkit.records import History, Nuisance, Prediction, Predictor, Status

if TYPE_CHECKING:
    from creepkit.inverse.search.cost_function import SearchTrace


LOW_TEST_WEIGHT = 0.5
"""Weight below which a test is named."""


LARGE_STRAIN, LARGE_RUPTURE_STRAIN = 0.5, 2.0
"""Strains above these are worth a word: of a test whose end is not known, and of one that was followed to it."""


def fitted_ranges(residual_function: ResidualFunction) -> dict[str, tuple[float, float]]:
    """What the fitted frames cover."""
    tests = residual_function.histories
    values_by_name = {
        "stress": [v for h in tests for v in reference_stresses(h, residual_function.predictor)],
        "temperature": [v for h in tests for v in h.temperature_program().values],
        "strain": [0.0, *(reference_end_strain(h, residual_function.predictor) for h in tests)],
        "time": [v for h in tests for v in (float(h.times[0]), float(h.times[-1]))],
    }
    return {name: (float(min(values)), float(max(values))) for name, values in values_by_name.items()}


def provenance_of(
    residual_function: ResidualFunction, settings: IdentificationSettings, search_evaluations: int
) -> dict[str, str | int]:
    """Versions, fingerprints and counts; one evaluation is one candidate on all tests.

    screened : evaluations of the global search, by the stand-in where the predictor has one.
    """
    law = residual_function.law
    return {
        "creepkit": version("creepkit"),
        "law": law.name,
        "origin": registry.default_registry().distributions_of(law),
        "fingerprint": law.fingerprint,
        "specimen": getattr(residual_function.predictor, "name", type(residual_function.predictor).__name__),
        "evaluations": residual_function.evaluations,
        "search_evaluations": search_evaluations,
        "data": _data_digest(residual_function, settings),
        "when": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def _data_digest(residual_function: ResidualFunction, settings: IdentificationSettings) -> str:
    """What was compared, and how: identifications that share it can be ranked against one another."""
    digest, observations = hashlib.sha256(), residual_function.observations
    for array in (observations.values, observations.times, observations.present, observations.output_index):
        digest.update(np.ascontiguousarray(array).tobytes())
    names = [h.name for h in residual_function.histories]
    weights = settings.weights if isinstance(settings.weights, str) else sorted(settings.weights.items())
    method = (
        names,
        observations.outputs,
        observations.transforms,
        settings.loss,
        settings.test_loss,
        weights,
        settings.nuisances,
    )
    digest.update(repr(method).encode())
    return digest.hexdigest()[:16]


def identification_notes(
    residual_function: ResidualFunction, estimation: EstimationResult, settings: IdentificationSettings, tests: Sequence[TestFit],
    nuisances: Sequence[NuisanceEstimate],
) -> tuple[str, ...]:  # fmt: skip
    """What to be wary of, one sentence each."""
    sentences, law, histories = [], residual_function.law, residual_function.histories
    if not estimation.minimum.converged:
        sentences.append("the last refinement stopped at its cap of steps: raise starts or look at the plot")
    temperatures = {round(float(v), 1) for h in histories for v in h.temperature_program().values}
    if max(temperatures) - min(temperatures) > 5 and not law.uses(temperature):
        sentences.append(
            f"the tests span {min(temperatures):.0f} to {max(temperatures):.0f} K and this law knows no temperature"
        )
    stress_levels = {round(float(v), 3) for h in histories for v in reference_stresses(h, residual_function.predictor)}
    if len(stress_levels) == 1 and all(h.loading.quantity == "stress" for h in histories):
        sentences.append("all tests have one stress: the stress dependence is not determined by them")
    if len(histories) < MINIMUM_TESTS and any(n.kind == "rate" and n.sd is None for n in settings.nuisances):
        assumption_note = f"their rates are assumed to scatter by {100 * ASSUMED_RATE_SD:.0f} %"
        likelihood_note = "how their rates scatter cannot be seen, and intervals are those of these tests alone"
        sentences.append(
            f"fewer than {MINIMUM_TESTS} tests: {likelihood_note if settings.weights == 'likelihood' else assumption_note}"
        )
    sentences += _large_strain_notes(histories)
    if (BoundPenalties(residual_function).constraint_violations(estimation.minimum.u[: len(law.params)]) > 1e-3).any():
        sentences.append("a constraint of the law does not hold over the tests at these values")
    return (*sentences, *_test_notes(residual_function, tests, nuisances))


def domain_notes(prediction: Prediction, histories: Sequence[History]) -> tuple[str, ...]:
    """The tests for which a surrogate speaks of what it was not trained on, in one sentence."""
    outside = [h.name for h, s in zip(histories, prediction.status[0], strict=True) if s == Status.OUTSIDE_DOMAIN]
    if not outside:
        return ()
    named_tests = f"'{outside[0]}'" + (f" and {len(outside) - 1} more" if len(outside) > 1 else "")
    problem = "the answer lies outside the domain that the surrogate was trained in"
    return (f"{problem}, in test {named_tests}: simulate it with the specimen itself",)


def _large_strain_notes(histories: Sequence[History]) -> list[str]:
    """A column in percent that was taken for plain strain shows in its size."""
    for end_is_known, limit in ((False, LARGE_STRAIN), (True, LARGE_RUPTURE_STRAIN)):
        tests = [h for h in histories if "strain" in h.outputs and h.end_known == end_is_known]
        if any(h.outputs["strain"][usable_frames(h, "strain")].max(initial=0.0) > limit for h in tests):
            return [f"strains above {limit:g} were fitted: a column in percent must say so, as strain_pct"]
    return []


def _test_notes(
    residual_function: ResidualFunction, tests: Sequence[TestFit], nuisances: Sequence[NuisanceEstimate]
) -> list[str]:
    sentences = [
        f"test '{m.name}' is far from the others and weighs {m.weight:.2g} of one"
        for m in tests
        if m.weight < LOW_TEST_WEIGHT
    ]
    nuisance_parameters = residual_function.nuisance_parameters
    for n, low, high in zip(nuisances, nuisance_parameters.low, nuisance_parameters.high, strict=True):
        if min(n.value - low, high - n.value) < 1e-4 * (high - low):
            sentences.append(f"the {n.kind} of '{n.owner}' lies at its bound, {n.value:.4g}")
    return sentences


REFIT_ROUNDS = 2


def identify(
    law: CreepLaw,
    histories: Sequence[History],
    using: Predictor | Mapping[str, Predictor],
    *,
    settings: IdentificationSettings | None = None,
    search: GlobalSearch | None = None,
    through: Predictor | None = None,
    start: Floats | None = None,
    known_nuisances: Sequence[NuisanceEstimate] = (),
    reference: ReferencePoint | None = None,
    progress: IterationCallback | None = None,
) -> Identification:
    """Identify the parameters of `law` from `histories` by a global search, then by their likelihood.

    using : predictor, such as the specimen that study.specimen("uniaxial") returns, or {specimen: predictor} where
        histories are of several. One that offers screening() is searched with that stand-in and then refined.
    search : how to begin; by default least squares from several screened starts (MultiStart).
    through : a cheaper predictor, such as a surrogate, in which the search's minima are refined before `using` is
        asked: values and intervals are those of `using`.
    start : conditioned coordinates to begin from instead of a global search; a refit takes two rounds at most.
    known : explicit nuisances as they were found before, to begin from.
    """
    settings = settings or IdentificationSettings()
    with single_threaded_blas():
        problem = IdentificationProblem.from_histories(law, histories, using, settings, reference)
        if start is not None:
            search_outcome = SearchOutcome([problem.bounds.clip(np.asarray(start, float))], 0, None)
        else:
            search_outcome = _global_search(problem, through, search or MultiStart(), progress)
        if search_outcome.dropped_terms:
            return _without_terms(problem, search_outcome, progress)
        nuisance_values = {(n.kind, n.owner): n.value for n in known_nuisances}
        estimates = _local_estimates(problem, search_outcome, through, nuisance_values, start is not None, progress)
        best = max(estimates, key=lambda end: end.log_likelihood)
        problem.residual_function.nuisance_parameters = best.nuisance_parameters
        check_bounds(problem.residual_function, best.minimum.u[: len(law.params)], _gradient(best)[: len(law.params)])
        return _result(problem, best, search_outcome)


def _gradient(best: EstimationResult) -> Floats:
    """(unknowns,) derivative of half the chi-square of the data to x."""
    covariance_factor, r = cholesky_factors(best.residuals, best.working_noise), best.residuals
    assert r.jacobian is not None
    whitened = np.linalg.solve(covariance_factor, np.concatenate([r.values[..., None], r.jacobian], axis=-1))
    return np.asarray(np.einsum("te,tep->p", whitened[..., 0], whitened[..., 1:]))


class SearchOutcome(NamedTuple):
    """Where a search left off: starts, candidates asked for, its trace, and terms that its best minimum is without."""

    starts: list[Floats]
    evaluations: int
    trace: SearchTrace | None
    dropped_terms: tuple[str, ...] = ()


def _without_terms(
    problem: IdentificationProblem, search_outcome: SearchOutcome, progress: IterationCallback | None
) -> Identification:
    """The answer for what the search left of a sum: a term that is off must not come back as a small one."""
    residual_function = problem.residual_function
    reduced_law = residual_function.law.without(*search_outcome.dropped_terms)
    kept_positions = [residual_function.law.names.index(name) for name in reduced_law.names]
    fit = identify(
        reduced_law, problem.histories, residual_function.predictor, settings=problem.settings, start=search_outcome.starts[0][kept_positions],
        reference=residual_function.coordinates.reference, progress=progress,
    )  # fmt: skip
    note = f"the search left out {' and '.join(search_outcome.dropped_terms)} of law '{residual_function.law.name}'"
    return replace(fit, search_trace=search_outcome.trace, notes=(*fit.notes, note))


def _global_search(
    problem: IdentificationProblem, through: Predictor | None, search: GlobalSearch, progress: IterationCallback | None
) -> SearchOutcome:
    """The best minima that differ, by the stand-in of the cheapest predictor."""
    predictor = through or problem.residual_function.predictor
    reduced_order_model = reduced_order_model_of(predictor)
    cost_function = problem.cost_function(reduced_order_model or predictor)
    search_result = search.minima(cost_function, progress)
    distinct_minima = distinct(
        search_result.minima,
        problem.bounds,
        equal_predictions=EQUAL_PREDICTIONS if reduced_order_model is None else EQUAL_REDUCED_ORDER_PREDICTIONS,
    )
    return SearchOutcome(
        [m.u for m in distinct_minima],
        cost_function.objective.evaluations,
        search_result.trace,
        distinct_minima[0].terms_off,
    )


def _local_estimates(
    problem: IdentificationProblem, search_outcome: SearchOutcome, through: Predictor | None, known_nuisances: Mapping[tuple[str, str], float], is_refit: bool,
    progress: IterationCallback | None,
) -> list[EstimationResult]:  # fmt: skip
    """Where the starts lead, through the cheaper predictor first if there is one; its best end goes on."""
    residual_function, working_estimator, full_bounds = (
        problem.residual_function,
        problem.working_noise,
        problem.full_bounds,
    )
    is_expensive = reduced_order_model_of(residual_function.predictor) is not None
    starts, limits, working_noise = (
        [starting_point(residual_function.nuisance_parameters, u, known_nuisances) for u in search_outcome.starts],
        IterationLimits(),
        None,
    )
    if through is not None and not is_refit:
        cheaper = problem.with_predictor(through)
        results = [
            estimate_iteratively(cheaper, full_bounds, x, working_estimator, APPROXIMATE_LIMITS, progress)
            for x in starts
        ]
        best = max(results, key=lambda end: end.log_likelihood)
        starts, working_noise = [best.minimum.u], best.working_noise
    if is_expensive:
        limits = SIMULATION_LIMITS
    if is_refit:
        limits = replace(limits, rounds=REFIT_ROUNDS)
    results, nuisance_parameters = [], residual_function.nuisance_parameters
    for x in starts:
        residual_function.nuisance_parameters = nuisance_parameters
        results.append(
            estimate_iteratively(residual_function, full_bounds, x, working_estimator, limits, progress, working_noise)
        )
    return results


def _result(problem: IdentificationProblem, best: EstimationResult, search_outcome: SearchOutcome) -> Identification:
    """Scatter, intervals and misfits at the optimum."""
    residual_function, settings, histories = problem.residual_function, problem.settings, problem.histories
    law, coordinates, residuals = residual_function.law, residual_function.coordinates, best.residuals
    parameters, x = len(law.params), best.minimum.u
    u = x[:parameters]
    noise_model, covariance, freedom = _uncertainty(problem, best)
    prediction = predict(
        residual_function.predictor,
        law,
        coordinates.theta(u)[None],
        list(histories),
        nuisances=best.nuisance_parameters.predictor_values(x[parameters:]),
    )
    law_covariance = covariance[:parameters, :parameters]
    ruptures = compare_rupture_times(
        coordinates, u, law_covariance, noise_model, interval_quantile(freedom), histories, residual_function.predictor
    )
    tests = goodness_of_tests(
        residual_function, residuals, predicted_random_effects(residuals, noise_model), histories, prediction, ruptures
    )
    nuisance_estimates = _nuisance_estimates(
        best.nuisance_parameters, x[parameters:], np.sqrt(np.diag(covariance))[parameters:]
    )
    return Identification(
        law=law,
        estimates=parameter_estimates(law, coordinates, u, law_covariance, interval_quantile(freedom)),
        u=u,
        covariance=law_covariance,
        reference=coordinates.reference,
        noise_model=noise_model,
        rms=pooled_log_strain_rms(tests),
        log_likelihood=best.log_likelihood,
        effective_frames=effective_sample_size(residuals, noise_model),
        freedom=freedom,
        tests=tests,
        ranges=fitted_ranges(residual_function),
        settings=settings,
        provenance=provenance_of(residual_function, settings, search_outcome.evaluations),
        errors=pooled_errors(histories, prediction, tests),
        nuisances=nuisance_estimates,
        converged=best.minimum.converged,
        notes=(
            *identification_notes(residual_function, best, settings, tests, nuisance_estimates),
            *domain_notes(prediction, histories),
        ),
        histories=histories,
        predictor=residual_function.predictor,
        search_trace=search_outcome.trace,
        linearised=best.linearised,
    )


def _uncertainty(problem: IdentificationProblem, best: EstimationResult) -> tuple[NoiseModel, Floats, float]:
    """The whole scatter, the posterior covariance of x = (u, e), and its degrees of freedom."""
    settings, working_estimator = problem.settings, problem.working_noise
    if best.linearised is not None:
        fixed = working_estimator.fixed_components(best.working_noise)
        return best.working_noise, *restricted_covariance(
            best.linearised, best.working_noise, settings.nuisances, fixed
        )
    size, nuisances = (
        len(problem.residual_function.law.params),
        _with_assumed_rate(settings.nuisances, len(problem.histories)),
    )
    at_prior_means = best.nuisance_parameters.integrate_out(best.residuals, best.minimum.u[size:])
    noise_model = estimate_variance_components(
        at_prior_means,
        initial_noise_model(working_estimator.with_measured_noise(best.working_noise), nuisances),
        nuisances,
    )
    rate_is_given = any(n.kind == "rate" and n.sd is not None for n in nuisances)
    full_bounds = problem.bounds.with_nuisances(best.nuisance_parameters)
    fitting_noise = with_rupture_weight(best.working_noise, problem.residual_function.observations)
    return noise_model, *laplace_covariance(
        best.residuals, fitting_noise, noise_model, full_bounds, best.nuisance_parameters, rate_known=rate_is_given
    )


def _nuisance_estimates(nuisance_parameters: NuisanceParameters, e: Floats, sd: Floats) -> tuple[NuisanceEstimate, ...]:
    return tuple(
        NuisanceEstimate(n.kind, n.scope, member, float(value), float(s), float(mean), float(prior_sd))
        for n, member, value, s, mean, prior_sd in zip(
            nuisance_parameters.nuisances,
            nuisance_parameters.owners,
            e,
            sd,
            nuisance_parameters.mean,
            nuisance_parameters.sd,
            strict=True,
        )
    )


def _with_assumed_rate(nuisances: Sequence[Nuisance], tests: int) -> tuple[Nuisance, ...]:
    """The nuisances, with the scatter between tests assumed where too few tests could show it."""
    if tests >= MINIMUM_TESTS:
        return tuple(nuisances)
    return tuple(replace(n, sd=ASSUMED_RATE_SD) if n.kind == "rate" and n.sd is None else n for n in nuisances)


def refit(fit: Identification, histories: Sequence[History]) -> Identification:
    """The same law on other histories, starting where `fit` ended (for hold-out and resampling)."""
    if fit.predictor is None:
        raise FitError("cannot refit an identification that was loaded from a file without its specimen")
    return identify(
        fit.law,
        histories,
        fit.predictor,
        settings=fit.settings,
        start=fit.u,
        known_nuisances=fit.nuisances,
        reference=fit.reference,
    )
