"""Young's modulus of a test: as stated, at its temperature, or as its loading ramp shows it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from creepkit.errors import HistoryError, quoted
from creepkit.readers.conditions import StatedConditions, StatedNumber, errors_located_at
from creepkit.readers.derived_records import modulus_of_ramp
from creepkit.readers.frames import TableFrames
from creepkit.readers.vocabulary import value_in
from creepkit.records import Loading, Program
from creepkit.records.quantities import MODULUS, TEMPERATURE

if TYPE_CHECKING:
    from creepkit.language.elastic import Elastic

_FAR = 25.0
"""K beyond the temperatures at which moduli are stated, from which on another one is asked for."""


def take_modulus_by_temperature(conditions: StatedConditions, temperature: float | Program) -> None:
    """Put the modulus at the temperature at which a test begins, between those that are stated at temperatures."""
    entry = conditions.take_entry("modulus_by_temperature")
    if entry is None:
        return
    kelvin = float(temperature.values[0] if isinstance(temperature, Program) else temperature)
    moduli = dict[float, float]()
    for item in entry.text.split(";"):
        at, _, modulus = (part.strip() for part in item.partition("="))
        degrees, E = value_in(at, TEMPERATURE), value_in(modulus, MODULUS)
        if degrees is None or E is None:
            what = f"'{quoted(item.strip(), 60)}' is no modulus at a temperature; write such as 650 °C = 165 GPa"
            raise HistoryError(f"{entry.location}: {what}")
        moduli[degrees] = E
    levels = sorted(moduli)
    E = float(np.interp(kelvin, levels, [moduli[one] for one in levels]))
    listed = " and ".join(f"{one - 273.15:g}" for one in levels)
    if not levels[0] - _FAR <= kelvin <= levels[-1] + _FAR:
        what = f"the modulus is stated at {listed} °C; how many GPa is it at {kelvin - 273.15:g} °C?"
        raise conditions.question(what, "modulus_GPa", E / 1e3, location=entry.location)
    conditions.put_number("modulus", StatedNumber(E, "modulus", entry.location))
    if min(abs(kelvin - one) for one in levels) > 0.5:
        conditions.record_assumption(f"modulus {E / 1e3:.4g} GPa by those at {listed} °C")


def elastic_stated(
    conditions: StatedConditions, frames: TableFrames | None = None, loading: Loading | None = None
) -> Elastic | None:
    """The elastic data that are stated; of a test with imposed strain else those of its loading ramp."""
    modulus = conditions.take_number("modulus")
    if modulus is None and frames is not None and loading is not None and loading.quantity == "strain":
        if not {"strain", "stress"} <= frames.values.keys():
            return None
        found = modulus_of_ramp(loading.program().at(frames.times), frames.values["stress"])
        if found is None:
            raise conditions.missing_error(
                "Young's modulus, and no loading ramp that shows it",
                "write modulus_GPa: the stress is E (strain - creep)",
                "modulus_GPa",
            )
        modulus = StatedNumber(found[0], "modulus", conditions.location)
        conditions.record_assumption(found[1])
    if modulus is None:
        return None
    # Here, not above: the record of elasticity brings sympy, which listing the readers must not wait for.
    from creepkit.language.elastic import Elastic

    poisson = conditions.take_number("poisson")
    with errors_located_at(modulus.location):
        return Elastic(modulus.value) if poisson is None else Elastic(modulus.value, poisson.value)


def first_modulus(elastic: Elastic, temperature: float | Program) -> float:
    """Young's modulus at the beginning, MPa."""
    start = temperature.values[0] if isinstance(temperature, Program) else temperature
    return float(elastic.at(float(start)).E)
