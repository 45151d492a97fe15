"""Whether a test shows tertiary or primary creep: whether its rate rises, or falls, by more than noise can do.

Under one load creep strain without tertiary creep is concave in time: its rate falls or is constant. Of the parabola
fitted by least squares to a part of a concave curve the curvature is then negative or zero, whatever that curve is
(the weights of its curvature are those of a mean of second derivatives). Its estimate over its standard deviation
therefore has Student's distribution at most. Noise is what a polynomial of the fourth degree leaves, correlated from
mean to mean of neighbouring frames as an AR(1) process, whose correlation is corrected for the fit. Noise that is
correlated over a large part of the test cannot be told from creep, and a rate that rises and falls within a quarter of
a test is missed where that polynomial does not follow it: tests/unit/quality/test_curve_shapes.py says what was
measured. Where the rate falls, time is convex over strain, which is judged alike.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.stats import t as student

from creepkit.arrays import Floats, Ints
from creepkit.limits import SIGNIFICANCE
from creepkit.quality.frames import block_means, load_segments
from creepkit.records import History, growing_output
from creepkit.records.loading import held_of
from creepkit.records.reading_noise import noise_of_readings

LEAST_RISE = 1.5
"""Rate at the end over the smallest, of the fitted curve, from which on it is called tertiary creep."""


PARTS = ((0.0, 1.0), (0.25, 1.0), (0.5, 1.0), (0.7, 1.0), (0.0, 0.6), (0.2, 0.8))
"""Parts of a curve in which its rate is judged, over its duration: a rate that rises may fall again later."""


PARTS_OF_STRAIN = tuple((0.0, end) for end in (1.0, 0.5, 0.3, 0.15, 0.08, 0.04))
"""Parts in which a rate may fall, over the growth of the output: primary creep comes first, and is short in time."""


CLEAR = 20.0
"""Standard deviations of a reading that the output grows in a part at least, where time is judged over the output."""


LARGEST_STRAIN = 2.0
"""Up to which loss of section is taken into account; beyond it readings are none."""


LEAST_RECOVERY, RECOVERED = 1e-3, 5.0
"""Share of the range of the readings, and standard deviations of one, that a mean of three falls by in recovery."""


STEEP, LAST_FRAMES = 2.0, 5
"""Slope of ln output over ln time from which on a curve runs away, and the frames at its end that tell."""


CUT_LABEL = "cut at strain"
"""Label of a history whose later frames were left out."""


EARLY, FIRST_RISE = 1 / 3, 1.2
"""Share of the time within which a rate may fall at first; and the rate there over that of the line behind it."""


FEWEST_FRAMES = 12
"""Of a part that is judged."""


FEWEST_READINGS, RISE_OF_FEW = 5, 2.0
"""Of a curve of fewer readings: of what is judged at all, and the last rate over the mean one before."""


MOST_MEANS = 25
"""Means over neighbouring frames of a part: what is correlated over shorter times is then nearly independent."""


def shows_tertiary_creep(history: History, exponent: float = 0.0) -> bool:
    """Whether the rate of the output that grows rises under the last load by LEAST_RISE and by more than noise.

    exponent : of stress, where it is known: under a constant load the true stress grows as exp(strain), and the rate
    as exp(exponent strain), which is no tertiary creep of the material.
    """
    segments = load_segments(history)
    if not segments or not segments[-1].load_increased:
        return False
    times, values = _curve(history, segments[-1].frames)
    if exponent > 0.0 and history.loading.quantity == "stress" and held_of(history.loading) == "load":
        values = np.log1p(values) if history.strain_measure == "engineering" else values
        speed = np.exp(exponent * np.clip(values, 0.0, LARGEST_STRAIN))
        times = times[0] + np.append(0.0, np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(times)))
    if not np.ptp(times) > 0 or values[-1] < values[0]:
        return False
    return _rises_to_the_end(times, values) if times.size < FEWEST_FRAMES else _rises_in_a_part(times, values, PARTS)


def runs_away(history: History) -> bool:
    """Whether tertiary creep ends so steeply that a few per cent of rate are twice as many of the output.

    There ln output over ln time has a slope above STEEP in the last frames. A curve that was cut at a strain does not.
    """
    if CUT_LABEL in history.labels or not shows_tertiary_creep(history):
        return False
    times, values = _curve(history, load_segments(history)[-1].frames[-LAST_FRAMES:])
    positive = (times > 0) & (values > 0)
    return bool(positive.sum() > 2 and np.polyfit(np.log(times[positive]), np.log(values[positive]), 1)[0] > STEEP)


def shows_primary_creep(history: History) -> bool:
    """Whether the rate of the output that grows falls under the first load by LEAST_RISE and by more than noise."""
    segments = load_segments(history)
    if not segments or not segments[0].is_first:
        return False
    times, values = _curve(history, segments[0].frames)
    if not np.ptp(times) > 0 or not values[-1] > values[0]:
        return False
    least = CLEAR * noise_of_readings(values) / float(np.ptp(values))
    parts = [part for part in PARTS_OF_STRAIN if part[1] > least or part in PARTS_OF_STRAIN[:3]]
    return _rises_in_a_part(values, times, parts) or _falls_at_first(times, values)


def shows_recovery(history: History) -> bool:
    """Whether a bar shortens, by more than noise, under a tension to which its stress has fallen, or none."""
    if history.loading.quantity != "stress":
        return False
    least = LEAST_RECOVERY * float(np.ptp(history.outputs[growing_output(history)][history.used]))
    for segment in load_segments(history):
        times, values = _curve(history, segment.frames)
        means = np.convolve(values, np.full(3, 1.0 / 3.0), "valid") if values.size > 3 else values[:0]
        fallen = not segment.load_increased and segment.load >= 0.0 and means.size > 0
        if fallen and means[0] - means.min() > max(least, RECOVERED * noise_of_readings(values, times)):
            return True
    return False


def falls_logarithmically(history: History) -> bool:
    """Whether the output grows under the first load by ln(1 + t/t_0) rather than by t^m or an exponential and a line.

    By BIC of least squares, each with a strain of loading.
    """
    if not shows_primary_creep(history):
        return False
    times, values = _curve(history, load_segments(history)[0].frames)
    x = (times / times[-1])[:, None]
    starts, powers = np.geomspace(1e-4, 3.0, 40), np.linspace(0.02, 0.98, 49)
    shapes = [
        [np.log1p(x / t) for t in starts],
        [x**m for m in powers],
        [np.hstack([np.exp(-x / t), x]) for t in starts],
    ]
    scores = []
    for shape in shapes:
        columns = [np.hstack([np.ones_like(x), one]) for one in shape]
        left = min(float(((one @ np.linalg.lstsq(one, values)[0] - values) ** 2).sum()) for one in columns)
        scores.append(x.size * np.log(max(left, 1e-300)) + columns[0].shape[1] * np.log(x.size))
    return bool(scores[0] < min(scores[1:]))


def _falls_at_first(times: Floats, values: Floats) -> bool:
    """Whether the first rate is FIRST_RISE times the later one, and the second reading below the line of later ones.

    By more than chance: the first reading alone may be before the load. A line through the last two thirds of the time.
    """
    later = times > times[0] + EARLY * np.ptp(times)
    if later.sum() < FEWEST_FRAMES or later[1]:
        return False
    (slope, level), covariance = np.polyfit(times[later], values[later], 1, cov=True)
    variance = covariance[0, 0] * times[1] ** 2 + 2.0 * covariance[0, 1] * times[1] + covariance[1, 1]
    noise = float(np.var(values[later] - level - slope * times[later], ddof=2))
    below = level + slope * times[1] - values[1]
    first = (values[1] - values[0]) / (times[1] - times[0])
    limit = float(student.isf(SIGNIFICANCE, int(later.sum()) - 2)) * np.sqrt(variance + noise)
    return bool(slope > 0.0 and first > FIRST_RISE * slope and below > limit)


def _curve(history: History, frames: Ints) -> tuple[Floats, Floats]:
    """Times and values of the output that grows."""
    return history.times[frames], history.outputs[growing_output(history)][frames]


def _rises_to_the_end(x: Floats, y: Floats) -> bool:
    """Whether the rate of few readings rises over the last two of their intervals, above the mean one before.

    Of 4000 steady curves of 5 to 11 readings with a noise of 1, 2 and 5 % of the last reading 0, 0 and 1.2 % do.
    """
    apart = np.append(True, np.diff(x) > 0)
    x, y = x[apart], y[apart]
    if x.size < FEWEST_READINGS:
        return False
    before = (y[-3] - y[0]) / (x[-3] - x[0])
    last_but_one, last = np.diff(y[-3:]) / np.diff(x[-3:])
    return bool(last > last_but_one > before and last > RISE_OF_FEW * before > 0)


def _rises_in_a_part(x: Floats, y: Floats, parts: Sequence[tuple[float, float]]) -> bool:
    """Whether the slope of y over x rises in some of the parts of the range of x."""
    places = (x - x[0]) / np.ptp(x)
    masks = [(places >= start) & (places <= end) for start, end in parts]
    known = [(places[mask], y[mask]) for mask in masks if mask.sum() >= FEWEST_FRAMES]
    return any(_rises(x, y, SIGNIFICANCE / len(known)) for x, y in known)


def _rises(x: Floats, y: Floats, significance: float) -> bool:
    """Whether the slope of y over x rises by more than chance, and by LEAST_RISE."""
    x, y = block_means(MOST_MEANS, x, y)
    x = 2.0 * (x - x[0]) / np.ptp(x) - 1.0
    parabola = np.linalg.lstsq(np.vander(x, 3), y, rcond=None)[0]
    curvature, slope = parabola[:2]
    if curvature <= 0 or slope + 2 * curvature < LEAST_RISE * (slope - 2 * curvature):
        return False
    weights = np.linalg.pinv(np.vander(x, 3))[0]
    flexible = np.vander(x, 5)
    left = y - flexible @ np.linalg.lstsq(flexible, y, rcond=None)[0]
    freedom = x.size - flexible.shape[1]
    smallest = 1e-9 * float(np.ptp(y))
    variance = max(float((left**2).sum()) / freedom, smallest**2)
    correlation = _correlation(left, flexible.shape[1])
    lags = np.abs(np.subtract.outer(np.arange(x.size), np.arange(x.size)))
    covariance = correlation**lags
    projection = np.eye(x.size) - flexible @ np.linalg.pinv(flexible)
    share = float(np.trace(projection @ covariance)) / freedom
    sd = float(np.sqrt(weights @ covariance @ weights * variance / share))
    effective = freedom * (1.0 - correlation) / (1.0 + correlation)
    return bool(curvature / sd > student.isf(significance, max(effective, 2.0)))


def _correlation(left: Floats, unknowns: int) -> float:
    """Of neighbours, from what a fit with so many unknowns leaves; a fit makes it appear smaller."""
    variance = float((left**2).sum())
    r = float((left[1:] * left[:-1]).sum()) / variance if variance > 0 else 0.0
    return float(np.clip((r + unknowns / left.size) / (1.0 - unknowns / left.size), 0.0, 0.9))
