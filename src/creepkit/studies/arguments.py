"""What a study file says, as arguments of the public functions; an error names file, line and key."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import creepkit as ck
from creepkit.errors import FitError, SurrogateError, nearest, quoted
from creepkit.experiments.design_task import GoalOptions
from creepkit.experiments.rig import Rig, changed_rigs
from creepkit.forecasts.planned_tests import DescribedTest, PlannedTestOptions, specimen_taking, stated_temperature
from creepkit.inverse.candidate_laws import LawChanges
from creepkit.language import temperature
from creepkit.options import values_of_table
from creepkit.readers.vocabulary import COMPONENT_LOADING_KINDS, split_unit
from creepkit.records import (
    SECONDS_PER_HOUR,
    ZERO_CELSIUS,
    History,
    Nuisance,
    Predictor,
    Program,
    Specimen,
    dimensions_of,
    is_length_nuisance,
    known_specimens,
    loads_of,
    outputs_of,
)
from creepkit.records.quantities import LENGTH, QuantityKind
from creepkit.studies.study_file import KeyPath, StudyFile
from creepkit.studies.tables import Step

if TYPE_CHECKING:
    from creepkit.inverse.settings import IdentificationSettings
    from creepkit.language import CreepLaw


# ---- numbers with units --------------------------------------------------------------------------------------------


def quantity(file: StudyFile, key: KeyPath, kinds: Mapping[str, QuantityKind]) -> tuple[str, str]:
    """The quantity and the unit of a key such as pressure_bar; StudyError with the nearest key for any other."""
    name = str(key[-1])
    found = split_unit(name, kinds)
    if found is not None and found[1] in kinds[found[0]].units:
        return found
    known = [f"{one}_{next(iter(kind.units))}".rstrip("_") for one, kind in kinds.items()]
    what = f"has no unit of '{found[0]}' that is known" if found else "is no quantity that is known here"
    raise file.error(key, f"{what}; {nearest(name, known)}")


def values_of(
    file: StudyFile, key: KeyPath, kinds: Mapping[str, QuantityKind], numbers: Sequence[float]
) -> tuple[str, list[float]]:
    """The quantity of a key, and numbers in creepkit's unit."""
    name, unit = quantity(file, key, kinds)
    with file.at(*key):
        return name, [kinds[name].convert(number, unit, "", name) for number in numbers]


def lengths_of(file: StudyFile, table: KeyPath, given: Mapping[str, float], specimen: object) -> dict[str, float]:
    """{length of a specimen: mm}."""
    names = {name: one.name for one in dimensions_of(specimen) for name in one.names}
    lengths: dict[str, float] = {}
    for key, number in given.items():
        name, (length,) = values_of(file, (*table, key), dict.fromkeys(names, LENGTH), [number])
        if names[name] in lengths:
            raise file.error((*table, key), f"{names[name]} is given twice; keep one of them")
        lengths[names[name]] = length
    return lengths


def levels_of(
    file: StudyFile, key: KeyPath, kinds: Mapping[str, QuantityKind], steps: Sequence[Step]
) -> tuple[str, list[tuple[float, float]]]:
    """The load of a key, and (start in s, level in creepkit's unit) of its steps."""
    name, levels = values_of(file, key, kinds, [one.level for one in steps])
    return name, [(SECONDS_PER_HOUR * one.from_h, level) for one, level in zip(steps, levels, strict=True)]


def temperature_of(file: StudyFile, key: KeyPath, steps: Sequence[Step]) -> float | Program | None:
    """K, a number or a program; None of no steps."""
    with file.at(*key):
        return stated_temperature([(SECONDS_PER_HOUR * one.from_h, one.level) for one in steps])


# ---- laws, predictors, settings ------------------------------------------------------------------------------------


def laws_of(file: StudyFile) -> list[CreepLaw]:
    """The candidate laws by their names; StudyError for one that there is not, and for parameters that none has.

    Those of a factor of temperature, such as Q, are known too; `law_changes` bounds and fixes them.
    """
    part = file.model.identification
    assert part is not None
    laws = []
    for k, name in enumerate(dict.fromkeys(part.laws)):
        with file.at("identification", "laws", k):
            laws.append(ck.law(name))
    changes, fitted = law_changes(file), list(laws)
    if changes.temperature == "auto":
        factor = ck.arrhenius(T_ref=ZERO_CELSIUS)
        fitted += [law.times(factor) for law in laws if not law.uses(temperature)]
    for table in ("bounds", "fix"):
        given = getattr(changes, table)
        check_parameters(file, ("identification", table), given, fitted)
        with file.at("identification", table):
            LawChanges("none", **{table: given}).applied(fitted, ())
    return laws


def law_changes(file: StudyFile) -> LawChanges:
    """What is bounded and fixed of candidate laws, and their factor of temperature."""
    part, idle = file.model.identification, idle_fixes(file)
    with file.at("identification"):
        changes = LawChanges().changed(values_of_table(LawChanges, part))
        return replace(changes, fix={name: value for name, value in changes.fix.items() if name not in idle})


def idle_fixes(file: StudyFile) -> list[str]:
    """Parameters fixed at 0 that registered laws have, and none of the study's: a law without one is that with 0."""
    part = file.model.identification
    zero = [] if part is None else [name for name, value in (part.fix or {}).items() if value == 0]
    others = [name for name in zero if not any(name in ck.law(law).names for law in part.laws)] if part else []
    return [name for name in others if any(name in law.names for law in ck.available("laws").values())]


def isothermal_laws(changes: LawChanges, laws: Sequence[CreepLaw]) -> list[CreepLaw]:
    """The laws without a factor of temperature, with those of their own parameters changed that the study names."""
    own = {name for law in laws for name in law.names}
    bounds = {name: limits for name, limits in changes.bounds.items() if name in own}
    fixed = {name: value for name, value in changes.fix.items() if name in own}
    return LawChanges("none", fixed, bounds).applied(laws, ())


def check_parameters(file: StudyFile, table: KeyPath, names: Mapping[str, Any], laws: Sequence[CreepLaw]) -> None:
    """StudyError for keys of a table that are parameters of none of the laws."""
    known = {name for law in laws for name in law.names}
    for name in names:
        if name not in known:
            raise file.error((*table, name), f"no law has a parameter '{name}'; {nearest(name, known)}")


def predictor_of(file: StudyFile) -> Predictor | None:
    """What predicts the tests: the specimen of the study, or a surrogate; None for the specimens that tests name."""
    from creepkit.surrogates.surrogate import reduced_order_models

    part = file.model.identification
    named = None if part is None else part.using
    specimen = None if file.model.specimen is None else specimen_of_study(file)
    if named is None or named == "specimen":
        return specimen
    beside = predictor_path(file)
    with file.at("identification", "using"):
        if beside is None and named not in reduced_order_models():  # never a file of the folder one happens to be in
            what = f"no file '{quoted(named)}' lies beside the study, and no surrogate is called that"
            raise SurrogateError(f"{what}; {nearest(named, reduced_order_models())}")
        return ck.surrogate(named if beside is None else beside)


def predictor_path(file: StudyFile) -> Path | None:
    """The file of the study's predictor; None where it has none, or it is known by its name."""
    part = file.model.identification
    if part is None or part.using is None:
        return None
    path = file.base / file.place_of(("identification", "using"), part.using)
    return path if path.is_file() else None


def specimen_of_study(file: StudyFile) -> Specimen:
    """The specimen of the table [specimen], with its lengths."""
    part = file.model.specimen
    assert part is not None
    with file.at("specimen", "name"):
        specimen: Any = ck.specimen(part.name)
    lengths = lengths_of(file, ("specimen", "lengths"), part.lengths, specimen)
    with file.at("specimen", "lengths"):
        found: Specimen = specimen.replace(**lengths) if lengths else specimen
        return found


def settings_of(file: StudyFile) -> IdentificationSettings:
    """Settings of every identification: the defaults with what the study changes."""
    model, base = file.model, ck.IdentificationSettings()
    changes: dict[str, Any] = {"seed": model.study.seed, "suspect_frames": model.data.suspect_frames}
    if model.selection is not None:
        changes["further_laws"] = model.selection.further_laws
    if model.identification is not None:
        part, place = model.identification, "identification"
        changes |= values_of_table(ck.IdentificationSettings, part) | {"nuisances": None}
        for name, value in changes.items():
            with file.at(place, name):
                base.changed({name: value})
        if part.nuisances:
            with file.at(place, "nuisances"):
                changes["nuisances"] = nuisances_of_texts(part.nuisances)
    with file.at("identification"):
        return base.changed(changes)


def settings_of_group(
    file: StudyFile, tests: Sequence[History], everywhere: Sequence[str], priors: Sequence[Nuisance], *, warm: bool
) -> IdentificationSettings:
    """Settings of the identifications of some tests: their own nuisance parameters, and what is known of each of them.

    everywhere : names of all tests. priors : of single tests. warm : whether a law uses the temperature. The scatter of
    rates between tests is not sought in a single test, unless the study states it.
    """
    settings, names = settings_of(file), [test.name for test in tests]
    part = file.model.identification
    stated = any(text.startswith("rate") for text in part.nuisances) if part is not None else False
    kept = []
    for nuisance in settings.nuisances:
        for test in nuisance.tests:
            file.check_name(("identification", "nuisances"), "test", test, everywhere)
        own = [test for test in nuisance.tests if test in names]
        if (nuisance.tests and not own) or (nuisance.kind == "rate" and len(tests) == 1 and not stated):
            continue
        kept.append(replace(nuisance, tests=() if len(own) == len(names) else tuple(own)))
    taken = {one.key for one in kept}
    own_priors = [prior for prior in priors if prior.tests[0] in names and prior.key not in taken]
    for kind in dict.fromkeys(prior.kind for prior in own_priors if warm or prior.kind != "temperature"):
        of_kind = [prior for prior in own_priors if prior.kind == kind]
        if is_length_nuisance(kind):  # of all tests of a group, which lengths are: with the largest of the tolerances
            kept.append(Nuisance(kind, sd=max(prior.sd or 0.0 for prior in of_kind)))
        else:
            kept += of_kind
    return replace(settings, nuisances=tuple(kept))


NUISANCE_SYNTAX = "KIND[=MEAN[:SD]][@START][ for TESTS]"
"""KIND=none leaves a default out; TESTS is test, alloy or all, or names with commas between them, which share one.
START is in s, MEAN and SD in the unit of the kind."""


def nuisances_of_texts(texts: Sequence[str]) -> tuple[Nuisance, ...]:
    """The default nuisance parameters with those of texts of NUISANCE_SYNTAX, and without those that are none."""
    from creepkit.inverse.settings import default_nuisances

    left_out = {text: text.partition("=")[0].strip() for text in texts if text.partition("=")[2].strip() == "none"}
    further = (_nuisance(text) for text in texts if text not in left_out)
    return default_nuisances(*further, without=[*left_out.values()])


def _nuisance(text: str) -> Nuisance:
    """One nuisance, such as "temperature step=0:30@8250 for all"."""
    definition, _, whose = text.partition(" for ")
    definition, _, start = definition.partition("@")
    kind, _, numbers = definition.partition("=")
    mean, _, sd = numbers.partition(":")
    tests = tuple(name.strip() for name in whose.split(",") if name.strip())
    scope: Any = tests[0] if tests in (("test",), ("alloy",), ("all",)) else "all" if tests else "test"
    try:
        numbers_of: dict[str, Any] = {
            name: float(part) for name, part in (("mean", mean), ("sd", sd), ("start", start)) if part
        }
    except ValueError:
        numbers_of = {"mean": math.nan}
    if not all(map(math.isfinite, numbers_of.values())):
        raise FitError(f"'{quoted(text)}' is not known; write {NUISANCE_SYNTAX}, such as thickness=0.49:0.03")
    return Nuisance(kind.strip(), scope, tests=() if tests == (scope,) else tests, **numbers_of)


def _unit_of_kind(kind: str) -> str:
    return "mm" if is_length_nuisance(kind) else "K" if kind.startswith("temperature") else ""


# ---- forecasts and designs -----------------------------------------------------------------------------------------


def targets_of(file: StudyFile, number: int) -> dict[str, list[float]]:
    """{output: its values in creepkit's unit} of a forecast, of keys such as amplitude_mm."""
    kinds = {str(o): o.kind for one in ck.available("specimens").values() for o in outputs_of(one)}
    given = file.model.forecast[number].targets
    return dict(values_of(file, ("forecast", number, "targets", key), kinds, values) for key, values in given.items())


def tolerances_of(file: StudyFile, number: int) -> dict[str, float]:
    """{kind: standard deviation} of a forecast, in the unit of the nuisance parameter of that kind."""
    from creepkit.records.prediction import GENERAL_NUISANCES
    from creepkit.records.specimen_lookup import all_dimensions

    kinds = {f"{kind}_{_unit_of_kind(kind)}".rstrip("_"): kind for kind in (*GENERAL_NUISANCES, *all_dimensions())}
    given = file.model.forecast[number].tolerances
    for key in given:
        file.check_name(("forecast", number, "tolerances", key), "tolerance", key, kinds)
    return {kinds[key]: value for key, value in given.items()}


def goal_of(file: StudyFile) -> GoalOptions:
    """What a design is asked for."""
    with file.at("design", "goal"):
        asked = GoalOptions().changed(values_of_table(GoalOptions, file.model.design))
        _ = asked.quantity  # which a rate without a stress has not
        return asked


def rigs_of_study(file: StudyFile, rigs: Sequence[Rig]) -> list[Rig]:
    """The rigs of the tests, one of them changed by what the study says of it."""
    from creepkit.registry.arguments import specimen_by_name

    part = file.model.design
    assert part is not None
    changes = values_of_table(Rig, part) | {"levels": None, "dimensions": None}
    specimen = specimen_by_name(part.specimen or rigs[0].specimen)
    kinds = {load.name: load.kind for load in loads_of(specimen)}
    for key, bounds in part.levels.items():
        changes["levels"] = tuple(values_of(file, ("design", "levels", key), kinds, bounds)[1])
    kinds = {name: LENGTH for one in dimensions_of(specimen) for name in one.names}
    lengths = [values_of(file, ("design", "lengths", key), kinds, values) for key, values in part.lengths.items()]
    if lengths:
        changes["dimensions"] = {name: tuple(values) for name, values in lengths}
    with file.at("design"):
        return changed_rigs(rigs, {name: value for name, value in changes.items() if value is not None})


def check_temperature(file: StudyFile) -> None:
    """StudyError for forms of temperature and parameters that there are not."""
    from creepkit.discovery.forms import check_form_names

    part = file.model.temperature
    if part is None:
        return
    laws = laws_of(file) if file.model.identification is not None else []
    if part.law is not None:
        with file.at("temperature", "law"):
            laws = [ck.law(part.law)]
    if laws:
        check_parameters(file, ("temperature", "forms"), part.forms or {}, laws)
    for parameter, names in (part.forms or {}).items():
        with file.at("temperature", "forms", parameter):
            check_form_names(names)


# ---- planned tests ---------------------------------------------------------------------------------------------------


def check_forecast(file: StudyFile, number: int) -> None:
    """StudyError for a forecast that is neither of measured tests nor of a planned one, or of both."""
    part, place = file.model.forecast[number], ("forecast", number)
    if part.tests:
        keys = ("load", "end_h", "temperature_C", "lengths", "modulus_GPa", "control", "ramp_s", "specimen", "labels")
        given = [key for key in keys if getattr(part, key) not in (None, {})]
        if given:
            raise file.error((*place, given[0]), "describes a planned test, and tests are given; leave one of them out")
        return
    if not part.load:
        raise file.error((*place, "load"), "a planned test has a load, such as { stress_MPa = 80 }, found none")
    if part.end_h is None:
        raise file.error(place, "a planned test needs its end: end_h, such as 100")
    planned_test(file, number, ZERO_CELSIUS + 20.0)


def planned_test(file: StudyFile, number: int, temperature: float | Program | None) -> History:
    """The planned test of a forecast; temperature : K, where the study gives none.

    StudyError where a test cannot be made of what is said.
    """
    part, place = file.model.forecast[number], ("forecast", number)
    assert part.end_h is not None
    kinds = {load.name: load.kind for one in known_specimens().values() for load in loads_of(one)}
    kinds = {**kinds, **COMPONENT_LOADING_KINDS}
    loads: dict[str, list[tuple[float, float]]] = {}
    for key, steps in part.load.items():
        name, levels = levels_of(file, (*place, "load", key), kinds, steps)
        if name in loads:
            raise file.error((*place, "load", key), f"{name} is given twice; keep one of them")
        loads[name] = levels
    of_study = None if file.model.specimen is None else file.model.specimen.name
    with file.at(*((*place, "specimen") if part.specimen else ("specimen", "name"))):
        specimen = ck.specimen(part.specimen or of_study or specimen_taking(loads))
    if part.temperature_C is not None:
        temperature = temperature_of(file, (*place, "temperature_C"), part.temperature_C)
    if temperature is None:
        raise file.error(place, "the fitted tests were made at several temperatures; give temperature_C")
    stated = values_of_table(PlannedTestOptions, part)
    options = PlannedTestOptions().changed({name: stated[name] for name in stated if name != "temperature"})
    lengths = lengths_of(file, (*place, "lengths"), part.lengths, specimen)
    described = DescribedTest(specimen, options, loads, lengths, temperature)
    with file.at(*place, "load", next(iter(part.load))):
        _ = described.loading  # which may contradict itself or the specimen
    with file.at(*place):
        return described.history(temperature, part.name).replace(labels=dict(part.labels))
