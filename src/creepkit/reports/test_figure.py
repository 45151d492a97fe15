"""Small multiples of the tests of an identification: each with its curve and, below it, what the law leaves of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from creepkit.reports.condition_colours import stress_scale
from creepkit.reports.curve_of_test import axis_label, curve_of_test
from creepkit.reports.figures import empty_figure, shortened
from creepkit.reports.identification_plot import draw_curve, set_curve_ranges
from creepkit.reports.prediction_bands import fitted_curves
from creepkit.reports.residual_panels import draw_residuals

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from creepkit.inverse.identification import Identification

COLUMNS, WIDTH, HEIGHT = 3, 11.0, 2.7
"""Tests side by side, inches of the figure and of a row of them."""


def small_multiples(fit: Identification, tests: Sequence[int]) -> Figure:
    """Measured and identified over time of each output of tests, and its residuals; tests : positions."""
    curves, colours = fitted_curves(fit), stress_scale(fit.histories, fit.predictor).colours
    drawn = [(k, one.output) for k in tests for one in fit.tests[k].outputs]
    columns = min(COLUMNS, len(drawn))
    rows = -(-len(drawn) // columns)
    figure = empty_figure(WIDTH * columns / COLUMNS, HEIGHT * rows)
    cells = figure.add_gridspec(rows, columns)
    for place, (k, output) in enumerate(drawn):
        cell = cells[place // columns, place % columns].subgridspec(2, 1, height_ratios=(2.2, 1.0), hspace=0.04)
        above, below = figure.add_subplot(cell[0]), figure.add_subplot(cell[1])
        curve = curve_of_test(fit, curves, k, output)
        draw_curve(above, curve, colours[k], dots="0.25")
        set_curve_ranges([above], [curve], output)
        draw_residuals(below, fit, curves, output, [k], colours)
        above.set_title(f"{shortened(fit.tests[k].name)}: {fit.histories[k].condition}", fontsize=8)
        above.set_ylabel(axis_label(output), fontsize=8)
        above.tick_params(labelbottom=False, labelsize=7)
        below.tick_params(labelsize=7)
        below.set_ylabel("noise sd" if place % columns == 0 else "", fontsize=7)
        below.set_xlabel("time, h" if place // columns == rows - 1 else "", fontsize=8)
    return figure
