"""One test of an identification in a figure of its own: each output with the 95 % band, and beside it the residuals."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from creepkit.reports.curve_of_test import TestCurve, axis_label, curve_of_test, unit_of
from creepkit.reports.figures import empty_figure, save_figure
from creepkit.reports.identification_plot import draw_curve, draw_residuals, set_curve_ranges
from creepkit.reports.load_programs import program_text
from creepkit.reports.prediction_bands import FittedCurves

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from creepkit.inverse.identification import Identification


COLOUR = "#1f5fa8"


def fitted_test_figure(fit: Identification, curves: FittedCurves, test: int) -> Figure:
    """Measured and identified outputs of one test over time, and measured less identified, a row an output."""
    fitted, history = fit.tests[test], fit.histories[test]
    figure = empty_figure(9.6, 0.7 + 2.3 * len(fitted.outputs))
    panels = figure.subplots(len(fitted.outputs), 2, squeeze=False, width_ratios=(1.25, 1.0))
    colours = {test: COLOUR}
    for row, one in zip(panels, fitted.outputs, strict=True):
        curve = curve_of_test(fit, curves, test, one.output)
        draw_curve(row[0], curve, COLOUR, dots="0.25")
        set_curve_ranges([row[0]], [curve], one.output)
        row[0].set(xlabel="time, h", ylabel=axis_label(one.output))
        draw_residuals(row[1], fit, curves, one.output, [test], colours)
        judged = fit.adequacy is None or fit.adequacy.judges(one.output)
        chi_square = one.errors.chi_square
        known = judged and np.isfinite(chi_square)
        row[1].set_title(f"mean square misfit / noise² {chi_square:.3g}" if known else "", fontsize=9)
        for axes in row:
            axes.xaxis.label.set_fontsize(9)
            axes.yaxis.label.set_fontsize(9)
            axes.tick_params(labelsize=8)
    for axes in panels[:-1].flat:
        axes.set_xlabel("")
        axes.tick_params(labelbottom=False)
    figure.suptitle(f"{history.name}: {program_text(history)}", fontsize=10)
    return save_figure(figure, None)


def fitted_test_text(fit: Identification, curves: FittedCurves, test: int) -> str:
    """The same figure in words: for each output the last value measured and identified, and how far they differ."""
    fitted, history = fit.tests[test], fit.histories[test]
    parts = []
    for one in fitted.outputs:
        curve = curve_of_test(fit, curves, test, one.output)
        parts.append(f"{axis_label(one.output).split(',')[0]}: {_end_text(curve, unit_of(one.output))}")
    return f"Test {history.name}, {program_text(history)}, outputs over time in h. {'. '.join(parts)}."


def _end_text(curve: TestCurve, unit: str) -> str:
    known = np.flatnonzero(np.isfinite(curve.identified) & np.isfinite(curve.measured))
    if not known.size:
        return "nothing is predicted"
    last, (low, high) = int(known[-1]), curve.band
    residuals = curve.residuals[curve.residual_frames & np.isfinite(curve.residuals)]
    rms = float(np.sqrt(np.mean(residuals**2))) if residuals.size else float("nan")
    measure = "per cent" if curve.logarithmic else "standard deviations of the noise"
    with_unit = f" {unit}" if unit else ""
    return (
        f"{curve.hours.size} frames; at {curve.hours[last]:.3g} h measured {curve.measured[last]:.3g}{with_unit}, "
        f"identified {curve.identified[last]:.3g}{with_unit}, 95 % band {low[last]:.3g} to {high[last]:.3g}; "
        f"residuals have a root mean square of {rms:.2g} {measure}"
    )
