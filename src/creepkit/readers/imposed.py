"""Loading and temperature of a test: stated in its head, recorded in columns, or both.

A column of nominal levels is steps; a column that was recorded is straight pieces. What the file leaves open is decided
and recorded, or asked for.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from itertools import pairwise
from typing import Literal

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import HistoryError
from creepkit.readers.conditions import StatedConditions, StatedNumber, TimeValuePairs, errors_located_at
from creepkit.readers.text_tables import TableFrames
from creepkit.readers.vocabulary import COMPONENT_LOADING_KINDS, Terms
from creepkit.records import Loading, PointLoading, Program, TwoLevels, loading_of
from creepkit.records.quantities import TEMPERATURE, QuantityKind
from creepkit.records.recorded_programs import LOAD_RECORD_TOLERANCE, TEMPERATURE_RECORD_TOLERANCE, recorded_program

_PROGRAM_FORMS = ("steps", "program")


_LOADING_SUFFIXES = ("", "_1", *(f"_{form}" for form in _PROGRAM_FORMS))


LARGEST_GAP = 0.1
"""Of the shorter of two steps: a change of load between two frames farther apart must be stated."""


LARGEST_BARE_STRAIN = 0.05
"""A held strain without a unit above it is as likely a percentage."""


HELD_RANGE = 0.02
"""Of its median: between its tenth and ninetieth percentile a quantity that is held varies by less."""


def read_temperature(
    conditions: StatedConditions, frames: TableFrames, marked: Collection[int] = ()
) -> float | Program:
    """The temperature, K; marked : lines of frames at which a load or temperature changed."""
    result = _stated_loading(conditions, frames, "temperature", marked)
    if result is None:
        raise conditions.missing_error("temperature", "write temperature_C or temperature_K, or a column of that name")
    return Program.steps(result) if isinstance(result, tuple) else result


def read_loading(conditions: StatedConditions, frames: TableFrames, marked: Collection[int] = ()) -> Loading:
    """The loading: by components, by what has steps and programs alone, else by the first load that is stated.

    marked : lines of frames at which a load or temperature changed.
    """
    terms, load_kinds = conditions.terms, conditions.terms.load_kinds
    quantities = (*load_kinds, *COMPONENT_LOADING_KINDS)
    with errors_located_at(
        conditions.location_of(*(f"{quantity}{form}" for quantity in quantities for form in _LOADING_SUFFIXES))
    ):
        loading = _component_loading(conditions)
        likely = {load for one in conditions.terms.specimens_with(frames.values) for load in terms.loads.get(one, ())}
        for name in sorted(load_kinds, key=lambda name: (name in terms.number_kinds, name not in likely)):
            loading = loading or _loading_by(name, conditions, frames, marked)
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


def _loading_by(
    quantity: str, conditions: StatedConditions, frames: TableFrames, marked: Collection[int]
) -> Loading | None:
    """The loading by one quantity, if it is stated or recorded."""
    value: float | TimeValuePairs | Program | TwoLevels | None = _stated_loading(conditions, frames, quantity, marked)
    value = _step_change(conditions, quantity) if value is None else value
    return None if value is None else _loading_of(conditions, quantity, value, float(frames.times[-1]))


def _loading_of(
    conditions: StatedConditions, quantity: str, value: float | TimeValuePairs | Program | TwoLevels, end: float
) -> Loading:
    control: Literal["load", "stress"] = "load"
    if quantity == "stress" and _control(conditions, varies=not isinstance(value, float)) == "stress":
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


def _control(conditions: StatedConditions, *, varies: bool) -> str:
    """Whether the load or the true stress follows what is stated; an engineering stress is a load.

    varies : whether the stress changes, so that the two differ by more than what happens to the cross-section.
    """
    location = conditions.location_of("stress_measure")
    measure = conditions.take_choice("stress_measure", ("engineering", "true"), required=False)
    meant = {"engineering": "load", "true": "stress", "": ""}[measure]
    if meant and not conditions.states("control"):
        conditions.record_assumption(f"control {meant}, for the stress is the {measure} one")
        return meant
    control = conditions.take_choice("control", ("load", "stress"), required=True)
    if varies and meant and control != meant:
        raise HistoryError(
            f"{location}: stress_measure is {measure} and control is {control}, but steps and records of an "
            "engineering stress are a load, and those of a true stress a stress; keep one of the two"
        )
    return control


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
    conditions: StatedConditions, frames: TableFrames, quantity: str, marked: Collection[int]
) -> float | TimeValuePairs | Program | None:
    """The value given for a quantity: a number, steps as (time, value), or a Program.

    A column that differs from what is stated beside it is what was recorded, and is used; the rest is kept as stated.
    """
    kind = TEMPERATURE if quantity == "temperature" else conditions.terms.load_kinds[quantity]
    column = _imposed_column(conditions, frames, quantity)
    number = conditions.take_number(quantity)
    steps = conditions.take_pairs(f"{quantity}_steps", kind)
    breakpoints = conditions.take_pairs(f"{quantity}_program", kind)
    forms = [form for form in (number, steps, breakpoints) if form is not None]
    if len(forms) > 1:
        raise HistoryError(
            f"{conditions.location}: the {quantity} is given {len(forms)} times over, as a number, {quantity}_steps "
            f"or {quantity}_program; keep one"
        )
    if number is not None:
        _check_bare_strain(conditions, quantity, kind, number)
    stated: float | TimeValuePairs | Program | None = number.value if number is not None else steps
    if breakpoints is not None:
        stated = Program(*np.array(breakpoints).T)
    earlier = conditions.take_pairs(f"stated_{quantity}_program", kind)
    if earlier is not None:
        conditions.stated[quantity] = Program(*np.array(earlier).T)
    if column is None or (stated is not None and _agrees(_as_program(stated), frames.times, column)):
        return stated
    if stated is None and "step" not in frames.values:
        jump = _step_change(conditions, quantity) if quantity != "temperature" else None
        stated = None if jump is None else _loading_of(conditions, quantity, jump, jump.time).program()
    if stated is not None:
        conditions.stated[quantity] = _as_program(stated)
    return _recorded(conditions, frames, quantity, column, marked)


def _agrees(program: Program, times: Floats, column: Floats) -> bool:
    """Whether a column says what was stated, at every frame; at a jump, the value before or after it."""
    later, before = program.at(times), program.at(np.nextafter(times, -np.inf).clip(0.0))
    same = [np.isclose(column, stated, rtol=1e-9, atol=0.0) for stated in (later, before)]
    return bool(np.logical_or(*same).all())


def _check_bare_strain(conditions: StatedConditions, quantity: str, kind: QuantityKind, number: StatedNumber) -> None:
    """Ask for the unit of a held strain that may be a fraction or a percentage."""
    if "pct" not in kind.units or number.unit:
        return
    if abs(number.value) > LARGEST_BARE_STRAIN:
        raise HistoryError(
            f"{number.location}: '{number.key}' is {number.value:g} without a unit; write {quantity}_pct for a "
            f"percentage, or {quantity}_steps: 0 s {number.value:g} for a fraction"
        )
    conditions.record_assumption(f"{quantity} {number.value:g} as a fraction")


def _imposed_column(conditions: StatedConditions, frames: TableFrames, quantity: str) -> Floats | None:
    """The column of a load or of the temperature, unless it is an output; levels of numbered steps stand for it."""
    terms, column = conditions.terms, frames.values.get(quantity)
    if column is None or quantity == "temperature":
        return _levels_of_steps(conditions, frames, quantity) if column is None else column
    if terms.own_outputs:
        is_output = quantity in terms.own_outputs and quantity not in terms.own_loads
        return None if is_output or quantity not in (*terms.number_kinds, *terms.own_loads) else column
    others = [
        other
        for one, loads in terms.loads.items()
        for other in terms.outputs[one]
        if quantity in loads
        and other in frames.values
        and any(other in terms.loads[two] and quantity in terms.outputs[two] for two in terms.loads)
    ]
    if others:
        return column if _imposed_of(conditions, frames, quantity, others[0]) == quantity else None
    return column if quantity in terms.number_kinds else None


def _imposed_of(conditions: StatedConditions, frames: TableFrames, first: str, second: str) -> str:
    """Which of two quantities was imposed, where each may be the answer to the other: the stated or the held one."""
    pair = sorted((first, second))
    stated = [q for q in pair if any(conditions.states(f"{q}{form}") for form in _LOADING_SUFFIXES)]
    if len(stated) == 1:
        return stated[0]
    columns = {q: frames.values[q] for q in pair}
    held = [q for q, column in columns.items() if _is_held(column)] or [
        q for q, column in columns.items() if _level_starts(column, LOAD_RECORD_TOLERANCE * float(np.ptp(column)))
    ]
    imposed = held[0] if len(held) == 1 else next(q for q in pair if q in conditions.terms.number_kinds)
    why = "its column is held" if imposed in held else "neither column is held"
    conditions.record_assumption(f"{imposed} imposed, for {why}")
    return imposed


def _is_held(column: Floats) -> bool:
    low, middle, high = np.percentile(column, (10, 50, 90))
    return bool(high - low <= HELD_RANGE * abs(middle) and middle != 0.0)


def _levels_of_steps(conditions: StatedConditions, frames: TableFrames, quantity: str) -> Floats | None:
    """The level at each frame, of numbered steps: a column `step` beside `stress_1_MPa`, `stress_2_MPa`, ..."""
    steps = frames.values.get("step")
    if steps is None or not conditions.states(f"{quantity}_1"):
        return None
    levels = np.full(steps.size, np.nan)
    for number in np.unique(steps):
        level = conditions.take_number(f"{quantity}_{number:g}")
        if level is None:
            frame = int(np.argmax(steps == number))
            raise HistoryError(
                f"{frames.location(frame)}: step {number:g} has no level; write {quantity}_{number:g} with its unit"
            )
        levels[steps == number] = level.value
    return levels


def _recorded(
    conditions: StatedConditions, frames: TableFrames, quantity: str, column: Floats, marked: Collection[int]
) -> float | TimeValuePairs | Program:
    """A column as a number, as steps where it holds nominal levels, else as the program of a record."""
    if np.ptp(column) == 0.0:
        return float(column[0])
    is_temperature = quantity == "temperature"
    tolerance = TEMPERATURE_RECORD_TOLERANCE if is_temperature else LOAD_RECORD_TOLERANCE * float(np.abs(column).max())
    starts = _level_starts(column, tolerance)
    if not starts:
        return recorded_program(frames.times, column, tolerance)
    bounds = [*starts, column.size]
    for before, frame, after in zip(bounds, bounds[1:-1], bounds[2:], strict=False):
        shorter = min(frames.times[frame - 1] - frames.times[before], frames.times[after - 1] - frames.times[frame])
        gap = frames.times[frame] - frames.times[frame - 1]
        if gap > LARGEST_GAP * shorter and int(frames.lines[frame]) not in marked:
            unit = "K" if is_temperature else next(iter(conditions.terms.load_kinds[quantity].units))
            first, second = (f"{column[k]:g} {unit}".rstrip() for k in (frame - 1, frame))
            early, late = (f"{frames.times[k]:g} s" for k in (frame - 1, frame))
            raise HistoryError(
                f"{frames.location(frame)}: the {quantity} changes from {first} to {second} between {early} and "
                f"{late}; state when, such as '# {quantity}_steps: 0 s {first}; {early} {second}', or add a frame there"
            )
    conditions.record_assumption(f"steps of {quantity} from the first frame of each level on")
    values = [float(np.median(column[first:last])) for first, last in pairwise(bounds)]
    return tuple((0.0 if k == 0 else float(frames.times[k]), v) for k, v in zip(starts, values, strict=True))


def _level_starts(column: Floats, tolerance: float) -> list[int]:
    """First frames of nominal levels, each held over two frames or more; [] where a column holds no such levels."""
    starts = [0, *(np.flatnonzero(np.abs(np.diff(column)) > tolerance) + 1).tolist()]
    bounds = [*starts, column.size]
    held = all(last - first > 1 and np.ptp(column[first:last]) <= tolerance for first, last in pairwise(bounds))
    return starts if held and len(starts) > 1 else []


def _as_program(stated: float | TimeValuePairs | Program) -> Program:
    if isinstance(stated, Program):
        return stated
    return Program.steps(stated) if isinstance(stated, tuple) else Program.constant(stated)
