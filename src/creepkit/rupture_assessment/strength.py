"""Rupture strength: the stress at which a test lasts a given time, with bounds, of one method or an average of several.

The distribution of log10 of the rupture time at a stress and temperature is a mixture over methods by their weights.
Between the bounds of a strength lie the stresses about the estimate at which the time asked for lies between quantiles
of that distribution (Fieller's construction for a curve), so that those of a wider kind hold those of a narrower one. A
bound exists where a quantile reaches the time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from creepkit.arrays import Floats
from creepkit.records.units import celsius_text
from creepkit.rupture_assessment.fitting import MinimumRateRelation
from creepkit.rupture_assessment.methods import Conditions
from creepkit.rupture_assessment.observed_tests import RuptureTests, TensileStrength
from creepkit.rupture_assessment.rupture_fit import MixedLogTime, RuptureFit, power_of_ten

BOUND_KINDS = ("mean", "heat", "test")
"""Of the median time of the average heat; of the median time of a new heat; of one test of a new heat."""

LOWEST_STRESS, HIGHEST_STRESS = 0.1, 3.0
"""Of the lowest and the highest stress tested: between them strengths are looked for."""

TENSILE_LIMIT = 0.999
"""Of the tensile strength: above it no test is a creep test."""

GRID_POINTS = 301

LONGEST_EXTRAPOLATION = 3.0
"""Times the longest test: estimates beyond it are flagged."""


WeightedModels = Sequence[tuple[RuptureFit | MinimumRateRelation, float]]
"""What predicts the distribution of rupture times, with weights that add up to one."""


@dataclass(frozen=True)
class StrengthEstimate:
    """Rupture strength at a time and a temperature.

    hours : h, as the name says; other times are in s.
    temperature : K. method : or "average". value : MPa, at which the median time of the average heat is that
    time.
    bounds_of_mean : (low, high) of that value. bounds_of_heat : of a new heat (and laboratory). bounds_of_test : of one
    test of it. None where a bound is not bracketed. Where nothing tells heats or laboratories apart, bounds_of_heat are
    those of the mean.
    extrapolation : what lies beyond the tests, "" where nothing does. reason : why a value or a bound is None, or "".
    """

    hours: float
    temperature: float
    method: str
    value: float | None
    bounds_of_mean: tuple[float | None, float | None]
    bounds_of_heat: tuple[float | None, float | None]
    bounds_of_test: tuple[float | None, float | None]
    extrapolation: str = ""
    reason: str = ""


@dataclass(frozen=True)
class LifeEstimate:
    """Time to rupture at a stress, MPa, and a temperature, K, by the average of methods.

    hours : h, the median of the average heat. bounds_of_mean, bounds_of_heat, bounds_of_test : (low, high) h, of that
    median, of a new heat, of one test of it. extrapolation : what lies beyond the tests, "" where nothing does.
    """

    stress: float
    temperature: float
    hours: float
    bounds_of_mean: tuple[float, float]
    bounds_of_heat: tuple[float, float]
    bounds_of_test: tuple[float, float]
    extrapolation: str = ""


def mixed(models: WeightedModels, at: Conditions, of: str) -> MixedLogTime:
    """The distribution of an average of methods."""
    return MixedLogTime([model.log_time(at, of) for model, _ in models], [weight for _, weight in models])


def bound_curves(models: WeightedModels, at: Conditions, level: float) -> dict[tuple[str, float], Floats]:
    """{(of, probability): (points,)} log10 h that bound a time: lower and upper, of each of BOUND_KINDS.

    A wider kind holds the narrower ones: each has degrees of freedom of its own, by which alone it might not. With few
    heats, whose scatter has one or two degrees of freedom, that of a test beside it has many: so the half width of a
    test is at least the root of the sum of squares of that of its heat and of its own scatter (the combination of
    intervals of Zou and Donner (2008), Stat. Med. 27, 1693).
    """
    tail = 0.5 * (1.0 - level)
    distributions = {of: mixed(models, at, of) for of in BOUND_KINDS}
    own = MixedLogTime([model.test_scatter(at) for model, _ in models], [weight for _, weight in models])
    median = distributions["mean"].quantile(0.5)
    curves: dict[tuple[str, float], Floats] = {}
    for p, sign in ((tail, -1.0), (1.0 - tail, 1.0)):
        mean, heat, test = (sign * (distributions[of].quantile(p) - median) for of in BOUND_KINDS)
        heat = np.maximum(heat, mean)
        test = np.maximum(test, np.hypot(heat, own.quantile(p)))
        curves |= {(of, p): median + sign * half for of, half in zip(BOUND_KINDS, (mean, heat, test), strict=True)}
    return {(of, p): curves[of, p] for of in BOUND_KINDS for p in (tail, 1.0 - tail)}


BOUND_NAMES = {"mean": "the mean", "heat": "a new heat", "test": "one test"}
"""Of what bounds are, in words, as the heads of tables have it."""


def strength_estimates(
    models: WeightedModels,
    name: str,
    tests: RuptureTests,
    tensile: TensileStrength,
    *,
    hours: Sequence[float],
    temperature: float,
    level: float,
) -> list[StrengthEstimate]:
    """Strengths at one temperature and several times, with all bounds, flags and reasons."""
    limit = float(tensile(np.array([temperature]))[0])
    lowest, highest = LOWEST_STRESS * float(tests.stress.min()), HIGHEST_STRESS * float(tests.stress.max())
    if np.isfinite(limit):
        highest = min(highest, TENSILE_LIMIT * limit)
    stress = np.geomspace(lowest, highest, GRID_POINTS)
    at = Conditions.isotherm(stress, temperature, tensile)
    median = mixed(models, at, "mean").quantile(0.5)
    tested = (stress >= 0.99 * tests.stress.min()) & (stress <= 1.01 * tests.stress.max())
    start = int(np.argmin(np.where(tested, np.abs(median - np.median(tests.log_time)), np.inf)))
    central = _falling_branch(stress, median, start)
    curves = bound_curves(models, at, level)
    return [_estimate(central, (stress, curves), name, tests, time, temperature) for time in hours]


def _estimate(
    central: _Branch,
    bound_of_time: tuple[Floats, Mapping[tuple[str, float], Floats]],
    name: str,
    tests: RuptureTests,
    hours: float,
    temperature: float,
) -> StrengthEstimate:
    value, reason = central.stress_at(hours)
    reasons = [reason] if reason else []
    bounds: dict[str, list[float | None]] = {of: [] for of in BOUND_KINDS}
    stress, curves = bound_of_time
    lacking: dict[str, list[str]] = {"lower": [], "upper": []}
    for k, ((of, _), curve) in enumerate(curves.items()):
        bound, reason = (None, "") if value is None else _bound(stress, curve, hours, value, upper=bool(k % 2))
        bounds[of].append(bound)
        if reason:
            lacking["upper" if k % 2 else "lower"].append(f"{BOUND_NAMES[of]}: {reason}")
    # Of the narrowest kind alone: wider ones hold it, and where heats do not scatter nothing is said of a new heat.
    reasons += [f"no {side} bound of {ofs[0]}" for side, ofs in lacking.items() if ofs]
    pairs = {f"bounds_of_{of}": (ends[0], ends[1]) for of, ends in bounds.items()}
    flag = extrapolation(tests, hours, temperature, value)
    return StrengthEstimate(hours, temperature, name, value, **pairs, extrapolation=flag, reason="; ".join(reasons))


def extrapolation(tests: RuptureTests, hours: float, temperature: float, stress: float | None) -> str:
    """What of a prediction lies beyond the tests, in words; "" where nothing does."""
    longest = 10.0 ** float(tests.log_time.max())
    parts = []
    if hours > LONGEST_EXTRAPOLATION * longest:
        parts.append(f"{hours / longest:.3g} times the longest test ({longest:.4g} h)")
    low, high = float(tests.temperature.min()), float(tests.temperature.max())
    if not low - 1.0 <= temperature <= high + 1.0:
        span = celsius_text(low) if high - low < 1.0 else celsius_text(low, high)
        parts.append(f"temperature outside the tested {span}")
    if stress is not None and not 0.999 * tests.stress.min() <= stress <= 1.001 * tests.stress.max():
        parts.append(f"stress outside the tested {tests.stress.min():.4g} to {tests.stress.max():.4g} MPa")
    return "; ".join(parts)


@dataclass(frozen=True, eq=False)
class _Branch:
    """The part of a curve of log10 of time over stress that falls through the tests.

    stress, log_time : (points,), one point where the curve does not fall. turns : whether it turns back at its ends.
    """

    stress: Floats
    log_time: Floats
    turns: tuple[bool, bool]

    def stress_at(self, hours: float) -> tuple[float | None, str]:
        """MPa at which the time is that, else None and the reason."""
        low, high, target = self.stress[0], self.stress[-1], np.log10(hours)
        shorter, longer = (f"predicted times get {what} again" for what in ("shorter", "longer"))
        if self.stress.size < 2:
            return None, f"the time does not fall with stress about {low:.3g} MPa"
        if target > self.log_time[0]:
            if self.turns[0]:
                return None, f"{shorter} below {low:.3g} MPa; the longest is {_hours(self.log_time[0])}"
            return (
                None,
                f"only {_hours(self.log_time[0])} are reached at {low:.3g} MPa, a tenth of the lowest stress tested",
            )
        if target < self.log_time[-1]:
            if self.turns[1]:
                return None, f"{longer} above {high:.3g} MPa; the shortest is {_hours(self.log_time[-1])}"
            return None, f"it lies above {high:.4g} MPa, up to which strengths are looked for"
        inverse = PchipInterpolator(self.log_time[::-1], np.log(self.stress[::-1]))
        return float(np.exp(inverse(target))), ""


def _bound(stress: Floats, log_time: Floats, hours: float, value: float, *, upper: bool) -> tuple[float | None, str]:
    """The end of the stresses about a strength at which a quantile is above the time, or below it, and why none is.

    stress, log_time : (points,) of the upper quantile, which is above the time at the strength, or of the lower one.
    """
    target, start = np.log10(hours), int(np.searchsorted(stress, value)) - upper
    start = int(np.clip(start, 0, stress.size - 1))
    crossings = np.flatnonzero((log_time[:-1] > target) & (log_time[1:] <= target))
    inside = crossings[crossings >= start] if upper else crossings[crossings < start]
    if inside.size:
        return _falling_branch(stress, log_time, int(inside[0] if upper else inside[-1])).stress_at(hours)
    if (log_time[start] < target) == upper:  # no wider than the distance of two points
        return _falling_branch(stress, log_time, start).stress_at(hours)
    beyond = log_time[start:] if upper else log_time[: start + 1]
    extreme = start + int(beyond.argmin()) if upper else int(beyond.argmax())
    ends = slice(start, extreme + 1) if upper else slice(extreme, start + 1)
    turned = extreme < stress.size - 1 if upper else extreme > 0
    return _Branch(stress[ends], log_time[ends], (turned, turned)).stress_at(hours)


def _falling_branch(stress: Floats, log_time: Floats, start: int) -> _Branch:
    """Of a curve (points,), about the point at a place, which lies among the tests."""
    first = last = start
    falling = np.diff(log_time) < 0
    while first > 0 and falling[first - 1]:
        first -= 1
    while last < stress.size - 1 and falling[last]:
        last += 1
    kept = slice(first, last + 1)
    return _Branch(stress[kept], log_time[kept], (first > 0, last < stress.size - 1))


def _hours(log_time: float) -> str:
    return f"{power_of_ten(log_time):.3g} h"
