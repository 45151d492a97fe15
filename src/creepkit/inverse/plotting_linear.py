"""Panels of an output that is compared as it is: measured and identified over time, and what is left."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.inverse.scales import usable
from creepkit.records import Prediction

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from creepkit.inverse.identification import Identification

LEGEND = 12
"""At most so many tests are named."""
HEADROOM = 1.4
"""Top of the panel over the largest value, so that the names do not lie on the curves."""
UNITS = {"amplitude": ("mm", "um", 1e3), "width": ("mm", "um", 1e3), "shape": ("", "1e-3", 1e3)}
"""Of outputs: their unit, and the unit and factor of what is left; a strain has none, a stress is in MPa."""
FULL = 0.5
"""Weight below which a test is drawn dashed."""


def draw_linear(
    panels: tuple[Axes, Axes], fit: Identification, output: str, found: Prediction, colours: Sequence[Any]
) -> None:
    """Measured (dots), identified (lines, with each test's own nuisances and offset), and measured less identified."""
    tests, left = panels
    noise, (_, _, factor) = fit.scatter[output].noise, _units(output)
    for k, (history, misfit) in enumerate(zip(fit.histories, fit.misfits, strict=True)):
        if misfit.outputs[0].output != output:
            continue
        used = usable(history, output)
        hours, measured = history.times[used] / 3600.0, history.outputs[output][used]
        predicted = found.of(k)[used, found.outputs.index(output)]
        style = "--" if misfit.weight < FULL else "-"
        tests.plot(hours, measured, ".", ms=3, color=colours[k], alpha=0.5)
        tests.plot(hours, predicted, style, lw=1.3, color=colours[k], label=f"{history.name}, {history.condition}")
        left.plot(hours, factor * (measured - predicted), style, lw=0.9, color=colours[k], alpha=0.85)
    left.axhspan(-2 * factor * noise, 2 * factor * noise, color="black", alpha=0.1, lw=0, label="2 sd of frame noise")
    _finish(tests, left, fit, output)


def _finish(tests: Axes, left: Axes, fit: Identification, output: str) -> None:
    unit, fine, _ = _units(output)
    tests.set(xlabel="time, h", ylabel=_labelled(output, unit), ylim=(0, HEADROOM * tests.get_ylim()[1]))
    tests.set_title("measured (dots), identified (lines)", fontsize=10)
    drawn = sum(m.outputs[0].output == output for m in fit.misfits)
    if drawn <= LEGEND:
        tests.legend(fontsize=6.5, loc="upper left", ncols=2)
    errors = fit.errors[output]
    left.set(xlabel="time, h", ylabel=_labelled(f"{output}, measured less identified", fine))
    left.axhline(0, color="black", lw=0.8)
    left.set_title(f"relative squared error {errors.rse:.3g}, reduced chi-square {errors.chi_square:.3g}", fontsize=10)
    reach = 1.1 * max(float(np.max(np.abs(line.get_ydata()))) for line in left.get_lines()[:-1])
    left.set_ylim(-reach, reach)
    left.legend(fontsize=7, loc="lower left")
    for axes in (tests, left):
        axes.grid(alpha=0.25)
        if output.startswith("stress"):
            axes.set_xscale("log")  # relaxation is over before a linear axis shows it


def _units(output: str) -> tuple[str, str, float]:
    """Unit of an output, and unit and factor of what is left of it."""
    return UNITS.get(output, ("MPa", "MPa", 1.0) if output.startswith("stress") else ("", "1e-6", 1e6))


def _labelled(words: str, unit: str) -> str:
    return f"{words}, {unit}" if unit else words
