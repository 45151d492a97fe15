"""Panels of creep rates over stress and of rupture times, measured beside identified, with 95 % intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import CreepkitError
from creepkit.inverse.identified_values import MinimumRate, minimum_rates_of
from creepkit.inverse.minimum_rates import apparent_exponent
from creepkit.inverse.reference_conditions import ISOTHERMAL_RANGE, reference_stresses
from creepkit.language import strain, time
from creepkit.records import SECONDS_PER_HOUR, ZERO_CELSIUS, Prediction
from creepkit.records.units import celsius_text
from creepkit.reports.condition_colours import ColourScale, distinct_colours, temperature_scale, tested_temperatures
from creepkit.reports.figures import panels_of, place_legend_right, set_range, shortened
from creepkit.reports.prediction_bands import HoldRate, rates_of_tests

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.inverse.identification import Identification
    from creepkit.inverse.single_values import SingleValue


MOST_TEMPERATURES = 6
"""Curves of rate over stress at most."""


SMALLEST_SHARE = 1e-4
"""Of the lowest curve: rates of tests below that are not drawn."""


def draw_rates(axes: Axes, fit: Identification, prediction: Prediction) -> None:
    """Creep rates over stress: measured minimum rates and those by the law, or the law's rate at the reference point.

    prediction : of the fitted tests, at their own nuisances.
    """
    minimum_rates = compared_minimum_rates(fit)
    if minimum_rates:
        draw_minimum_rates(axes, fit, minimum_rates)
    else:
        _draw_reference_rates(axes, fit, rates_of_tests(fit, prediction))


def _draw_reference_rates(axes: Axes, fit: Identification, rates: Sequence[HoldRate]) -> None:
    """Identified rate over stress with its 95 % band at some temperatures, and that rate times what each test shows."""
    stresses = [v for h in fit.histories for v in reference_stresses(h, fit.predictor) if v > 0]
    if not stresses:
        axes.set_axis_off()
        return
    grid = np.geomspace(0.8 * min(stresses), 1.25 * max(stresses), 60)
    scale = temperature_scale(fit.histories)
    bounds: list[float] = []
    for celsius in _drawn_temperatures(tested_temperatures(fit.histories)):
        rate, low, high = fit.rate(grid, np.full_like(grid, celsius + ZERO_CELSIUS), warn=False)
        rate, low, high = (PERCENT_PER_HOUR * v for v in (rate, low, high))
        axes.fill_between(grid, low, high, color=scale(celsius), alpha=0.25, lw=0)
        axes.plot(grid, rate, color=scale(celsius), lw=1.4, label=f"{celsius:.0f} °C")
        bounds += [float(rate.min()), float(rate.max()), float(low.min()), float(high.max())]
    shown = [r for r in rates if PERCENT_PER_HOUR * r.rate > SMALLEST_SHARE * min(bounds)]
    for marker, label, tests in (
        ("o", "law × measured /\nidentified growth\nof each test", [r for r in shown if not r.stated]),
        ("s", "law × measured /\nidentified minimum\nrate of each test", [r for r in shown if r.stated]),
    ):
        for k, test in enumerate(tests):
            axes.plot(
                test.stress,
                PERCENT_PER_HOUR * test.rate,
                marker,
                ms=4,
                color=scale(test.temperature - ZERO_CELSIUS),
                mec="black",
                mew=0.4,
                label=label if k == 0 else None,
            )
    bounds += [PERCENT_PER_HOUR * r.rate for r in shown]
    set_range(axes, "x", float(grid[0]), float(grid[-1]), logarithmic=True)
    finite = [b for b in bounds if np.isfinite(b) and b > 0]
    set_range(axes, "y", max(min(finite), 1e-12 * max(finite)), max(finite), logarithmic=True)
    axes.set(xlabel="von Mises stress, MPa", ylabel="creep rate, %/h")
    place_legend_right(axes, "95 % band:\nlaw")
    reference = fit.reference
    initial = "\ninternal variables as at the start, not those of a test" if fit.law.states else ""
    axes.set_title(
        f"the law's rate at strain {reference.strain:.2g} and {reference.time / SECONDS_PER_HOUR:.4g} h{initial}",
        fontsize=9,
    )


def _drawn_temperatures(tested: Sequence[float]) -> list[float]:
    """Temperatures of tests, °C: all where they are few, else some of them from the lowest to the highest."""
    values = np.unique(np.round(tested, 0))
    wanted = np.linspace(values[0], values[-1], MOST_TEMPERATURES)
    return [float(v) for v in np.unique(values[np.abs(values[:, None] - wanted).argmin(axis=0)])]


def rupture_rows(fit: Identification) -> list[SingleValue]:
    """The rupture times of the tests whose end is known and was compared with the law."""
    return [m.rupture for m in fit.tests if m.rupture is not None and m.rupture.used]


def draw_ruptures(axes: Axes, fit: Identification, colours: Sequence[Any]) -> None:
    """One point a test with its 95 % interval; tests that were stopped are open, and lie where they were stopped."""
    ruptures = [
        (m.rupture, colour)
        for m, colour in zip(fit.tests, colours, strict=True)
        if m.rupture is not None and m.rupture.used
    ]
    for r, colour in ruptures:
        if not np.isfinite(r.predicted):
            continue
        measured, predicted = r.measured / SECONDS_PER_HOUR, r.predicted / SECONDS_PER_HOUR
        ends = [predicted - r.low / SECONDS_PER_HOUR, r.high / SECONDS_PER_HOUR - predicted]
        interval = [[max(end, 0.0)] for end in ends]  # the median may lie outside where draws disagree with it
        marker, face = (">", "white") if r.censored else ("o", colour)
        axes.errorbar(measured, predicted, yerr=interval, fmt=marker, ms=4.5, lw=0.7, color=colour, mfc=face)
    finite = [(r.measured, r.predicted, r.low, r.high) for r, _ in ruptures if np.isfinite(r.predicted)]
    hours = np.array([*(t for row in finite for t in row), *(r.measured for r, _ in ruptures)]) / SECONDS_PER_HOUR
    hours = hours[np.isfinite(hours) & (hours > 0)]
    set_range(axes, "x", 0.8 * float(hours.min()), 1.25 * float(hours.max()), logarithmic=True, most=6)
    set_range(axes, "y", 0.8 * float(hours.min()), 1.25 * float(hours.max()), logarithmic=True, most=6)
    limits = np.array(axes.get_xlim())
    axes.plot(limits, limits, "k-", lw=1.2)
    axes.fill_between(limits, limits / 2, limits * 2, color="black", alpha=0.08, lw=0, label="factor of 2")
    if any(r.censored for r, _ in ruptures):
        axes.plot([], [], ">", ms=4.5, mfc="white", color="grey", label="stopped: broke\nlater, if at all")
    axes.set(xlabel="measured time to rupture, h", ylabel="identified time to rupture, h", ylim=tuple(limits))
    place_legend_right(axes)
    axes.set_title(
        "time to rupture; bars: 95 % of a single test\n(if the law is right; with scatter between tests)", fontsize=9
    )


# ---- minimum rates ---------------------------------------------------------------------------------------------------


MOST_NAMED_TEMPERATURES = 6
"""Temperatures that the legend names."""


PERCENT_PER_HOUR = 100.0 * SECONDS_PER_HOUR
"""Of 1/s."""


DRAWN_FACTOR = 30.0
"""Beyond the rates by which bands end at the axis."""


def compared_minimum_rates(fit: Identification) -> list[MinimumRate]:
    """Minimum rates to draw: of laws whose rate at a given strain and time is not what a test shows, else none.

    These are laws with internal variables or of strain or time, laws that the tests reject, and laws of tests that
    were followed to rupture. There are none where fewer than half of the tests show a minimum rate.
    """
    law, rejected = fit.law, getattr(fit.adequacy, "rejects", False)
    changing = bool(law.states) or law.uses(strain) or law.uses(time)
    if not (changing or rejected or any(m.rupture is not None for m in fit.tests)):
        return []
    try:
        rates = minimum_rates_of(fit)
    except CreepkitError:
        return []
    return rates if 2 * len(rates) >= len(fit.tests) else []


def exponents(rates: Sequence[MinimumRate]) -> tuple[float, float]:
    """The apparent stress exponents of measured and of predicted minimum rates; NaN of tests at one stress."""
    stresses, temperatures = _column(rates, "stress"), _column(rates, "temperature")
    measured, predicted = (
        apparent_exponent(stresses, _column(rates, name), temperatures) for name in ("measured", "predicted")
    )
    return measured, predicted


def exponent_sentence(rates: Sequence[MinimumRate]) -> str:
    """Both in words; "" where the stresses do not differ."""
    measured, predicted = exponents(rates)
    if not np.isfinite([measured, predicted]).all():
        return ""
    return f"apparent stress exponent: measured {measured:.2g}, by the law {predicted:.2g}"


def draw_minimum_rates(axes: Axes, fit: Identification, rates: Sequence[MinimumRate]) -> None:
    """Measured minimum rates as dots, those by the law for the same tests as a line with the 95 % band of one test."""
    scale = temperature_scale(fit.histories)
    rates = [_in_percent(rate) for rate in rates]
    levels = _levels(rates)
    for level in levels:
        _draw_level(axes, [r for r in rates if _level(r) == level], scale, named=len(levels) <= MOST_NAMED_TEMPERATURES)
    centre = _positive([v for r in rates for v in (r.measured, r.predicted)])
    ends = _positive([v for r in rates for v in (r.low, r.high)])
    ends = ends[(ends > centre.min() / DRAWN_FACTOR) & (ends < centre.max() * DRAWN_FACTOR)]
    values = np.concatenate([centre, ends])
    stresses = _column(rates, "stress")
    set_range(axes, "x", 0.93 * float(stresses.min()), 1.07 * float(stresses.max()), logarithmic=True, most=6)
    set_range(axes, "y", 0.8 * float(values.min()), 1.25 * float(values.max()), logarithmic=True)
    axes.plot([], [], "o", ms=4, color="grey", mec="black", mew=0.4, label="measured")
    axes.set(xlabel="stress, MPa", ylabel="minimum creep rate, %/h")
    place_legend_right(axes, "line: by the law;\nband: 95 % of\na single test")
    sentence = exponent_sentence(rates)
    heading = "minimum creep rate of the tests"
    axes.set_title(f"{heading}\n{sentence}" if sentence else heading, fontsize=9)


def _in_percent(rate: MinimumRate) -> MinimumRate:
    """The same in %/h."""
    drawn = {name: PERCENT_PER_HOUR * getattr(rate, name) for name in ("measured", "predicted", "low", "high")}
    return replace(rate, **drawn)


def _draw_level(axes: Axes, rates: Sequence[MinimumRate], scale: ColourScale, *, named: bool) -> None:
    """The tests of one temperature."""
    colour = scale(float(np.mean(_column(rates, "temperature"))) - ZERO_CELSIUS)
    known = sorted((r for r in rates if np.isfinite([r.predicted, r.low, r.high]).all()), key=lambda r: r.stress)
    if known:
        label = celsius_text(float(_column(known, "temperature").mean()), digits=0) if named else None
        stresses, predicted = _column(known, "stress"), _column(known, "predicted")
        low, high = _column(known, "low"), _column(known, "high")
        if np.ptp(stresses) > 0:
            axes.fill_between(stresses, low, high, color=colour, alpha=0.25, lw=0)
            axes.plot(stresses, predicted, color=colour, lw=1.4, label=label)
        else:
            error = np.stack([predicted - low, high - predicted])
            axes.errorbar(stresses, predicted, yerr=np.maximum(error, 0.0), fmt="_", color=colour, label=label)
    axes.plot(
        _column(rates, "stress"), _column(rates, "measured"), "o", ms=4, color=colour, mec="black", mew=0.4, zorder=3
    )


def _level(rate: MinimumRate) -> int:
    return round(rate.temperature / ISOTHERMAL_RANGE)


def _levels(rates: Sequence[MinimumRate]) -> list[int]:
    return sorted({_level(r) for r in rates})


def _column(rates: Sequence[MinimumRate], name: str) -> Floats:
    return np.array([getattr(r, name) for r in rates], float)


def _positive(values: Sequence[float]) -> Floats:
    array = np.array(values, float)
    return np.asarray(array[np.isfinite(array) & (array > 0)])


# ---- the map of a plate ----------------------------------------------------------------------------------------------


MOST_LAWS = 10
"""Laws with a colour of their own."""


WIDTH, ROW, LARGEST = 8.6, 0.17, 11.0
"""Inches of the figure, of a material in it, and of its height at most."""


def plate_figure(fits: Sequence[tuple[str, Identification]]) -> Figure:
    """Rates in %/h with 95 % intervals at the median stress of all; fits : (material, best law), in the order drawn."""
    stress = float(np.median([fit.reference.stress for _, fit in fits]))
    figure, axes = panels_of(WIDTH, min(1.4 + ROW * max(len(fits), 12), LARGEST))
    laws = list(dict.fromkeys(fit.law.name for _, fit in fits))
    colours = dict(zip(laws, distinct_colours(len(laws)), strict=True))
    rates = np.array([[float(v) for v in fit.rate(stress, warn=False)] for _, fit in fits])
    rates = PERCENT_PER_HOUR * rates
    centre = rates[:, 0][np.isfinite(rates[:, 0]) & (rates[:, 0] > 0)]
    named: set[str] = set()
    for k, ((_, fit), (rate, low, high)) in enumerate(zip(fits, rates, strict=True)):
        if not rate > 0:
            continue
        agrees = fit.adequacy is not None and fit.adequacy.explains
        label = fit.law.name if fit.law.name not in named and len(named) < MOST_LAWS else None
        named.add(fit.law.name)
        colour = colours[fit.law.name]
        ends = [[max(rate - max(low, rate / 1e3), 0.0)], [max(min(high, 1e3 * rate) - rate, 0.0)]]
        axes.errorbar(
            rate, k, xerr=ends, fmt="o", ms=4.5, lw=0.9, color=colour, mfc=colour if agrees else "white", label=label
        )
    if centre.size:
        drawn = rates[:, 1:][
            (rates[:, 1:] > centre.min() / DRAWN_FACTOR) & (rates[:, 1:] < centre.max() * DRAWN_FACTOR)
        ]
        every = np.concatenate([centre, drawn])
        set_range(axes, "x", float(every.min()), float(every.max()), logarithmic=True)
    axes.set_yticks(range(len(fits)), [shortened(name, 24) for name, _ in fits], fontsize=7 if len(fits) > 20 else 8)
    axes.set_ylim(len(fits) - 0.5, -0.5)
    axes.set(xlabel=f"creep rate at {stress:.3g} MPa, %/h")
    place_legend_right(axes, "law; open:\ncontradicted\nby its tests")
    return figure
