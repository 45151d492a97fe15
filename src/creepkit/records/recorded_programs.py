"""Recorded columns of load or temperature as programs of few straight pieces."""

from __future__ import annotations

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.records.loading import Program
from creepkit.records.reading_noise import noise_of_readings

TEMPERATURE_RECORD_TOLERANCE, LOAD_RECORD_TOLERANCE = 0.25, 0.002
"""K, and fraction of the largest load, by which a program may be off its record: 1 % of a creep rate at 400 kJ/mol and
800 C, and for a stress exponent of 5."""


NOISE_FACTOR = 3.0
"""Standard deviations of the noise of a record that its program does not follow."""


LARGEST_NOISE = 10.0
"""Standard deviations by which the line between two readings may miss a third one: below a tenth of the tolerance noise
makes no breakpoints."""


FAULT = 20.0
"""Standard deviations off the median of its neighbours beyond which a reading is a fault of the sensor."""


SURE_DRIFT = 0.01
"""Probability of a slope by noise alone below which a record that is a line drifts; above, it is held."""


_MEDIAN_FRAMES = 5


_LONG_SPAN = 2000
"""Frames above which a span is not split near its ends: else a record that swings takes a time quadratic in them."""


def recorded_program(times: Floats, values: Floats, tolerance: float) -> Program:
    """The program of a record; its first value is taken to hold from time zero.

    times : (frames,) s. values : (frames,) MPa or K. tolerance : in the same unit; where three standard deviations of
    the record's noise are more, that is taken. Breakpoints are frames (Douglas and Peucker's choice), and where noise
    decides their values are the least-squares ones of all frames; a line whose slope noise alone may make is held.
    """
    noise = noise_of_readings(values)
    noisy = LARGEST_NOISE * noise > tolerance and values.size > _MEDIAN_FRAMES
    followed = running_median(values) if noisy else values
    kept = _breakpoints(times, followed, max(tolerance, NOISE_FACTOR * noise) if noisy else tolerance)
    at_breakpoints: Floats = values[kept]
    off = np.abs(values - followed)
    sound = np.where(off > max(tolerance, FAULT * 1.4826 * float(np.median(off))), followed, values)
    if noisy and kept.size == 2 and not _drifts(times, values):
        at_breakpoints = np.full(2, sound.mean())
    elif noisy:
        at_breakpoints = _least_squares(times, sound, kept)
    if times[0] == 0.0:
        return Program(times[kept], at_breakpoints)
    return Program(np.append(0.0, times[kept]), np.append(at_breakpoints[0], at_breakpoints))


def _drifts(times: Floats, values: Floats) -> bool:
    """Whether the slope of a line through readings is more than their noise makes, at 1 %."""
    from scipy.stats import linregress

    return bool(linregress(times, values).pvalue < SURE_DRIFT)


def _least_squares(times: Floats, values: Floats, kept: Ints) -> Floats:
    """Values at breakpoints of the polygon with the least sum of squares; its normal equations are tridiagonal."""
    from scipy.linalg import solveh_banded

    count = kept.size
    piece = np.clip(np.searchsorted(times[kept], times, side="right") - 1, 0, count - 2)
    right = (times - times[kept][piece]) / np.diff(times[kept])[piece]
    left = 1.0 - right
    diagonal = np.bincount(piece, left**2, count) + np.bincount(piece + 1, right**2, count)
    beside = np.bincount(piece, left * right, count - 1)
    sums = np.bincount(piece, left * values, count) + np.bincount(piece + 1, right * values, count)
    return np.asarray(solveh_banded(np.stack([np.append(0.0, beside), diagonal]), sums), dtype=float)


def running_median(values: Floats) -> Floats:
    """(frames,) medians of five about each of the values (frames,)."""
    padded = np.pad(values, _MEDIAN_FRAMES // 2, mode="edge")
    return np.asarray(np.median(np.lib.stride_tricks.sliding_window_view(padded, _MEDIAN_FRAMES), axis=-1))


def _breakpoints(times: Floats, values: Floats, tolerance: float) -> Ints:
    """Frames between which straight lines stay within the tolerance."""
    kept, spans = {0, values.size - 1}, [(0, values.size - 1)]
    while spans:
        first, last = spans.pop()
        ends = [first, last]
        line = np.interp(times[first : last + 1], times[ends], values[ends])
        distance = np.abs(values[first : last + 1] - line)
        farthest = first + int(np.argmax(distance))
        if distance[farthest - first] > tolerance:
            length = last - first
            if length > _LONG_SPAN and not length < 8 * (farthest - first) < 7 * length:
                farthest = first + length // 2
            kept.add(farthest)
            spans += [(first, farthest), (farthest, last)]
    return np.array(sorted(kept))
