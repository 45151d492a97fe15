"""Labels of tests in plots: load and temperature programs as people say them, "8 → 10 MPa at 4 h, 793 °C"."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from creepkit.inverse.reference_conditions import HELD_LOAD
from creepkit.records import ZERO_CELSIUS, History, PointLoading, Program, load_unit
from creepkit.records.held_levels import holds, is_isothermal, last_data_time, temperature_holds
from creepkit.records.loading import held_of
from creepkit.records.units import time_text

MOST_HOLDS = 3
"""Holds that are written one by one; of more, the first, the last and their number."""


EVEN, EVEN_POINTS = 0.02, 41
"""Of the final strain: how far a strain that rises evenly departs from a line; and at how many times that is asked."""


SHORT_RAMP = 0.025
"""Of the time at its end: a longer ramp has both its ends written, such as a step that lies between two readings."""


def program_text(history: History) -> str:
    """Load and temperature over the frames of a test, such as "8 → 10 MPa at 4 h, 793 °C"."""
    return f"{load_text(history)}, {temperature_text(history)}"


def load_text(history: History) -> str:
    """The load program over the frames of a test, such as "8 → 10 MPa at 4 h"."""
    loading = history.loading
    last = last_data_time(history)
    if isinstance(loading, PointLoading):
        parts = [f"stress {name} {_level_text(p, last, ' MPa')}" for name, p in loading.stress.items()]
        return ", ".join(parts + [f"strain {name} {_level_text(p, last, '')}" for name, p in loading.strain.items()])
    if loading.quantity == "strain":
        return _level_text(loading.program(), last, " % strain", 100.0)
    return _level_text(loading.program(), last, f" {load_unit(history)}")


def kind_of_test(history: History) -> str:
    """What is prescribed in a test: "creep under constant load", "constant strain, at which the stress relaxes".

    A strain that rises evenly is "tension at a constant strain rate".
    """
    loading = history.loading
    if isinstance(loading, PointLoading):
        prescribed = [name for name, one in (("stress", loading.stress), ("strain", loading.strain)) if one]
        return f"prescribed components of {' and '.join(prescribed)}"
    program, last = loading.program(), last_data_time(history)
    pieces = holds(program, last, HELD_LOAD * float(np.abs(program.values).max()))
    levels = "constant" if len(pieces) == 1 else "stepwise" if pieces else "changing"
    if strain_rate(history) is not None:
        return "tension at a constant strain rate"
    if loading.quantity == "strain":
        return f"{levels} strain{', at which the stress relaxes' if pieces else ''}"
    if loading.quantity == "stress":
        held = "true stress" if held_of(loading) == "stress" else "load"
        return f"creep under {levels} {held}"
    return f"creep under {levels} {loading.quantity}"


def strain_rate(history: History) -> float | None:
    """1/s, of a strain that is prescribed and rises evenly over the frames; None of other tests."""
    if isinstance(history.loading, PointLoading) or history.loading.quantity != "strain":
        return None
    program, last = history.loading.program(), last_data_time(history)
    times = np.linspace(0.0, last, EVEN_POINTS)
    values = np.interp(times, program.times, program.values)
    rate = float(values[-1] - values[0]) / last if last > 0 else 0.0
    even = np.abs(values - values[0] - rate * times).max() <= EVEN * abs(values[-1] - values[0])
    return rate if rate > 0 and even else None


def _level_text(program: Program, last: float, unit: str, factor: float = 1.0) -> str:
    tolerance = HELD_LOAD * float(np.abs(program.values).max())
    return _holds_text(holds(program, last, tolerance), unit, lambda v: f"{factor * v:.4g}")


def temperature_text(history: History) -> str:
    """The temperature over the frames of a test, such as "793 → 800 °C at 4 h"."""
    program = history.temperature_program()
    if is_isothermal(history):
        return f"{float(np.mean(program.values)) - ZERO_CELSIUS:.0f} °C"
    return _holds_text(temperature_holds(history), " °C", lambda v: f"{v - ZERO_CELSIUS:.0f}")


def _holds_text(pieces: list[tuple[float, float, float]], unit: str, number: Callable[[float], str]) -> str:
    """The values of holds, and when each but the first begins, or between which times."""
    if not pieces:
        return f"ramps{unit}"
    first = number(pieces[0][2])
    if len(pieces) == 1:
        return first + unit
    if len(pieces) > MOST_HOLDS:
        return f"{first} → … → {number(pieces[-1][2])}{unit}, {len(pieces)} steps"
    text = first
    for before, after in pairwise(pieces):
        known = after[0] - before[1] <= SHORT_RAMP * after[0]
        when = time_text(before[1]) if known else f"{time_text(before[1])} to {time_text(after[0])}"
        text += f" → {number(after[2])}{unit} at {when}"
    return text
