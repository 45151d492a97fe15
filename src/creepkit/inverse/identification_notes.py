"""Provenance and notes of an identification: versions and fingerprints, ranges of the tests, and its limitations.

Histories that are attached to one that was loaded are compared with those that it was made from.
"""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime
from importlib.metadata import version
from typing import TYPE_CHECKING

import numpy as np

from creepkit import registry
from creepkit.arrays import Floats
from creepkit.errors import FitWarning
from creepkit.inverse.compared_tests import UNTESTABLE, compared_tests, followed_duration, rests_on_durations
from creepkit.inverse.history_checks import sound_tests
from creepkit.inverse.iterative_estimation import EstimationResult
from creepkit.inverse.noise_model import MINIMUM_TESTS
from creepkit.inverse.nuisance_parameters import NuisanceEstimate
from creepkit.inverse.prediction_failures import tests_without_prediction
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.reference_conditions import (
    reference_end_strain,
    reference_stresses,
    spans_temperatures,
    usable_frames,
)
from creepkit.inverse.uncertainty.rate_scatter import unstated_member_notes
from creepkit.language import temperature
from creepkit.records import History, Prediction, Predictor, Status
from creepkit.records.conditions import condition_values
from creepkit.records.units import celsius_text

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification

LARGE_STRAIN, LARGE_RUPTURE_STRAIN = 0.5, 2.0
"""Strains above these are worth a word: of a test whose end is not known, and of one that was followed to it."""


PAUSE = 0.1
"""Of the largest stress of a test under a load: below it, as in a pause or a loading ramp, hardly anything creeps."""


def fitted_ranges(problem: LeastSquaresProblem, simulated: Sequence[Floats]) -> dict[str, tuple[float, float]]:
    """{"stress", "temperature", "strain", "time": (low, high)} of the fitted frames, MPa, K, s; and of conditions.

    simulated : of each test (stresses,) MPa, those that it goes through.
    """
    tests = problem.histories
    stresses = [
        float(v)
        for h, of_test in zip(tests, simulated, strict=True)
        for v in of_test
        if h.loading.quantity == "strain" or v >= PAUSE * of_test.max()
    ]
    values_by_name = {
        "stress": stresses or [0.0],
        "temperature": [v for h in tests for v in _temperatures(h)],
        "strain": [0.0, *(reference_end_strain(h, problem.predictor) for h in tests)],
        "time": [v for h in tests for v in _time_range(h)],
    }
    conditions = zip(problem.law.conditions, condition_values(problem.law, tests).T, strict=True)
    values_by_name |= {one.name: values.tolist() for one, values in conditions}
    return {name: (float(min(values)), float(max(values))) for name, values in values_by_name.items()}


def _temperatures(history: History) -> Floats:
    """(levels,) K, where a stress was imposed without those of pauses."""
    levels, end = history.followed_temperatures, history.used_times[-1]
    if history.loading.quantity != "stress" or levels.size < 3:
        return levels
    times, load = history.temperature_program().times, history.loading.program()
    stress = load.at(np.append(times[times < end], end))
    is_on = (stress >= PAUSE * load.values.max()) | (np.arange(levels.size) == 0)
    return np.asarray(levels[is_on])


def _time_range(history: History) -> tuple[float, float]:
    """First time and that of the last used frame, s; of a test without frames from loading to its end."""
    if not history.outputs:
        return 0.0, followed_duration(history)
    return float(history.times[0]), float(history.used_times[-1])


def provenance_of(problem: LeastSquaresProblem, search_evaluations: int) -> dict[str, str | int]:
    """Versions, fingerprints and counts; one evaluation is one candidate on all tests.

    search_evaluations : of the global search, by the reduced-order model where the predictor has one.
    """
    law = problem.law
    return {
        "creepkit": version("creepkit"),
        "law": law.name,
        "origin": registry.default_registry().distributions_of(law),
        "fingerprint": law.fingerprint,
        "specimen": problem.predictor.label,
        "evaluations": problem.evaluations.count,
        "search_evaluations": search_evaluations,
        "data": data_digest(problem),
        "when": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def data_digest(problem: LeastSquaresProblem) -> str:
    """What was compared, and how: identifications that share it can be ranked against one another."""
    digest, observations, settings = hashlib.sha256(), problem.observations, problem.settings
    for array in (observations.values, observations.times, observations.present, observations.output_index):
        digest.update(np.ascontiguousarray(array).tobytes())
    names = [h.name for h in problem.histories]
    method = (names, observations.outputs, observations.transforms, settings.nuisances)
    digest.update(repr(method).encode())
    return digest.hexdigest()[:16]


def identification_notes(estimation: EstimationResult, nuisances: Sequence[NuisanceEstimate]) -> tuple[str, ...]:
    """What limits the trust in an identification, one sentence each."""
    problem = estimation.problem
    sentences, law, histories, settings = [], problem.law, problem.histories, problem.settings
    if not estimation.converged:
        sentences.append("the last refinement stopped at its largest number of steps: raise starts or look at the plot")
    temperatures = [float(v) for h in histories for v in h.followed_temperatures]
    if spans_temperatures(histories) and not law.uses(temperature):
        sentences.append(
            f"the tests span {celsius_text(min(temperatures), max(temperatures))} and this law knows no temperature"
        )
    elif spans_temperatures(histories):
        isothermal = [str(s) for s, state in law.states.items() if state.rate != 0 and not state.rate.has(temperature)]
        if isothermal:
            sentences.append(f"the rate of {', '.join(isothermal)} knows no temperature, as that of creep does")
    stress_levels = {round(float(v), 3) for h in histories for v in reference_stresses(h, problem.predictor)}
    if len(stress_levels) == 1 and all(h.loading.quantity == "stress" for h in histories):
        sentences.append("all tests have one stress: the stress dependence is not determined by them")
    if len(histories) < MINIMUM_TESTS and any(n.kind == "rate" and n.sd is None for n in settings.nuisances):
        note = "how their rates scatter cannot be seen, and intervals are those of these tests alone"
        sentences.append(f"fewer than {MINIMUM_TESTS} tests: {note}")
    sentences += [UNTESTABLE] if rests_on_durations(law, histories) else []
    sentences += _large_strain_notes(histories)
    with_both = [h.name for h in histories if h.minimum_rate is not None and h.outputs]
    if with_both:
        sentences.append(
            f"the minimum rate stated of {_named(with_both)} was not used: the readings of its test hold it already"
        )
    sentences += unstated_member_notes(histories)
    if (problem.bound_penalties.constraint_violations(estimation.x[: problem.parameter_count]) > 1e-3).any():
        sentences.append("a constraint of the law does not hold over the tests at these values")
    limits = problem.nuisance_parameters
    for n, low, high in zip(nuisances, limits.low, limits.high, strict=True):
        if min(n.value - low, high - n.value) < 1e-4 * (high - low):
            sentences.append(f"the {n.key} of '{n.owner}' lies at its bound, {n.value:.4g}")
    return tuple(sentences)


def domain_notes(prediction: Prediction, histories: Sequence[History]) -> tuple[str, ...]:
    """Tests of which nothing is predicted, and those outside what a surrogate was trained on, a sentence each."""
    sentences = []
    missing = tests_without_prediction(prediction, histories)[0]
    if missing.any():
        names = [h.name for h, is_missing in zip(histories, missing, strict=True) if is_missing]
        how = Status(int(prediction.status[0, int(missing.argmax())])).text
        sentences.append(f"nothing is predicted of test {_named(names)}: {how}")
    outside = [h.name for h, s in zip(histories, prediction.status[0], strict=True) if s == Status.OUTSIDE_DOMAIN]
    if outside:
        problem = "the identified law lies outside the domain that the surrogate was trained in"
        sentences.append(f"{problem}, in test {_named(outside)}: simulate it with the specimen itself")
    return tuple(sentences)


def _named(tests: Sequence[str]) -> str:
    """The first of some tests, and how many others there are."""
    return f"'{tests[0]}'" + (f" and {len(tests) - 1} more" if len(tests) > 1 else "")


def _large_strain_notes(histories: Sequence[History]) -> list[str]:
    """A column in percent that was taken for plain strain shows in its size."""
    for end_is_known, limit in ((False, LARGE_STRAIN), (True, LARGE_RUPTURE_STRAIN)):
        tests = [h for h in histories if "strain" in h.outputs and h.end_known == end_is_known]
        if any(h.outputs["strain"][usable_frames(h, "strain")].max(initial=0.0) > limit for h in tests):
            return [f"strains above {limit:g} were fitted: a column in percent must say so, as strain_pct"]
    return []


def with_attached(fit: Identification, tests: Sequence[History], predictor: Predictor) -> Identification:
    """The identification with its tests and what predicts them, copies and suspect frames left out as they were.

    FitWarning where the tests are not those that it was made from: other frames, values, weights or nuisances.
    """
    tests, _ = compared_tests(fit.law, tests, fit.settings)
    attached = replace(fit, histories=tuple(tests), predictor=predictor, problem=None)
    known = fit.provenance.get("data")
    sound = tuple(sound_tests(tests, fit.settings)[0])
    if known is None or _digest(attached) == known:
        return attached
    without_suspect = replace(attached, histories=sound)
    if _digest(without_suspect) == known:
        return without_suspect
    warnings.warn(
        f"the tests given differ from those that {fit.law.name} was identified from, although they have the same "
        "names: identify it again, or give the same files",
        FitWarning,
        stacklevel=5,
    )
    return attached


def _digest(fit: Identification) -> str:
    assert fit.predictor is not None
    return data_digest(
        LeastSquaresProblem.from_histories(fit.law, fit.histories, fit.predictor, fit.settings, fit.reference)
    )
