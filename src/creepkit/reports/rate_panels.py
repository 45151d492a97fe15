"""Panels of creep rates over stress and of rupture times, measured beside identified, with 95 % intervals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import CreepkitError
from creepkit.inverse.identified_values import MinimumRate, minimum_rates_of
from creepkit.inverse.minimum_rates import apparent_energy, apparent_exponent
from creepkit.inverse.reference_conditions import ISOTHERMAL_RANGE
from creepkit.language import strain, time
from creepkit.records import SECONDS_PER_HOUR, ZERO_CELSIUS
from creepkit.records.held_levels import held_temperatures
from creepkit.records.units import time_text
from creepkit.reports.condition_colours import distinct_colours, temperature_scale, tested_temperatures
from creepkit.reports.description import rejected
from creepkit.reports.figures import draw_parity, panels_of, place_legend, shortened, span
from creepkit.reports.words import MEAN_SLOPES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.inverse.identification import Identification
    from creepkit.inverse.single_values import SingleValue


MOST_TEMPERATURES = 6
"""Curves of rate over stress at most, and temperatures that the legend names."""


DRAWN_FACTOR = 30.0
"""Beyond the rates by which bands end at the axis."""


PERCENT_PER_HOUR = 100.0 * SECONDS_PER_HOUR
"""Of 1/s."""


class RateCurve(NamedTuple):
    """Rates over stress at a temperature.

    stress : (stresses,) MPa. rate, low, high : (stresses,) 1/s, with the ends of 95 % intervals. tested : MPa, the
    lowest and the highest stress of tests there; beyond them the curve is dashed.
    """

    celsius: float
    stress: Floats
    rate: Floats
    low: Floats
    high: Floats
    tested: tuple[float, float] = (0.0, np.inf)


class RatePoints(NamedTuple):
    """Rates that tests show; label : of the legend. celsius, stress, rate : (tests,) °C, MPa, 1/s."""

    label: str
    celsius: Floats
    stress: Floats
    rate: Floats


def has_rates(fit: Identification) -> bool:
    """Whether there are creep rates over stress to draw."""
    return bool(compared_minimum_rates(fit)) or any(_tested_stresses(fit))


def _tested_stresses(fit: Identification) -> list[float]:
    return [float(v) for stresses in fit.simulated_stresses for v in stresses]


def draw_rates(axes: Axes, fit: Identification) -> None:
    """Creep rates over stress: measured minimum rates and the law's, or the law's rate at the reference point."""
    minimum_rates = compared_minimum_rates(fit)
    if minimum_rates:
        draw_minimum_rates(axes, fit, minimum_rates)
    elif any(_tested_stresses(fit)):
        _draw_reference_rates(axes, fit)
    else:
        axes.set_axis_off()


def _draw_reference_rates(axes: Axes, fit: Identification) -> None:
    """Identified rate over stress with its 95 % band at some temperatures, and the own rate of each test."""
    own = [rate for k in range(len(fit.tests)) for rate in own_rates(fit, k)]
    stresses = _tested_stresses(fit)
    grid = np.geomspace(0.8 * min(stresses), 1.25 * max(stresses), 60)
    curves = [
        RateCurve(celsius, grid, *fit.rate(grid, np.full_like(grid, T), warn=False), _stresses_at(fit, T))
        for celsius in _drawn_temperatures(tested_temperatures(fit.histories))
        for T in [celsius + ZERO_CELSIUS]
    ]
    points = [RatePoints("each test: the law at its own rate", *np.array(own).T)] if own else []
    _draw(axes, fit, curves, points, "95 % band: law")
    reference = fit.reference
    at = [f"{100 * reference.strain:.2g} % strain"] * fit.law.uses(strain)
    at += [time_text(reference.time)] * fit.law.uses(time) + ["initial internal variables"] * bool(fit.law.states)
    conditions = reference.conditions_text(fit.law).replace(", ", "\n", 1)
    axes.set(xlabel="von Mises stress, MPa", ylabel="creep rate, %/h")
    axes.set_title(f"the law's rate{' at ' * bool(at)}{' and '.join(at)}{conditions}", fontsize=9)


def _stresses_at(fit: Identification, T: float) -> tuple[float, float]:
    """MPa, the lowest and the highest of the tests at a temperature, K."""
    here = [np.abs(np.subtract(held_temperatures(h), T)).min() < ISOTHERMAL_RANGE for h in fit.histories]
    stresses = [float(v) for seen, is_here in zip(fit.simulated_stresses, here, strict=True) if is_here for v in seen]
    return min(stresses, default=0.0), max(stresses, default=0.0)


def own_rates(fit: Identification, test: int) -> list[tuple[float, float, float]]:
    """Temperature, °C, stress, MPa, and the law's rate, 1/s, times the own factor of a test, of each of its levels.

    Of a test without frames the factor is that of its minimum rate. There are none where tests have no rate of their
    own.
    """
    history, found = fit.histories[test], fit.tests[test]
    factor = 1.0 / found.minimum_rate.ratio if not found.outputs and found.minimum_rate else found.rate_factor
    stresses = np.unique(fit.simulated_stresses[test])
    if factor == 1.0 or not np.isfinite(factor):
        return []
    return [
        (T - ZERO_CELSIUS, float(stress), factor * float(fit.rate(stress, T, warn=False)[0]))
        for stress in stresses
        for T in dict.fromkeys(held_temperatures(history))
    ]


def draw_minimum_rates(axes: Axes, fit: Identification, rates: Sequence[MinimumRate]) -> None:
    """Measured minimum rates as dots, those by the law for the same tests as a line with the 95 % band of one test."""
    curves = list[RateCurve]()
    for level in sorted({round(r.temperature / ISOTHERMAL_RANGE) for r in rates}):
        own = [r for r in rates if round(r.temperature / ISOTHERMAL_RANGE) == level]
        known = sorted((r for r in own if np.isfinite([r.predicted, r.low, r.high]).all()), key=lambda r: r.stress)
        if known:
            celsius, stress, *rate = _columns(known, "temperature", "stress", "predicted", "low", "high")
            curves.append(RateCurve(float(celsius.mean()), stress, rate[0], rate[1], rate[2]))
    points = RatePoints("measured", *_columns(rates, "temperature", "stress", "measured"))
    _draw(axes, fit, curves, [points], "line: by the law; band: 95 % of a single test")
    axes.set(xlabel="stress, MPa", ylabel="minimum creep rate, %/h")
    axes.set_title(exponent_sentence(rates), fontsize=9)


def _columns(rates: Sequence[Any], *names: str) -> list[Floats]:
    """Columns of rates; temperatures in °C."""
    shift = {"temperature": ZERO_CELSIUS}
    return [np.array([getattr(r, name) for r in rates], float) - shift.get(name, 0.0) for name in names]


def _draw(
    axes: Axes, fit: Identification, curves: Sequence[RateCurve], points: Sequence[RatePoints], legend: str
) -> None:
    """Curves with their bands, and points, in the colours of temperatures; one stress alone is an error bar."""
    scale = temperature_scale(fit.histories)
    drawn: list[Any] = [*curves, *points]
    centre = PERCENT_PER_HOUR * np.concatenate([one.rate for one in drawn])
    centre = centre[np.isfinite(centre) & (centre > 0)]
    for curve in curves:
        rate, low, high = (PERCENT_PER_HOUR * v for v in (curve.rate, curve.low, curve.high))
        inside = (curve.stress >= 0.99 * curve.tested[0]) & (curve.stress <= 1.01 * curve.tested[1])
        style: Any = {"color": scale(curve.celsius)}
        label = f"{curve.celsius:.0f} °C" if len(curves) <= MOST_TEMPERATURES else None
        if np.ptp(curve.stress) > 0:
            axes.fill_between(curve.stress, low, high, alpha=0.25, lw=0, **style)
            axes.plot(curve.stress[inside], rate[inside], lw=1.4, label=label, **style)
            axes.plot(curve.stress, rate, lw=1.0, ls="--", **style)
        else:
            error = np.maximum(np.stack([rate - low, high - rate]), 0.0)
            axes.errorbar(curve.stress, rate, yerr=error, fmt="_", label=label, **style)
    for one in points:
        for celsius, stress, rate in zip(one.celsius, one.stress, PERCENT_PER_HOUR * one.rate, strict=True):
            axes.plot(stress, rate, "o", ms=4, color=scale(celsius), mec="black", mew=0.4, zorder=3)
        axes.plot([], [], "o", ms=4, color="grey", mec="black", mew=0.4, label=one.label)
    if any(np.isfinite(curve.tested[1]) for curve in curves):
        axes.plot([], [], "--", lw=1.0, color="grey", label="beyond the tests")
    ends = PERCENT_PER_HOUR * np.concatenate([v for curve in curves for v in (curve.low, curve.high)] or [centre])
    ends = ends[(ends > centre.min() / DRAWN_FACTOR) & (ends < centre.max() * DRAWN_FACTOR)]
    span(axes, "x", *(one.stress for one in drawn), logarithmic=True, margin=1.07)
    span(axes, "y", centre, ends, logarithmic=True, margin=1.25, most=8)
    place_legend(axes, legend, below=True)


def _drawn_temperatures(tested: Sequence[float]) -> list[float]:
    """Temperatures of tests, °C: all where they are few, else some of them from the lowest to the highest."""
    values = np.unique(np.round(tested, 0))
    wanted = np.linspace(values[0], values[-1], MOST_TEMPERATURES)
    return [float(v) for v in np.unique(values[np.abs(values[:, None] - wanted).argmin(axis=0)])]


# ---- rupture times ---------------------------------------------------------------------------------------------------


def rupture_rows(fit: Identification) -> list[SingleValue]:
    """The rupture times of the tests whose end is known and was compared with the law."""
    return [m.rupture for m in fit.tests if m.rupture is not None and m.rupture.used]


def draw_ruptures(axes: Axes, fit: Identification, colours: Sequence[Any]) -> None:
    """One point a test with its 95 % interval; tests that were stopped are open, and lie where they were stopped."""
    pairs = zip(fit.tests, colours, strict=True)
    ruptures = [(m.rupture, colour) for m, colour in pairs if m.rupture is not None and m.rupture.used]
    hours = np.array([(r.measured, r.predicted, r.low, r.high) for r, _ in ruptures]) / SECONDS_PER_HOUR
    hours[~np.isfinite(hours[:, 1]), 2:] = np.nan
    draw_parity(axes, hours, logarithmic=True, margin=1.25, factor=2.0)
    for (r, colour), (measured, predicted, low, high) in zip(ruptures, hours, strict=True):
        marker, face = (">", "white") if r.censored else ("o", colour)
        if np.isfinite(predicted):  # the median may lie outside where draws disagree with it
            ends = [[max(predicted - low, 0.0)], [max(high - predicted, 0.0)]]
            axes.errorbar(measured, predicted, yerr=ends, fmt=marker, ms=4.5, lw=0.7, color=colour, mfc=face)
    if any(r.censored for r, _ in ruptures):
        axes.plot([], [], ">", ms=4.5, mfc="white", color="grey", label="stopped before rupture")
    axes.set(xlabel="measured time to rupture, h", ylabel="predicted time to rupture, h")
    place_legend(axes, below=True)
    axes.set_title("bars: 95 % of a single test, if the law is right", fontsize=9)


# ---- minimum rates ---------------------------------------------------------------------------------------------------


def compared_minimum_rates(fit: Identification) -> list[MinimumRate]:
    """Minimum rates to draw: of laws whose rate at a given strain and time is not what a test shows, else none.

    These are laws with internal variables or of strain or time, laws that the tests reject, and laws of tests that
    were followed to rupture. There are none where fewer than half of the tests show a minimum rate.
    """
    law = fit.law
    changing = bool(law.states) or law.uses(strain) or law.uses(time)
    if not (changing or rejected(fit) or any(m.rupture is not None for m in fit.tests)):
        return []
    try:
        rates = minimum_rates_of(fit)
    except CreepkitError:
        return []
    return rates if 2 * len(rates) >= len(fit.tests) else []


def exponents(rates: Sequence[MinimumRate], *, energy: bool = False) -> tuple[float, float, float]:
    """The apparent stress exponent of measured minimum rates with half of its 95 % interval, and of predicted ones.

    NaN of tests at one stress. energy : the activation energy instead, J/mol, NaN of tests at one temperature.
    """
    apparent = apparent_energy if energy else apparent_exponent
    celsius, stresses, *columns = _columns(rates, "temperature", "stress", "measured", "predicted")
    measured, predicted = (apparent(stresses, one, celsius + ZERO_CELSIUS) for one in columns)
    return *measured, predicted[0]


def exponent_sentence(rates: Sequence[MinimumRate]) -> str:
    """Both in words; "" where the stresses do not differ."""
    measured, _, predicted = exponents(rates)
    if not np.isfinite([measured, predicted]).all():
        return ""
    return MEAN_SLOPES.format(measured=f"{measured:.2g}", predicted=f"{predicted:.2g}")


# ---- the map of a plate ----------------------------------------------------------------------------------------------


MOST_LAWS = 10
"""Laws with a colour of their own."""


WIDTH, PAGE_WIDTH, ROW, LARGEST = 8.6, 4.8, 0.115, 11.0
"""Inches of the figure, of one on a page for telephones too, of a material in it, and of its height at most."""


def plate_size(materials: int) -> tuple[float, float]:
    """Inches of the map of so many materials."""
    return WIDTH, min(1.4 + ROW * max(materials, 18), LARGEST)


def plate_figure(fits: Sequence[tuple[str, Identification]]) -> Figure:
    """The map of a plate alone, see draw_plate."""
    figure, axes = panels_of(PAGE_WIDTH, plate_size(len(fits))[1])
    draw_plate(axes, fits)
    return figure


def plate_rates(fits: Sequence[tuple[str, Identification]]) -> tuple[float, float, Floats]:
    """The median stress, MPa, and strain of the materials, and their rates there, %/h, (materials, 3) with ends."""
    points = [fit.tested_point for _, fit in fits]
    stress, strain = (float(v) for v in np.median([(one.stress, one.strain) for one in points], axis=0))
    rates = [[float(v) for v in fit.rate(stress, strain=strain, warn=False)] for _, fit in fits]
    return stress, strain, PERCENT_PER_HOUR * np.array(rates)


def draw_plate(axes: Axes, fits: Sequence[tuple[str, Identification]]) -> None:
    """Rates in %/h, 95 % intervals, at the median stress and strain of all; fits : (material, best law), in order."""
    stress, strain, rates = plate_rates(fits)
    laws = list(dict.fromkeys(fit.law.name for _, fit in fits))
    colours = dict(zip(laws, distinct_colours(len(laws)), strict=True))
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
        bounds = rates[:, 1:]
        bounds = bounds[(bounds > centre.min() / DRAWN_FACTOR) & (bounds < centre.max() * DRAWN_FACTOR)]
        span(axes, "x", centre, bounds, logarithmic=True, most=8)
    axes.set_yticks(range(len(fits)), [shortened(name, 24) for name, _ in fits], fontsize=7 if len(fits) > 20 else 8)
    axes.set_ylim(len(fits) - 0.5, -0.5)
    axes.set(xlabel=f"creep rate at {stress:.3g} MPa and {100 * strain:.2g} % strain, %/h")
    place_legend(axes, below=True)
