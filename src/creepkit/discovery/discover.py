"""discover: a law of temperature from identifications at single temperatures; temperature_study: from tests.

The elastic moduli are fitted to the first frames of tests, with Wachtman's form through them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
from scipy.optimize import least_squares

from creepkit.arrays import Floats
from creepkit.checked_arguments import checked
from creepkit.discovery.combinations import rank_combinations
from creepkit.discovery.forms import CONSTANT, CandidateForm, candidate_forms, check_form_names
from creepkit.discovery.regression import MIN_TEMPERATURES, IsothermalEstimates, check_temperatures, isothermal_groups
from creepkit.discovery.temperature_law import TemperatureLaw, refit, temperature_law_from_combinations
from creepkit.errors import CreepkitError, FitError
from creepkit.inverse.composite_predictor import CompositePredictor
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.history_checks import sound_tests, suspect_frames_note
from creepkit.inverse.identification import Identification
from creepkit.inverse.identify import identify
from creepkit.inverse.reference_conditions import ISOTHERMAL_RANGE, with_arrhenius
from creepkit.inverse.search.local_refinement import IterationCallback
from creepkit.inverse.search.multistart import StartingEstimate
from creepkit.inverse.settings import IdentificationSettings
from creepkit.language import CreepLaw, temperature
from creepkit.language.elastic import Elastic, wachtman
from creepkit.limits import numbers
from creepkit.options import Options, option, takes_options
from creepkit.records import History, Nuisance, Predictor
from creepkit.records.presentable import Presentable
from creepkit.records.units import celsius_text
from creepkit.registry import resolve_law
from creepkit.registry.arguments import resolve_predictors

if TYPE_CHECKING:
    from creepkit.option_keywords import DiscoveryOptionsKeywords

FIRST_FRAMES = 15


MODULUS_BOUNDS = (-0.7, 2.0)
"""Bounds of a modulus, relative to what the history states."""


_T0_BOUNDS = (100.0, 3000.0)
"""K, bounds of T0: below, the form is a straight line in T; above, a constant over any test."""


@dataclass(frozen=True, eq=False)
class ModulusEstimates(Presentable):
    """What the first frames say of the modulus.

    names : of the tests. temperatures : (tests,) K; values, sd : (tests,) MPa.
    elastic : Wachtman's form through them, with the first history's Poisson's ratio, or None for fewer than three
        temperatures. fit : the identification that they come from; its law holds for these frames alone.
    """

    names: tuple[str, ...]
    temperatures: Floats
    values: Floats
    sd: Floats
    elastic: Elastic | None
    fit: Identification

    shown_by = "temperature_law.modulus_estimates_text"


@checked
def moduli(
    law: CreepLaw | str,
    histories: Sequence[History],
    using: Predictor | str | None = None,
    *,
    frames: int = FIRST_FRAMES,
    settings: IdentificationSettings | None = None,
) -> ModulusEstimates:
    """Identify Young's modulus of each bulge test from its first frames, and Wachtman's form through the moduli.

    law : the creep law, with its temperature; frames : used frames of each test, the paper's 15 by default.
    Every history states a modulus to begin from.
    `[h.replace(elastic=estimates.elastic) for h in histories]` then fixes the moduli.
    """
    histories = list(histories)
    predictor = resolve_predictors(using, histories)
    if isinstance(predictor, Mapping):
        raise FitError("moduli are identified from tests of one specimen; give those alone, and using= that one")
    without_modulus = [h.name for h in histories if h.elastic is None]
    if without_modulus:
        raise FitError(f"history '{without_modulus[0]}' states no modulus to begin from; set elastic=Elastic(E=...)")
    if frames < 3:
        raise FitError(f"frames is {frames}; at least 3 are needed to tell a modulus from creep")
    first_frames = [h.replace(used=h.used & (np.cumsum(h.used) <= frames)) for h in histories]
    modulus = Nuisance("modulus", sd=np.inf, bounds=MODULUS_BOUNDS)
    chosen = replace(settings or IdentificationSettings(), nuisances=(modulus,))
    fit = identify(resolve_law(law), first_frames, predictor, settings=chosen)
    estimates = {n.owner: n for n in fit.nuisances if n.kind == "modulus"}
    stated = np.array([float(h.elastic.at(h.mean_temperature).E) for h in histories if h.elastic is not None])
    values = stated * (1.0 + np.array([estimates[h.name].value for h in histories]))
    sd = stated * np.array([estimates[h.name].sd for h in histories])
    temperatures = np.array([h.mean_temperature for h in histories])
    first_elastic = histories[0].elastic
    poisson_ratio = first_elastic.at(float(temperatures[0])).nu if first_elastic is not None else 0.3
    elastic = (
        Elastic(wachtman(*fit_wachtman(temperatures, values, sd)), poisson_ratio)
        if np.unique(temperatures).size > 2
        else None
    )
    return ModulusEstimates(tuple(h.name for h in histories), temperatures, values, sd, elastic, fit)


def fit_wachtman(temperatures: Floats, values: Floats, sd: Floats) -> tuple[float, float, float]:
    """E0 MPa, b MPa/K and T0 K of Wachtman's form.

    temperatures : (tests,) K. values : (tests,) MPa, the moduli. sd : (tests,) MPa, their standard deviations.
    """
    weights = 1.0 / np.maximum(sd, 1e-3 * values)

    def linear(T0: float) -> tuple[Floats, Floats]:
        columns = np.stack([np.ones_like(temperatures), -temperatures * np.exp(-T0 / temperatures)], axis=1)
        coefficients, *_ = np.linalg.lstsq(columns * weights[:, None], values * weights, rcond=None)
        return np.asarray(coefficients, float), np.asarray((columns @ coefficients - values) * weights, float)

    start = np.log(np.clip(np.median(temperatures), *_T0_BOUNDS))
    result = least_squares(lambda x: linear(float(np.exp(x[0])))[1], [start], bounds=np.log(_T0_BOUNDS))
    T0 = float(np.exp(result.x[0]))
    E0, b = linear(T0)[0]
    return float(E0), float(b), T0


Forms = Any
"""One or more temperature forms, or {parameter: one or more}; see discover()."""


@checked
def discover(
    fits: Sequence[Identification],
    *,
    forms: Forms | None = None,
    optimizer: Any = None,
    parameters: Sequence[str] | None = None,
    histories: Sequence[History] | None = None,
    joint_fit: Identification | None = None,
    progress: IterationCallback | None = None,
) -> TemperatureLaw:
    """Find closed forms of the parameters against temperature, and compare them on the tests where those are given.

    fits : identifications of one law, each at one temperature; three temperatures or more.
    forms : a list of temperature forms, or {parameter: list}; by default all registered ones that suit a parameter. A
        form is a name; a sympy expression in ck.temperature, with the parameter's symbol or to be added to it; a
        function of temperature; one that returns a TemperatureForm for a T_ref, as ck.linear; or a feature library of
        pysindy, whose features of T/1000 K are forms each and all together.
    optimizer : of pysindy, such as pysindy.STLSQ(threshold=2.0); it drops terms of a combination, whose coefficients it
        sees in standard deviations of their whitened columns. By default every term stays and the forms are weighed.
    parameters : those that may depend on temperature; by default all.
    histories : all tests; the forms are then put back into the law and refitted to them (see refit), with the settings
        and the predictor of the first identification.
    joint_fit : an identification of the law times Arrhenius' factor from all tests, where the refits begin.

    Before the estimates are seen 1/T counts four times for the coefficient of a rate, and forms of equally many numbers
    share equal odds. A combination of forms that fails is recorded in the notes with its reason, and the others go on.
    """
    estimates = IsothermalEstimates.from_identifications(fits)
    candidates = candidate_forms_of(estimates, forms, parameters)
    combinations = rank_combinations(estimates, candidates, progress, optimizer)
    temperature_law = temperature_law_from_combinations(estimates, combinations)
    if histories is None:
        return temperature_law
    predictor = fits[0].predictor
    if predictor is None:
        raise FitError(
            "the identifications were loaded from files: attach tests and specimen with fit.with_histories(tests)"
        )
    settings = fits[0].settings
    tests, _ = sound_tests(list(histories), settings)
    return refit(temperature_law, tests, predictor, settings=settings, joint_fit=joint_fit, progress=progress)


def candidate_forms_of(
    estimates: IsothermalEstimates, forms: Forms | None, parameters: Sequence[str] | None
) -> dict[str, list[CandidateForm]]:
    """{parameter: its candidate forms}, in the law's order."""
    law = estimates.law
    check_form_options(law, forms, parameters)
    coordinates = Coordinates(law, estimates.reference)
    rate_coefficients = {law.names[k] for k in coordinates.coefficients}
    T_ref, forms_by_parameter = estimates.reference.temperature, {}
    for name in law.names:
        own = _listed(forms.get(name) if isinstance(forms, Mapping) else forms)
        own = (CONSTANT,) if parameters is not None and name not in parameters else own
        forms_by_parameter[name] = candidate_forms(
            law, name, name in rate_coefficients, T_ref, estimates.temperatures, own
        )
    return forms_by_parameter


@checked
def check_form_options(law: CreepLaw, forms: Forms | None = None, parameters: Sequence[str] | None = None) -> None:
    """Raise an error, before any work, for names of parameters or temperature forms that there are not."""
    by_parameter = {n: _listed(own) or () for n, own in forms.items()} if isinstance(forms, Mapping) else {}
    for name in (*(parameters or ()), *by_parameter):
        law.symbol(name)
    listed = [*(chain.from_iterable(by_parameter.values()) if by_parameter else _listed(forms) or ())]
    check_form_names(one for one in listed if isinstance(one, str))


def _listed(forms: Any) -> Sequence[Any] | None:
    """Forms as a list, where one stands alone."""
    return forms if forms is None or isinstance(forms, list | tuple) else [forms]


@checked
@dataclass(frozen=True)
class DiscoveryOptions(Options, title="options of a temperature study"):
    """What temperature_study() is asked beside the settings of its identifications.

    forms : names of registered temperature forms, or {parameter: names}; by default all that suit a parameter.
    parameters : those that may depend on temperature; by default all.
    moduli : whether to find each test's modulus from its first 15 frames before; every test states one to begin from.
    within : K, tests so near to the coldest of a group are at one temperature.
    """

    forms: Mapping[str, Sequence[str]] | Sequence[str] | None = option(
        None, "Forms that a parameter may take.", flag="form", example="n=constant,linear"
    )
    parameters: tuple[str, ...] | None = option(None, "Those that may depend on temperature; by default all.")
    moduli: bool = option(False, "First find each test's modulus from its first 15 frames.")
    within: float = option(
        ISOTHERMAL_RANGE, "Tests so near are at one temperature.", numbers(0, 1e5), unit="K", flag="within"
    )


@dataclass(frozen=True, eq=False)
class TemperatureStudy(Presentable):
    """The result of temperature_study().

    tests : with the moduli found, where they were. moduli_fit : None where no modulus could be identified.
    joint_fit : the law times Arrhenius' factor, from all tests at once. isothermal_fits : one for each temperature.
    temperature_law : None where there are too few temperatures, which notes then say.
    """

    tests: tuple[History, ...]
    moduli_fit: ModulusEstimates | None
    joint_fit: Identification
    isothermal_fits: tuple[Identification, ...]
    temperature_law: TemperatureLaw | None
    notes: tuple[str, ...]

    shown_by = "temperature_law.temperature_study_text"


@takes_options(DiscoveryOptions)
@checked
def temperature_study(
    law: CreepLaw | str,
    tests: Sequence[History],
    using: Predictor | str | Mapping[str, Predictor | str] | None = None,
    *,
    settings: IdentificationSettings | None = None,
    joint_fit: Identification | None = None,
    progress: IterationCallback | None = None,
    **changes: Unpack[DiscoveryOptionsKeywords],
) -> TemperatureStudy:
    """Identify moduli, then the law times Arrhenius, then each temperature alone, and discover forms of temperature.

    law : without temperature. using : a predictor, or the name of a specimen; by default those that the tests name.
    joint_fit : that of the law times Arrhenius from these tests, where it was made; not with moduli, which change it.
    changes : fields of DiscoveryOptions.

    Tests whose used frames are not at one temperature are left out, and a temperature that cannot be identified alone
    is left out of the forms; both are noted.
    """
    options = DiscoveryOptions().changed(changes)
    form_options: dict[str, Any] = {"forms": options.forms, "parameters": options.parameters}
    law, resolved = resolve_law(law), resolve_predictors(using, tests)
    predictor = CompositePredictor.of(resolved)
    if law.uses(temperature):
        raise FitError(f"law '{law.name}' depends on temperature already; give it without: forms are what is sought")
    check_form_options(law, **form_options)
    if not tests:
        raise FitError("there are no histories to study")
    settings = settings or IdentificationSettings()
    histories, left_out = sound_tests(tests, settings)
    histories, not_isothermal = isothermal_tests(histories, options.within)
    if not histories:
        raise FitError(f"no test is at one temperature: {not_isothermal}; forms are found through single temperatures")
    notes = [*left_out, *([not_isothermal] if not_isothermal else [])]
    moduli_fit = None
    if options.moduli:
        moduli_fit = moduli(with_arrhenius(law, histories), histories, predictor, settings=settings)
        if moduli_fit.elastic is not None:
            histories = [h.replace(elastic=moduli_fit.elastic) for h in histories]
    if joint_fit is None or options.moduli:
        joint_fit = identify(with_arrhenius(law, histories), histories, predictor, settings=settings, progress=progress)
    isothermal_fits, failures = _isothermal_fits(
        law, histories, predictor, joint_fit, options.within, settings, progress
    )
    notes += suspect_frames_note(histories)
    temperature_law = None
    try:
        check_temperatures([group[0].mean_temperature for group in group_by_temperature(histories, options.within)])
        if len(isothermal_fits) < MIN_TEMPERATURES:
            known = f"forms of '{law.name}' need it at {MIN_TEMPERATURES} temperatures, each by itself"
            raise FitError(f"{known}, and it is identified at {len(isothermal_fits)}: {'; '.join(failures)}")
        notes += failures
    except FitError as error:
        notes.append(str(error))
    else:
        temperature_law = discover(
            isothermal_fits, histories=histories, joint_fit=joint_fit,
            progress=progress, **form_options
        )  # fmt: skip
    return TemperatureStudy(
        tuple(histories), moduli_fit, joint_fit, tuple(isothermal_fits), temperature_law, tuple(notes)
    )


def isothermal_tests(
    tests: Sequence[History], temperature_tolerance: float = ISOTHERMAL_RANGE
) -> tuple[list[History], str]:
    """The tests at one temperature each, and a sentence that names the others; "" where there are none.

    temperature_tolerance : K, within which the temperatures up to the last used frame of a test are one, but
    ISOTHERMAL_RANGE at most, which identifications at single temperatures are held to.
    """
    most = min(temperature_tolerance, ISOTHERMAL_RANGE)
    others = {test.name: test.followed_temperatures for test in tests if np.ptp(test.followed_temperatures) > most}
    remaining = [test for test in tests if test.name not in others]
    if not others:
        return remaining, ""
    spans = [f"{name} ({celsius_text(T.min(), T.max(), digits=0)})" for name, T in others.items()]
    what = "is left out, for it is" if len(others) == 1 else "are left out, for they are"
    return remaining, f"{', '.join(spans)} {what} not at one temperature"


@checked
def group_by_temperature(
    tests: Sequence[History], temperature_tolerance: float = ISOTHERMAL_RANGE
) -> list[list[History]]:
    """Tests by temperature, ascending; each within `temperature_tolerance` K of the coldest of its group."""
    groups = isothermal_groups([test.mean_temperature for test in tests], temperature_tolerance)
    return [[tests[k] for k in group] for group in groups]


def _isothermal_fits(
    law: CreepLaw,
    tests: Sequence[History],
    predictor: Predictor,
    joint_fit: Identification,
    temperature_tolerance: float,
    settings: IdentificationSettings,
    progress: IterationCallback | None,
) -> tuple[list[Identification], list[str]]:
    """One for each temperature, which begins at the values of all tests there; why the others could not be made."""
    fits, failures = [], []
    groups = group_by_temperature(tests, temperature_tolerance)
    for k, group in enumerate(groups):
        try:
            start = _start_at(law, joint_fit, group[0].mean_temperature)
            fits.append(identify(law, group, predictor, settings=settings, start=start))
        except CreepkitError as error:
            failures.append(f"at {celsius_text(group[0].mean_temperature, digits=0)} alone: {error}")
        if progress is not None:
            progress("temperature", k + 1, len(groups))
    return fits, failures


def _start_at(law: CreepLaw, joint_fit: Identification, T: float) -> StartingEstimate | None:
    """The rates and exponents of the law times Arrhenius' factor at a temperature, K; None where it is another law."""
    reference = replace(joint_fit.reference, temperature=T)
    there = Coordinates(joint_fit.law, reference).u(joint_fit.coordinates.theta(joint_fit.u))
    values = dict(zip(joint_fit.law.names, there, strict=True))
    u = np.array([values.get(name, np.nan) for name in law.names])
    return StartingEstimate(u, reference=reference, is_near=False) if np.isfinite(u).all() else None
