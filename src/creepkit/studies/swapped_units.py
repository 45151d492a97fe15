"""Units that files seem to have swapped: loads a factor of ksi to MPa apart, durations one of minutes or hours to s."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations

import numpy as np

from creepkit.inverse.duration import duration_known
from creepkit.records import History

LOAD_FACTORS = {"ksi and MPa": 6.894757, "MPa and psi": 145.0377, "ksi and psi": 1000.0}
TIME_FACTORS = {"min and s, or h and min": 60.0, "h and s": 3600.0}


SAME_RATIO = 0.01
"""Relative difference of a ratio from a factor, with which numbers that were rounded are still that factor apart."""


RATE_RATIO, DURATION_RATIO = 1.5, 1.05
"""Of rates of repeated tests, which scatter, and of durations, besides a factor between units."""


ALIKE = 5.0
"""Ratio of the mean rates of two tests below which these could be at one load; a load 6.9 times higher with a stress
exponent of 3 makes it 300."""


SAME_LOAD, SIMILAR_LOAD, SAME_TEMPERATURE = 0.01, 0.3, 5.0
"""Relative, relative, and K."""


ASK = "are the units of both files right?"


MOST_FILES = 50
"""That are compared, each with each other."""


def swapped_units(tests: Sequence[History]) -> list[str]:
    """A sentence for loads, and one for times, that differ between files as units do; none where nothing does."""
    by_file: dict[str, list[History]] = {}
    for history in tests:
        by_file.setdefault(history.source.partition(" (")[0] or history.name, []).append(history)
    files = dict(list(by_file.items())[:MOST_FILES])
    return [*_first(_of_loads(files)), *_first(_of_times(files))]


def _first(sentences: Iterator[str]) -> list[str]:
    return [one] if (one := next(sentences, "")) else []


def _of_loads(files: Mapping[str, Sequence[History]]) -> Iterator[str]:
    """Of files where every level of one is that of the other times one factor, and tests so paired creep alike."""
    for a, b in combinations(files, 2):
        low, high = sorted((files[a], files[b]), key=lambda tests: max(map(_load, tests)))
        for units, factor in LOAD_FACTORS.items():
            pairs = [[h for h in high if _is_near(_load(h), factor * _load(g), SAME_RATIO)] for g in low]
            if not all(pairs) or not all(
                _creep_alike(g, h) for g, found in zip(low, pairs, strict=True) for h in found
            ):
                continue
            names = (a, b) if high is files[a] else (b, a)
            yield f"loads of {_name(names[0])} are those of {_name(names[1])} times {factor:.4g}, as of {units}: {ASK}"


def _creep_alike(first: History, second: History) -> bool:
    """Whether two tests could be at one load: a load so much higher would make the second creep far faster."""
    if first.specimen != second.specimen or first.loading.quantity != second.loading.quantity:
        return False
    rates = _mean_rate(first), _mean_rate(second)
    return _same_temperature(first, second) and (0.0 in rates or 1 / ALIKE < rates[0] / rates[1] < ALIKE)


def _of_times(files: Mapping[str, Sequence[History]]) -> Iterator[str]:
    """Of files whose tests at similar conditions last, or creep, longer or slower by a factor between units of time."""
    for a, b in combinations(files, 2):
        for ratio, tolerance in (*_ratio_of_durations(files[a], files[b]), *_ratio_of_rates(files[a], files[b])):
            for units, factor in TIME_FACTORS.items():
                if abs(abs(math.log(ratio)) - math.log(factor)) < math.log(tolerance):
                    names = [_name(one) for one in ((a, b) if ratio > 1 else (b, a))]
                    yield f"times of {names[0]} are about {factor:g} times those of {names[1]}, as of {units}: {ASK}"


def _ratio_of_durations(first: Sequence[History], second: Sequence[History]) -> Iterator[tuple[float, float]]:
    ratios = [
        float(g.times[-1] / h.times[-1])
        for g in first
        for h in second
        if _at_one_condition(g, h, SIMILAR_LOAD)
        and all(one.times.size and duration_known(one) and one.times[-1] > 0 for one in (g, h))
    ]
    if ratios:
        yield float(np.median(ratios)), DURATION_RATIO


def _ratio_of_rates(first: Sequence[History], second: Sequence[History]) -> Iterator[tuple[float, float]]:
    """Median ratio of the mean rates of tests at one condition, inverted: that of their times."""
    ratios = [
        _mean_rate(h) / _mean_rate(g)
        for g in first
        for h in second
        if _at_one_condition(g, h, SAME_LOAD) and _mean_rate(g) > 0 < _mean_rate(h)
    ]
    if ratios:
        yield float(np.median(ratios)), RATE_RATIO


def _at_one_condition(first: History, second: History, tolerance: float) -> bool:
    return (
        first.specimen == second.specimen
        and _is_near(_load(first), _load(second), tolerance)
        and _same_temperature(first, second)
    )


def _same_temperature(first: History, second: History) -> bool:
    return abs(first.mean_temperature - second.mean_temperature) <= SAME_TEMPERATURE


def _is_near(value: float, other: float, tolerance: float) -> bool:
    return abs(value - other) <= tolerance * other if other > 0 else False


def _mean_rate(history: History) -> float:
    """Of the first output, over the whole test; 0 where it does not grow."""
    values = next(iter(history.outputs.values()), np.zeros(0))
    if not values.size:
        return 0.0
    finite = np.flatnonzero(np.isfinite(values) & (history.times > 0))
    if finite.size < 2:
        return 0.0
    return max(float(values[finite[-1]] / history.times[finite[-1]]), 0.0)


def _load(history: History) -> float:
    """The largest load; 0 of what has none that is positive."""
    return max(float(history.loading.program().values.max()), 0.0)


def _name(source: str) -> str:
    return f"'{source.replace(chr(92), '/').rpartition('/')[2]}'"
