"""Levels of load and temperature at which tests are held."""

from __future__ import annotations

import numpy as np

from creepkit.records.history import History
from creepkit.records.loading import Program

HELD_TEMPERATURE = 1.0
"""K, within which a temperature is held."""


def held_temperatures(history: History) -> list[float]:
    """K at which a test is held, in their order; the mean temperature of one that is never held at any."""
    if is_isothermal(history):
        return [float(np.mean(history.temperature_program().values))]
    held = [value for _, _, value in temperature_holds(history)]
    return held or [history.mean_temperature]


def is_isothermal(history: History) -> bool:
    """Whether one temperature is held all the time."""
    return float(np.ptp(history.temperature_program().values)) <= 2 * HELD_TEMPERATURE


def temperature_holds(history: History) -> list[tuple[float, float, float]]:
    """(start, end, K) of the pieces, s, over which the temperature of a test is held, up to its last used frame."""
    return holds(history.temperature_program(), last_data_time(history), HELD_TEMPERATURE)


def holds(program: Program, last: float, tolerance: float) -> list[tuple[float, float, float]]:
    """(start, end, value) of the pieces, s, over which a program stays within a tolerance of their first value.

    last : s, the end of what is looked at. Ramps are no holds; a program of ramps alone has none.
    """
    times = np.append(program.times, max(last, float(program.times[-1])))
    values = np.append(program.values, program.values[-1])
    pieces: list[tuple[float, float, float]] = []
    for start, end, value, following in zip(times[:-1], times[1:], values[:-1], values[1:], strict=True):
        if start >= last or end <= start or abs(following - value) > tolerance:
            continue
        if pieces and start <= pieces[-1][1] * (1 + 1e-12) and abs(value - pieces[-1][2]) <= tolerance:
            pieces[-1] = (pieces[-1][0], float(end), pieces[-1][2])
        else:
            pieces.append((float(start), float(end), float(value)))
    return pieces


def last_data_time(history: History) -> float:
    """Time of the last used frame with data, s."""
    frames = np.flatnonzero(history.used & history.frames_with_data)
    return float(history.times[frames[-1] if frames.size else -1])
