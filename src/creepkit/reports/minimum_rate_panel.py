"""The panel of minimum creep rates over stress: measured on the tests, and by the law for the same tests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import CreepkitError
from creepkit.inverse.identified_values import MinimumRate, minimum_rates_of
from creepkit.inverse.minimum_rates import apparent_exponent
from creepkit.inverse.reference_conditions import ISOTHERMAL_RANGE
from creepkit.language import strain, time
from creepkit.records import SECONDS_PER_HOUR, ZERO_CELSIUS
from creepkit.records.units import celsius_text
from creepkit.reports.condition_colours import ColourScale, temperature_scale
from creepkit.reports.figures import place_legend_right, set_range

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from creepkit.inverse.identification import Identification

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
    axes.grid(alpha=0.25)
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
