"""Frames of doubtful quality by the history alone: unloading, a decreasing creep output, single outliers."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from creepkit.arrays import Bools, Floats, Ints
from creepkit.quality.flags import QualityFlag
from creepkit.records import History, growing_output, output_named
from creepkit.records.reading_noise import noise_of_readings
from creepkit.records.recorded_programs import running_median
from creepkit.records.units import time_text, times_text

OUTLIER_THRESHOLD = 6.0
"""Robust standard deviations by which a single frame must differ from its neighbours: 2 in 1e9 of Gaussian noise do."""


FEW_FRAMES_CORRECTION = 10.0
"""The threshold is OUTLIER_THRESHOLD (1 + this / frames): few frames say little about their own noise."""


DECREASE_FRACTION = 0.02
"""Fraction of the largest value: less can be drift of instruments; a loaded dimple or bar does not recover at all."""


DECREASE_THRESHOLD = 6.0
"""Standard deviations that a fall must have at least."""


END_FIT_FRAMES, END_THRESHOLD, MOST_UNLOADING_FRAMES = 12, 4.0, 5
"""Frames through which a line predicts the end, standard deviations of it that an unloading falls short, the most
frames that it may have: 1 in 3e4 ends of Gaussian noise fall as much.
"""


FRACTURE_FACTOR, FRACTURE_FRACTION, LEAST_WAIT = 4.0, 0.2, 1e-3
"""Times the most growth that the frames before lead to, and fraction of all of it, of a growth after fracture; how
near to the singularity of accelerating creep, of the time between two readings, a reading is taken by chance. Of 6000
planted curves to rupture 8 were flagged, and 90 % of those whose last row jumped by one to four times its value.
"""


FEWEST_FRAMES = 12
"""Frames under one load below which nothing is said of noise."""


LOAD_TOLERANCE, TEMPERATURE_TOLERANCE = 0.01, 2.0
"""Relative change of the load, and K, that begin a new part of a test."""


OPPOSITE_NEIGHBOUR_FRACTION = 0.3
"""Fraction of a frame's residual that its neighbours must have with the other sign if it is to be a single outlier."""


STEP_FRACTION = 0.4
"""Fraction of a frame's residual that one beside it has without it where the curve steps there: then nearly all."""


TIES = 0.1
"""Fraction of readings that are the same as those before, above which the readings are rounded."""


ROUNDING_FRACTION, SHAPE_FRACTION = 0.5, 1e-5
"""Fractions of the step to which values are rounded, and of their range, below which noise cannot be seen."""


_MOST_OUTLIERS = 0.05
"""Largest fraction of frames that are outliers; more are not outliers."""


class LoadSegment(NamedTuple):
    """Frames under one load and temperature.

    frames : (n,) positions in the history. load : MPa. load_increased : whether it is at least the load before.
    is_first : whether the segment is the first of the test.
    """

    frames: Ints
    load: float
    load_increased: bool
    is_first: bool


def grows(history: History) -> bool:
    """Whether the leading output grows with creep under a load; the stress of a relaxing bar falls, and should."""
    return output_named(growing_output(history), history.specimen).grows if history.outputs else False


def fracture_frames(history: History) -> Iterator[QualityFlag]:
    """The last frames, from a growth on that no acceleration of the creep before leads to: a piece is broken."""
    segments = load_segments(history) if grows(history) else []
    if not segments or segments[-1].frames.size <= FEWEST_FRAMES:
        return
    frames, jumps = segments[-1].frames, list[tuple[float, int, float, float]]()
    t, y = history.times[frames], history.outputs[growing_output(history)][frames]
    for first in range(max(t.size - MOST_UNLOADING_FRAMES, FEWEST_FRAMES), t.size):
        sigma = noise_standard_deviation(t[:first], y[:first])
        most = _most_growth(t[:first], y[:first], float(t[first]), sigma)
        growth = float(y[first] - y[first - 1])
        if growth > FRACTURE_FRACTION * float(np.ptp(y[:first])):
            jumps.append((growth / (most + END_THRESHOLD * sigma), first, growth, most))
    factor, first, growth, most = max(jumps, default=(0.0, 0, 0.0, 0.0))
    if factor > FRACTURE_FACTOR:
        reason = (
            f"at {time_text(float(t[first]))} {_difference_text(history, growth)} above the frame before, and "
            f"{_difference_text(history, most)} at most is what the creep before leads to: read after fracture"
        )
        yield QualityFlag.of_frames(history, "fracture", frames[first:], reason)


def _most_growth(t: Floats, y: Floats, time: float, sigma: float) -> float:
    """Growth from the last frame to a later time, s, if 1 over the rate goes on to fall as it did: to infinite strain.

    Tertiary creep to a finite strain grows less. t, y : (frames,). Rates are those of the fewest last intervals over
    which the output grows beyond its noise sigma, and of as many before.
    """
    for count in range(1, t.size // 2):
        late, early = y[-1] - y[-1 - count], y[-1 - count] - y[-1 - 2 * count]
        if min(late, early) > END_THRESHOLD * sigma or count == MOST_UNLOADING_FRAMES:
            break
    late = max(late, 0.0) + 2.0 * sigma
    early = max(early - 2.0 * sigma, 1e-3 * late)
    span, before = t[-1] - t[-1 - count], t[-1 - count] - t[-1 - 2 * count]
    slowness, wait = span / late, time - float(t[-1])
    fall = 2.0 * (before / early - slowness) / (span + before)
    if fall <= 0.0:
        return float(wait / slowness)
    left = slowness / fall - 0.5 * span
    return float(np.log(left / max(left - wait, LEAST_WAIT * wait)) / fall) if left > 0.0 else float("inf")


def unloading_frames(history: History) -> Iterator[QualityFlag]:
    """Frames after the end of the test, and a sudden fall in its last used frames."""
    if not grows(history):
        return
    usable = np.flatnonzero(history.used & _has_value(history))
    later_frames = np.flatnonzero(~history.used)
    later_frames = later_frames[later_frames > usable[-1]] if usable.size else later_frames[:0]
    if later_frames.size and "frames_after_end" in history.labels:
        reason = f"from {time_text(float(history.times[later_frames[0]]))} on, after the end of the test"
        yield QualityFlag.of_frames(history, "unloading", later_frames, reason)
    segments = [part for part in load_segments(history) if part.frames.size > FEWEST_FRAMES]
    if segments and segments[-1].frames[-1] == usable[-1]:
        yield from _unloaded_end(history, segments[-1].frames)


def _unloaded_end(history: History, frames: Ints) -> Iterator[QualityFlag]:
    t, y = history.times[frames], history.outputs[growing_output(history)][frames]
    sigma = noise_standard_deviation(t, y)
    for count in range(min(MOST_UNLOADING_FRAMES, frames.size - FEWEST_FRAMES), 0, -1):
        before = slice(max(frames.size - count - END_FIT_FRAMES, 0), frames.size - count)
        expected, standard_error = extrapolate(t[before], y[before], t[-count])
        sigma = max(sigma, scatter_about_line(t[before], y[before]))  # noise may grow with the output
        shortfall = expected - y[-count]
        if shortfall > END_THRESHOLD * sigma * standard_error and (y[-count:] < y[-count - 1] - sigma).all():
            reason = (
                f"at {time_text(float(t[-count]))} {_difference_text(history, shortfall)} below what the "
                f"{END_FIT_FRAMES} frames before it lead to, "
                f"{shortfall / sigma:.0f} times the noise: the load was taken off"
            )
            yield QualityFlag.of_frames(history, "unloading", frames[-count:], reason)
            return


def scatter_about_line(t: Floats, y: Floats) -> float:
    """Standard deviation of y (frames,) about a line in t (frames,), in the unit of y."""
    residuals = y - np.polyval(np.polyfit(t - t[0], y, 1), t - t[0])
    return float(np.sqrt((residuals**2).sum() / max(t.size - 2, 1)))


def extrapolate(t: Floats, y: Floats, time: float) -> tuple[float, float]:
    """A line through frames, at a later time, and the standard deviation of y less it over that of y.

    t, y : (frames,) s, and the output's unit.
    """
    mean_time, time_variation = t.mean(), float(((t - t.mean()) ** 2).sum())
    slope = float(((t - mean_time) * (y - y.mean())).sum()) / time_variation
    return float(y.mean()) + slope * (time - mean_time), float(
        np.sqrt(1 + 1 / t.size + (time - mean_time) ** 2 / time_variation)
    )


def decreasing_frames(history: History) -> Iterator[QualityFlag]:
    """Frames of a part in which the amplitude falls though the load is held or was raised.

    They begin at the highest frame; after a raise of the load with the raise, for whatever makes a dimple or a bar fall
    under a larger load was there from then on.
    """
    if not grows(history):
        return
    for segment in load_segments(history):
        if segment.frames.size < FEWEST_FRAMES or not segment.load_increased:
            continue
        t, y = history.times[segment.frames], history.outputs[growing_output(history)][segment.frames]
        smoothed, noise = running_median(y), noise_standard_deviation(t, y)
        highest = int(np.argmax(smoothed))
        decrease = float(smoothed[highest] - smoothed[highest:].min())
        if decrease > max(DECREASE_THRESHOLD * noise, DECREASE_FRACTION * float(np.abs(smoothed).max())):
            lowest = highest + int(np.argmin(smoothed[highest:]))
            change = "is held at" if segment.is_first else "was raised to"
            load_text = f"{history.loading.quantity} {change} {segment.load:g} MPa"
            reason = (
                f"falls by {_difference_text(history, decrease)} from "
                f"{times_text(float(t[highest]), float(t[lowest]))}, "
                f"{decrease / noise:.0f} times the noise, though the {load_text}"
            )
            falling = segment.frames[highest if segment.is_first else 0 :]
            yield QualityFlag.of_frames(history, "falling", falling, reason)


def outlier_frames(history: History) -> Iterator[QualityFlag]:
    """Single frames that miss the cubic through their four neighbours, largest first."""
    for segment in load_segments(history):
        frames, values = segment.frames, history.outputs[growing_output(history)]
        if frames.size < FEWEST_FRAMES:
            continue
        sigma = noise_standard_deviation(history.times[frames], values[frames])
        for _ in range(int(_MOST_OUTLIERS * segment.frames.size) + 1):
            if frames.size < FEWEST_FRAMES:
                break
            residuals, residual_scale = _interpolation_residuals(history.times[frames], values[frames])
            standardised = np.where(
                _isolated(residuals), np.abs(residuals) / np.maximum(_local_scale(residuals), sigma), 0.0
            )
            standardised[standardised <= OUTLIER_THRESHOLD * (1 + FEW_FRAMES_CORRECTION / frames.size)] = 0.0
            for k in np.flatnonzero(standardised):
                kept = np.delete(frames, k + 2)
                left = _interpolation_residuals(history.times[kept], values[kept])[0][max(k - 2, 0) : k + 2]
                if np.abs(left).max() > STEP_FRACTION * abs(residuals[k]):
                    standardised[k] = 0.0  # its neighbour is off without it, too
            worst = int(np.argmax(standardised))
            if not standardised[worst]:
                break
            deviation_text = _difference_text(history, float(residuals[worst] * residual_scale[worst]))
            frame = int(frames[worst + 2])
            reason = (
                f"at {time_text(float(history.times[frame]))} off its neighbours by {deviation_text}, "
                f"{standardised[worst]:.0f} times the noise"
            )
            yield QualityFlag.of_frames(history, "outlier", [frame], reason)
            frames = np.delete(frames, worst + 2)


def block_means(most: int, *series: Floats) -> tuple[Floats, ...]:
    """At most so many means over neighbouring frames of each of the series (frames,)."""
    if series[0].size <= most:
        return series
    edges = np.linspace(0, series[0].size, most + 1).astype(int)
    return tuple(np.add.reduceat(values, edges[:-1]) / np.diff(edges) for values in series)


def load_segments(history: History) -> list[LoadSegment]:
    """The used and measured frames, by load and temperature."""
    frames = np.flatnonzero(history.used & _has_value(history) & (history.times > 0))
    if not frames.size:
        return []
    load = history.loading.program().at(history.times[frames])
    temperature = history.temperature_program().at(history.times[frames])
    is_new = (np.abs(np.diff(load)) > LOAD_TOLERANCE * load.max()) | (
        np.abs(np.diff(temperature)) > TEMPERATURE_TOLERANCE
    )
    edges = np.flatnonzero(np.concatenate([[True], is_new, [True]]))
    segments = []
    for first, end in pairwise(edges):
        load_increased = bool(first == 0 or load[first] >= load[first - 1])
        segments.append(LoadSegment(frames[first:end], float(load[first]), load_increased, bool(first == 0)))
    return segments


def noise_standard_deviation(times: Floats, values: Floats) -> float:
    """Standard deviation of white noise (see records.reading_noise), but no less than can be seen of it.

    times : (frames,) s. values : (frames,) mm or strain, whose unit the result has.
    """
    least = max(SHAPE_FRACTION * float(np.ptp(values)), 1e-12)
    return max(noise_of_readings(values, times, order=3), ROUNDING_FRACTION * rounding_step(values), least)


def rounding_step(values: Floats) -> float:
    """The step to which readings are rounded, in their unit; 0 where few are the same as those before.

    values : (readings,).
    """
    steps = np.abs(np.diff(values))
    is_rounded = steps.size > 0 and 1.0 > (steps == 0.0).mean() > TIES
    return float(steps[steps > 0.0].min()) if is_rounded else 0.0


def _interpolation_residuals(times: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Standardised residuals from the cubic of the neighbours, and their scale, (n - 4,) each; outer frames have none.

    The cubic is one in time or in its logarithm, whichever fits better: some tests are read evenly, some over decades.
    """
    results = [_cubic_residuals(x, values) for x in (times, np.log(times))]
    return min(results, key=lambda pair: float(np.median(np.abs(pair[0]))))


def _cubic_residuals(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    neighbour_times = np.stack([x[:-4], x[1:-3], x[3:-1], x[4:]])
    centre_times, neighbour_values = x[2:-2], np.stack([y[:-4], y[1:-3], y[3:-1], y[4:]])
    weights = np.ones_like(neighbour_times)
    for a in range(4):
        for b in range(4):
            if a != b:
                weights[a] *= (centre_times - neighbour_times[b]) / (neighbour_times[a] - neighbour_times[b])
    residual_scale = np.sqrt(1.0 + (weights**2).sum(axis=0))
    return np.asarray((y[2:-2] - (weights * neighbour_values).sum(axis=0)) / residual_scale), residual_scale


def _local_scale(residuals: Floats) -> Floats:
    """The size of misses about each frame, without it and its neighbours: large where a curve bends sharply."""
    padded = np.pad(np.abs(residuals), 7, constant_values=np.nan)
    beside = np.r_[0:5, 10:15]  # from seven to three frames before and after
    windows = np.sort(np.lib.stride_tricks.sliding_window_view(padded, 15)[:, beside], axis=1)  # no frames come last
    count, row = (~np.isnan(windows)).sum(axis=1), np.arange(len(windows))
    return np.asarray(1.4826 * 0.5 * (windows[row, (count - 1) // 2] + windows[row, count // 2]))


def _isolated(residuals: Floats) -> Bools:
    """Where a single frame is off: its neighbours then miss the other way, by 2/3 of it when evenly spaced.

    Where a curve bends too sharply for cubics they miss the same way.
    """
    neighbours = -np.sign(residuals)[:, None] * np.stack([np.roll(residuals, 1), np.roll(residuals, -1)], axis=1)
    neighbours[0, 0] = neighbours[-1, 1] = np.inf
    return np.asarray((neighbours > OPPOSITE_NEIGHBOUR_FRACTION * np.abs(residuals)[:, None]).all(axis=1))


def _has_value(history: History) -> Bools:
    """(frames,) where the leading output has a number."""
    name = growing_output(history)
    return np.isfinite(history.outputs[name]) if name else np.zeros(history.times.size, bool)


def _difference_text(history: History, value: float) -> str:
    """A difference of the leading output in words."""
    output = output_named(growing_output(history), history.specimen)
    return f"{1e3 * value:.3g} um" if output.unit == "mm" else f"{value:.2g} {output.unit}".strip() + f" of {output}"
