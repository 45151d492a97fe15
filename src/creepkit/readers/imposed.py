"""What was imposed on a test, from its conditions or a column of its frames: the loading and the temperature."""

from __future__ import annotations

from typing import Literal

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import HistoryError
from creepkit.readers.conditions import Amount, Conditions, Pairs, placed
from creepkit.readers.frames import Frames
from creepkit.readers.units import Kind
from creepkit.readers.words import COMPONENTS_IMPOSED, IMPOSED, IMPOSED_STRAINS
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

_FORMS = ("", "_1", "_steps", "_program")
_LOADS = (
    "write stress_MPa for a uniaxial test, strain_steps for a relaxation test, or pressure_1_MPa, pressure_2_MPa and "
    "jump_time_h for a bulge test"
)


def read_temperature(conditions: Conditions, frames: Frames) -> float | Program:
    """The temperature, K."""
    found = _given(conditions, frames, "temperature")
    if found is None:
        raise conditions.missing("temperature", "write temperature_C or temperature_K, or a column of that name")
    return Program.steps(found) if isinstance(found, tuple) else found


def read_loading(conditions: Conditions, frames: Frames) -> Loading:
    """The loading: by stress where a stress is given, else by pressure; MPa."""
    quantities = ("stress", "pressure", "strain", *COMPONENTS_IMPOSED)
    with placed(conditions.where(*(f"{quantity}{form}" for quantity in quantities for form in _FORMS))):
        loading = _by_components(conditions) or _by_strain(conditions)
        loading = loading or _by_stress(conditions, frames) or _by_pressure(conditions, frames)
    if loading is None:
        raise conditions.missing("loading (neither stress nor pressure)", _LOADS)
    return loading


def _by_components(conditions: Conditions) -> Loading | None:
    """The stresses and strains of a material point."""
    given: dict[str, dict[str, Program]] = {"stress": {}, "strain": {}}
    for name, kind in COMPONENTS_IMPOSED.items():
        found = _pieces(conditions, name, kind)
        if found is not None:
            quantity, _, component = name.partition("_")
            given[quantity][component] = Program.steps(found) if isinstance(found, tuple) else found
    return PointLoading(**given) if given["stress"] or given["strain"] else None


def _by_strain(conditions: Conditions) -> Loading | None:
    """The total strain of a bar."""
    found = _pieces(conditions, "strain", IMPOSED_STRAINS["strain"])
    if found is None:
        return None
    return StrainSteps(found) if isinstance(found, tuple) else RecordedLoading(found, "strain")


def _pieces(conditions: Conditions, quantity: str, kind: Kind) -> Pairs | Program | None:
    """Steps or a program that stand in the head."""
    steps, knots = (conditions.pairs(f"{quantity}_{form}", kind) for form in ("steps", "program"))
    if steps is not None and knots is not None:
        raise HistoryError(f"{conditions.place}: {quantity} has both steps and a program; keep one")
    return steps if knots is None else Program(*np.array(knots).T)


def _by_stress(conditions: Conditions, frames: Frames) -> Loading | None:
    found = _given(conditions, frames, "stress")
    jump = None if found is not None else _jump(conditions, "stress")
    if jump is not None:
        first, second, time = jump
        found = ((0.0, first), (time, second))
    if found is None:
        return None
    control: Literal["load", "stress"] = "stress" if _control(conditions) == "stress" else "load"
    if isinstance(found, Program):
        return RecordedLoading(found, "stress", control)
    return StressSteps(found, control) if isinstance(found, tuple) else constant_stress(found, control)


def _by_pressure(conditions: Conditions, frames: Frames) -> Loading | None:
    found = _given(conditions, frames, "pressure")
    if isinstance(found, (Program, tuple)):
        program = Program.steps(found) if isinstance(found, tuple) else found
        return RecordedLoading(program, "pressure")
    jump = _jump(conditions, "pressure") if found is None else (found, found, float(frames.times[-1]))
    if jump is None:
        return None
    ramp = conditions.number("ramp")
    return PressureJump(*jump) if ramp is None else PressureJump(*jump, ramp=ramp.value)


def _control(conditions: Conditions) -> str:
    return conditions.choice("control", ("load", "stress"), needed=True)


def _jump(conditions: Conditions, quantity: str) -> tuple[float, float, float] | None:
    """First value, second value and time of the change, when all three are given."""
    names = (f"{quantity}_1", f"{quantity}_2", "jump_time")
    first = conditions.number(names[0])
    if first is None:
        return None
    second, time = (_needed(conditions, name, first) for name in names[1:])
    return first.value, second.value, time.value


def _needed(conditions: Conditions, name: str, beside: Amount) -> Amount:
    found = conditions.number(name)
    if found is None:
        raise HistoryError(f"{beside.place}: '{beside.key}' needs {name} beside it (with its unit), which is missing")
    return found


def _given(conditions: Conditions, frames: Frames, quantity: str) -> float | Pairs | Program | None:
    """What was given of a quantity: a number, steps as (time, value), or a Program."""
    kind = IMPOSED[quantity]
    number = conditions.number(quantity)
    steps = conditions.pairs(f"{quantity}_steps", kind)
    knots = conditions.pairs(f"{quantity}_program", kind)
    column = frames.values.get(quantity)
    if column is not None and number is not None:
        _agree(frames, column, number)
        column = None
    forms = [form for form in (number, steps, knots, column) if form is not None]
    if len(forms) > 1:
        raise HistoryError(
            f"{conditions.place}: the {quantity} is given {len(forms)} times over, as a number, {quantity}_steps, "
            f"{quantity}_program or a column; keep one"
        )
    if knots is not None:
        return Program(*np.array(knots).T)
    if column is not None:
        return float(column[0]) if np.ptp(column) == 0.0 else _recorded(frames, column)
    return steps if number is None else number.value


def _agree(frames: Frames, column: Floats, number: Amount) -> None:
    """Refuse a column that contradicts the number said of the whole test."""
    apart = np.abs(column - number.value) > 1e-9 * abs(number.value)
    if apart.any():
        k = int(np.argmax(apart))
        raise HistoryError(
            f"{frames.place(k)}: the column holds {column[k]:g} where '{number.key}' ({number.place}) says "
            f"{number.value:g}; keep the column or the number, or rename the number to 'label {number.key}'"
        )


def _recorded(frames: Frames, column: Floats) -> Program:
    """A column as a piecewise linear program; its first value is taken to hold from time zero."""
    if frames.times[0] == 0.0:
        return Program(frames.times, column)
    return Program(np.append(0.0, frames.times), np.append(column[0], column))
