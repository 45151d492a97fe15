"""Planned tests of a study's forecasts: histories of the loads, temperatures and lengths that its tables state."""

from __future__ import annotations

from collections.abc import Mapping

from creepkit.api.options import PlannedTestOptions, elastic_of
from creepkit.forecasts.planned_tests import (
    COMPONENTS,
    load_of_components,
    needs_modulus,
    planned_history,
    stepped_load,
)
from creepkit.options import values_of_table
from creepkit.readers.column_names import split_unit
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
from creepkit.studies.arguments import lengths_of, levels_of, quantity, temperature_of
from creepkit.studies.study_file import StudyFile
from creepkit.studies.tables import ForecastTable

COMPONENT_KINDS: Mapping[str, QuantityKind] = {
    f"{name}_{component}": QUANTITIES[quantity_name]
    for name, quantity_name in (("stress", "signed stress"), ("strain", "strain"))
    for component in TENSOR_COMPONENTS
}


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
    specimen, end = _specimen_of(file, number, part), SECONDS_PER_HOUR * part.end_h
    loading = _loading_of(file, number, part, specimen, end)
    if part.temperature_C is not None:
        temperature = temperature_of(file, (*place, "temperature_C"), part.temperature_C)
    if temperature is None:
        raise file.error(place, "the fitted tests were made at several temperatures; give temperature_C")
    chosen = PlannedTestOptions().changed(values_of_table(PlannedTestOptions, part))
    if chosen.modulus is None and needs_modulus(specimen, loading):
        raise file.error(place, f"specimen '{specimen.name}' needs modulus_GPa, such as 150")
    lengths = lengths_of(file, (*place, "lengths"), part.lengths, specimen)
    with file.at(*place):
        elastic = elastic_of(chosen.modulus)
        return planned_history(
            specimen, loading, end, temperature=temperature, elastic=elastic, lengths=lengths, name=part.name
        ).replace(labels=dict(part.labels))


def _loading_of(file: StudyFile, number: int, part: ForecastTable, specimen: Specimen, end: float) -> Loading:
    """One load by steps, or stresses and strains of components, { stress_11_MPa = 60, strain_12 = 0 }, from rest."""
    place = ("forecast", number)
    loads = {load.name: load for load in loads_of(specimen)}
    if COMPONENTS not in loads:
        if len(part.load) > 1:
            several = f"a test of specimen '{specimen.name}' has one load, found {' and '.join(part.load)}"
            raise file.error((*place, "load"), several)
        ((key, steps),) = part.load.items()
        name, levels = levels_of(file, (*place, "load", key), {n: load.kind for n, load in loads.items()}, steps)
        with file.at(*place, "load", key):
            return stepped_load(name, loads[name], levels, control=part.control, ramp=part.ramp_s, end=end)
    for key in (one for one in ("control", "ramp_s") if getattr(part, one) is not None):
        raise file.error((*place, key), "belongs to a single load; leave it out")
    given: dict[str, dict[str, list[tuple[float, float]]]] = {"stress": {}, "strain": {}}
    for key, steps in part.load.items():
        name, levels = levels_of(file, (*place, "load", key), COMPONENT_KINDS, steps)
        kind, _, component = name.partition("_")
        if component in given[kind]:
            raise file.error((*place, "load", key), f"{name} is given twice; keep one of them")
        given[kind][component] = levels
    with file.at(*place, "load"):
        return load_of_components(given)


def _specimen_of(file: StudyFile, number: int, part: ForecastTable) -> Specimen:
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
    for specimen in ck.available("specimens").values():
        loads = {load.name: load.kind for load in loads_of(specimen)}
        kinds = COMPONENT_KINDS if COMPONENTS in loads else loads
        found = split_unit(key, kinds)
        if found is not None and found[1] in kinds[found[0]].units:
            taking: Specimen = specimen
            return taking
        known |= kinds
    quantity(file, (*place, "load", key), known)
    raise file.error((*place, "load", key), "no specimen takes such a load")
