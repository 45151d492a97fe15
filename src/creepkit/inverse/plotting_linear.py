"""Panels of an output that is compared as it is: measured and identified over time, and what is left."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.inverse.scales import usable_frames
from creepkit.records import Prediction

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from creepkit.inverse.identification import Identification

MAXIMUM_LEGEND = 12
"""At most so many tests are named."""
HEADROOM = 1.4
"""Top of the panel over the largest value, so that the names do not lie on the curves."""
OUTPUT_UNITS = {"amplitude": ("mm", "um", 1e3), "width": ("mm", "um", 1e3), "shape": ("", "1e-3", 1e3)}
"""Of outputs: their unit, and the unit and factor of what is left; a strain has none, a stress is in MPa."""
DASHED_BELOW_WEIGHT = 0.5
"""Weight below which a test is drawn dashed."""


def draw_linear(
    panels: tuple[Axes, Axes], fit: Identification, output: str, prediction: Prediction, colours: Sequence[Any]
) -> None:
    """Measured (dots), identified (lines, with each test's own nuisances and offset), and measured less identified."""
    curve_axes, residual_axes = panels
    noise, (_, _, factor) = fit.noise_model[output].noise, _units(output)
    for k, (history, test_fit) in enumerate(zip(fit.histories, fit.tests, strict=True)):
        if test_fit.outputs[0].output != output:
            continue
        used = usable_frames(history, output)
        hours, measured = history.times[used] / 3600.0, history.outputs[output][used]
        predicted = prediction.of(k)[used, prediction.outputs.index(output)]
        style = "--" if test_fit.weight < DASHED_BELOW_WEIGHT else "-"
        curve_axes.plot(hours, measured, ".", ms=3, color=colours[k], alpha=0.5)
        curve_axes.plot(hours, predicted, style, lw=1.3, color=colours[k], label=f"{history.name}, {history.condition}")
        residual_axes.plot(hours, factor * (measured - predicted), style, lw=0.9, color=colours[k], alpha=0.85)
    residual_axes.axhspan(-2 * factor * noise, 2 * factor * noise, color="black", alpha=0.1, lw=0, label="2 sd of frame noise")
    _finish_linear(curve_axes, residual_axes, fit, output)


def _finish_linear(curve_axes: Axes, residual_axes: Axes, fit: Identification, output: str) -> None:
    unit, residual_unit, _ = _units(output)
    curve_axes.set(xlabel="time, h", ylabel=_axis_label(output, unit), ylim=(0, HEADROOM * curve_axes.get_ylim()[1]))
    curve_axes.set_title("measured (dots), identified (lines)", fontsize=10)
    drawn = sum(m.outputs[0].output == output for m in fit.tests)
    if drawn <= MAXIMUM_LEGEND:
        curve_axes.legend(fontsize=6.5, loc="upper left", ncols=2)
    errors = fit.errors[output]
    residual_axes.set(xlabel="time, h", ylabel=_axis_label(f"{output}, measured less identified", residual_unit))
    residual_axes.axhline(0, color="black", lw=0.8)
    residual_axes.set_title(f"relative squared error {errors.relative_squared_error:.3g}, reduced chi-square {errors.chi_square:.3g}", fontsize=10)
    axis_limit = 1.1 * max(float(np.max(np.abs(line.get_ydata()))) for line in residual_axes.get_lines()[:-1])
    residual_axes.set_ylim(-axis_limit, axis_limit)
    residual_axes.legend(fontsize=7, loc="lower left")
    for axes in (curve_axes, residual_axes):
        axes.grid(alpha=0.25)
        if output.startswith("stress"):
            axes.set_xscale("log")  # relaxation is over before a linear axis shows it


def _units(output: str) -> tuple[str, str, float]:
    """Unit of an output, and unit and factor of what is left of it."""
    return OUTPUT_UNITS.get(output, ("MPa", "MPa", 1.0) if output.startswith("stress") else ("", "1e-6", 1e6))


def _axis_label(label: str, unit: str) -> str:
    return f"{label}, {unit}" if unit else label
