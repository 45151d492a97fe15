"""What a study file says, as arguments of the public functions; an error names file, line and key."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any

from creepkit.errors import SurrogateError, nearest, quoted
from creepkit.inverse.reference_conditions import with_arrhenius
from creepkit.language import temperature
from creepkit.readers.vocabulary import split_unit
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
    loads_of,
    outputs_of,
)
from creepkit.records.quantities import LENGTH, QuantityKind
from creepkit.studies.model import IdentificationPart, NuisancePart, Step
from creepkit.studies.study_file import StudyFile

if TYPE_CHECKING:
    from creepkit.experiments.design_task import Goal
    from creepkit.experiments.rig import Rig
    from creepkit.inverse.settings import IdentificationSettings
    from creepkit.language import CreepLaw


def quantity(file: StudyFile, key: tuple[str | int, ...], kinds: Mapping[str, QuantityKind]) -> tuple[str, str]:
    """The quantity and the unit of a key such as pressure_bar; StudyError with the nearest key for any other."""
    name = str(key[-1])
    found = split_unit(name, kinds)
    if found is not None and found[1] in kinds[found[0]].units:
        return found
    known = [f"{one}_{next(iter(kind.units))}".rstrip("_") for one, kind in kinds.items()]
    what = f"has no unit of '{found[0]}' that is known" if found else "is no quantity that is known here"
    raise file.error(key, f"{what}; {nearest(name, known)}")


def value_of(file: StudyFile, key: tuple[str | int, ...], kinds: Mapping[str, QuantityKind], number: float) -> float:
    """A number in creepkit's unit, from the unit of its key."""
    name, unit = quantity(file, key, kinds)
    with file.at(*key):
        return kinds[name].convert(number, unit, "", name)


def laws_of(file: StudyFile) -> list[CreepLaw]:
    """The candidate laws, with parameters bounded and fixed, each where it has them.

    Those of a factor of temperature, such as Q, are known too; `law_as_fitted` bounds and fixes them.
    """
    import creepkit as ck

    part = file.model.identification
    assert part is not None
    laws = []
    for k, name in enumerate(dict.fromkeys(part.laws)):
        with file.at("identification", "laws", k):
            laws.append(ck.law(name))
    known = {name for law in laws for name in law.names}
    if part.temperature == "auto":
        factor = ck.arrhenius(T_ref=ZERO_CELSIUS)
        known |= {name for law in laws if not law.uses(temperature) for name in law.times(factor).names}
    for table, changes in (("bounds", part.bounds), ("fix", part.fix)):
        for name in changes:
            if name not in known:
                raise file.error(
                    ("identification", table, name), f"no law has a parameter '{name}'; {nearest(name, known)}"
                )
    return [_changed(file, part, law) for law in laws]


def law_as_fitted(file: StudyFile, law: CreepLaw, histories: Sequence[History]) -> CreepLaw:
    """A candidate law as it is fitted to tests: with its factor of temperature, bounded and fixed as the study says."""
    part = file.model.identification
    assert part is not None
    if part.temperature == "none":
        return law
    return _changed(file, part, with_arrhenius(law, histories))


def _changed(file: StudyFile, part: IdentificationPart, law: CreepLaw) -> CreepLaw:
    """The law with those of its parameters bounded and fixed that the study names."""
    with file.at("identification", "bounds"):
        bounds: dict[str, Any] = {n: (low, high) for n, (low, high) in part.bounds.items() if n in law.names}
        law = law.with_bounds(**bounds) if bounds else law
    with file.at("identification", "fix"):
        fixed = {n: v for n, v in part.fix.items() if n in law.names}
        return law.fix(**fixed) if fixed else law


def predictor_of(file: StudyFile, root: Path | None) -> Predictor | None:
    """What predicts the tests: the specimen of the study, or a surrogate; None for the specimens that tests name.

    root : folder of files that a report carried, in which `..` is written `up`.
    """
    import creepkit as ck
    from creepkit.surrogates.loading import reduced_order_models

    model = file.model
    specimen = None if model.specimen is None else specimen_of_study(file)
    named = None if model.identification is None else model.identification.predictor
    if named in (None, "specimen"):
        return specimen
    beside = predictor_path(file, root)
    with file.at("identification", "predictor"):
        if (
            beside is None and str(named) not in reduced_order_models()
        ):  # never a file of the folder one happens to be in
            what = f"no file '{quoted(str(named))}' lies beside the study, and no surrogate is called that"
            raise SurrogateError(f"{what}; {nearest(str(named), reduced_order_models())}")
        return ck.surrogate(beside if beside is not None else str(named))


def predictor_path(file: StudyFile, root: Path | None) -> Path | None:
    """The file of the study's predictor; None where it has none, or it is known by its name."""
    part = file.model.identification
    if part is None or part.predictor is None:
        return None
    plain = plain_path(file, ("identification", "predictor"), part.predictor)
    path = file.path.parent / plain if root is None else root / carried_name(plain)
    return path if path.is_file() else None


def specimen_of_study(file: StudyFile) -> Specimen:
    """The specimen of the table [specimen], with its lengths."""
    import creepkit as ck

    part = file.model.specimen
    assert part is not None
    with file.at("specimen", "name"):
        specimen = ck.specimen(part.name)
    lengths = lengths_of(file, ("specimen", "lengths"), part.lengths, specimen)
    untyped: Any = specimen
    with file.at("specimen", "lengths"):
        return untyped.replace(**lengths) if lengths else specimen


def carried_name(path: PurePosixPath) -> str:
    """The name under which a report carries a file: plain parts only."""
    return str(PurePosixPath(*("up" if part == ".." else part for part in path.parts)))


def plain_path(file: StudyFile, key: tuple[str | int, ...], text: str) -> PurePosixPath:
    """A path relative to the study file; StudyError for an absolute one."""
    path = PurePosixPath(text.replace("\\", "/"))
    if path.is_absolute() or text.startswith("~") or re.match(r"^[A-Za-z]:", text):
        raise file.error(key, f"'{text}' is absolute; write it relative to the study file, such as data/*.csv")
    return path


def lengths_of(
    file: StudyFile, table: tuple[str | int, ...], given: Mapping[str, float], specimen: object
) -> dict[str, float]:
    """{length of a specimen: mm}."""
    kinds = {name: LENGTH for one in dimensions_of(specimen) for name in one.names}
    names = {name: one.name for one in dimensions_of(specimen) for name in one.names}
    lengths: dict[str, float] = {}
    for key, number in given.items():
        name = names[quantity(file, (*table, key), kinds)[0]]
        if name in lengths:
            raise file.error((*table, key), f"{name} is given twice; keep one of them")
        lengths[name] = value_of(file, (*table, key), kinds, number)
    return lengths


def nuisances_of(file: StudyFile) -> tuple[Nuisance, ...] | None:
    """The default nuisances with those of the study; None where it names none."""
    from creepkit.inverse.settings import default_nuisances

    part = file.model.identification
    if part is None or not (part.nuisances or part.without_nuisances):
        return None
    further = [_nuisance(file, k, one) for k, one in enumerate(part.nuisances)]
    with file.at("identification", "without_nuisances" if part.without_nuisances else "nuisances"):
        return default_nuisances(*further, without=part.without_nuisances)


def _nuisance(file: StudyFile, number: int, part: NuisancePart) -> Nuisance:
    place = ("identification", "nuisances", number)
    with file.at(*place, "kind"):
        Nuisance(part.kind, start=1.0 if part.kind.endswith("step") else 0.0)
    unit = _unit_of_kind(part.kind)
    values: dict[str, Any] = {}
    for name in ("mean", "sd"):
        for suffix in ("", "_mm", "_K"):
            value = getattr(part, name + suffix)
            if value is not None and suffix.removeprefix("_") != unit and part.kind != "offset":
                right = f"{name}_{unit}" if unit else name
                raise file.error((*place, name + suffix), f"a nuisance '{part.kind}' is given as {right}")
            if value is not None:
                values[name] = value
    with file.at(*place):
        return Nuisance(
            part.kind,
            part.scope,
            output=part.output or "",
            tests=tuple(part.tests),
            start=SECONDS_PER_HOUR * (part.start_h or 0.0),
            **values,
        )


def _unit_of_kind(kind: str) -> str:
    return "mm" if is_length_nuisance(kind) else "K" if kind.startswith("temperature") else ""


def settings_of(file: StudyFile) -> IdentificationSettings:
    """Settings of every identification: the defaults with what the study changes."""
    import creepkit as ck

    model, changes = file.model, {"seed": file.model.study.seed, "suspect_frames": file.model.data.suspect_frames}
    base = ck.IdentificationSettings()
    if model.identification is not None:
        part = model.identification
        for name in ("starts", "frames", "loss", "test_loss", "weights", "rupture_times"):
            value = getattr(part, name)
            if value is not None:
                with file.at("identification", name):
                    base.changed({name: value})
                changes[name] = value
        changes["nuisances"] = nuisances_of(file)  # type: ignore[assignment]
    if model.selection is not None and model.selection.further_laws is not None:
        changes["further_laws"] = model.selection.further_laws
    with file.at("identification"):
        return base.changed(changes)


def steps_of(steps: Sequence[Step]) -> list[tuple[float, float]]:
    """(start in s, level) of each step."""
    return [(SECONDS_PER_HOUR * one.from_h, one.level) for one in steps]


def temperature_of(file: StudyFile, key: tuple[str | int, ...], steps: Sequence[Step]) -> float | Program:
    """K, a number or a program."""
    levels = [(start, level + ZERO_CELSIUS) for start, level in steps_of(steps)]
    if any(not 0.0 < level < 1e4 for _, level in levels):
        raise file.error(key, f"{min(steps, key=lambda s: s.level).level:g} °C is no temperature of a test")
    if levels[0][0] != 0.0:
        raise file.error(key, "nothing is said of the time before; give the first level from_h = 0")
    with file.at(*key):
        return levels[0][1] if len(levels) == 1 else Program.steps(levels)


def numbers_by_output(file: StudyFile, key: tuple[str | int, ...], given: Mapping[str, Any]) -> dict[str, Any]:
    """{output: its values in creepkit's unit} of keys such as amplitude_mm."""
    import creepkit as ck

    kinds = {str(o): o.kind for one in ck.available("specimens").values() for o in outputs_of(one)}
    values: dict[str, Any] = {}
    for name, numbers in given.items():
        output, _ = quantity(file, (*key, name), kinds)
        values[output] = [value_of(file, (*key, name), kinds, number) for number in numbers]
    return values


def goal_of(file: StudyFile) -> Goal | None:
    """The goal of a design, as ck.design takes it."""
    import creepkit as ck

    part = file.model.design
    assert part is not None
    if part.goal is None or part.goal == "law" or part.goal == "parameters":
        if part.at_stress_MPa is not None or part.at_temperature_C is not None:
            name = "at_stress_MPa" if part.at_stress_MPa is not None else "at_temperature_C"
            raise file.error(("design", name), 'belongs to the goals "rate" and "exponent"; leave it out')
        return part.goal
    if part.at_stress_MPa is None:
        raise file.error(("design", "goal"), f"{part.goal} is asked for at a stress: give at_stress_MPa")
    place = [part.at_stress_MPa]
    if part.at_temperature_C is not None:
        place.append(part.at_temperature_C + ZERO_CELSIUS)
    with file.at("design", "goal"):
        return {"rate": ck.rate_at, "exponent": ck.exponent_at}[part.goal](*place)


def rigs_of_study(file: StudyFile, rigs: Sequence[Rig], predictor: object) -> list[Rig]:
    """The rigs of the tests, one of them changed by what the study says of it."""
    part = file.model.design
    assert part is not None
    names = [rig.specimen for rig in rigs]
    chosen = part.specimen or names[0]
    if chosen not in names:
        raise file.error(("design", "specimen"), f"the tests are of {' and '.join(names)}")
    from creepkit.registry.arguments import specimen_by_name

    specimen = specimen_by_name(chosen)
    changes: dict[str, Any] = {
        "longest_hours": part.longest_h,
        "tests_per_run": part.tests_per_run,
        "setup_hours": part.setup_h,
        "frame_interval": part.frame_interval_s,
    }
    if part.temperatures_C is not None:
        changes["temperatures"] = tuple(T + ZERO_CELSIUS for T in part.temperatures_C)
    kinds = {load.name: load.kind for load in loads_of(specimen)}
    for key, bounds in part.levels.items():
        changes["levels"] = tuple(value_of(file, ("design", "levels", key), kinds, one) for one in bounds)
    lengths = {name: LENGTH for one in dimensions_of(specimen) for name in one.names}
    if part.lengths:
        changes["dimensions"] = {
            quantity(file, ("design", "lengths", key), lengths)[0]: tuple(
                value_of(file, ("design", "lengths", key), lengths, one) for one in values
            )
            for key, values in part.lengths.items()
        }
    changes = {name: value for name, value in changes.items() if value is not None}
    if changes and len(rigs) > 1 and part.specimen is None:
        raise file.error(("design",), f"the tests are of {' and '.join(names)}: say by specimen whose rig is described")
    with file.at("design"):
        return [rig.replace(**changes) if rig.specimen == chosen else rig for rig in rigs]


def tolerances_of(file: StudyFile, number: int) -> dict[str, float]:
    """{kind: standard deviation} of a forecast, in the unit of the nuisance parameter of that kind."""
    from creepkit.records.prediction import GENERAL_NUISANCES
    from creepkit.records.specimen_lookup import all_dimensions

    known = [*GENERAL_NUISANCES, *all_dimensions()]
    spelt = {f"{kind}_{unit}" if (unit := _unit_of_kind(kind)) else kind: kind for kind in known}
    tolerances: dict[str, float] = {}
    for key, value in file.model.forecast[number].tolerances.items():
        if key not in spelt:
            raise file.error(("forecast", number, "tolerances", key), f"is not known; {nearest(key, spelt)}")
        tolerances[spelt[key]] = value
    return tolerances


def check_names(file: StudyFile) -> None:
    """StudyError for methods of rupture times, forms of temperature and parameters that there are not."""
    import creepkit as ck
    from creepkit.discovery.forms import CONSTANT
    from creepkit.registry import default_registry
    from creepkit.rupture_assessment.methods import METHODS, MINIMUM_RATE

    rupture, temperature = file.model.rupture, file.model.temperature
    methods = [name for name in METHODS if name != MINIMUM_RATE.name]
    for k, name in enumerate((rupture.methods or []) if rupture is not None else []):
        if name not in methods:
            raise file.error(("rupture", "methods", k), f"there is no method '{name}'; {nearest(name, methods)}")
    if temperature is None:
        return
    laws = laws_of(file) if file.model.identification is not None else []
    if temperature.law is not None:
        with file.at("temperature", "law"):
            laws = [ck.law(temperature.law)]
    known = {name for law in laws for name in law.names}
    for table in ("forms", "prior_odds"):
        for parameter, names in getattr(temperature, table).items():
            if known and parameter not in known:
                what = f"no law has a parameter '{parameter}'"
                raise file.error(("temperature", table, parameter), f"{what}; {nearest(parameter, known)}")
            for name in names:
                if name != CONSTANT:
                    with file.at("temperature", table, parameter):
                        default_registry().temperature_form(name)
