"""Tests of doubtful quality beside others: replicates, trends with temperature, elasticity."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from creepkit.arrays import Floats
from creepkit.language import CreepLaw, Param, parameters, stress
from creepkit.quality.flags import QualityFlag
from creepkit.quality.frames import load_segments, noise_standard_deviation
from creepkit.records import History, Predictor, growing_output, output_named
from creepkit.records.units import celsius_text, time_text

REPLICATE_TEMPERATURE_TOLERANCE = 3.0
"""K between replicates; at 400 kJ/mol and 800 C it changes rates by 13 %."""


REPLICATE_FACTOR, LOGARITHMIC_REPLICATE_FACTOR = 1.6, 3.0
"""Between the creep of replicates. Deflections: three standard deviations of 2^0.5 times 11 %, which is what
thicknesses that scatter by 5.5 % do to that of a dimple. Strains of bars, compared by their logarithms: rates scatter
by a factor of two, and products and environments differ."""


_COMPARISON_FRACTIONS = np.linspace(0.2, 1.0, 9)
"""Fractions of the common time at which replicates are compared; the median counts, as the end of a failing test may
differ."""


COMMON_TIME_FRACTION = 0.5
"""Fraction of the shorter test for which two tests must have been loaded alike to be compared."""


FEWEST_TREND_TESTS = 6
"""Least number of tests that show a trend with temperature."""


TREND_THRESHOLD = 5.0
"""Standard deviations of the others about their trend that a test must be off it."""


TEMPERATURE_ERROR = 15.0
"""K that a temperature must seem wrong by: thermocouples and gradients make up to 10 K."""


MODULUS_ERROR = 0.03
"""Relative error of a modulus; curves of handbooks differ by that much."""


ELASTIC_ERROR = 0.15
"""Fraction of the elastic deflection by which a first frame must differ from it: thicknesses and moduli known to 5 %
make 10 %."""


NEGLIGIBLE_CREEP = 0.1
"""Fraction of the elastic deflection, largest creep before the first frame with which the latter can be checked."""


_FIRST_FRAMES = 5


_A, _n = parameters("A n")


_NO_CREEP_LAW = CreepLaw(
    name="no creep",
    title="No creep",
    terms={"power law": _A * stress**_n},
    params={
        _A: Param("rate coefficient", unit="1/s", bounds=(1e-40, 1.0), scale="log", off=0.0),
        _n: Param("exponent", bounds=(1, 8)),
    },
    references=("a rate of zero",),
)


def replicate_deviations(histories: Sequence[History]) -> Iterator[QualityFlag]:
    """Of two replicates that differ the one that is farther from the trend of the others, else both."""
    results: dict[int, str] = {}
    for a, b in combinations(range(len(histories)), 2):
        one, two = histories[a], histories[b]
        end = _same_loading_until(one, two)
        if abs(one.mean_temperature - two.mean_temperature) > REPLICATE_TEMPERATURE_TOLERANCE or end is None:
            continue
        ratio = _creep_ratio(one, two, end)
        logarithmic = output_named(growing_output(one), one.specimen).logarithmic
        if max(ratio, 1.0 / ratio) < (LOGARITHMIC_REPLICATE_FACTOR if logarithmic else REPLICATE_FACTOR):
            continue
        for k, other in _deviating_tests(histories, a, b, end):
            test, replicate = histories[k], histories[other]
            growth = [f"{_creep_increment(each, end):.3g}" for each in (test, replicate)]
            results[k] = (
                f"grows {_creep_ratio(test, replicate, end):.2f} times as much as its replicate {replicate.name} "
                f"(to {time_text(end)} by {growth[0]} and {growth[1]}), "
                f"at {celsius_text(test.mean_temperature)} and {celsius_text(replicate.mean_temperature)}"
            )
    return (QualityFlag((histories[k].name,), "replicate", (), reason) for k, reason in results.items())


def _deviating_tests(histories: Sequence[History], a: int, b: int, end: float) -> list[tuple[int, int]]:
    """(deviating test, replicate): the one farther from the trend of the tests loaded alike, both if there is none."""
    pair = (a, b)
    others = [
        k
        for k, h in enumerate(histories)
        if k not in pair and (_same_loading_until(histories[a], h) or 0) >= end and _creep_increment(h, end) > 0
    ]
    x, y = _arrhenius_points([histories[k] for k in (*others, *pair)], end)
    if len(others) < FEWEST_TREND_TESTS or not _shows_trend(1.0 / x[:-2], 2):
        return [(a, b), (b, a)]
    scaled_x = (x - x[-1]) / np.ptp(x)
    deviations = np.abs(y - np.polyval(np.polyfit(scaled_x[:-2], y[:-2], 2), scaled_x))[-2:]
    return [(a, b)] if deviations[0] > deviations[1] else [(b, a)]


def temperature_trend_outliers(histories: Sequence[History]) -> Iterator[QualityFlag]:
    """Tests that grew as others did at quite another temperature."""
    for group, end in _comparable_groups(histories):
        x, y = _arrhenius_points(group, end)
        slope = float(np.polyfit(x - x.mean(), y, 1)[0])
        if slope >= 0:  # no activation: nothing is known of temperatures
            continue
        smallest = -slope * TEMPERATURE_ERROR * float(x.mean()) ** 2
        for k, expected in _trend_outliers(x, y, degree=2, smallest_deviation=smallest).items():
            temperature_error = (y[k] - expected) / -slope / x[k] ** 2
            reason = (
                f"grows {np.exp(y[k] - expected):.2f} times as much as the others' trend with temperature says, as if "
                f"it had been {abs(temperature_error):.0f} K {'warmer' if temperature_error > 0 else 'colder'} than "
                f"{celsius_text(group[k].mean_temperature)}"
            )
            yield QualityFlag((group[k].name,), "temperature", (), reason)


def modulus_trend_outliers(histories: Sequence[History]) -> Iterator[QualityFlag]:
    """Moduli off the straight line that those of the alloy follow over temperature."""
    groups: dict[tuple[str, str], list[History]] = {}
    for history in histories:
        if history.elastic is not None:
            groups.setdefault((history.alloy, history.specimen), []).append(history)
    for group in groups.values():
        x = np.array([history.mean_temperature for history in group])
        y = np.array([np.log(_youngs_modulus(history)) for history in group])
        for k, expected in _trend_outliers(x, y, degree=1, smallest_deviation=MODULUS_ERROR).items():
            reason = (
                f"a modulus of {np.exp(y[k]) / 1e3:.1f} GPa at {celsius_text(group[k].mean_temperature)}, where the "
                f"others lead to {np.exp(expected) / 1e3:.1f} GPa"
            )
            yield QualityFlag((group[k].name,), "modulus", (), reason)


def first_frame_deviations(histories: Sequence[History], specimen: Predictor) -> Iterator[QualityFlag]:
    """First frames that are not where the elastic specimen would be, in tests that creep slowly."""
    for history in histories:
        segments, output = load_segments(history), growing_output(history)
        if not segments or segments[0].frames.size < _FIRST_FRAMES or history.elastic is None:
            continue
        times, values = history.times[segments[0].frames], history.outputs[output][segments[0].frames]
        elastic = _elastic_value(history, int(segments[0].frames[0]), specimen, output)
        slope, intercept = (float(x) for x in np.polyfit(times[:_FIRST_FRAMES], values[:_FIRST_FRAMES], 1))
        deviation, creep = intercept - elastic, abs(slope) * float(times[0])
        limit = max(ELASTIC_ERROR * elastic, 6 * noise_standard_deviation(times, values))
        if elastic > 0 and creep < NEGLIGIBLE_CREEP * elastic and abs(deviation) > limit:
            reason = (
                f"{output} begins {'above' if deviation > 0 else 'below'} the elastic one by {abs(deviation):.3g}: "
                f"{intercept:.3g} (its first {_FIRST_FRAMES} frames carried back to 0 s), where "
                f"{_youngs_modulus(history) / 1e3:.4g} GPa make {elastic:.3g}"
            )
            yield QualityFlag((history.name,), "first frame", (int(np.argmax(history.used)),), reason)


def _elastic_value(history: History, frame: int, specimen: Predictor, output: str) -> float:
    """Output of the specimen without creep at a frame."""
    elastic_history = history.replace(times=history.times[frame : frame + 1], outputs={}, standard_deviation={})
    theta = _NO_CREEP_LAW.to_internal({"A": 0.0, "n": 1.0})
    result = specimen.predict(_NO_CREEP_LAW, theta, [elastic_history])
    return float(result.of(0)[0, result.outputs.index(output)])


def _comparable_groups(histories: Sequence[History]) -> Iterator[tuple[list[History], float]]:
    """Tests loaded alike, and until when; those of enough at different temperatures."""
    groups: list[list[tuple[History, float]]] = []
    for history in histories:
        alike = ((group, _same_loading_until(group[0][0], history)) for group in groups)
        group, end = next(((group, end) for group, end in alike if end is not None), (None, None))
        if group is None or end is None:
            end = _same_loading_until(history, history)
            groups += [] if end is None else [[(history, end)]]
        else:
            group.append((history, end))
    for group in groups:
        until = min(end for _, end in group)
        members = [history for history, _ in group if _creep_increment(history, until) > 0]
        temperatures = [history.mean_temperature for history in members]
        if len(members) >= FEWEST_TREND_TESTS and np.ptp(temperatures) > REPLICATE_TEMPERATURE_TOLERANCE:
            yield members, until


def _trend_outliers(x: Floats, y: Floats, *, degree: int, smallest_deviation: float) -> dict[int, float]:
    """{index: value of the trend there}: points off the polynomial trend of the others, the farthest first.

    Each is compared with a fit without it, by its deleted residual (Cook and Weisberg, 1982, Residuals and Influence in
    Regression, 2.2); at most a third are taken for strays.
    """
    remaining, result = np.arange(x.size), dict[int, float]()
    for _ in range(x.size // 3 if x.size >= FEWEST_TREND_TESTS else 0):
        if remaining.size < degree + 4 or not all(_shows_trend(np.delete(x, k), degree) for k in range(x.size)):
            break
        basis = np.linalg.qr(np.vander((x - x.mean()) / np.ptp(x), degree + 1))[0]
        residual, free = y - basis @ (basis.T @ y), 1.0 - (basis**2).sum(axis=1)
        variance = (residual @ residual - residual**2 / free) / (x.size - degree - 2)
        ratio = np.abs(residual) / np.maximum(np.sqrt(np.maximum(variance, 0.0) * free), 1e-12 * free)
        ratio[np.abs(residual) <= smallest_deviation * free] = 0.0
        k = int(np.argmax(ratio))
        if ratio[k] < TREND_THRESHOLD:
            break
        result[int(remaining[k])] = float(y[k] - residual[k] / free[k])
        remaining, x, y = np.delete(remaining, k), np.delete(x, k), np.delete(y, k)
    return result


def _shows_trend(x: Floats, degree: int) -> bool:
    """Whether points lie at enough different places for a polynomial, with one to spare."""
    return np.unique(np.round((x - x.min()) / max(float(np.ptp(x)), 1e-300), 2)).size >= degree + 2


def _creep_ratio(one: History, two: History, end: float) -> float:
    """How many times as much as the other a test has grown, over a common time; 1 where that is not known."""
    pairs = [
        (_creep_increment(one, share * end), _creep_increment(two, share * end)) for share in _COMPARISON_FRACTIONS
    ]
    ratios = [a / b for a, b in pairs if a > 0 and b > 0]
    return float(np.median(ratios)) if ratios else 1.0


def _same_loading_until(one: History, two: History) -> float | None:
    """Until when two tests of one kind were loaded alike, s; None for too short a time."""
    if (one.specimen, one.alloy, growing_output(one)) != (two.specimen, two.alloy, growing_output(two)):
        return None
    end = min(_last_used_time(one), _last_used_time(two))
    a, b = one.loading.program(), two.loading.program()
    common_times = np.unique(np.concatenate([a.times, b.times, one.times, two.times]))
    common_times = common_times[(common_times > 0) & (common_times <= end)]
    if not common_times.size:
        return None
    differs = np.abs(a.at(common_times) - b.at(common_times)) > 0.01 * max(float(a.values.max()), float(b.values.max()))
    same_until = float(common_times[np.argmax(differs)]) if differs.any() else end
    common_frames = [t for h in (one, two) for t in [h.times[h.used & (h.times < same_until * (1 + 1e-12))]]]
    if any(t.size < 2 for t in common_frames) or same_until < COMMON_TIME_FRACTION * end:
        return None
    return min(float(t[-1]) for t in common_frames)


def _last_used_time(history: History) -> float:
    return float(history.times[history.used][-1]) if history.used.any() else 0.0


def _creep_increment(history: History, end: float) -> float:
    """Growth of the leading output from the first used frame to a time; 0 if it is not known."""
    y = history.outputs.get(growing_output(history), np.full(history.times.size, np.nan))
    usable = history.used & np.isfinite(y) & (history.times > 0)
    if usable.sum() < 2 or _last_used_time(history) < end * (1 - 1e-9):
        return 0.0
    return float(np.interp(end, history.times[usable], y[usable]) - y[usable][0])


def _arrhenius_points(histories: Sequence[History], end: float) -> tuple[Floats, Floats]:
    """(tests,) 1/K, and logarithms of the growth up to a time."""
    growth = [_creep_increment(history, end) for history in histories]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.array([1.0 / history.mean_temperature for history in histories]), np.log(growth)


def _youngs_modulus(history: History) -> float:
    assert history.elastic is not None
    return float(history.elastic.at(history.mean_temperature).E)
