"""What happened in several tests at one clock time: changes of the creep rate, and steps of an output.

Changes of rate under one load that follow from a law (hardening, softening, an exponent that drifts) are smooth, and
each test's own spline takes them up; changes with the load are not looked for. What is left is scored, test by test,
and the scores at one time are combined with the weights of the best estimate of one common factor.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc

from creepkit.arrays import Floats
from creepkit.quality.comparison import duplicate_tests
from creepkit.quality.frames import FEWEST_FRAMES, load_segments
from creepkit.quality.smooth_curve import RateStep, SmoothCurve, robust_spread, smooth_curve
from creepkit.records import History, growing_output

CHANGE_THRESHOLD = 6.0
"""Combined score from which a change of rate is reported. Normal numbers at 100 times reach 5 once in 20,000 plates;
what is left of correlated noise and of laws that bend sharply asks for more (docs/measured/common_events.md)."""


OTHERS_THRESHOLD = 2.33
"""Combined score that the tests without the one that says most must reach by themselves: 1 % by chance."""


SHOWN_THRESHOLD = 1.645
"""Standard deviations of ln of its factor from which a test is said to show a change known from all of them: 5 %."""


ELASTIC_JUMP_THRESHOLD = 4.0
"""Standard deviations from which a step of the value is believed beside a change of rate."""


LEAST_FACTOR = 1.1
"""Smallest factor of the rate, in the median of the tests that show it, that is reported: about 2 K."""


JUMP_THRESHOLD, FEW_POINTS_CORRECTION = 7.0, 10.0
"""Standard deviations of a step of the value; the threshold is this times (1 + correction / points)."""


MOST_CHANGES, MOST_TIMES = 3, 300
"""Changes looked for in a group of tests, or in a part of one test; times at which changes of rate are sought."""


SAME_TIMES_FRACTION = 0.8
"""Fraction of the frames of two tests that were taken at the same times, if one clock is to be supposed."""


TIME_UNCERTAINTY = 3.84
"""Loss of the squared combined score up to which another time is as good: 95 % of one parameter."""


@dataclass(frozen=True)
class Jump:
    """A step of the leading output of one test between two frames: time, s; size, in its unit, over the noise."""

    test: int
    time: float
    previous_time: float
    size: float
    score: float


@dataclass(frozen=True)
class CommonRateChange:
    """A change of the creep rate at one time in several tests.

    time : s. earliest, latest : s, times that explain it as well. steps : {test: its step}, of the tests loaded alike
    before and after. shown : those whose own score shows it. score : combined, in standard deviations. jump, jump_sd :
    mean of the steps of the value over those that show it, and its standard deviation, in the unit of the output.
    """

    time: float
    earliest: float
    latest: float
    steps: Mapping[int, RateStep]
    shown: tuple[int, ...]
    score: float
    jump: float
    jump_sd: float

    @property
    def has_jump(self) -> bool:
        """Whether the value steps as well, the way that the rate does, as it would with a step of the load."""
        return bool(np.sign(self.score) * self.jump > ELASTIC_JUMP_THRESHOLD * self.jump_sd)

    @property
    def same_factor(self) -> bool:
        """Whether one factor on the rate explains the tests that show it, at 5 %."""
        logs = np.array([self.steps[k].log_factor for k in self.shown])
        sd = np.array([self.steps[k].log_factor_sd for k in self.shown])
        mean = float((logs / sd**2).sum() / (1 / sd**2).sum())
        return bool(chdtrc(max(logs.size - 1, 1), (((logs - mean) / sd) ** 2).sum()) > 0.05)


@dataclass(frozen=True, eq=False)
class _Part:
    """One part of a test under one load, with its curve."""

    test: int
    curve: SmoothCurve


def find_jumps(histories: Sequence[History]) -> list[Jump]:
    """Steps of the leading output without a step of the load, in any test by itself."""
    results = []
    for k, history in enumerate(histories):
        for times, values, start in _parts(history):
            shifts: list[float] = []
            for _ in range(MOST_CHANGES):
                curve = smooth_curve(times, values, start, level_shifts=shifts)
                gaps, scores, sizes = curve.level_shift_scores()
                worst = int(np.argmax(np.abs(scores))) if scores.size else 0
                threshold = JUMP_THRESHOLD * (1 + FEW_POINTS_CORRECTION / curve.times.size)
                if not scores.size or abs(scores[worst]) < threshold:
                    break
                after = int(np.searchsorted(curve.times, gaps[worst]))
                shifts.append(float(gaps[worst]))
                if _stands_out(curve, after, float(sizes[worst])):
                    between = (float(curve.times[after]), float(curve.times[after - 1]))
                    results.append(Jump(k, *between, float(sizes[worst]), float(scores[worst])))
    return results


def common_rate_changes(histories: Sequence[History], jumps: Sequence[Jump] = ()) -> list[CommonRateChange]:
    """Changes of rate at one time in the tests of a kind of specimen, the clearest first; jumps : those known."""
    results = []
    for group in _tests_together(histories):
        changes: list[float] = []
        while len(group) > 1 and len(changes) < MOST_CHANGES:
            parts = [part for k in group for part in _fitted_parts(k, histories[k], jumps, changes)]
            change = _clearest_change(parts)
            if change is None:
                break
            results.append(_with_known_jumps(change, jumps))
            changes.append(change.time)
    return results


def _tests_together(histories: Sequence[History]) -> list[list[int]]:
    """Groups of tests of one kind that were observed at the same times for the most part: one rig, one clock."""
    groups: list[list[int]] = []
    repeated = {second for _, second in duplicate_tests(histories)}
    for k, history in enumerate(histories):
        if not history.used.any() or history.name in repeated:
            continue
        group = next((g for g in groups if _same_clock(histories[g[0]], history)), None)
        groups.append([k]) if group is None else group.append(k)
    return groups


def _same_clock(one: History, two: History) -> bool:
    if (one.specimen, growing_output(one)) != (two.specimen, growing_output(two)):
        return False
    a, b = (h.times[h.used] for h in (one, two))
    end = min(a[-1], b[-1])
    a, b = a[a <= end], b[b <= end]
    nearest = np.abs(a[:, None] - b[None, :]).min(axis=1, initial=np.inf)
    return bool((nearest < 1e-3 * end / max(a.size, b.size)).sum() >= SAME_TIMES_FRACTION * min(a.size, b.size))


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


def _fitted_parts(test: int, history: History, jumps: Sequence[Jump], changes: Sequence[float]) -> list[_Part]:
    results = []
    for times, values, start in _parts(history):
        shifts = [0.5 * (j.time + j.previous_time) for j in jumps if j.test == test and times[0] < j.time <= times[-1]]
        known = [time for time in changes if times[1] < time < times[-2]]
        results.append(_Part(test, smooth_curve(times, values, start, level_shifts=shifts, slope_changes=known)))
    return results


def _stands_out(curve: SmoothCurve, after: int, size: float) -> bool:
    """Whether the mean slope over a gap is beyond those of the gaps around it by at least half of the step.

    Where a curve bends sharply between few points, a step seems to fit and yet the slopes only follow one another.
    """
    slopes = np.diff(curve.values) / np.diff(curve.times)
    around = np.delete(slopes[max(after - 3, 0) : after + 2], min(after - 1, 2))
    limit = around.max() if size > 0 else around.min()
    gap = float(curve.times[after] - curve.times[after - 1])
    return bool(np.sign(size) * (slopes[after - 1] - limit) * gap > 0.5 * abs(size))


def _clearest_change(parts: Sequence[_Part]) -> CommonRateChange | None:
    """The change of rate that the parts of different tests agree on most; None where that may be chance."""
    times = np.unique(np.concatenate([part.curve.times for part in parts] or [np.zeros(0)]))
    if times.size > MOST_TIMES:
        times = times[np.linspace(0, times.size - 1, MOST_TIMES).astype(int)]
    if not times.size:
        return None
    scores, weights = _scores(parts, times)
    combined = _combined(scores, weights)
    if not np.isfinite(combined).any():
        return None
    best = int(np.nanargmax(np.abs(combined)))
    if abs(combined[best]) < CHANGE_THRESHOLD:
        return None
    # How far scores spread by chance is seen when the change itself is part of the curves.
    changed = [_with_change(part, float(times[best])) for part in parts]
    remaining, precisions = _scores(changed, times)
    inflation = [part.curve.autocorrelation_inflation() for part in changed]
    spreads = np.array([max(r, robust_spread(row)) for r, row in zip(inflation, remaining, strict=True)])[:, None]
    spread = max(1.0, robust_spread(_combined(remaining / spreads, precisions / spreads)))
    scores, weights = scores / (spreads * spread), weights / spreads
    combined = _combined(scores, weights)
    best = int(np.nanargmax(np.abs(combined)))
    sign = float(np.sign(combined[best]))
    clearest = int(np.nanargmax(sign * scores[:, best] * weights[:, best]))
    others = np.isfinite(scores[:, best]) & (np.arange(len(parts)) != clearest)
    score_of_others = (
        sign * float((scores * weights)[others, best].sum()) / float(np.hypot.reduce(weights[others, best]))
    )
    if abs(combined[best]) < CHANGE_THRESHOLD or score_of_others < OTHERS_THRESHOLD:
        return None
    as_good = np.nan_to_num(sign * combined) ** 2 * (sign * combined > 0) > combined[best] ** 2 - TIME_UNCERTAINTY
    as_good[[0, -1]] = False
    first, last = best - int(np.argmin(as_good[best::-1])), best + int(np.argmin(as_good[best:]))
    span = (float(times[first]), float(times[last]))
    return _change_at(parts, float(times[best]), span, float(combined[best]))


def _with_known_jumps(change: CommonRateChange, jumps: Sequence[Jump]) -> CommonRateChange:
    """The change with the steps of the value that were found beforehand in two or more tests at its time."""
    sizes = [
        j.size
        for j in jumps
        if j.test in change.shown and j.previous_time <= change.latest and j.time >= change.earliest
    ]
    if len(sizes) < 2:
        return change
    return replace(change, jump=float(np.mean(sizes)), jump_sd=float(np.std(sizes, ddof=1) / len(sizes) ** 0.5))


def _scores(parts: Sequence[_Part], times: Floats) -> tuple[Floats, Floats]:
    """(parts, times) scores of a change of the slope and the precisions of ln of its factor."""
    scores, precisions = zip(*(part.curve.slope_change_scores(times) for part in parts), strict=True)
    return np.array(scores), np.array(precisions)


def _with_change(part: _Part, time: float) -> _Part:
    curve = part.curve
    if not curve.covers(np.array([time]))[0]:
        return part
    changes = (*curve.slope_changes, time)
    return _Part(
        part.test,
        smooth_curve(curve.times, curve.values, curve.start, level_shifts=curve.level_shifts, slope_changes=changes),
    )


def _combined(scores: Floats, weights: Floats) -> Floats:
    """(times,) sums of the scores by their weights, as standard normal numbers; NaN where fewer than two tests are."""
    known = np.isfinite(scores)
    size = np.sqrt((weights**2 * known).sum(axis=0))
    total = np.where(known, scores * weights, 0.0).sum(axis=0)
    enough = (known.sum(axis=0) > 1) & (size > 0)
    return np.asarray(np.divide(total, size, out=np.full(total.shape, np.nan), where=enough))


def _change_at(
    parts: Sequence[_Part], time: float, span: tuple[float, float], combined: float
) -> CommonRateChange | None:
    """The record of a change at a time (s); span : s, earliest and latest."""
    sign = float(np.sign(combined))
    steps = {p.test: p.curve.rate_step(time) for p in parts if p.curve.covers(np.array([time]))[0]}
    shown = tuple(k for k, step in steps.items() if sign * step.log_factor > SHOWN_THRESHOLD * step.log_factor_sd)
    if len(shown) < 2 or np.exp(np.median([abs(steps[k].log_factor) for k in shown])) < LEAST_FACTOR:
        return None
    jumps, precisions = (
        np.array(x) for x in zip(*((steps[k].jump, steps[k].jump_sd ** -2) for k in shown), strict=True)
    )
    mean = float((jumps * precisions).sum() / precisions.sum())
    chi_square = float((precisions * (jumps - mean) ** 2).sum()) / max(len(shown) - 1, 1)
    jump_sd = float(precisions.sum() ** -0.5) * max(1.0, chi_square**0.5)
    return CommonRateChange(time, *span, steps, shown, combined, mean, jump_sd)
