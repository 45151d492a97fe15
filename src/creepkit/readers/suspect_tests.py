"""Tests that look wrong beside others (twins, trends with temperature) or beside elasticity (their first frame)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from creepkit.arrays import Floats
from creepkit.language import CreepLaw, Param, parameters, stress
from creepkit.readers.suspect_frames import leading, noise, parts_of
from creepkit.records import ZERO_CELSIUS, History, Predictor

TWIN_TEMPERATURE = 3.0
"""K between twins; at 400 kJ/mol and 800 C it changes rates by 13 %."""
TWIN_FACTOR = {"amplitude": 1.6, "strain": 3.0}
"""Between the growths of twins. Dimples: three standard deviations of 2^.5 times 11 %, which is what thicknesses that
scatter by 5.5 % do to a deflection. Bars: rates scatter by a factor of two, and products and environments differ.
"""
_MOMENTS = np.linspace(0.2, 1.0, 9)
"""Of the common time, at which twins are compared; the median counts, for the end of a failing test tells little."""
COMMON = 0.5
"""Of the shorter test, for which two tests must have been loaded alike to be compared."""
TREND_TESTS = 6
"""Least number of tests that show a trend with temperature."""
TREND_NOISE = 5.0
"""Standard deviations of the others about their trend that a test must be off it."""
TREND_TEMPERATURE = 15.0
"""K that a temperature must seem wrong by: thermocouples and gradients make up to 10 K."""
TREND_MODULUS = 0.03
"""Relative error of a modulus; curves of handbooks differ by that much."""
ELASTIC = 0.15
"""Of the elastic deflection, that a first frame must be off it: thicknesses and moduli known to 5 % make 10 %."""
STILL = 0.1
"""Of the elastic deflection: largest creep before the first frame with which the latter can be judged."""
_FIRST = 5

_A, _n = parameters("A n")
_RIGID = CreepLaw(
    name="no creep",
    title="No creep",
    terms={"power law": _A * stress**_n},
    params={
        _A: Param("rate coefficient", unit="1/s", bounds=(1e-40, 1.0), scale="log", off=0.0),
        _n: Param("exponent", bounds=(1, 8)),
    },
    references=("a rate of zero",),
)  # fmt: skip


def far_from_twins(histories: Sequence[History]) -> dict[int, str]:
    """{test: reason}; of two twins that differ the one that is farther from the trend of the others, else both."""
    found: dict[int, str] = {}
    for a, b in combinations(range(len(histories)), 2):
        one, two = histories[a], histories[b]
        end = _alike_until(one, two)
        if abs(_warmth(one) - _warmth(two)) > TWIN_TEMPERATURE or end is None:
            continue
        ratio = _ratio(one, two, end)
        if max(ratio, 1.0 / ratio) < TWIN_FACTOR.get(leading(one), max(TWIN_FACTOR.values())):
            continue
        for k, other in _culprits(histories, a, b, end):
            mine, its = (_growth(histories[j], end) for j in (k, other))
            found[k] = (
                f"grows {_ratio(histories[k], histories[other], end):.2f} times as much as its twin "
                f"{histories[other].name} (to {end:g} s by {mine:.3g} and {its:.3g}), at {_celsius(histories[k])} and "
                f"{_celsius(histories[other])}"
            )
    return found


def _culprits(histories: Sequence[History], a: int, b: int, end: float) -> list[tuple[int, int]]:
    """(culprit, twin): the one farther from the trend of the tests loaded alike, both if there is none."""
    pair = (a, b)
    others = [k for k, h in enumerate(histories) if k not in pair and (_alike_until(histories[a], h) or 0) >= end]
    others = [k for k in others if _growth(histories[k], end) > 0]
    if len(others) < TREND_TESTS or not _shows_trend(np.array([_warmth(histories[k]) for k in others]), 2):
        return [(a, b), (b, a)]
    x, y = (np.array([_arrhenius(histories[k], end)[i] for k in (*others, *pair)]) for i in (0, 1))
    places = (x - x[-1]) / np.ptp(x)
    off = np.abs(y - np.polyval(np.polyfit(places[:-2], y[:-2], 2), places))[-2:]
    return [(a, b)] if off[0] > off[1] else [(b, a)]


def temperatures_out_of_line(histories: Sequence[History]) -> dict[int, str]:
    """{test: reason}: tests that grew as others did at quite another temperature."""
    found: dict[int, str] = {}
    for group, end in _groups(histories):
        x, y = (np.array([_arrhenius(histories[k], end)[i] for k in group]) for i in (0, 1))
        slope = float(np.polyfit(x - x.mean(), y, 1)[0])
        if slope >= 0:  # no activation: nothing is known of temperatures
            continue
        for k, expected in _strays(x, y, degree=2, least=-slope * TREND_TEMPERATURE * float(x.mean()) ** 2).items():
            warmer = (y[k] - expected) / -slope / x[k] ** 2
            found[group[k]] = (
                f"grows {np.exp(y[k] - expected):.2f} times as much as the others' trend with temperature says, as if "
                f"it had been {abs(warmer):.0f} K {'warmer' if warmer > 0 else 'colder'} than "
                f"{_celsius(histories[group[k]])}"
            )
    return found


def moduli_out_of_line(histories: Sequence[History]) -> dict[int, str]:
    """{test: reason}: moduli off the straight line that those of the alloy follow over temperature."""
    found: dict[int, str] = {}
    alloys = {(h.alloy, h.specimen) for h in histories if h.elastic is not None}
    for alloy in alloys:
        group = [k for k, h in enumerate(histories) if (h.alloy, h.specimen) == alloy and h.elastic is not None]
        if len(group) < TREND_TESTS:
            continue
        x = np.array([_warmth(histories[k]) for k in group])
        y = np.array([np.log(_modulus(histories[k])) for k in group])
        for k, expected in _strays(x, y, degree=1, least=TREND_MODULUS).items():
            found[group[k]] = (
                f"a modulus of {np.exp(y[k]) / 1e3:.1f} GPa at {_celsius(histories[group[k]])}, where the others "
                f"lead to {np.exp(expected) / 1e3:.1f} GPa"
            )
    return found


def first_frames(histories: Sequence[History], specimen: Predictor) -> dict[int, str]:
    """{test: reason}: first frames that are not where the elastic specimen would be, in tests that creep slowly."""
    found: dict[int, str] = {}
    for k, history in enumerate(histories):
        parts, output = parts_of(history), leading(history)
        if not parts or parts[0].frames.size < _FIRST or history.elastic is None:
            continue
        elastic = _elastic_value(history, int(parts[0].frames[0]), specimen, output)
        early = parts[0].frames[:_FIRST]
        slope, start = np.polyfit(history.times[early], history.outputs[output][early], 1)
        off = float(start) - elastic
        crept = abs(float(slope)) * float(history.times[early[0]])
        sigma = noise(history.times[parts[0].frames], history.outputs[output][parts[0].frames])
        if elastic > 0 and crept < STILL * elastic and abs(off) > max(ELASTIC * elastic, 6 * sigma):
            found[k] = (
                f"{output} begins {'above' if off > 0 else 'below'} the elastic one by {abs(off):.3g}: "
                f"{start:.3g} (its first {_FIRST} frames carried back to 0 s), where {_modulus(history) / 1e3:.4g} GPa "
                f"make {elastic:.3g}"
            )
    return found


def _elastic_value(history: History, frame: int, specimen: Predictor, output: str) -> float:
    """What the specimen shows without creep at a frame."""
    bare = history.replace(times=history.times[frame : frame + 1], outputs={}, standard_deviation={})
    found = specimen.predict(_RIGID, {"A": 0.0, "n": 1.0}, [bare])
    return float(found.of(0)[0, found.outputs.index(output)])


def _groups(histories: Sequence[History]) -> list[tuple[list[int], float]]:
    """Tests loaded alike, and until when; those of six and more with an alloy in common."""
    groups: list[list[int]] = []
    for k, history in enumerate(histories):
        mine = next((g for g in groups if _alike_until(histories[g[0]], history) is not None), None)
        groups.append([k]) if mine is None else mine.append(k)
    out = []
    for group in groups:
        ends = [end for end in (_alike_until(histories[group[0]], histories[k]) for k in group) if end is not None]
        if not ends:
            continue
        kept = [k for k in group if _growth(histories[k], min(ends)) > 0]
        if len(kept) >= TREND_TESTS and np.ptp([_warmth(histories[k]) for k in kept]) > TWIN_TEMPERATURE:
            out.append((kept, min(ends)))
    return out


def _strays(x: Floats, y: Floats, *, degree: int, least: float) -> dict[int, float]:
    """{index: value of the trend there}: points off the polynomial trend of the others, the farthest first.

    Each is compared with a fit without it; at most a third are taken for strays.
    """
    kept, found = list(range(x.size)), dict[int, float]()
    scale = np.ptp(x)
    for _ in range(x.size // 3):
        if len(kept) < degree + 4 or not all(_shows_trend(np.delete(x[kept], k), degree) for k in range(len(kept))):
            break
        best = (0.0, -1, 0.0)
        for k in kept:
            others = [j for j in kept if j != k]
            places = (x[others] - x[k]) / scale
            trend = np.polyfit(places, y[others], degree)
            rest = y[others] - np.polyval(trend, places)
            spread = float(np.sqrt((rest**2).sum() / (len(others) - degree - 1)))
            design = np.vander(places, degree + 1)
            reach = float(np.linalg.inv(design.T @ design)[-1, -1])
            ratio = abs(float(y[k] - trend[-1])) / max(spread * np.sqrt(1 + reach), 1e-12)
            if abs(y[k] - trend[-1]) > least and ratio > best[0]:
                best = (ratio, k, float(trend[-1]))
        if best[0] < TREND_NOISE:
            break
        found[best[1]] = best[2]
        kept.remove(best[1])
    return found


def _shows_trend(x: Floats, degree: int) -> bool:
    """Whether points lie at enough different places for a polynomial, with one to spare."""
    return np.unique(np.round((x - x.min()) / max(float(np.ptp(x)), 1e-300), 2)).size >= degree + 2


def _ratio(one: History, two: History, end: float) -> float:
    """How many times as much as the other a test has grown, over a common time; 1 where that is not known."""
    pairs = [(_growth(one, share * end), _growth(two, share * end)) for share in _MOMENTS]
    ratios = [a / b for a, b in pairs if a > 0 and b > 0]
    return float(np.median(ratios)) if ratios else 1.0


def _alike_until(one: History, two: History) -> float | None:
    """Until when two tests of one kind were loaded alike, s; None for too short a time."""
    if (one.specimen, one.alloy, leading(one)) != (two.specimen, two.alloy, leading(two)):
        return None
    end = min(_last(one), _last(two))
    a, b = one.loading.program(), two.loading.program()
    marks = np.unique(np.concatenate([a.times, b.times, one.times, two.times]))
    marks = marks[(marks > 0) & (marks <= end)]
    if not marks.size:
        return None
    apart = np.abs(a.at(marks) - b.at(marks)) > 0.01 * max(float(a.values.max()), float(b.values.max()))
    until = float(marks[np.argmax(apart)]) if apart.any() else end
    shared = [t for h in (one, two) for t in [h.times[h.used & (h.times < until * (1 + 1e-12))]]]
    if any(t.size < 2 for t in shared) or until < COMMON * end:
        return None
    return min(float(t[-1]) for t in shared)


def _last(history: History) -> float:
    return float(history.times[history.used][-1]) if history.used.any() else 0.0


def _growth(history: History, end: float) -> float:
    """Growth of the leading output from the first used frame to a time; 0 if it is not known."""
    y = history.outputs.get(leading(history), np.full(history.times.size, np.nan))
    usable = history.used & np.isfinite(y) & (history.times > 0)
    if usable.sum() < 2 or _last(history) < end * (1 - 1e-9):
        return 0.0
    return float(np.interp(end, history.times[usable], y[usable]) - y[usable][0])


def _arrhenius(history: History, end: float) -> tuple[float, float]:
    return 1.0 / _warmth(history), float(np.log(_growth(history, end)))


def _warmth(history: History) -> float:
    """Mean temperature, K."""
    return float(history.temperature_program().at(history.times).mean())


def _celsius(history: History) -> str:
    return f"{_warmth(history) - ZERO_CELSIUS:.1f} C"


def _modulus(history: History) -> float:
    assert history.elastic is not None
    return float(history.elastic.at(_warmth(history)).E)
