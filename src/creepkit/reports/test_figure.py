"""One test of an identification in a figure of its own: each output with the 95 % band, and beside it the residuals."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from creepkit.reports.curve_of_test import TestCurve, axis_label, curve_of_test, unit_of
from creepkit.reports.figures import empty_figure, save_figure
from creepkit.reports.identification_plot import draw_curve, set_curve_ranges
from creepkit.reports.judged_readings import judged_readings
from creepkit.reports.load_programs import program_text
from creepkit.reports.prediction_bands import FittedCurves
from creepkit.reports.residual_panels import draw_residuals

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
        row[1].set_title(draw_residuals(row[1], fit, curves, one.output, [test], colours), fontsize=9)
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
        name, unit = axis_label(one.output).split(",")[0], unit_of(one.output)
        parts.append(f"{name}: {_end_text(curve, unit)}; {_residual_text(fit, curve, test, one.output)}")
    return f"Test {history.name}, {program_text(history)}, outputs over time in h. {'. '.join(parts)}."


WIDE_BAND = 100.0
"""Upper over lower end of a band from which the band is said to be unbounded."""


def _end_text(curve: TestCurve, unit: str) -> str:
    """The last reading, what the law predicts there or when its prediction ends, and the band."""
    read, with_unit = np.flatnonzero(np.isfinite(curve.measured)), f" {unit}" if unit else ""
    if not read.size:
        return "nothing was measured"
    known = read[np.isfinite(curve.identified[read])]
    text = f"{read.size} readings; at {curve.hours[read[-1]]:.3g} h measured {curve.measured[read[-1]]:.3g}{with_unit}"
    if not known.size:
        return f"{text}, the law predicts nothing"
    if known[-1] < read[-1]:
        return f"{text}; the law follows {known.size} readings, to {curve.hours[known[-1]]:.3g} h, and then ruptures"
    low, high = (float(end[known[-1]]) for end in curve.band)
    band = f"95 % band {low:.3g} to {high:.3g}"
    if curve.logarithmic and not high <= WIDE_BAND * low:
        band = "95 % band unbounded, as near a predicted rupture"
    return f"{text}, identified {curve.identified[known[-1]]:.3g}{with_unit}, {band}"


def _residual_text(fit: Identification, curve: TestCurve, test: int, output: str) -> str:
    readings = judged_readings(fit)
    if readings is not None and readings.mask(test, output).any():
        values, measure = readings.residuals(test, output)[1], "standard deviations of the noise of a reading"
        which = f"the {values.size} residuals with the test's own rate and offset"
    else:
        values = curve.residuals[np.isfinite(curve.residuals)]
        measure = "per cent" if curve.logarithmic else unit_of(output)
        which = f"{values.size} residuals"
    rms = f"{float(np.sqrt(np.mean(values**2))):.2g} {measure}".strip() if values.size else "not known"
    return f"{which} have a root mean square of {rms}"
