"""Tests under one condition: copies, which count once, rows of tables that say the same, replicates that differ.

Two tests of one specimen under the same load and temperature are compared at the times that both have, each reading to
half the last digit in which it is written (of the coarser of the two). That they agree everywhere is taken for a copy
only where repeated measurements would hardly do so. Their chance is at most that of the rate of a second test to be so
near that of the first, times those of the single readings to agree in spite of the noise; of a test without noise, such
as a simulation, the first alone. Readings that are written so coarsely that repeats may agree are no copies.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations
from math import erf, sqrt
from typing import NamedTuple

import numpy as np

from creepkit.arrays import Bools, Floats, Ints
from creepkit.quality.flags import QualityFlag
from creepkit.quality.frames import FEWEST_FRAMES, noise_standard_deviation
from creepkit.records import History, Program, growing_output, output_named
from creepkit.records.units import celsius_text, time_text

REPEAT_CHANCE = 1e-3
"""Largest chance of repeated measurements to agree so well, below which a test is a copy."""


RATE_SCATTER = 0.02
"""Of ln rate between repeats of one laboratory, at the least: well-made creep tests scatter by 5 % and more."""


FEWEST_COMMON = 3
COMMON_FRACTION = 0.5
"""Readings at times that both tests have, and their least fraction of the shorter record."""


SAME, ALIKE = (2e-3, 0.6), (0.01, 3.0)
"""Relative of the load, and K: of one condition, which may be written in other units and rounded; and of replicates,
whose rates at 400 kJ/mol and 800 C then differ by 13 %."""


VISIBLE_NOISE = 3.0
"""Last digits of a reading, above which its noise can be told from its rounding."""


ROUND_OFF = 1e-9
"""Of the largest value: what conversions of units leave."""


DIGITS = 12
"""Decimal digits, relative to the largest value, beyond which a reading counts as exact."""


TIME_UNITS = (86400.0, 3600.0, 60.0, 1.0)
"""s, of units in which times are written with few digits."""


def copied_tests(histories: Sequence[History]) -> dict[int, int]:
    """{copy: original}, positions of tests whose readings another test has; the one with more readings is the original.

    Of equal ones the first is. All frames are compared, also those that are not used. Time grows with the square of the
    number of tests, for those under one condition alone.
    """
    copies: dict[int, int] = {}
    conditions = [_Condition.of(history) for history in histories]
    for a, b in combinations(range(len(histories)), 2):
        if a in copies or b in copies or not conditions[a].is_that_of(conditions[b]):
            continue
        copy, original = (a, b) if histories[a].times.size < histories[b].times.size else (b, a)
        if agreement_by_chance(histories[copy], histories[original]) < REPEAT_CHANCE:
            copies[copy] = original
    return {copy: _first(copies, original) for copy, original in copies.items()}


def repeated_rows(histories: Sequence[History]) -> dict[int, int]:
    """{row: an earlier one}, positions of tests without frames that state the same numbers as another one.

    Load, temperature, how they ended and minimum rate are equal to all digits, as in a table that was read twice. Of
    rows that have one measured value, a rate or a time, a single pair may agree by chance, and is none.
    """
    first: dict[tuple[object, ...], int] = {}
    repeated: dict[int, int] = {}
    for k, history in enumerate(histories):
        if history.outputs or (history.rupture_time is None and history.minimum_rate is None):
            continue
        load, temperature = history.loading.program(), history.temperature_program()
        programs = (*(tuple(v.tolist()) for p in (load, temperature) for v in (p.times, p.values)),)
        ended = (history.rupture_time, history.unruptured and float(history.times[-1]))
        labels = tuple(history.labels.get(name, "") for name in ("heat", "laboratory"))
        key = (history.alloy, history.specimen, history.loading.quantity, programs, ended, history.minimum_rate, labels)
        if key in first:
            repeated[k] = first[key]
        first.setdefault(key, k)
    single = [k for k in repeated if histories[k].rupture_time is None or histories[k].minimum_rate is None]
    return {k: earlier for k, earlier in repeated.items() if k not in single or len(single) > 1}


END_OF_TIME, END_OF_OUTPUT = 1e-5, 1e-4
"""Relative roundings of the last frame of a test that is published twice: two times of six digits differ by 1e-5."""


def duplicate_tests(histories: Sequence[History]) -> list[tuple[str, str]]:
    """The names of every two histories that seem to be one test: the same condition and the same end.

    Records of one test may differ elsewhere, since sources thin them in their own ways.
    """
    pairs = combinations([(history, _Condition.of(history)) for history in histories], 2)
    return [(a.name, b.name) for (a, one), (b, other) in pairs if one.is_that_of(other) and _same_end(a, b)]


def _same_end(a: History, b: History) -> bool:
    if a.outputs.keys() != b.outputs.keys() or abs(a.times[-1] - b.times[-1]) > END_OF_TIME * abs(b.times[-1]):
        return False
    return all(np.isclose(a.outputs[k][-1], b.outputs[k][-1], rtol=END_OF_OUTPUT, atol=0.0) for k in a.outputs)


def _first(copies: dict[int, int], position: int) -> int:
    while position in copies:
        position = copies[position]
    return position


def agreement_by_chance(one: History, two: History) -> float:
    """Chance of a repeated measurement to agree with a test as `one` does with `two`; 1 where they do not agree."""
    names = [name for name in one.outputs if name in two.outputs]
    pairs = _common_frames(one, two)
    if not names or pairs is None:
        return 1.0
    chance = 1.0
    leading = growing_output(one)
    for name in names:
        a, b = one.outputs[name], two.outputs[name]
        step_a, step_b = last_digits(a), last_digits(b)
        first, second = pairs
        known = np.isfinite(a[first]) & np.isfinite(b[second])
        first, second = first[known], second[known]
        if first.size < FEWEST_COMMON:
            return 1.0
        if not _agree(a[first], b[second], step_a[first], step_b[second]).all():
            return 1.0
        if name != leading and leading in names:
            continue
        width = 0.5 * np.maximum(step_a[first], step_b[second]) + ROUND_OFF * float(np.abs(a[first]).max())
        size = float(np.ptp(a[first]))
        if size <= 0:
            return 1.0
        noise = _noise(one if np.median(step_a) <= np.median(step_b) else two, name)
        reading = np.array([_reading_chance(float(half), noise) for half in width])
        rate = min(1.0, 2.0 * float(np.median(width)) / size / (RATE_SCATTER * 2.0 * sqrt(np.pi)))
        chance *= rate * float(np.exp(np.log(np.maximum(reading, 1e-300)).sum()))
    return chance


def _reading_chance(half: float, noise: float) -> float:
    """Of two measurements of one value to be the same digit of width 2 half, under a noise; 1 without noise."""
    spread = sqrt(2.0) * noise
    if spread <= 1e-3 * half:
        return 1.0
    ratio = sqrt(2.0) * half / spread
    return float(erf(ratio) - (1.0 - np.exp(-(ratio**2))) / (ratio * sqrt(np.pi)))


def _noise(history: History, name: str) -> float:
    """Standard deviation of the readings; 0 where there are too few, or where it may be that of their last digit."""
    values = history.outputs[name]
    usable = np.isfinite(values) & (history.times > 0)
    if int(usable.sum()) < FEWEST_FRAMES or (np.diff(history.times[usable]) <= 0).any():
        return 0.0
    noise = noise_standard_deviation(history.times[usable], values[usable])
    return noise if noise > VISIBLE_NOISE * float(np.median(last_digits(values)[usable])) else 0.0


def _common_frames(one: History, two: History) -> tuple[Ints, Ints] | None:
    """Positions of frames at the same times in both, to the digits written; None where they are too few."""
    a, b = one.times, two.times
    if a.size == b.size and _agree(a, b, _time_digits(a), _time_digits(b)).all():
        return np.arange(a.size), np.arange(b.size)
    nearest = np.clip(np.searchsorted(b, a), 1, b.size - 1)
    nearest -= (a - b[nearest - 1]) <= np.abs(b[nearest] - a) if b.size > 1 else 0
    same = _agree(a, b[nearest], _time_digits(a), _time_digits(b)[nearest])
    if int(same.sum()) < max(FEWEST_COMMON, COMMON_FRACTION * min(a.size, b.size)):
        return None
    return np.flatnonzero(same), nearest[same]


def _agree(a: Floats, b: Floats, step_a: Floats, step_b: Floats) -> Bools:
    """Where values can be one number written to these last digits; NaN of both agrees with NaN."""
    half = 0.5 * (step_a + step_b) * np.where(np.isclose(step_a, step_b, rtol=1e-6), 0.999, 1.0 + 1e-6)
    largest = float(np.nanmax(np.abs(a), initial=0.0))
    return np.asarray((np.abs(a - b) <= half + ROUND_OFF * largest) | (np.isnan(a) & np.isnan(b)))


def _time_digits(times: Floats) -> Floats:
    return np.asarray(np.max([unit * last_digits(times / unit) for unit in TIME_UNITS], axis=0))


def last_digits(values: Floats) -> Floats:
    """(values,) size of the last decimal digit in which each value is written, 0 where it is exact.

    Values that are written with fixed decimals share it, also where a constant was added to all of them; those with a
    fixed number of digits have it by their size. values : (values,).
    """
    finite = values[np.isfinite(values)]
    if not finite.size or not np.abs(finite).max() > 0:
        return np.zeros(values.size)
    fixed = [_common_power(each) for each in (finite, finite - finite[0])]
    own = max((10.0**power for power in fixed if power is not None), default=0.0)
    magnitude = np.where(np.isfinite(values) & (values != 0), np.abs(values), 1.0)
    exponent = np.floor(np.log10(magnitude))
    power = _common_power((magnitude / 10.0**exponent)[np.isfinite(values) & (values != 0)])
    by_size = np.zeros(values.size) if power is None else 10.0 ** (exponent + power)
    return np.asarray(np.where(np.isfinite(values), np.maximum(own, by_size), 0.0))


def _common_power(values: Floats) -> int | None:
    """The exponent of the largest power of ten of which all values are multiples; None where that is their round-off.

    The round-off is the last one of DIGITS digits of the largest value.
    """
    largest = float(np.abs(values).max())
    if largest <= 0:
        return None
    last = int(np.floor(np.log10(largest))) - DIGITS
    common = str(np.gcd.reduce(np.rint(values / 10.0**last).astype(np.int64)))
    zeros = len(common) - len(common.rstrip("0"))
    return last + zeros if zeros else None


class _Condition(NamedTuple):
    """What a test of one specimen was put under: load, MPa, and temperature, K, until its end, s."""

    kind: tuple[str, str]
    alloy: str
    load: Program
    temperature: Program
    end: float

    @classmethod
    def of(cls, history: History) -> _Condition:
        kind = (history.specimen, history.loading.quantity) if history.outputs else ("", history.name)
        end = float(history.times[-1]) if history.times.size else 0.0
        return cls(kind, history.alloy, history.loading.program(), history.temperature_program(), end)

    def is_that_of(self, other: _Condition, tolerances: tuple[float, float] = SAME) -> bool:
        """Whether both are the same, over the time that both tests last."""
        if self.kind != other.kind or (self.alloy and other.alloy and self.alloy != other.alloy):
            return False
        largest = max(float(np.abs(program.values).max()) for program in (self.load, other.load))
        end = min(self.end, other.end)
        return _near(self.load, other.load, end, tolerances[0] * largest) and _near(
            self.temperature, other.temperature, end, tolerances[1]
        )


def _near(one: Program, other: Program, end: float, tolerance: float) -> bool:
    times = np.concatenate([one.times, other.times, [end]])
    times = times[times <= end]
    return bool((np.abs(one.at(times) - other.at(times)) <= tolerance).all())


# ---- replicates ------------------------------------------------------------------------------------------------------


REPLICATE_FACTOR, LOGARITHMIC_REPLICATE_FACTOR = 1.6, 3.0
"""Between the creep of replicates. Deflections: three standard deviations of 2^0.5 times 11 %, which is what
thicknesses that scatter by 5.5 % do to that of a dimple. Strains of bars, compared by their logarithms: rates scatter
by a factor of two, and products and environments differ."""


_COMPARISON_FRACTIONS = np.linspace(0.2, 1.0, 9)
"""Fractions of the common time at which replicates are compared; the median counts, as the end of a failing test may
differ."""


def replicate_deviations(histories: Sequence[History]) -> Iterator[QualityFlag]:
    """Pairs of replicates of which one creeps much more than the other; which of them is odd, a fit can tell."""
    conditions = [_Condition.of(history) for history in histories]
    for a, b in combinations(range(len(histories)), 2):
        one, two = histories[a], histories[b]
        if growing_output(one) != growing_output(two) or not conditions[a].is_that_of(conditions[b], ALIKE):
            continue
        end = min(_last_used_time(one), _last_used_time(two))
        growth = np.array([[_growth(test, share * end) for test in (one, two)] for share in _COMPARISON_FRACTIONS])
        growth = growth[(growth > 0.0).all(axis=1)]
        ratio = float(np.median(growth[:, 0] / growth[:, 1])) if growth.size else 1.0
        logarithmic = output_named(growing_output(one), one.specimen).logarithmic
        if max(ratio, 1.0 / ratio) >= (LOGARITHMIC_REPLICATE_FACTOR if logarithmic else REPLICATE_FACTOR):
            reason = (
                f"{one.name} grows {ratio:.2f} times as much as its replicate {two.name} (to {time_text(end)} by "
                f"{_growth(one, end):.3g} and {_growth(two, end):.3g}), at {celsius_text(one.mean_temperature)} and "
                f"{celsius_text(two.mean_temperature)}"
            )
            yield QualityFlag((one.name, two.name), "replicate", (), reason)


def _last_used_time(history: History) -> float:
    return float(history.times[history.used][-1]) if history.used.any() else 0.0


def _growth(history: History, end: float) -> float:
    """Growth of the leading output from the first used frame to a time; 0 if it is not known."""
    y = history.outputs.get(growing_output(history), np.full(history.times.size, np.nan))
    usable = history.used & np.isfinite(y) & (history.times > 0)
    if usable.sum() < 2 or _last_used_time(history) < end * (1 - 1e-9):
        return 0.0
    return float(np.interp(end, history.times[usable], y[usable]) - y[usable][0])
