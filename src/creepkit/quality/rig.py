"""What the rig did: steps of an output without one of the load, thermal expansion, records off a program."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np

from creepkit.arrays import Floats
from creepkit.quality.flags import QualityFlag
from creepkit.quality.frames import (
    FEWEST_FRAMES,
    LOAD_TOLERANCE,
    TEMPERATURE_TOLERANCE,
    extrapolate,
    load_segments,
    rounding_step,
    scatter_about_line,
)
from creepkit.quality.smooth_curve import SmoothCurve, smooth_curve
from creepkit.records import History, growing_output, output_named
from creepkit.records.recorded_programs import running_median
from creepkit.records.units import time_text, times_text

JUMP_THRESHOLD, ROUNDING_STEPS = 5.0, 2.0
"""Standard deviations of a step of the value, and steps of rounded readings, that it must exceed.

Planted in 2000 curves of 18 to 70 readings (power, exponential and logarithmic primary, tertiary and steady creep;
noise 0.1 to 2 % of all strain), steps of 4, 6, 8, 12, 20 and 40 standard deviations of a reading were found in 10, 24,
44, 73, 88 and 96 %; none was found in the curves without a step, nor in 750 whose noise is autocorrelated, whose
readings are rounded or whose rate changes, and 3 in 250 with a single outlier of ten.
"""


MOST_JUMPS = 3
"""Steps looked for in a part of one test."""


LINE_FRAMES, EXPANSION, EXPANSION_THRESHOLD = (4, 6), (4e-6, 35e-6), 4.0
"""Frames on a side of a step of temperature, at least and at most; 1/K, coefficients of thermal expansion that solids
of creep tests have; standard deviations of a step."""


class Jump(NamedTuple):
    """A step of the leading output of one test between two frames: time, s; size, in its unit, over the noise."""

    test: int
    time: float
    previous_time: float
    size: float
    score: float


def find_jumps(histories: Sequence[History]) -> list[Jump]:
    """Steps of the leading output without a step of the load, in any test by itself."""
    results = []
    for k, history in enumerate(histories):
        for times, values, start in _parts(history):
            shifts, least = list[float](), ROUNDING_STEPS * rounding_step(values)
            for _ in range(MOST_JUMPS):
                curve = smooth_curve(times, values, start, shifts)
                gaps, scores, sizes = curve.level_shift_scores()
                worst = int(np.argmax(np.abs(scores))) if scores.size else 0
                if not scores.size or abs(scores[worst]) < JUMP_THRESHOLD or abs(sizes[worst]) < least:
                    break
                after = int(np.searchsorted(curve.times, gaps[worst]))
                shifts.append(float(gaps[worst]))
                left = smooth_curve(times, values, start, shifts).level_shift_scores()[1]
                score = float(scores[worst]) / max(1.0, 1.4826 * float(np.median(np.abs(left))))
                if abs(score) > JUMP_THRESHOLD and _stands_out(curve, after, float(sizes[worst])):
                    between = (float(curve.times[after]), float(curve.times[after - 1]))
                    results.append(Jump(k, *between, float(sizes[worst]), score))
    return results


def _parts(history: History) -> list[tuple[Floats, Floats, float]]:
    """Times, values and start (s) of the parts of a test under one load."""
    segments = load_segments(history)
    starts = [float(history.times[segments[k - 1].frames[-1]]) if k else 0.0 for k in range(len(segments))]
    values = history.outputs.get(growing_output(history), np.zeros(0))
    return [
        (history.times[s.frames], values[s.frames], start)
        for s, start in zip(segments, starts, strict=True)
        if s.frames.size >= FEWEST_FRAMES and np.ptp(values[s.frames]) > 0
    ]


def _stands_out(curve: SmoothCurve, after: int, size: float) -> bool:
    """Whether the mean slope over a gap is beyond those of the gaps around it by at least half of the step.

    Where a curve bends sharply between few points, a step seems to fit and yet the slopes only follow one another.
    """
    slopes = np.diff(curve.values) / np.diff(curve.times)
    around = np.delete(slopes[max(after - 3, 0) : after + 2], min(after - 1, 2))
    limit = around.max() if size > 0 else around.min()
    gap = float(curve.times[after] - curve.times[after - 1])
    return bool(np.sign(size) * (slopes[after - 1] - limit) * gap > 0.5 * abs(size))


def jump_flags(histories: Sequence[History], jumps: Sequence[Jump]) -> Iterator[QualityFlag]:
    """Flags of steps of an output; those of one gap between frames are one flag."""
    remaining = sorted(jumps, key=lambda jump: (jump.time, jump.test))
    while remaining:
        first = remaining[0]
        kind = histories[first.test].specimen
        together = [
            j for j in remaining if histories[j.test].specimen == kind and j.previous_time < first.time <= j.time
        ]
        remaining = [j for j in remaining if j not in together]
        sizes = {histories[j.test].name: j.size for j in together}
        texts = [f"{_size_text(histories[j.test], j.size)} ({abs(j.score):.0f} times its error)" for j in together]
        yield QualityFlag(
            tuple(sizes),
            "jump",
            (),
            f"{growing_output(histories[first.test])} steps by {', '.join(texts)} from "
            f"{times_text(first.previous_time, first.time)}, though the load does not",
            time=first.time,
            jumps=sizes,
            proposal=f"take the step off if the observation moved (a bumped camera or extensometer): "
            f"'steps_taken_off = \"{time_text(first.time)}\"' in tests.toml; cut the frames from then on, or ignore it",
        )


def expansion_flags(history: History) -> Iterator[QualityFlag]:
    """A flag of a test whose strain steps with the temperature, under one load, by what thermal expansion does.

    Each step is the distance of lines through the frames on either side, at both ends of the gap between them, for the
    temperature may have changed at either; the test piece may follow the furnace one frame later.
    """
    name = growing_output(history)
    if not history.outputs or output_named(name, history.specimen).quantity != "strain":
        return
    values, clock, found = history.outputs[name], history.times, dict[float, tuple[float, float]]()
    temperature, parts = history.temperature_program().at(clock), load_segments(history)
    sides = pairwise(part for part in parts if part.frames.size > LINE_FRAMES[0])
    for (before, after), skipped in product(sides, (0, 1)):
        early, late = before.frames[-LINE_FRAMES[1] :], after.frames[skipped : LINE_FRAMES[1] + skipped]
        change, is_far = float(temperature[late[0]] - temperature[early[-1]]), late[0] - early[-1] > LINE_FRAMES[0]
        is_loaded = abs(after.load - before.load) > LOAD_TOLERANCE * before.load
        if is_far or is_loaded or abs(change) <= TEMPERATURE_TOLERANCE:
            continue
        gap = map(float, clock[[early[-1], late[0]]])
        lines = [[extrapolate(clock[k], values[k], time) for k in (early, late)] for time in gap]
        steps = [end[0] - start[0] for start, end in lines]
        noise = max(scatter_about_line(clock[k], values[k]) for k in (early, late))
        error = noise * max((start[1] ** 2 + end[1] ** 2 - 2.0) ** 0.5 for start, end in lines)  # those of the lines
        is_expansion = all(EXPANSION[0] < step / change < EXPANSION[1] for step in steps)
        if is_expansion and min(map(abs, steps)) > EXPANSION_THRESHOLD * error:
            found.setdefault(float(clock[after.frames[0]]), (steps[1], change))
    if found:
        times, (sizes, changes) = list(found), np.array([*found.values()]).T
        at, jumps = "; ".join(map(time_text, times)), ", ".join(f"{size:+.2g}" for size in sizes)
        kelvin, alpha = ", ".join(f"{one:+.3g} K" for one in changes), float(sizes @ changes / (changes @ changes))
        reason = f"{name} steps by {jumps} at {at}, as the temperature does by {kelvin}: thermal expansion"
        advice = f"take off that of the alloy: 'thermal_expansion = \"{alpha:.2g} 1/K\"' in tests.toml"
        reason, first = f"{reason} of about {alpha:.2g}/K, which is no creep", {history.name: float(sizes[0])}
        yield QualityFlag((history.name,), "jump", (), reason, time=times[0], jumps=first, proposal=advice)


def record_flags(history: History) -> Iterator[QualityFlag]:
    """Flags of records of load or temperature that are off what was stated of the test."""
    times = history.times[history.used]
    for quantity, stated in history.stated.items():
        is_temperature = quantity == "temperature"
        record = history.temperature_program() if is_temperature else history.loading.program()
        wanted = stated.at(times)
        limit = TEMPERATURE_TOLERANCE if is_temperature else LOAD_TOLERANCE * float(stated.values.max())
        difference = running_median(record.at(times) - wanted)
        off = np.flatnonzero(np.abs(difference) > limit)
        if not off.size:
            continue
        worst = int(np.argmax(np.abs(difference)))
        unit, name, time = ("K" if is_temperature else "MPa"), history.name, float(times[off[0]])
        text = (
            f"the recorded {quantity} is off the stated one by more than {limit:g} {unit} in {off.size} of "
            f"{times.size} frames, first at {time_text(time)}; most at {time_text(float(times[worst]))}, "
            f"by {difference[worst]:+.3g} {unit}"
        )
        yield QualityFlag(
            (name,),
            "record",
            (),
            text,
            time=time,
            proposal="the record is what simulations use: ignore this if it is right; if the sensor is wrong, remove "
            f"its column; if the control failed, cut the frames from {time_text(time)} on",
        )


def _size_text(history: History, value: float) -> str:
    output = output_named(growing_output(history), history.specimen)
    return f"{value:.2g} {output.unit}" if output.unit else f"{value:.2g} of {output}"
