"""Tests of doubtful quality beside others: replicates, trends with temperature, elasticity, duplicates."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from creepkit.arrays import Floats
from creepkit.language import CreepLaw, Param, parameters, stress
from creepkit.quality.frames import load_segments, noise_standard_deviation
from creepkit.records import History, Predictor, Program, growing_output, output_named, predict_with
from creepkit.records.units import celsius_text, time_text


def duplicate_tests(
    histories: Sequence[History], *, time_rounding: float = 1e-5, output_rounding: float = 1e-4
) -> list[tuple[str, str]]:
    """Return the names of every two histories that are one test: same condition, same end.

    The end is the last frame: its time and each output must agree to the relative roundings (two times of six digits
    may differ by 1e-5). Records of one test may differ elsewhere, since sources thin them in their own ways.
    """
    pairs = combinations(histories, 2)
    return [(a.name, b.name) for a, b in pairs if _same_test(a, b, time_rounding, output_rounding)]


def _same_test(a: History, b: History, time_rounding: float, output_rounding: float) -> bool:
    if a.specimen != b.specimen or a.outputs.keys() != b.outputs.keys():
        return False
    if abs(a.times[-1] - b.times[-1]) > time_rounding * abs(b.times[-1]):
        return False
    if not a.outputs and (a.minimum_rate, a.rupture_time) != (b.minimum_rate, b.rupture_time):
        return False
    if not all(np.isclose(a.outputs[k][-1], b.outputs[k][-1], rtol=output_rounding, atol=0.0) for k in a.outputs):
        return False
    return _same_program(a.loading.program(), b.loading.program()) and _same_program(
        a.temperature_program(), b.temperature_program()
    )


def _same_program(a: Program, b: Program) -> bool:
    return a.times.shape == b.times.shape and np.allclose(a.times, b.times) and np.allclose(a.values, b.values)


REPLICATE_TEMPERATURE_TOLERANCE = 3.0
"""K between replicates; at 400 kJ/mol and 800 C it changes rates by 13 %."""


REPLICATE_FACTOR, LOGARITHMIC_REPLICATE_FACTOR = 1.6, 3.0
"""Between the creep of replicates. Deflections: three standard deviations of 2^0.5 times 11 %, which is what
thicknesses that scatter by 5.5 % do to that of a dimple. Strains of bars, compared by their logarithms: rates scatter
by a factor of two, and products and environments differ."""


def _replicate_factor(history: History) -> float:
    logarithmic = output_named(growing_output(history), history.specimen).logarithmic
    return LOGARITHMIC_REPLICATE_FACTOR if logarithmic else REPLICATE_FACTOR


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


def replicate_deviations(histories: Sequence[History]) -> dict[int, str]:
    """{test: reason}; of two replicates that differ the one that is farther from the trend of the others, else both."""
    results: dict[int, str] = {}
    for a, b in combinations(range(len(histories)), 2):
        one, two = histories[a], histories[b]
        end = _same_loading_until(one, two)
        if abs(one.mean_temperature - two.mean_temperature) > REPLICATE_TEMPERATURE_TOLERANCE or end is None:
            continue
        ratio = _creep_ratio(one, two, end)
        if max(ratio, 1.0 / ratio) < _replicate_factor(one):
            continue
        for k, other in _deviating_tests(histories, a, b, end):
            creep_of_test, creep_of_replicate = (_creep_increment(histories[j], end) for j in (k, other))
            results[k] = (
                f"grows {_creep_ratio(histories[k], histories[other], end):.2f} times as much as its replicate "
                f"{histories[other].name} (to {time_text(end)} by {creep_of_test:.3g} and {creep_of_replicate:.3g}), "
                f"at {_celsius_text(histories[k])} and {_celsius_text(histories[other])}"
            )
    return results


def _deviating_tests(histories: Sequence[History], a: int, b: int, end: float) -> list[tuple[int, int]]:
    """(deviating test, replicate): the one farther from the trend of the tests loaded alike, both if there is none."""
    pair = (a, b)
    others = [
        k for k, h in enumerate(histories) if k not in pair and (_same_loading_until(histories[a], h) or 0) >= end
    ]
    others = [k for k in others if _creep_increment(histories[k], end) > 0]
    if len(others) < FEWEST_TREND_TESTS or not _shows_trend(
        np.array([histories[k].mean_temperature for k in others]), 2
    ):
        return [(a, b), (b, a)]
    x, y = (np.array([_arrhenius_point(histories[k], end)[i] for k in (*others, *pair)]) for i in (0, 1))
    scaled_x = (x - x[-1]) / np.ptp(x)
    deviations = np.abs(y - np.polyval(np.polyfit(scaled_x[:-2], y[:-2], 2), scaled_x))[-2:]
    return [(a, b)] if deviations[0] > deviations[1] else [(b, a)]


def temperature_trend_outliers(histories: Sequence[History]) -> dict[int, str]:
    """{test: reason}: tests that grew as others did at quite another temperature."""
    results: dict[int, str] = {}
    for group, end in _comparable_groups(histories):
        x, y = (np.array([_arrhenius_point(histories[k], end)[i] for k in group]) for i in (0, 1))
        slope = float(np.polyfit(x - x.mean(), y, 1)[0])
        if slope >= 0:  # no activation: nothing is known of temperatures
            continue
        for k, expected in _trend_outliers(
            x, y, degree=2, smallest_deviation=-slope * TEMPERATURE_ERROR * float(x.mean()) ** 2
        ).items():
            temperature_error = (y[k] - expected) / -slope / x[k] ** 2
            results[group[k]] = (
                f"grows {np.exp(y[k] - expected):.2f} times as much as the others' trend with temperature says, as if "
                f"it had been {abs(temperature_error):.0f} K {'warmer' if temperature_error > 0 else 'colder'} than "
                f"{_celsius_text(histories[group[k]])}"
            )
    return results


def modulus_trend_outliers(histories: Sequence[History]) -> dict[int, str]:
    """{test: reason}: moduli off the straight line that those of the alloy follow over temperature."""
    results: dict[int, str] = {}
    alloys = {(h.alloy, h.specimen) for h in histories if h.elastic is not None}
    for alloy in alloys:
        group = [k for k, h in enumerate(histories) if (h.alloy, h.specimen) == alloy and h.elastic is not None]
        if len(group) < FEWEST_TREND_TESTS:
            continue
        x = np.array([histories[k].mean_temperature for k in group])
        y = np.array([np.log(_youngs_modulus(histories[k])) for k in group])
        for k, expected in _trend_outliers(x, y, degree=1, smallest_deviation=MODULUS_ERROR).items():
            results[group[k]] = (
                f"a modulus of {np.exp(y[k]) / 1e3:.1f} GPa at {_celsius_text(histories[group[k]])}, where the others "
                f"lead to {np.exp(expected) / 1e3:.1f} GPa"
            )
    return results


def first_frame_deviations(histories: Sequence[History], specimen: Predictor) -> dict[int, str]:
    """{test: reason}: first frames that are not where the elastic specimen would be, in tests that creep slowly."""
    results: dict[int, str] = {}
    for k, history in enumerate(histories):
        segments, output = load_segments(history), growing_output(history)
        if not segments or segments[0].frames.size < _FIRST_FRAMES or history.elastic is None:
            continue
        elastic = _elastic_value(history, int(segments[0].frames[0]), specimen, output)
        first_segment_frames = segments[0].frames[:_FIRST_FRAMES]
        slope, intercept = np.polyfit(
            history.times[first_segment_frames], history.outputs[output][first_segment_frames], 1
        )
        deviation = float(intercept) - elastic
        creep = abs(float(slope)) * float(history.times[first_segment_frames[0]])
        sigma = noise_standard_deviation(history.times[segments[0].frames], history.outputs[output][segments[0].frames])
        if (
            elastic > 0
            and creep < NEGLIGIBLE_CREEP * elastic
            and abs(deviation) > max(ELASTIC_ERROR * elastic, 6 * sigma)
        ):
            results[k] = (
                f"{output} begins {'above' if deviation > 0 else 'below'} the elastic one by {abs(deviation):.3g}: "
                f"{intercept:.3g} (its first {_FIRST_FRAMES} frames carried back to 0 s), where "
                f"{_youngs_modulus(history) / 1e3:.4g} GPa make {elastic:.3g}"
            )
    return results


def _elastic_value(history: History, frame: int, specimen: Predictor, output: str) -> float:
    """Output of the specimen without creep at a frame."""
    elastic_history = history.replace(times=history.times[frame : frame + 1], outputs={}, standard_deviation={})
    theta = _NO_CREEP_LAW.to_internal({"A": 0.0, "n": 1.0})
    result = predict_with(specimen, _NO_CREEP_LAW, theta, [elastic_history])
    return float(result.of(0)[0, result.outputs.index(output)])


def _comparable_groups(histories: Sequence[History]) -> list[tuple[list[int], float]]:
    """Tests loaded alike, and until when; those of six and more with an alloy in common."""
    groups: list[list[int]] = []
    for k, history in enumerate(histories):
        matching_group = next((g for g in groups if _same_loading_until(histories[g[0]], history) is not None), None)
        groups.append([k]) if matching_group is None else matching_group.append(k)
    groups_with_end = []
    for group in groups:
        ends = [
            end for end in (_same_loading_until(histories[group[0]], histories[k]) for k in group) if end is not None
        ]
        if not ends:
            continue
        members = [k for k in group if _creep_increment(histories[k], min(ends)) > 0]
        if (
            len(members) >= FEWEST_TREND_TESTS
            and np.ptp([histories[k].mean_temperature for k in members]) > REPLICATE_TEMPERATURE_TOLERANCE
        ):
            groups_with_end.append((members, min(ends)))
    return groups_with_end


def _trend_outliers(x: Floats, y: Floats, *, degree: int, smallest_deviation: float) -> dict[int, float]:
    """{index: value of the trend there}: points off the polynomial trend of the others, the farthest first.

    Each is compared with a fit without it; at most a third are taken for strays.
    """
    remaining, result = list(range(x.size)), dict[int, float]()
    scale = np.ptp(x)
    for _ in range(x.size // 3):
        if len(remaining) < degree + 4 or not all(
            _shows_trend(np.delete(x[remaining], k), degree) for k in range(len(remaining))
        ):
            break
        largest = (0.0, -1, 0.0)
        for k in remaining:
            others = [j for j in remaining if j != k]
            scaled_x = (x[others] - x[k]) / scale
            trend = np.polyfit(scaled_x, y[others], degree)
            residuals = y[others] - np.polyval(trend, scaled_x)
            standard_deviation = float(np.sqrt((residuals**2).sum() / (len(others) - degree - 1)))
            design = np.vander(scaled_x, degree + 1)
            leverage = float(np.linalg.inv(design.T @ design)[-1, -1])
            ratio = abs(float(y[k] - trend[-1])) / max(standard_deviation * np.sqrt(1 + leverage), 1e-12)
            if abs(y[k] - trend[-1]) > smallest_deviation and ratio > largest[0]:
                largest = (ratio, k, float(trend[-1]))
        if largest[0] < TREND_THRESHOLD:
            break
        result[largest[1]] = largest[2]
        remaining.remove(largest[1])
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


def _arrhenius_point(history: History, end: float) -> tuple[float, float]:
    return 1.0 / history.mean_temperature, float(np.log(_creep_increment(history, end)))


def _celsius_text(history: History) -> str:
    return celsius_text(history.mean_temperature)


def _youngs_modulus(history: History) -> float:
    assert history.elastic is not None
    return float(history.elastic.at(history.mean_temperature).E)
