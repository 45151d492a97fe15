"""Idle time: parts of a test in which the clock ran on while nothing crept, as in a power failure with the load off.

Between two frames, or over several, the output must grow at least by the smaller one of the rates before and after:
hardening, steady and softening creep do. Where it grows by much less, the rest of the time was idle.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache, partial
from typing import NamedTuple

import numpy as np

from creepkit.arrays import Floats
from creepkit.quality.flags import QualityFlag
from creepkit.quality.frames import grows, load_segments, rounding_step
from creepkit.records import History, growing_output
from creepkit.records.reading_noise import noise_of_readings
from creepkit.records.units import time_text, times_text

FRAMES_BESIDE, SHORTEST_BESIDE = 5, 0.2
"""Intervals before and after over which the rates are found at least, and their duration over that of the part."""


WIDTHS = (*range(1, 40), *(int(40 * 1.2**k) for k in range(20)))
"""Intervals that an idle part may have."""


LARGEST_GROWTH, THRESHOLD, RATE_THRESHOLD, RATE_RATIO, FALL_THRESHOLD = 0.25, 8.0, 5.0, 4.0, 8.0
"""Of the growth that the rates lead to; standard deviations by which it falls short, and of the rates themselves; ratio
of the rates before and after, above which the curve bends too sharply to say anything; standard deviations of a fall
from one frame to the next, which no idle time explains."""


class IdlePart(NamedTuple):
    """Frames between which nothing crept, and for how long, s."""

    first: int
    last: int
    idle: float


def idle_flags(history: History) -> Iterator[QualityFlag]:
    """Flags of idle parts, with their length."""
    if not grows(history):
        return
    values = history.outputs[growing_output(history)]
    for segment in load_segments(history):
        for part in idle_parts(history.times[segment.frames], values[segment.frames]):
            first, last = (int(segment.frames[k]) for k in (part.first, part.last))
            start, end = float(history.times[first]), float(history.times[last])
            yield QualityFlag(
                (history.name,),
                "idle",
                (),
                f"from {times_text(start, end)} nothing crept for {time_text(part.idle)}: {growing_output(history)} "
                "grows by less than a quarter of what the rates before and after lead to",
                time=start,
                proposal=f"if the load or the furnace was off, subtract {time_text(part.idle)} from the later times",
            )


def _rates(times: Floats, values: Floats, sigma: float, count: int) -> tuple[Floats, Floats]:
    """Rates of lines through `count` frames from each on, and their standard deviations.

    times, values : (frames,) s, and the unit of the output, in which sigma is.
    """
    windows = [np.lib.stride_tricks.sliding_window_view(one, count) for one in (times, values)]
    x, y = (one - one.mean(axis=1, keepdims=True) for one in windows)
    variation = (x**2).sum(axis=1)
    return (x * y).sum(axis=1) / variation, sigma / np.sqrt(variation)


def idle_parts(times: Floats, values: Floats) -> list[IdlePart]:
    """The idle parts of a curve under one load, the longest first; none overlaps another.

    times, values : (frames,) s, and the unit of the output.
    """
    sigma = max(noise_of_readings(values), rounding_step(values))
    found: list[tuple[float, IdlePart]] = []
    rates_over = cache(partial(_rates, times, values, sigma))
    noise = max(noise_of_readings(values, times, order=3), rounding_step(values))
    falls = np.append(0, np.cumsum(np.diff(values) < -FALL_THRESHOLD * noise))
    for width in WIDTHS:
        beside = max(FRAMES_BESIDE, width // 2)
        first = np.arange(beside, times.size - beside - width)
        if not first.size:
            break
        rates, errors = rates_over(beside + 1)
        before, after, span = first - beside, first + width, times[first + width] - times[first]
        least, growth = np.minimum(rates[before], rates[after]), values[after] - values[first]
        is_idle = growth < LARGEST_GROWTH * least * span
        if not is_idle.any():
            continue
        lacking, error = least * span - growth, np.maximum(errors[before], errors[after])
        is_idle &= (least > RATE_THRESHOLD * error) & (np.maximum(rates[before], rates[after]) < RATE_RATIO * least)
        is_idle &= lacking > THRESHOLD * np.hypot(1.5 * sigma, span * error)
        shorter = np.minimum(times[first] - times[before], times[after + beside] - times[after])
        is_idle &= (shorter > SHORTEST_BESIDE * span) & (falls[first + width] == falls[first])
        for k in np.flatnonzero(is_idle):
            rate = float(np.sqrt(rates[before[k]] * rates[after[k]]))
            idle = float(span[k] - max(growth[k], 0.0) / rate)
            found.append((float(lacking[k]), IdlePart(int(first[k]), int(first[k] + width), idle)))
    parts: list[IdlePart] = []
    for _, part in sorted(found, reverse=True):
        if all(part.last <= other.first or part.first >= other.last for other in parts):
            parts.append(part)
    return parts
