"""Panels of residuals: what a law leaves of each reading over its noise, on an axis that most tests need."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from creepkit.arrays import Floats
from creepkit.records import is_logarithmic
from creepkit.reports.curve_of_test import curve_of_test, line_style, set_time_range, unit_of
from creepkit.reports.figures import set_range
from creepkit.reports.judged_readings import JudgedReadings, judged_readings
from creepkit.reports.load_programs import SECONDS_PER_HOUR
from creepkit.reports.prediction_bands import FittedCurves

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from creepkit.inverse.identification import Identification

NOISE_BAND = 2.0
"""Standard deviations of the noise of a reading that are shaded."""


LEAST_RANGE = 3.5
"""Standard deviations that the axis shows at least to either side."""


SHOWN_QUANTILE = 0.99
"""Of the sizes of the residuals of a test, what the axis shows."""


OUTLYING_RATIO = 4.0
"""Tests whose residuals exceed those of the median test by this factor do not set the axis."""


class Series(NamedTuple):
    """The residuals of one test, in the order of time. hours, values : (readings,)."""

    test: int
    hours: Floats
    values: Floats


def draw_residuals(
    axes: Axes,
    fit: Identification,
    curves: FittedCurves,
    output: str,
    tests: Sequence[int],
    colours: Sequence[Any] | Mapping[int, Any],
) -> str:
    """What the law leaves of the readings of tests; returns a title that says what is drawn.

    Over the noise of each reading, with the tests' own rates, lives and offsets, as the law is judged; where the noise
    is not known, measured less identified. Readings beyond the axis are marked at its edge.
    """
    readings = judged_readings(fit)
    judged = readings is not None and any(readings.mask(k, output).any() for k in tests)
    every = []
    for k in (k for k in tests if any(one.output == output for one in fit.tests[k].outputs)):
        series = _judged_series(readings, k, output) if judged and readings else _plain_series(fit, curves, k, output)
        if series.values.size:
            every.append(series)
    limit = _limit([series.values for series in every], LEAST_RANGE if judged else 0.0)
    beyond = 0
    for k, hours, values in every:
        style = line_style(fit.tests[k].weight)
        axes.plot(hours, values, style, lw=0.9, color=colours[k], alpha=0.85)
        for sign, marker in ((1.0, "^"), (-1.0, "v")):
            outside = sign * values > limit
            if outside.any():  # a line without points would collapse the layout
                edge = np.full(int(outside.sum()), sign * limit)
                axes.plot(hours[outside], edge, marker, ms=3.5, color=colours[k], mec="none", clip_on=False, zorder=4)
                beyond += edge.size
    if judged:
        axes.axhspan(-NOISE_BAND, NOISE_BAND, color="black", alpha=0.1, lw=0)
    axes.axhline(0, color="black", lw=0.8)
    set_range(axes, "y", -limit, limit, most=7)
    axes.set_ylim(-limit, limit)
    if every:
        set_time_range(axes, np.concatenate([series.hours for series in every]), output)
    name = output.replace("_", " ")
    axes.set(xlabel="time, h", ylabel=f"{name},\nnoise sd" if judged else _plain_label(name, output))
    axes.grid(alpha=0.25)
    marked = f"\n▴▾: {beyond} beyond the axis" if beyond else ""
    return f"{_title(readings, output, tests, fit) if judged and readings else _plain_title(fit, output)}{marked}"


def residual_caption(fit: Identification) -> str:
    """What panels of residuals show, for captions."""
    if judged_readings(fit) is None:
        return "measured less identified"
    return (
        "measured less identified over the standard deviation of the noise of the reading, with the test's own rate, "
        "rupture life and offset, as where the law is judged; grey: two standard deviations"
    )


def _judged_series(readings: JudgedReadings, test: int, output: str) -> Series:
    times, values = readings.residuals(test, output)
    order = np.argsort(times, kind="stable")
    return Series(test, times[order] / SECONDS_PER_HOUR, values[order])


def _plain_series(fit: Identification, curves: FittedCurves, test: int, output: str) -> Series:
    curve = curve_of_test(fit, curves, test, output)
    known = np.isfinite(curve.residuals)
    return Series(test, curve.hours[known], curve.residuals[known])


def _limit(values: Sequence[Floats], least: float) -> float:
    """The end of a symmetric axis: what the tests need but for those that lie far beyond the median test."""
    needed = [float(np.quantile(np.abs(one), SHOWN_QUANTILE)) for one in values]
    if not needed:
        return max(least, 1.0)
    middle = float(np.median(needed))
    most = max(one for one in needed if one <= OUTLYING_RATIO * middle or middle == 0.0)
    return max(1.15 * most, least) or 1.0


def _title(readings: JudgedReadings, output: str, tests: Sequence[int], fit: Identification) -> str:
    """Noise and reduced chi-square of an output."""
    unit = unit_of(output)
    ends = [ends for k in tests if (ends := readings.noise(k, output)) is not None]
    factor = 100.0 if is_logarithmic(output) else 1.0
    low, high = factor * min(e[0] for e in ends), factor * max(e[1] for e in ends)
    size = f"{low:.2g}" if f"{low:.2g}" == f"{high:.2g}" else f"{low:.2g} to {high:.2g}"
    whole = len(tests) == len(fit.tests)
    chi_square = readings.chi_square(None if whole else tests[0], output)
    of_tests = f", reduced chi-square {chi_square:.3g}" if whole or len(tests) == 1 else ""
    return f"{output.replace('_', ' ')}: noise sd {size}{' ' + unit if unit else ''}{of_tests}"


def _plain_label(name: str, output: str) -> str:
    if is_logarithmic(output):
        return f"100 ln (measured / identified {name}), ≈ %"
    return f"{name}, {unit_of(output)}" if unit_of(output) else name


def _plain_title(fit: Identification, output: str) -> str:
    noise = "noise not known"
    if is_logarithmic(output):
        return f"measured less identified, rms {fit.rms:.3g} of ln strain; {noise}"
    return f"measured less identified {output.replace('_', ' ')}; {noise}"
