"""Plot of an identification: measured and predicted values, residuals, creep rates with bands, rupture times."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.observation_vector import LOGARITHMIC_OUTPUTS, usable_frames
from creepkit.inverse.reference_conditions import reference_stresses
from creepkit.records import ZERO_CELSIUS, History, Prediction
from creepkit.report.figures import empty_figure, save_figure
from creepkit.report.identification_text import rupture_rows

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

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
    residual_axes.axhspan(
        -2 * factor * noise, 2 * factor * noise, color="black", alpha=0.1, lw=0, label="2 sd of frame noise"
    )
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
    residual_axes.set_title(
        f"relative squared error {errors.relative_squared_error:.3g}, reduced chi-square {errors.chi_square:.3g}",
        fontsize=10,
    )
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


SECONDS_PER_HOUR = 3600.0


def draw_ruptures(axes: Axes, fit: Identification, colours: Sequence[Any]) -> None:
    """One point a test with its 95 % interval; tests that were stopped are open, and lie where they were stopped."""
    ruptures = [(m.rupture, colour) for m, colour in zip(fit.tests, colours, strict=True) if m.rupture is not None]
    for r, colour in ruptures:
        if not np.isfinite(r.predicted):
            continue
        measured, predicted = r.measured / SECONDS_PER_HOUR, r.predicted / SECONDS_PER_HOUR
        interval = [[predicted - r.low / SECONDS_PER_HOUR], [r.high / SECONDS_PER_HOUR - predicted]]
        marker, face = (">", "white") if r.censored else ("o", colour)
        axes.errorbar(measured, predicted, yerr=interval, fmt=marker, ms=4.5, lw=0.7, color=colour, mfc=face)
    plotted_hours = [t / SECONDS_PER_HOUR for r, _ in ruptures for t in (r.measured, r.predicted) if np.isfinite(t)]
    axis_limits = np.array([0.5 * min(plotted_hours), 2.0 * max(plotted_hours)])
    axes.plot(axis_limits, axis_limits, "k-", lw=1.2)
    axes.fill_between(
        axis_limits, axis_limits / 2, axis_limits * 2, color="black", alpha=0.08, lw=0, label="within a factor of 2"
    )
    if any(r.censored for r, _ in ruptures):
        axes.plot([], [], ">", ms=4.5, mfc="white", color="grey", label="stopped: broke later, if at all")
    axes.set(
        xscale="log", yscale="log", xlim=axis_limits, ylim=axis_limits, xlabel="measured, h", ylabel="predicted, h"
    )
    axes.grid(alpha=0.25)
    axes.legend(fontsize=8, loc="upper left")
    axes.set_title("time to rupture, 95 % of a single test", fontsize=10)


COLOUR_MAP = "viridis"


MANY_TESTS = 12
"""Above this many tests strain over time is a thicket: identified over measured strain is drawn instead."""


PLOTTED_STRAIN_RATIO = 0.02
"""Residuals are drawn where a test's strain exceeds this share of its last one; below, noise fills the panel."""


def identification_figure(fit: Identification, path: str | Path | None = None) -> Figure:
    """Draw the tests and what is left of them over time, an output each, rates with 95 % bands, and ruptures."""
    if not fit.histories:
        raise FitError(
            "this identification was loaded without its histories: attach them with fit.with_histories(histories)"
        )
    outputs = list(dict.fromkeys(m.outputs[0].output for m in fit.tests))
    ruptures = rupture_rows(fit)
    ratios = (*(1.25, 1.0) * len(outputs), 1.0, *[1.0][: len(ruptures)])
    figure = empty_figure(4.5 * len(ratios), 4.8)
    panels = list(figure.subplots(1, len(ratios), width_ratios=ratios))
    if ruptures:
        draw_ruptures(panels.pop(), fit, _colours(fit.histories))
    rates = panels.pop()
    prediction, colours = fit.predict(), _colours(fit.histories)
    for k, output in enumerate(outputs):
        draw = _draw_strains if output in LOGARITHMIC_OUTPUTS else draw_linear
        draw((panels[2 * k], panels[2 * k + 1]), fit, output, prediction, colours)
    _draw_rates(rates, fit)
    figure.suptitle(f"{fit.law.title or fit.law.name}   ({len(fit.histories)} tests)", fontsize=11)
    return save_figure(figure, path)


def _draw_strains(
    panels: tuple[Axes, Axes], fit: Identification, output: str, prediction: Prediction, colours: Sequence[Any]
) -> None:
    """Strains less loading strain, and ln(identified / measured)."""
    tests, residuals = panels
    draw = _draw_parity if len(fit.histories) > MANY_TESTS else _draw_curve
    for k, history in enumerate(fit.histories):
        if fit.tests[k].outputs[0].output != output:
            continue
        used, offset = usable_frames(history, output), fit.tests[k].offset
        hours = history.times[used] / 3600.0
        predicted = prediction.of(k)[used, prediction.outputs.index(output)] - offset
        measured = history.outputs[output][used] - offset
        draw(tests, hours, measured, predicted, colours[k], history.condition)
        plotted = (measured > PLOTTED_STRAIN_RATIO * measured[-1]) & (predicted > 0)
        residuals.plot(
            hours[plotted], np.log(predicted[plotted] / measured[plotted]), lw=0.9, color=colours[k], alpha=0.8
        )
    _finish_tests(tests, fit)
    _finish_residuals(residuals, fit)


def _draw_curve(axes: Axes, hours: Floats, measured: Floats, predicted: Floats, colour: Any, label: str) -> None:
    axes.plot(hours, 100 * measured, ".", ms=3, color=colour, alpha=0.55, label=label)
    axes.plot(hours, 100 * predicted, "-", lw=1.2, color=colour)


def _draw_parity(axes: Axes, _: Floats, measured: Floats, predicted: Floats, colour: Any, label: str) -> None:
    plotted = (measured > 0) & (predicted > 0)
    axes.plot(100 * measured[plotted], 100 * predicted[plotted], "-", lw=0.8, color=colour, alpha=0.7)


def _finish_tests(axes: Axes, fit: Identification) -> None:
    with_strain = [h for h in fit.histories if "strain" in h.outputs]
    largest_strain = 100 * max(float(np.max(h.outputs["strain"][usable_frames(h, "strain")])) for h in with_strain)
    axes.set(xscale="log", yscale="log", ylim=(1e-3 * largest_strain, 2 * largest_strain))
    axes.grid(alpha=0.25)
    if len(fit.histories) <= MANY_TESTS:
        axes.set(xlabel="time, h", ylabel="creep strain, %")
        axes.set_title("measured less loading strain (dots), identified (lines)", fontsize=10)
        axes.legend(fontsize=7, loc="lower right")
        return
    axis_limits = np.array([1e-3 * largest_strain, 2 * largest_strain])
    axes.plot(axis_limits, axis_limits, "k-", lw=1.2)
    axes.fill_between(
        axis_limits, axis_limits / 2, axis_limits * 2, color="black", alpha=0.08, lw=0, label="within a factor of 2"
    )
    axes.set(xlim=axis_limits, xlabel="measured less loading strain, %", ylabel="identified creep strain, %")
    axes.set_title("each line one test, coloured by temperature", fontsize=10)
    axes.legend(fontsize=8, loc="upper left")


def _finish_residuals(axes: Axes, fit: Identification) -> None:
    axis_limit = float(np.clip(4.0 * fit.rms, 0.1, 4.0))
    axes.set(xscale="log", ylim=(-axis_limit, axis_limit), xlabel="time, h", ylabel="ln (identified / measured)")
    axes.axhline(0, color="black", lw=0.8)
    axes.grid(alpha=0.25)
    residual_label = "distance in ln strain and ln time" if rupture_rows(fit) else "of ln strain"
    axes.set_title(f"rms {residual_label} {fit.rms:.3g}, loading strains taken off", fontsize=10)


def _draw_rates(axes: Axes, fit: Identification) -> None:
    stresses = [v for h in fit.histories for v in reference_stresses(h, fit.predictor) if v > 0]
    grid = np.geomspace(0.8 * min(stresses), 1.25 * max(stresses), 60)
    temperatures = np.unique(np.round([float(np.mean(h.temperature_program().values)) for h in fit.histories], 0))
    temperatures = temperatures[np.linspace(0, temperatures.size - 1, min(temperatures.size, 5)).round().astype(int)]
    for T, colour in zip(temperatures, _shades(temperatures), strict=True):
        rate, low, high = fit.rate(grid, np.full_like(grid, T), warn=False)
        axes.fill_between(grid, low, high, color=colour, alpha=0.25, lw=0)
        axes.plot(grid, rate, color=colour, lw=1.4, label=f"{T - ZERO_CELSIUS:.0f} C")
    axes.set(xscale="log", yscale="log", xlabel="stress, MPa", ylabel="creep rate, 1/s")
    axes.grid(alpha=0.25)
    axes.legend(fontsize=8, title="identified, 95 % band", title_fontsize=8)
    if grid[-1] < 10 * grid[0]:
        for place in (axes.xaxis.set_major_formatter, axes.xaxis.set_minor_formatter):
            place("{x:g}")
    axes.set_title(f"rate at strain {fit.reference.strain:.1e}, {fit.reference.time / 3600:.3g} h", fontsize=10)


def _colours(histories: tuple[History, ...]) -> list[Any]:
    from matplotlib import colormaps

    temperatures = np.array([float(np.mean(h.temperature_program().values)) for h in histories])
    use_cycle = np.ptp(temperatures) < 2.0 or len(histories) <= 10
    return [colormaps["tab10"](k % 10) for k in range(len(histories))] if use_cycle else _shades(temperatures)


def _shades(temperatures: Floats) -> list[Any]:
    from matplotlib import colormaps

    span = max(float(np.ptp(temperatures)), 1e-9)
    return [colormaps[COLOUR_MAP](0.9 * float(v - np.min(temperatures)) / span) for v in temperatures]
