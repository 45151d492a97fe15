"""rupture: time-temperature methods fitted to rupture tests alike, ranked, with strengths and checks."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from importlib.metadata import version

import numpy as np

from creepkit.arrays import Floats, single_threaded_blas
from creepkit.checked_arguments import checked
from creepkit.errors import FitError, refuse_unknown
from creepkit.inverse.evidence import evidence_weights
from creepkit.records import History
from creepkit.records.units import celsius_text
from creepkit.rupture_assessment.assessment import (
    AVERAGE,
    RankedRuptureFit,
    RuptureAssessment,
    RuptureSettings,
    check_conditions,
    interpolated,
)
from creepkit.rupture_assessment.checks import (
    AssessmentCheck,
    effectiveness,
    physical_realism,
    populations,
    repeatability,
    turning,
)
from creepkit.rupture_assessment.fitting import (
    LEAST_CURVATURE,
    MinimumRateRelation,
    conditions_of,
    curvature_probability,
    fit_method,
    fit_relation,
    too_few_tests,
)
from creepkit.rupture_assessment.methods import METHODS, MINIMUM_RATE, MONKMAN_GRANT
from creepkit.rupture_assessment.observed_tests import (
    NOT_STATED,
    RuptureTests,
    TensileStrength,
    rupture_tests,
    tensile_strengths,
)
from creepkit.rupture_assessment.rupture_fit import RuptureFit
from creepkit.rupture_assessment.strength import strength_estimates

DEFAULT_HOURS = (1e3, 1e4, 1e5)

THERMAL_METHODS = ("larson-miller", "orr-sherby-dorn", "manson-haferd")

LEAST_RATES = 4
"""Tests with a rupture time and a minimum rate from which Monkman-Grant's relation is fitted unasked."""


@checked
def rupture(
    tests: Sequence[History],
    methods: Sequence[str] | str | None = None,
    *,
    hours: Sequence[float] = DEFAULT_HOURS,
    temperatures: Sequence[float] | None = None,
    stresses: Sequence[float] = (),
    tensile_strength: Mapping[float, float] | None = None,
    settings: RuptureSettings | None = None,
) -> RuptureAssessment:
    """Assess rupture tests: every method under one censored likelihood, ranked, with strengths and checks.

    tests : histories with a rupture time, or stopped unruptured, with or without frames, of one stress and temperature
        each; labels heat and laboratory where they are known, and tensile_strength_MPa and minimum rates for the
        methods that need them.
    methods : of "larson-miller", "orr-sherby-dorn", "manson-haferd", "wilshire", "monkman-grant", and "isothermal" for
        tests of one temperature; by default all that the tests allow.
    hours, temperatures : h and K, at which strengths are stated; by default 1e3, 1e4 and 1e5 h at the temperatures
        tested. stresses : MPa, at which times to rupture are stated at these temperatures.
    tensile_strength : {temperature in K: MPa}, interpolated between; by default as the tests state it.
    """
    chosen = settings or RuptureSettings()
    check_conditions(temperatures, hours)
    asked = _known_names(methods)
    observed, with_rate, notes = rupture_tests(list(tests))
    if not chosen.random_effects:
        observed, with_rate = replace(observed, groups={}), replace(with_rate, groups={})
    T, strengths = tensile_strengths(observed, tensile_strength)

    def tensile(at: Floats) -> Floats:
        return interpolated(T, strengths, at)

    names, relation_asked = _methods(asked, observed, tensile, chosen)
    with single_threaded_blas():
        ranked, rejected = _ranked(names, observed, tensile, chosen) if names else ((), {})
        relation = _relation(observed, with_rate, relation_asked, chosen)
        if not ranked:
            raise FitError(_nothing_left(rejected, relation))
        assessment = RuptureAssessment(
            observed,
            chosen,
            ranked,
            (),
            (),
            T,
            strengths,
            relation,
            rejected,
            (*notes, *_notes(observed, chosen), *_relation_notes(relation, with_rate)),
            {
                "creepkit": version("creepkit"),
                "data": observed.fingerprint,
                "when": datetime.now(UTC).isoformat(timespec="seconds"),
            },
        )
        wanted = list(observed.isotherms) if temperatures is None else temperatures
        by_name = [AVERAGE, *assessment.methods, *([] if relation is None else [MONKMAN_GRANT.name])]
        stated = [
            one for name in by_name for t in wanted for one in assessment.strengths_at(t, hours=hours, method=name)
        ]
        lives = tuple(assessment.life(stress, t) for t in wanted for stress in stresses)
        labels, at = [one.labels for one in tests if one.end_known], conditions_of(observed, tensile)
        checks = _checks(assessment, tensile, max(hours), wanted) + populations(assessment.best, observed, at, labels)
    return replace(assessment, strengths=tuple(stated), checks=tuple(checks), lives=lives)


def _known_names(methods: Sequence[str] | str | None) -> list[str] | None:
    """The methods asked for, each once; FitError for one that there is not."""
    if methods is None:
        return None
    known = [name for name in METHODS if name != MINIMUM_RATE.name]
    asked = list(dict.fromkeys([methods] if isinstance(methods, str) else methods))
    for name in asked:
        refuse_unknown(name, known, FitError, f"there is no method '{name}' of rupture times")
    return asked


def _methods(
    asked: Sequence[str] | None, tests: RuptureTests, tensile: TensileStrength, settings: RuptureSettings
) -> tuple[list[str], bool]:
    """Methods that are ranked, and whether Monkman-Grant's was asked for; FitError for what cannot be fitted."""
    strengths = tensile(tests.temperature)
    has_tensile = bool(
        np.isfinite(np.where(np.isfinite(tests.tensile_strength), tests.tensile_strength, strengths)).all()
    )
    if asked is None:
        names = ["isothermal"] if tests.isothermal else [*THERMAL_METHODS]
        if has_tensile and (not tests.isothermal or "Q" in settings.fixed.get("wilshire", {})):
            names.append("wilshire")
        return names, False
    for name in asked:
        constants = settings.fixed.get(name, {})
        if tests.isothermal and METHODS[name].thermal and not constants:
            place = celsius_text(float(tests.temperature.mean()))
            advice = f", or give its {METHODS[name].fixable[0]} by fixed=" if METHODS[name].fixable else ""
            raise FitError(
                f"all tests are at {place}, which does not determine {name}; use the method isothermal{advice}"
            )
        if name == "wilshire" and not has_tensile:
            missing = [T for T in tests.isotherms if not np.isfinite(tensile(np.array([T]))[0])]
            where = f" at {', '.join(celsius_text(T) for T in missing)}" if missing else ""
            raise FitError(
                f"wilshire needs the tensile strength{where}: give tensile_strength={{temperature in K: MPa}} "
                "(--tensile), or a label tensile_strength_MPa of each test"
            )
        if name == "isothermal" and not tests.isothermal:
            raise FitError(f"isothermal is for tests of one temperature; these have {len(tests.isotherms)}: select one")
    return [name for name in asked if name != MONKMAN_GRANT.name], MONKMAN_GRANT.name in asked


def _ranked(
    names: Sequence[str], tests: RuptureTests, tensile: TensileStrength, settings: RuptureSettings
) -> tuple[tuple[RankedRuptureFit, ...], dict[str, str]]:
    fits, rejected = [], {}
    at = conditions_of(tests, tensile)
    for name in names:
        if METHODS[name].needs == "tensile_strength" and (tests.stress >= at.tensile_strength).any():
            k = int(np.argmax(tests.stress - at.tensile_strength))
            rejected[name] = (
                f"test '{tests.names[k]}' is at {tests.stress[k]:g} MPa, not below the tensile strength, "
                f"{at.tensile_strength[k]:g} MPa"
            )
            continue
        for degree in settings.degrees if METHODS[name].degrees else (1,):
            label = f"{name}, degree {degree}" if METHODS[name].degrees else name
            few = too_few_tests(METHODS[name], tests, at, degree=degree, fixed=settings.fixed.get(name, {}))
            if few:
                rejected[label] = few
                continue
            try:
                fit = _fit(name, degree, tests, tensile, settings)
            except FitError as error:
                rejected[label] = str(error)
                continue
            problem = turning(fit, tests, tensile)
            if problem:
                rejected[label] = problem
            else:
                fits.append(fit)
    if not fits:
        return (), rejected
    scores = [-2.0 * fit.log_likelihood + fit.parameter_count * np.log(fit.observations) for fit in fits]
    excess, by_fit = evidence_weights(scores)
    degrees = Counter(fit.method for fit in fits)
    shares = by_fit / [degrees[fit.method] for fit in fits]  # every method has the same weight before the tests
    weight = shares / shares.sum()
    order = np.argsort(-weight, kind="stable")
    return tuple(RankedRuptureFit(fits[k], float(excess[k]), float(weight[k])) for k in order), rejected


def _fit(
    name: str, degree: int, tests: RuptureTests, tensile: TensileStrength, settings: RuptureSettings
) -> RuptureFit:
    return fit_method(
        METHODS[name],
        tests,
        conditions_of(tests, tensile),
        degree=degree,
        fixed=settings.fixed.get(name, {}),
        level=settings.level,
        usual=settings.usual_scatter,
    )


def _relation(
    tests: RuptureTests, with_rate: RuptureTests, asked: bool, settings: RuptureSettings
) -> MinimumRateRelation | None:
    known = np.isfinite(tests.minimum_rate) & ~tests.censored
    if not asked and known.sum() < LEAST_RATES:
        return None
    try:
        return fit_relation(tests, with_rate, level=settings.level, usual=settings.usual_scatter)
    except FitError:
        if asked:
            raise
        return None


def _relation_notes(relation: MinimumRateRelation | None, with_rate: RuptureTests) -> list[str]:
    """Why strengths by Monkman-Grant's relation may be off."""
    if relation is None:
        return []
    probability = curvature_probability(with_rate)
    if probability >= LEAST_CURVATURE:
        return ["strengths by monkman-grant take one stress exponent for all rates; checks are not made of them"]
    return [
        "strengths by monkman-grant are off, and their bounds do not say so: their rate law has one stress exponent, "
        f"which these rates contradict (p = {probability:.2g})"
    ]


def _nothing_left(rejected: Mapping[str, str], relation: MinimumRateRelation | None) -> str:
    """Why nothing is ranked: of each method the reason of its lowest degree, methods with one reason together."""
    if rejected:
        reasons: dict[str, str] = {}
        for label, why in rejected.items():
            reasons.setdefault(label.partition(",")[0], why)
        alike: dict[str, list[str]] = {}
        for name, why in reasons.items():
            alike.setdefault(why, []).append(name)
        parts = [f"{' and '.join(names)}: {why}" for why, names in alike.items()]
        return f"no method can be fitted: {'; '.join(parts)}"
    asked = "" if relation is None else " beside monkman-grant, which predicts no time without rates"
    return f"no method of rupture times is asked for{asked}; name one, such as larson-miller"


def _notes(tests: RuptureTests, settings: RuptureSettings) -> list[str]:
    notes = []
    if "heat" not in tests.groups and settings.random_effects:
        notes.append("heats are not told apart by the tests, so bounds hold no scatter between heats of its own")
    notes += [
        f"{values.count(NOT_STATED)} tests state no {group}; they count as one"
        for group, values in tests.groups.items()
        if NOT_STATED in values
    ]
    if len(tests.groups) > 1 and tests.censored.any():
        notes.append("effects of heats and laboratories are integrated out by Laplace's approximation")
    elif tests.groups and tests.censored.any():
        notes.append("effects are integrated out by adaptive Gauss-Hermite quadrature")
    few = [group for group, values in tests.groups.items() if len(set(values)) < 5]
    notes += [
        f"{len(set(tests.groups[g]))} values of {g} hardly tell the scatter between them, on which bounds of a new one "
        "and of a test rest: give tests of five or more, or count all as one (--no-random-effects; random_effects = "
        "false in a study)"
        for g in few
    ]
    return notes


def _checks(
    assessment: RuptureAssessment, tensile: TensileStrength, hours: float, temperatures: Sequence[float]
) -> list[AssessmentCheck]:
    best, tests = assessment.best, assessment.tests

    def strengths_of(fit: RuptureFit, of_tests: RuptureTests) -> list[float | None]:
        return [
            strength_estimates(
                [(fit, 1.0)], fit.name, of_tests, tensile, hours=[hours], temperature=T, level=best.level
            )[0].value
            for T in temperatures
            if not assessment.obstacle([(fit, 1.0)], T)
        ]

    original = strengths_of(best, tests)
    lowest = min((s for s in original if s is not None), default=None)

    def repeated(kept: RuptureTests) -> list[float | None]:
        return strengths_of(_fit(best.method, best.degree, kept, tensile, assessment.settings), tests)

    return [
        *physical_realism(best, tests, tensile, lowest),
        *effectiveness(best, tests, conditions_of(tests, tensile)),
        *repeatability(tests, original, repeated, hours=hours, seed=assessment.settings.seed),
    ]
