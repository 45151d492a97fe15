"""Loading and temperature of a test: stated in its head, recorded in columns, or both.

A column of nominal levels is steps; a column that was recorded is straight pieces. What the file leaves open is decided
and recorded, or asked for.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from creepkit.errors import HistoryError
from creepkit.readers.conditions import StatedConditions, StatedNumber, TimeValuePairs, errors_located_at
from creepkit.readers.recorded_programs import LOAD_RECORD_TOLERANCE, TEMPERATURE_RECORD_TOLERANCE, recorded_program
from creepkit.readers.text_tables import TableFrames
from creepkit.readers.vocabulary import COMPONENT_LOADING_KINDS, Terms
from creepkit.records import Loading, PointLoading, Program, TwoLevels, loading_of
from creepkit.records.quantities import TEMPERATURE, QuantityKind

_PROGRAM_FORMS = ("steps", "program")


_LOADING_SUFFIXES = ("", "_1", *(f"_{form}" for form in _PROGRAM_FORMS))


def read_temperature(conditions: StatedConditions, frames: TableFrames) -> float | Program:
    """The temperature, K."""
    result = _stated_loading(conditions, frames, "temperature")
    if result is None:
        raise conditions.missing_error("temperature", "write temperature_C or temperature_K, or a column of that name")
    return Program.steps(result) if isinstance(result, tuple) else result


def read_loading(conditions: StatedConditions, frames: TableFrames) -> Loading:
    """The loading: by components, by what has steps and programs alone, else by the first load that is stated."""
    terms, load_kinds = conditions.terms, conditions.terms.load_kinds
    quantities = (*load_kinds, *COMPONENT_LOADING_KINDS)
    with errors_located_at(
        conditions.location_of(*(f"{quantity}{form}" for quantity in quantities for form in _LOADING_SUFFIXES))
    ):
        loading = _component_loading(conditions)
        likely = {load for one in conditions.terms.specimens_with(frames.values) for load in terms.loads.get(one, ())}
        for name in sorted(load_kinds, key=lambda name: (name in terms.number_kinds, name not in likely)):
            loading = loading or _loading_by(name, conditions, frames)
    if loading is None:
        stated = sorted(likely) or [*load_kinds]
        wanted = " or ".join(name for name in stated if name in load_kinds)
        raise conditions.missing_error(f"loading (no {wanted})", _loading_advice(terms, stated))
    return loading


def _loading_advice(terms: Terms, loads: Sequence[str]) -> str:
    """What to write, for each of these loads."""
    forms = []
    for name in (load for load in loads if load in terms.load_kinds):
        unit = next(iter(terms.load_kinds[name].units))
        forms.append(
            f"{name}_{unit}, {name}_steps, or {name}_1_{unit}, {name}_2_{unit} and jump_time_h"
            if unit
            else f"{name}_steps"
        )
    return f"write {'; or '.join(forms)}"


def _loading_by(quantity: str, conditions: StatedConditions, frames: TableFrames) -> Loading | None:
    """The loading by one quantity, if it is stated."""
    kind = conditions.terms.load_kinds[quantity]
    if quantity not in conditions.terms.number_kinds:
        value: float | TimeValuePairs | Program | TwoLevels | None = _steps_or_program(conditions, quantity, kind)
    else:
        value = _stated_loading(conditions, frames, quantity)
    value = _step_change(conditions, quantity) if value is None else value
    return None if value is None else _loading_of(conditions, quantity, value, float(frames.times[-1]))


def _loading_of(
    conditions: StatedConditions, quantity: str, value: float | TimeValuePairs | Program | TwoLevels, end: float
) -> Loading:
    control: Literal["load", "stress"] = "load"
    if quantity == "stress" and _control(conditions) == "stress":
        control = "stress"
    ramp = None if isinstance(value, (Program, tuple)) else conditions.take_number("ramp")
    return loading_of(quantity, value, control=control, ramp=None if ramp is None else ramp.value, end=end)


def _component_loading(conditions: StatedConditions) -> Loading | None:
    """The stresses and strains of a material point."""
    programs: dict[str, dict[str, Program]] = {"stress": {}, "strain": {}}
    for name, kind in COMPONENT_LOADING_KINDS.items():
        result = _steps_or_program(conditions, name, kind)
        if result is not None:
            quantity, _, component = name.partition("_")
            programs[quantity][component] = Program.steps(result) if isinstance(result, tuple) else result
    return PointLoading(**programs) if programs["stress"] or programs["strain"] else None


def _steps_or_program(
    conditions: StatedConditions, quantity: str, kind: QuantityKind
) -> TimeValuePairs | Program | None:
    """Steps or a program that stand in the head."""
    steps, breakpoints = (conditions.take_pairs(f"{quantity}_{form}", kind) for form in ("steps", "program"))
    if steps is not None and breakpoints is not None:
        raise HistoryError(f"{conditions.location}: {quantity} has both steps and a program; keep one")
    return steps if breakpoints is None else Program(*np.array(breakpoints).T)


def _control(conditions: StatedConditions) -> str:
    return conditions.take_choice("control", ("load", "stress"), required=True)


def _step_change(conditions: StatedConditions, quantity: str) -> TwoLevels | None:
    """First value, second value and time of the change, when all three are given."""
    names = (f"{quantity}_1", f"{quantity}_2", "jump_time")
    first = conditions.take_number(names[0])
    if first is None:
        return None
    second, time = (_required_number(conditions, name, first) for name in names[1:])
    return TwoLevels(first.value, second.value, time.value)


def _required_number(conditions: StatedConditions, name: str, companion: StatedNumber) -> StatedNumber:
    result = conditions.take_number(name)
    if result is None:
        raise HistoryError(
            f"{companion.location}: '{companion.key}' needs {name} beside it (with its unit), which is missing"
        )
    return result


def _stated_loading(
    conditions: StatedConditions, frames: TableFrames, quantity: str
) -> float | TimeValuePairs | Program | None:
    """The value given for a quantity: a number, steps as (time, value), or a Program.

    A column that differs from what is stated beside it is what was recorded, and is used; the rest is kept as stated.
    """
    kind = TEMPERATURE if quantity == "temperature" else conditions.terms.load_kinds[quantity]
    number = conditions.take_number(quantity)
    steps = conditions.take_pairs(f"{quantity}_steps", kind)
    breakpoints = conditions.take_pairs(f"{quantity}_program", kind)
    forms = [form for form in (number, steps, breakpoints) if form is not None]
    if len(forms) > 1:
        raise HistoryError(
            f"{conditions.location}: the {quantity} is given {len(forms)} times over, as a number, {quantity}_steps "
            f"or {quantity}_program; keep one"
        )
    stated: float | TimeValuePairs | Program | None = number.value if number is not None else steps
    if breakpoints is not None:
        stated = Program(*np.array(breakpoints).T)
    earlier = conditions.take_pairs(f"stated_{quantity}_program", kind)
    if earlier is not None:
        conditions.stated[quantity] = Program(*np.array(earlier).T)
    column = frames.values.get(quantity)
    if column is None or (number is not None and np.allclose(column, number.value, rtol=1e-9, atol=0.0)):
        return stated
    if stated is None:
        jump = _step_change(conditions, quantity) if quantity != "temperature" else None
        stated = None if jump is None else _loading_of(conditions, quantity, jump, jump.time).program()
    if stated is not None:
        conditions.stated[quantity] = _as_program(stated)
    is_temperature = quantity == "temperature"
    tolerance = TEMPERATURE_RECORD_TOLERANCE if is_temperature else LOAD_RECORD_TOLERANCE * float(column.max())
    return float(column[0]) if np.ptp(column) == 0.0 else recorded_program(frames.times, column, tolerance)


def _as_program(stated: float | TimeValuePairs | Program) -> Program:
    if isinstance(stated, Program):
        return stated
    return Program.steps(stated) if isinstance(stated, tuple) else Program.constant(stated)
