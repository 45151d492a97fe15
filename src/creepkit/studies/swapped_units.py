"""Units that files seem to have swapped: loads a factor of ksi to MPa apart, durations one of minutes or hours to s."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations, product

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
    return [one for sentences in (_of_loads(files), _of_times(files)) if (one := next(sentences, ""))]


def _of_loads(files: Mapping[str, Sequence[History]]) -> Iterator[str]:
    """Of files where every level of one is that of the other times one factor, and tests so paired creep alike."""
    for pair in combinations(files, 2):
        small, large = sorted(pair, key=lambda name: max(map(_load, files[name])))
        for units, factor in LOAD_FACTORS.items():
            pairs = [
                [h for h in files[large] if _is_near(_load(h), factor * _load(g), SAME_RATIO)] for g in files[small]
            ]
            alike = (_creep_alike(g, h) for g, found in zip(files[small], pairs, strict=True) for h in found)
            if all(pairs) and all(alike):
                what = f"loads of {_name(large)} are those of {_name(small)} times {factor:.4g}"
                yield f"{what}, as of {units}: {ASK}"


def _creep_alike(first: History, second: History) -> bool:
    """Whether two tests could be at one load: a load so much higher would make the second creep far faster."""
    rates = _mean_rate(first), _mean_rate(second)
    same = _same_condition(first, second, None) and first.loading.quantity == second.loading.quantity
    return same and (0.0 in rates or 1 / ALIKE < rates[0] / rates[1] < ALIKE)


def _of_times(files: Mapping[str, Sequence[History]]) -> Iterator[str]:
    """Of files whose tests at similar conditions last, or creep, longer or slower by a factor between units of time."""
    for a, b in combinations(files, 2):
        pairs = [*product(files[a], files[b])]
        lasting = [(g, h) for g, h in pairs if _same_condition(g, h, SIMILAR_LOAD) and _lasts(g) and _lasts(h)]
        durations = [float(g.times[-1] / h.times[-1]) for g, h in lasting]
        repeated = [(_mean_rate(g), _mean_rate(h)) for g, h in pairs if _same_condition(g, h, SAME_LOAD)]
        rates = [second / first for first, second in repeated if first > 0 < second]
        for ratios, tolerance in ((durations, DURATION_RATIO), (rates, RATE_RATIO)):
            ratio = float(np.median(ratios)) if ratios else 1.0
            for units, factor in TIME_FACTORS.items():
                if abs(abs(math.log(ratio)) - math.log(factor)) < math.log(tolerance):
                    slow, fast = (a, b) if ratio > 1 else (b, a)
                    what = f"times of {_name(slow)} are about {factor:g} times those of {_name(fast)}"
                    yield f"{what}, as of {units}: {ASK}"


def _lasts(history: History) -> bool:
    return bool(history.times.size) and duration_known(history) and float(history.times[-1]) > 0


def _same_condition(first: History, second: History, load_tolerance: float | None) -> bool:
    """Whether specimens and temperatures are the same, and loads within a relative tolerance, where one is given."""
    near = load_tolerance is None or _is_near(_load(first), _load(second), load_tolerance)
    cold = abs(first.mean_temperature - second.mean_temperature) <= SAME_TEMPERATURE
    return first.specimen == second.specimen and near and cold


def _is_near(value: float, other: float, tolerance: float) -> bool:
    return abs(value - other) <= tolerance * other if other > 0 else False


def _mean_rate(history: History) -> float:
    """Of the first output, over the whole test; 0 where it does not grow."""
    values = next(iter(history.outputs.values()), np.zeros(0))
    finite = np.flatnonzero(np.isfinite(values) & (history.times > 0)) if values.size else values
    if finite.size < 2:
        return 0.0
    return max(float(values[finite[-1]] / history.times[finite[-1]]), 0.0)


def _load(history: History) -> float:
    """The largest load; 0 of what has none that is positive."""
    return max(float(history.loading.program().values.max()), 0.0)


def _name(source: str) -> str:
    return f"'{source.replace(chr(92), '/').rpartition('/')[2]}'"
