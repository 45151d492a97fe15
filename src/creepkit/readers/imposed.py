"""What was imposed on a test, from its conditions or a column of its frames: the loading and the temperature."""

from __future__ import annotations

from typing import Literal

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import HistoryError
from creepkit.readers.conditions import StatedNumber, StatedConditions, TimeValuePairs, errors_located_at
from creepkit.readers.frames import Frames
from creepkit.readers.units import QuantityKind
from creepkit.readers.words import COMPONENT_LOADING_KINDS, LOADING_KINDS, STRAIN_LOADING_KINDS
from creepkit.records import (
    Loading,
    PointLoading,
    PressureJump,
    Program,
    RecordedLoading,
    StrainSteps,
    StressSteps,
    constant_stress,
)

_LOADING_SUFFIXES = ("", "_1", "_steps", "_program")
_LOADING_ADVICE = (
    "write stress_MPa for a uniaxial test, strain_steps for a relaxation test, or pressure_1_MPa, pressure_2_MPa and "
    "jump_time_h for a bulge test"
)


def read_temperature(conditions: StatedConditions, frames: Frames) -> float | Program:
    """The temperature, K."""
    result = _stated_loading(conditions, frames, "temperature")
    if result is None:
        raise conditions.missing_error("temperature", "write temperature_C or temperature_K, or a column of that name")
    return Program.steps(result) if isinstance(result, tuple) else result


def read_loading(conditions: StatedConditions, frames: Frames) -> Loading:
    """The loading: by stress where a stress is given, else by pressure; MPa."""
    quantities = ("stress", "pressure", "strain", *COMPONENT_LOADING_KINDS)
    with errors_located_at(conditions.location_of(*(f"{quantity}{form}" for quantity in quantities for form in _LOADING_SUFFIXES))):
        loading = _component_loading(conditions) or _strain_loading(conditions)
        loading = loading or _stress_loading(conditions, frames) or _pressure_loading(conditions, frames)
    if loading is None:
        raise conditions.missing_error("loading (neither stress nor pressure)", _LOADING_ADVICE)
    return loading


def _component_loading(conditions: StatedConditions) -> Loading | None:
    """The stresses and strains of a material point."""
    programs: dict[str, dict[str, Program]] = {"stress": {}, "strain": {}}
    for name, kind in COMPONENT_LOADING_KINDS.items():
        result = _steps_or_program(conditions, name, kind)
        if result is not None:
            quantity, _, component = name.partition("_")
            programs[quantity][component] = Program.steps(result) if isinstance(result, tuple) else result
    return PointLoading(**programs) if programs["stress"] or programs["strain"] else None


def _strain_loading(conditions: StatedConditions) -> Loading | None:
    """The total strain of a bar."""
    result = _steps_or_program(conditions, "strain", STRAIN_LOADING_KINDS["strain"])
    if result is None:
        return None
    return StrainSteps(result) if isinstance(result, tuple) else RecordedLoading(result, "strain")


def _steps_or_program(conditions: StatedConditions, quantity: str, kind: QuantityKind) -> TimeValuePairs | Program | None:
    """Steps or a program that stand in the head."""
    steps, breakpoints = (conditions.take_pairs(f"{quantity}_{form}", kind) for form in ("steps", "program"))
    if steps is not None and breakpoints is not None:
        raise HistoryError(f"{conditions.location}: {quantity} has both steps and a program; keep one")
    return steps if breakpoints is None else Program(*np.array(breakpoints).T)


def _stress_loading(conditions: StatedConditions, frames: Frames) -> Loading | None:
    result = _stated_loading(conditions, frames, "stress")
    jump = None if result is not None else _step_change(conditions, "stress")
    if jump is not None:
        first, second, time = jump
        result = ((0.0, first), (time, second))
    if result is None:
        return None
    control: Literal["load", "stress"] = "stress" if _control(conditions) == "stress" else "load"
    if isinstance(result, Program):
        return RecordedLoading(result, "stress", control)
    return StressSteps(result, control) if isinstance(result, tuple) else constant_stress(result, control)


def _pressure_loading(conditions: StatedConditions, frames: Frames) -> Loading | None:
    result = _stated_loading(conditions, frames, "pressure")
    if isinstance(result, (Program, tuple)):
        program = Program.steps(result) if isinstance(result, tuple) else result
        return RecordedLoading(program, "pressure")
    jump = _step_change(conditions, "pressure") if result is None else (result, result, float(frames.times[-1]))
    if jump is None:
        return None
    ramp = conditions.take_number("ramp")
    return PressureJump(*jump) if ramp is None else PressureJump(*jump, ramp=ramp.value)


def _control(conditions: StatedConditions) -> str:
    return conditions.take_choice("control", ("load", "stress"), required=True)


def _step_change(conditions: StatedConditions, quantity: str) -> tuple[float, float, float] | None:
    """First value, second value and time of the change, when all three are given."""
    names = (f"{quantity}_1", f"{quantity}_2", "jump_time")
    first = conditions.take_number(names[0])
    if first is None:
        return None
    second, time = (_required_number(conditions, name, first) for name in names[1:])
    return first.value, second.value, time.value


def _required_number(conditions: StatedConditions, name: str, companion: StatedNumber) -> StatedNumber:
    result = conditions.take_number(name)
    if result is None:
        raise HistoryError(f"{companion.location}: '{companion.key}' needs {name} beside it (with its unit), which is missing")
    return result


def _stated_loading(conditions: StatedConditions, frames: Frames, quantity: str) -> float | TimeValuePairs | Program | None:
    """What was given of a quantity: a number, steps as (time, value), or a Program."""
    kind = LOADING_KINDS[quantity]
    number = conditions.take_number(quantity)
    steps = conditions.take_pairs(f"{quantity}_steps", kind)
    breakpoints = conditions.take_pairs(f"{quantity}_program", kind)
    column = frames.values.get(quantity)
    if column is not None and number is not None:
        _check_agreement(frames, column, number)
        column = None
    forms = [form for form in (number, steps, breakpoints, column) if form is not None]
    if len(forms) > 1:
        raise HistoryError(
            f"{conditions.location}: the {quantity} is given {len(forms)} times over, as a number, {quantity}_steps, "
            f"{quantity}_program or a column; keep one"
        )
    if breakpoints is not None:
        return Program(*np.array(breakpoints).T)
    if column is not None:
        return float(column[0]) if np.ptp(column) == 0.0 else _recorded_program(frames, column)
    return steps if number is None else number.value


def _check_agreement(frames: Frames, column: Floats, number: StatedNumber) -> None:
    """Refuse a column that contradicts the number said of the whole test."""
    differs = np.abs(column - number.value) > 1e-9 * abs(number.value)
    if differs.any():
        k = int(np.argmax(differs))
        raise HistoryError(
            f"{frames.location(k)}: the column holds {column[k]:g} where '{number.key}' ({number.location}) says "
            f"{number.value:g}; keep the column or the number, or rename the number to 'label {number.key}'"
        )


def _recorded_program(frames: Frames, column: Floats) -> Program:
    """A column as a piecewise linear program; its first value is taken to hold from time zero."""
    if frames.times[0] == 0.0:
        return Program(frames.times, column)
    return Program(np.append(0.0, frames.times), np.append(column[0], column))
