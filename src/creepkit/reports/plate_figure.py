"""The map of a plate: creep rate of each material at one stress, coloured by its law, filled where tests agree."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from creepkit.reports.condition_colours import distinct_colours
from creepkit.reports.figures import empty_figure, place_legend_right, set_range, shortened
from creepkit.reports.rate_panels import DRAWN_FACTOR, PERCENT_PER_HOUR

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from creepkit.inverse.identification import Identification

MOST_LAWS = 10
"""Laws with a colour of their own."""


WIDTH, ROW, LARGEST = 8.6, 0.17, 11.0
"""Inches of the figure, of a material in it, and of its height at most."""


def plate_figure(fits: Sequence[tuple[str, Identification]]) -> Figure:
    """Rates in %/h with 95 % intervals at the median stress of all; fits : (material, best law), in the order drawn."""
    stress = float(np.median([fit.reference.stress for _, fit in fits]))
    figure = empty_figure(WIDTH, min(1.4 + ROW * max(len(fits), 12), LARGEST))
    axes = figure.subplots()
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
    axes.grid(alpha=0.25)
    place_legend_right(axes, "law; open:\ncontradicted\nby its tests")
    return figure
