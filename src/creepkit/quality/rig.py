"""What the rig did: changes of the creep rate at one time in several tests, steps of an output, records off a program.

Changes of rate under one load that follow from a law (hardening, softening, an exponent that drifts) are smooth, and
each test's own spline takes them up; changes with the load are not looked for. What is left is scored, test by test,
and the scores at one time are combined with the weights of the best estimate of one common factor.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np
from scipy.special import chdtrc

from creepkit.arrays import Floats
from creepkit.quality.flags import QualityFlag
from creepkit.quality.frames import (
    FEWEST_FRAMES,
    LOAD_TOLERANCE,
    TEMPERATURE_TOLERANCE,
    extrapolate,
    load_segments,
    scatter_about_line,
)
from creepkit.quality.repeats import duplicate_tests
from creepkit.quality.smooth_curve import RateStep, SmoothCurve, robust_spread, smooth_curve
from creepkit.records import History, growing_output, output_named
from creepkit.records.recorded_programs import running_median
from creepkit.records.units import time_text, times_text

ACTIVATION_ENERGY = 400e3
"""J/mol, with which a factor of the rate is put as a step of temperature unless another one is given."""


_GAS_CONSTANT = 8.314462618


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


LINE_FRAMES, EXPANSION, EXPANSION_THRESHOLD = (4, 6), (4e-6, 35e-6), 4.0
"""Frames on a side of a step of temperature, at least and at most; 1/K, coefficients of thermal expansion that solids
of creep tests have; standard deviations of a step."""


SAME_TIMES_FRACTION = 0.8
"""Fraction of the frames of two tests that were taken at the same times, if one clock is to be supposed."""


TIME_UNCERTAINTY = 3.84
"""Loss of the squared combined score up to which another time is as good: 95 % of one parameter."""


class Jump(NamedTuple):
    """A step of the leading output of one test between two frames: time, s; size, in its unit, over the noise."""

    test: int
    time: float
    previous_time: float
    size: float
    score: float


class _Part(NamedTuple):
    """One part of a test under one load, with its curve."""

    test: int
    curve: SmoothCurve


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
    shifts, changes = curve.level_shifts, (*curve.slope_changes, time)
    return part._replace(
        curve=smooth_curve(curve.times, curve.values, curve.start, level_shifts=shifts, slope_changes=changes)
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


def temperature_step(temperature: float, rate_factor: float, activation_energy: float) -> float:
    """The step, K, from a temperature (K) that multiplies the rate by a factor at an activation energy (J/mol).

    1/T_2 = 1/T_1 - R ln(factor) / Q.
    """
    inverse = 1.0 / temperature - _GAS_CONSTANT * float(np.log(rate_factor)) / activation_energy
    return 1.0 / inverse - temperature if inverse > 0 else float("inf")


def rate_change_flag(histories: Sequence[History], change: CommonRateChange, activation_energy: float) -> QualityFlag:
    """The flag of a change of rate in several tests."""
    factors = {histories[k].name: float(np.exp(change.steps[k].log_factor)) for k in change.shown}
    errors = {histories[k].name: float(np.exp(1.96 * change.steps[k].log_factor_sd)) for k in change.shown}
    steps = {
        histories[k].name: temperature_step(
            float(histories[k].temperature_program().at(change.time)), factors[histories[k].name], activation_energy
        )
        for k in change.shown
    }
    rises = next(iter(factors.values())) > 1
    sizes = ", ".join(f"{n} {f if rises else 1 / f:.2f} ({errors[n]:.2f})" for n, f in factors.items())
    unclear = [histories[k].name for k in change.steps if k not in change.shown]
    kelvin = np.abs(list(steps.values()))
    one = histories[change.shown[0]]
    if change.has_jump:
        step_text = (
            f"its {growing_output(one)} steps with it by {_size_text(one, change.jump)}, as with a step of the load"
        )
        nuisances = '"load step"'
    else:
        limit = _size_text(one, abs(change.jump) + 1.96 * change.jump_sd)
        step_text = f"no elastic jump (less than {limit} on average), so it is no step of the load"
        nuisances = '"temperature step" (or "rate step")'
    scope = "one for all tests" if change.same_factor else "one for each group of tests, since the factors differ"
    return QualityFlag(
        tuple(factors),
        "rate change",
        (),
        f"at {time_text(change.time)} ({times_text(change.earliest, change.latest)}) the creep rate "
        f"{'rises' if rises else 'falls'} at once by a factor (in brackets its nominal 95 % error, as a factor) of "
        f"{sizes}; "
        f"{_kelvin_text(kelvin)} {'warmer' if rises else 'colder'} would do it at {activation_energy / 1e3:g} kJ/mol; "
        f"{step_text}; {abs(change.score):.1f} standard deviations"
        + (f"; not resolved in {', '.join(unclear)}" if unclear else ""),
        time=change.time,
        earliest=change.earliest,
        latest=change.latest,
        rate_factors=factors,
        factor_errors=errors,
        temperature_steps=steps,
        jumps={histories[k].name: change.steps[k].jump for k in change.shown},
        proposal=f"cut the frames after {time_text(change.time)}, model it by the nuisance {nuisances} from then on, "
        f"{scope}, or ignore it if the load or the alloy is known to have done it",
    )


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
            earliest=max(j.previous_time for j in together),
            latest=first.time,
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


def record_flags(history: History, activation_energy: float) -> Iterator[QualityFlag]:
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
        factors, steps = {}, {}
        if is_temperature:
            recorded = float(record.at(times[worst]))
            inverse = 1.0 / float(wanted[worst]) - 1.0 / recorded
            factors[name] = float(np.exp(activation_energy / _GAS_CONSTANT * inverse))
            steps[name] = float(difference[worst])
            text += f", a factor of {factors[name]:.2f} on the rate at {activation_energy / 1e3:g} kJ/mol"
        yield QualityFlag(
            (name,),
            "record",
            (),
            text,
            time=time,
            rate_factors=factors,
            temperature_steps=steps,
            proposal="the record is what simulations use: ignore this if it is right; if the sensor is wrong, remove "
            f"its column; if the control failed, cut the frames from {time_text(time)} on",
        )


def _kelvin_text(kelvin: Floats) -> str:
    low, high = float(kelvin.min()), float(kelvin.max())
    return f"{low:.0f} K" if round(low) == round(high) else f"{low:.0f} to {high:.0f} K"


def _size_text(history: History, value: float) -> str:
    output = output_named(growing_output(history), history.specimen)
    return f"{value:.2g} {output.unit}" if output.unit else f"{value:.2g} of {output}"
