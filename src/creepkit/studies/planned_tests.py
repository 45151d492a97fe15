"""Planned tests of a study's forecasts: histories of the loads, temperatures and lengths that its tables state."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from creepkit.readers.vocabulary import split_unit
from creepkit.records import (
    SECONDS_PER_HOUR,
    TENSOR_COMPONENTS,
    ZERO_CELSIUS,
    History,
    Loading,
    Program,
    Specimen,
    loads_of,
)
from creepkit.records.quantities import QUANTITIES, QuantityKind
from creepkit.studies.arguments import lengths_of, quantity, steps_of, temperature_of
from creepkit.studies.model import ForecastPart, Step
from creepkit.studies.study_file import StudyFile

COMPONENTS = "components"
"""The load of specimens under stresses and strains of several components; keys of a study name these."""


COMPONENT_KINDS: Mapping[str, QuantityKind] = {
    f"{name}_{component}": QUANTITIES[quantity_name]
    for name, quantity_name in (("stress", "signed stress"), ("strain", "strain"))
    for component in TENSOR_COMPONENTS
}


def planned_test(file: StudyFile, number: int, temperature: float | Program | None) -> History:
    """The planned test of a forecast; temperature : K, where the study gives none.

    StudyError where a test cannot be made of what is said.
    """
    import creepkit as ck
    from creepkit.api.planned_tests import planned_history, stepped_load
    from creepkit.records import PointLoading, StrainSteps

    part, place = file.model.forecast[number], ("forecast", number)
    specimen = _specimen_of(file, number, part)
    end = SECONDS_PER_HOUR * float(part.end_h or 0.0)
    taken = {load.name: load for load in loads_of(specimen)}
    if COMPONENTS in taken:
        loading = _component_loading(file, number, part)
    else:
        if len(part.load) > 1:
            several = " and ".join(part.load)
            raise file.error((*place, "load"), f"a test of specimen '{specimen.name}' has one load, found {several}")
        ((key, steps),) = part.load.items()
        name, levels = _levels(file, (*place, "load", key), {n: load.kind for n, load in taken.items()}, steps)
        with file.at(*place, "load", key):
            loading = stepped_load(name, taken[name], levels, control=part.control, ramp=part.ramp_s, end=end)
    if part.temperature_C is not None:
        temperature = temperature_of(file, (*place, "temperature_C"), part.temperature_C)
    if temperature is None:
        raise file.error(place, "the fitted tests were made at several temperatures; give temperature_C")
    prescribed = isinstance(loading, StrainSteps) or (isinstance(loading, PointLoading) and bool(loading.strain))
    if part.modulus_GPa is None and (prescribed or "modulus" in getattr(specimen, "conditions", {})):
        raise file.error(place, f"specimen '{specimen.name}' needs modulus_GPa, such as 150")
    with file.at(*place):
        return planned_history(
            specimen,
            loading,
            end,
            temperature=temperature,
            elastic=None if part.modulus_GPa is None else ck.Elastic(1e3 * part.modulus_GPa),
            lengths=lengths_of(file, (*place, "lengths"), part.lengths, specimen),
            name=part.name,
        ).replace(labels=dict(part.labels))


def _levels(
    file: StudyFile, key: tuple[str | int, ...], kinds: Mapping[str, QuantityKind], steps: Sequence[Step]
) -> tuple[str, list[tuple[float, float]]]:
    """The load of a key, and (start in s, level in creepkit's unit) of its steps."""
    name, unit = quantity(file, key, kinds)
    with file.at(*key):
        return name, [(start, kinds[name].convert(level, unit, "", name)) for start, level in steps_of(steps)]


def _component_loading(file: StudyFile, number: int, part: ForecastPart) -> Loading:
    """Stresses and strains of components, as { stress_11_MPa = 60, strain_12 = 0 }; at rest before their first step."""
    from creepkit.records import PointLoading

    place = ("forecast", number)
    for name in ("control", "ramp_s"):
        if getattr(part, name) is not None:
            raise file.error((*place, name), "belongs to a single load; leave it out")
    given: dict[str, dict[str, list[tuple[float, float]]]] = {"stress": {}, "strain": {}}
    for key, steps in part.load.items():
        name, levels = _levels(file, (*place, "load", key), COMPONENT_KINDS, steps)
        kind, _, component = name.partition("_")
        if component in given[kind]:
            raise file.error((*place, "load", key), f"{name} is given twice; keep one of them")
        given[kind][component] = levels if levels[0][0] == 0.0 else [(0.0, 0.0), *levels]
    with file.at(*place, "load"):
        return PointLoading(**given)


def _specimen_of(file: StudyFile, number: int, part: ForecastPart) -> Specimen:
    """The specimen of a planned test: as named, as the study says, else the first that takes its load."""
    import creepkit as ck

    place = ("forecast", number)
    if part.specimen is not None:
        with file.at(*place, "specimen"):
            return ck.specimen(part.specimen)
    if file.model.specimen is not None:
        with file.at("specimen", "name"):
            return ck.specimen(file.model.specimen.name)
    key = next(iter(part.load))
    known: dict[str, QuantityKind] = {}
    specimens: dict[str, Specimen] = ck.available("specimens")
    for specimen in specimens.values():
        kinds = {load.name: load.kind for load in loads_of(specimen)}
        known |= COMPONENT_KINDS if COMPONENTS in kinds else kinds
        kinds = COMPONENT_KINDS if COMPONENTS in kinds else kinds  # type: ignore[assignment]
        found = split_unit(key, kinds)
        if found is not None and found[1] in kinds[found[0]].units:
            return specimen
    quantity(file, (*place, "load", key), known)
    raise file.error((*place, "load", key), "no specimen takes such a load")


def check_forecast(file: StudyFile, number: int) -> None:
    """StudyError for a forecast that is neither of measured tests nor of a planned one, or of both."""
    part, place = file.model.forecast[number], ("forecast", number)
    planned = ("load", "end_h", "temperature_C", "lengths", "modulus_GPa", "control", "ramp_s", "specimen", "labels")
    given = [name for name in planned if getattr(part, name) not in (None, {})]
    if part.tests:
        if given:
            raise file.error((*place, given[0]), "describes a planned test, and tests are given; leave one of them out")
        return
    if not part.load:
        raise file.error((*place, "load"), "a planned test has a load, such as { stress_MPa = 80 }, found none")
    if part.end_h is None:
        raise file.error(place, "a planned test needs its end: end_h, such as 100")
    planned_test(file, number, ZERO_CELSIUS + 20.0 if part.temperature_C is None else None)
