"""Plot of an identification: tests over time with bands, residuals, creep rates over stress, times to rupture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.reference_conditions import ISOTHERMAL_RANGE
from creepkit.records import is_logarithmic
from creepkit.reports.condition_colours import (
    MOST_NAMED_TESTS,
    condition_groups,
    distinct_colours,
    stress_scale,
    temperature_scale,
)
from creepkit.reports.curve_of_test import TestCurve, axis_label, curve_of_test, line_style, set_time_range
from creepkit.reports.figures import empty_figure, save_figure, set_range, wrapped
from creepkit.reports.identification_text import rupture_rows
from creepkit.reports.load_programs import label_of
from creepkit.reports.prediction_bands import FittedCurves, fitted_curves
from creepkit.reports.rate_panels import draw_rates, draw_ruptures
from creepkit.reports.residual_panels import draw_titled_residuals

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.inverse.identification import Identification


SHOWN_STRAIN_RATIO = 1e-3
"""Of the largest strain: the lower end of a logarithmic axis of strain."""


DRAWN_STRAIN_RATIO = 1.5
"""Of the largest measured strain of a test: where its identified curve and band end."""


DOTS_ABOVE_LINES = 100
"""Up to so many frames lie above the identified curve; more would hide it."""


COLUMNS = (3, 4, 5)
"""Panels of groups of tests side by side, whichever leaves the fewest places empty."""


def identification_figure(fit: Identification, path: str | Path | None = None) -> Figure:
    """Draw the tests over time with bands, their residuals, creep rates over stress, and times to rupture.

    Up to MOST_NAMED_TESTS tests are named below the panels; more have a panel for each group of conditions, and
    colours by condition.
    """
    curves = fitted_curves(fit)
    draw = _few_tests if len(fit.histories) <= MOST_NAMED_TESTS else _many_tests
    figure = draw(fit, curves)
    headline = f"{fit.law.title or fit.law.name}: {len(fit.histories)} test{'s' if len(fit.histories) > 1 else ''}"
    adequacy = getattr(fit, "adequacy", None)
    title = headline if adequacy is None else f"{headline}\n{adequacy}"
    figure.suptitle(wrapped(title, float(figure.get_size_inches()[0])), fontsize=10)
    return save_figure(figure, path)


def _leading_outputs(fit: Identification) -> dict[str, list[int]]:
    """{output that grows with creep: positions of the tests of which it is the first}."""
    outputs: dict[str, list[int]] = {}
    for k, test in enumerate(fit.tests):
        if test.outputs:
            outputs.setdefault(test.outputs[0].output, []).append(k)
    return outputs


def _few_tests(fit: Identification, curves: FittedCurves) -> Figure:
    leading, has_ruptures = _leading_outputs(fit), bool(rupture_rows(fit))
    extras = ["rates", "ruptures"] if has_ruptures else ["rates"]
    cells = [(kind, name) for name in leading for kind in ("curves", "residuals")]
    if not leading:
        rows = [[(e, "") for e in extras]]
    elif len(leading) == 1 and has_ruptures:
        rows = [[*cells], [(e, "") for e in extras]]
    else:
        count = max(len(leading), len(extras))
        rows = [[*cells[2 * k : 2 * k + 2], *[(e, "") for e in extras[k : k + 1]]] for k in range(count)]
    figure = empty_figure(4.9 * max(map(len, rows)), 4.4 * len(rows) + 0.25 * (1 + len(fit.histories) // 3))
    grid = figure.add_gridspec(len(rows), max(map(len, rows)), width_ratios=None)
    colours = distinct_colours(len(fit.histories))
    for i, row in enumerate(rows):
        for j, (kind, output) in enumerate(row):
            if kind == "residuals":
                names = _outputs_of(fit, leading[output])
                cell = grid[i, j].subgridspec(len(names), 1, hspace=0.05)
                panels = [figure.add_subplot(cell[k]) for k in range(len(names))]
                draw_titled_residuals(panels, fit, curves, names, leading[output], colours)
                for axes in panels[:-1]:
                    axes.set_xlabel("")
                    axes.tick_params(labelbottom=False)
                continue
            axes = figure.add_subplot(grid[i, j])
            if kind == "curves":
                _draw_curves([axes], fit, curves, output, [leading[output]], colours)
                axes.set_title(_curve_title(fit), fontsize=9)
            elif kind == "rates":
                draw_rates(axes, fit, curves.prediction)
            else:
                draw_ruptures(axes, fit, colours)
    _name_below(figure, fit, colours)
    return figure


def _name_below(figure: Figure, fit: Identification, colours: Sequence[Any]) -> None:
    """Name, load program and temperature of each test below the panels."""
    from matplotlib.lines import Line2D

    labels = [label_of(history) for history in fit.histories]
    handles = [Line2D([], [], color=colour, marker=".", lw=1.3) for colour in colours]
    for handle, test in zip(handles, fit.tests, strict=True):
        handle.set_linestyle(line_style(test.weight))
    width = float(figure.get_size_inches()[0])
    columns = max(1, min(len(labels), int(width / (0.6 + 0.075 * max(map(len, labels))))))
    figure.legend(handles, labels, loc="outside lower center", ncols=columns, fontsize=8)


def _many_tests(fit: Identification, curves: FittedCurves) -> Figure:
    leading, has_ruptures = _leading_outputs(fit), bool(rupture_rows(fit))
    by_stress, by_temperature = stress_scale(fit.histories, fit.predictor), temperature_scale(fit.histories)
    by_condition = by_temperature if np.ptp(by_temperature.values) > ISOTHERMAL_RANGE else by_stress
    groups = {
        output: [
            (title, [tests[k] for k in members])
            for title, members in condition_groups([fit.histories[k] for k in tests], fit.predictor)
        ]
        for output, tests in leading.items()
    }
    most = max((len(g) for g in groups.values()), default=1)
    columns = min(COLUMNS, key=lambda count: (-most % count, -(-most // count))) if most > COLUMNS[0] else most
    row_counts = [-(-len(g) // columns) for g in groups.values()]
    width = 15.0
    figure = empty_figure(width, 2.9 * sum(row_counts) + 4.6 * -(-(len(leading) + 1 + has_ruptures) // 3) + 0.6)
    bottom = [("residuals", output) for output in leading] + [("rates", "")] + [("ruptures", "")] * has_ruptures
    bottom_rows = -(-len(bottom) // 3)
    parts = figure.subfigures(
        len(groups) + 1, 1, height_ratios=[*(2.9 * n + 0.3 for n in row_counts), 4.6 * bottom_rows], squeeze=False
    )[:, 0]
    for part, (output, of_output), rows in zip(parts, groups.items(), row_counts, strict=False):
        panels = part.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
        used = list(panels.flat)[: len(of_output)]
        _draw_curves(used, fit, curves, output, [tests for _, tests in of_output], by_stress.colours)
        for axes, (title, _) in zip(used, of_output, strict=True):
            axes.set_title(title, fontsize=9)
        for k, axes in enumerate(panels.flat):
            if k >= len(of_output):
                axes.set_visible(False)
                continue
            axes.tick_params(labelbottom=k + columns >= len(of_output))
            axes.set(xlabel="time, h" if k + columns >= len(of_output) else "")
            axes.set(ylabel=axis_label(output) if k % columns == 0 else "")
        part.suptitle(_curve_title(fit).replace("\n", " "), fontsize=9)
        by_stress.add_bar(part, used)
    panels = parts[-1].subplots(bottom_rows, min(len(bottom), 3), squeeze=False)
    by_panel = list(zip(panels.flat, bottom, strict=False))
    for axes, (kind, output) in by_panel:
        if kind == "residuals":
            draw_titled_residuals([axes], fit, curves, [output], leading[output], by_condition.colours)
        elif kind == "rates":
            draw_rates(axes, fit, curves.prediction)
        else:
            draw_ruptures(axes, fit, by_condition.colours)
    for axes in list(panels.flat)[len(bottom) :]:
        axes.set_visible(False)
    return figure


def _outputs_of(fit: Identification, tests: Sequence[int]) -> list[str]:
    return list(dict.fromkeys(one.output for k in tests for one in fit.tests[k].outputs))


def _curve_title(fit: Identification) -> str:
    """What is drawn, and what the bands include."""
    included = "the law and the nuisances of tests" if fit.nuisances else "the law"
    scatter = f", rates of tests differ by {100 * fit.noise_model.rate:.0f} %" if fit.noise_model.rate >= 0.005 else ""
    return f"measured (dots), identified (lines) with 95 % band\nof {included}; not in it: noise{scatter}"


def draw_curve(axes: Axes, curve: TestCurve, colour: Any, style: str = "-", dots: Any = None) -> None:
    """One output of one test: measured (in the colour of `dots`, if given), identified, and the 95 % band."""
    if dots is not None:
        plotted = curve.measured > 0 if curve.logarithmic else np.isfinite(curve.measured)
        above = int(plotted.sum()) <= DOTS_ABOVE_LINES
        axes.plot(
            *(curve.hours[plotted], curve.measured[plotted], "."),
            ms=3,
            color=dots,
            alpha=0.55,
            zorder=3 if above else 1,
        )
    low, high, identified = *curve.band, curve.identified
    if curve.logarithmic:  # beyond the strains of the test a curve towards rupture says nothing of its frames
        end = _drawn_end(curve)
        low, high = np.minimum(low, end), np.minimum(high, end)
        identified = np.where(identified <= end, identified, np.nan)
    axes.fill_between(curve.hours, low, high, color=colour, alpha=0.2, lw=0)
    axes.plot(curve.hours, identified, style, lw=1.2, color=colour)


def _drawn_end(curve: TestCurve) -> float:
    """The strain, %, at which the curve of a test ends; infinite where no strain above zero was measured."""
    largest = float(np.nanmax(curve.measured, initial=0.0))
    return DRAWN_STRAIN_RATIO * largest if largest > 0 else float("inf")


def _draw_curves(
    panels: Sequence[Axes],
    fit: Identification,
    curves: FittedCurves,
    output: str,
    groups: Sequence[Sequence[int]],
    colours: Sequence[Any],
) -> None:
    """The tests of each group in its panel; all panels have the same axes."""
    drawn = []
    for axes, tests in zip(panels, groups, strict=True):
        for k in tests:
            drawn.append(curve_of_test(fit, curves, k, output))
            draw_curve(axes, drawn[-1], colours[k], line_style(fit.tests[k].weight), dots=colours[k])
    set_curve_ranges(panels, drawn, output)
    for axes in panels:
        axes.set(xlabel="time, h", ylabel=axis_label(output))


def _drawn_values(curve: TestCurve) -> Floats:
    """(frames,) the identified values that are drawn."""
    return curve.identified[curve.identified <= _drawn_end(curve)] if curve.logarithmic else curve.identified


def set_curve_ranges(panels: Sequence[Axes], drawn: Sequence[TestCurve], output: str) -> None:
    """The same axes for all panels, from the measured and identified values of what is drawn of an output."""
    values = np.concatenate([v for c in drawn for v in (c.measured, _drawn_values(c))])
    values = values[np.isfinite(values)]
    largest = float(values.max(initial=0.0))
    for axes in panels:
        if is_logarithmic(output) and largest > 0:
            lowest = max(float(values[values > 0].min()), SHOWN_STRAIN_RATIO * largest)
            set_range(axes, "y", lowest, 1.1 * largest, logarithmic=True)
        else:
            set_range(axes, "y", min(float(values.min(initial=0.0)), 0.0), max(largest, 0.0))
        set_time_range(axes, np.concatenate([c.hours for c in drawn]), output)
        axes.grid(alpha=0.25)
