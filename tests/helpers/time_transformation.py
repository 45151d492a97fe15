"""The transformed time s in [0, 1] of a segment of the load program, in which creep strain is nearly a straight line.

`time_transformation.hpp` has the formulas; the integrators choose a transformation for each segment by themselves.
"""

from __future__ import annotations

import ctypes
from typing import NamedTuple

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.core import address, function


class TimeTransformation(NamedTuple):
    """start and length of the segment, s; beta, and tau in s (0: from a virgin state)."""

    start: float
    length: float
    beta: float
    tau: float


class TransformedTimes(NamedTuple):
    """What a transformation makes of positions, s in [0, 1].

    time, log_pace : (count,) s, and ln(dt/ds) with dt/ds in s.
    time_by_beta, log_pace_by_beta : (count,) s and 1, their derivatives to beta.
    time_by_tau, log_pace_by_tau : (count,) 1 and 1/s, their derivatives to tau.
    position : (count,) the positions of those times.
    """

    time: Floats
    log_pace: Floats
    time_by_beta: Floats
    log_pace_by_beta: Floats
    time_by_tau: Floats
    log_pace_by_tau: Floats
    position: Floats


def transformed_times(clock: TimeTransformation, s: ArrayLike) -> TransformedTimes:
    """Times, paces and derivatives at positions.

    s : (count,) above 0, or one number.
    """
    numbers, positions = np.array(clock, dtype=float), np.array(s, dtype=float, ndmin=1)
    out = np.empty((positions.size, len(TransformedTimes._fields)))
    function("creepkit_transformed_times", None)(
        address(numbers), ctypes.c_int64(positions.size), address(positions), address(out)
    )
    return TransformedTimes(*out.T)


def power_law_transformation(start: float, length: float, beta: float) -> TimeTransformation:
    """Of a segment that begins without creep strain; `beta` is the leading exponent of time."""
    return _chosen("creepkit_power_law_time", start, length, beta)


def shifted_power_law_transformation(start: float, length: float, bend: float, bend_rate: float) -> TimeTransformation:
    """Of a segment that begins after some creep, from r = `bend` in p'' = r p' and the rate of r."""
    return _chosen("creepkit_shifted_power_law_time", start, length, bend, bend_rate)


def _chosen(name: str, *numbers: float) -> TimeTransformation:
    clock = np.empty(4)
    function(name, None)(*(ctypes.c_double(number) for number in numbers), address(clock))
    return TimeTransformation(*clock.tolist())
