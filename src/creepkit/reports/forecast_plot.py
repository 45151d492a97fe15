"""Plot of a forecast: curves with bands, measured points over them, times on the axis, and what a band is made of."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.frame_noise import usable_frames
from creepkit.records import is_logarithmic
from creepkit.reports.curve_of_test import axis_label
from creepkit.reports.figures import empty_figure, save_figure, set_range, wrapped
from creepkit.reports.load_programs import SECONDS_PER_HOUR

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.forecasts.forecast import Forecast
    from creepkit.forecasts.results import OutputForecast, TestForecast

MOST_DRAWN = 12
"""Tests in one figure."""


COLUMNS = 4
"""Tests side by side."""


PART_COLOURS = {
    "parameters of the law": "#3b6fb6",
    "choice of the law": "#7b5ea7",
    "scatter between tests": "#e08214",
    "scatter between heats": "#f5b13d",
    "scatter between laboratories": "#fbd98c",
    "offset": "#9aa4ad",
    "noise": "#cfd5da",
    "misfit of the law": "#b2182b",
    "numerical error": "#555555",
}
"""Of the parts of a band; dimensions have those of DIMENSION_COLOURS in turn."""


TIME_COLOUR, RUPTURE_COLOUR = "#c51b7d", "#b2182b"


DIMENSION_COLOURS = ("#4d9221", "#7fbc41", "#b8e186", "#276419")


NAMED_SHARE, UNNAMED = 0.02, "#000000"
"""Share of the variance from which a part stands in the legend, and the colour of others."""


BELOW_EDGE = 0.04
"""Of the height of a panel: how far below its upper edge the interval of the rupture time is drawn."""


LONGEST_AXIS = 5.0
"""Of the time of a test: beyond, an interval goes on to the right of the axis, as an arrow says."""


SHOWN_RATIO = 1e-3
"""Of the largest strain: the lower end of a logarithmic axis."""


def forecast_figure(forecast: Forecast, path: str | Path | None = None) -> Figure:
    """Each test: its leading output with both bands, and below it what the band is made of over time.

    A single test shows all of its outputs. Tests beyond the first dozen are not drawn.
    """
    tests = [t for t in forecast.tests if t.outputs][:MOST_DRAWN]
    if not tests:
        raise FitError("nothing is predicted of these tests, so there is nothing to draw")
    columns = min(COLUMNS, len(tests))
    rows = -(-len(tests) // columns)
    shown = [[*t.outputs.values()] if len(tests) == 1 else [next(iter(t.outputs.values()))] for t in tests]
    panels = max(len(one) for one in shown)
    width, height = max(4.4 * columns, 6.6), rows * (3.1 * panels + 1.7) + 1.1
    figure = empty_figure(width, height)
    grid = figure.add_gridspec(rows, columns)
    parts: dict[str, str] = {}
    for k, (test, outputs) in enumerate(zip(tests, shown, strict=True)):
        cell = grid[k // columns, k % columns].subgridspec(
            len(outputs) + 1, 1, height_ratios=[*[2.0] * len(outputs), 1.0], hspace=0.08
        )
        panels_of_test = [figure.add_subplot(cell[j]) for j in range(len(outputs))]
        for j, (axes, one) in enumerate(zip(panels_of_test, outputs, strict=True)):
            _draw_curve(axes, test, one, first=j == 0)
        _draw_shares(figure.add_subplot(cell[len(outputs)]), panels_of_test[0], outputs[0], parts)
    events = {not t.output for test in tests for t in test.times if t.low <= 1.03 * SECONDS_PER_HOUR * _last(test)}
    _legend(figure, parts, forecast.level, events, measured=any(t.score is not None for t in tests))
    title = " or ".join(forecast.laws)
    left_out = len(forecast.tests) - len(tests)
    title += f" ({left_out} more tests are not drawn)" if left_out > 0 else ""
    figure.suptitle(wrapped(f"forecast by {title}", width), fontsize=10)
    return save_figure(figure, path)


def _scaled(one: OutputForecast) -> float:
    return 100.0 if is_logarithmic(one.output) else 1.0


def _draw_curve(axes: Axes, test: TestForecast, one: OutputForecast, *, first: bool) -> None:
    """The curve, pointwise and simultaneous bands, the measured points, and intervals of times."""
    factor, logarithmic = _scaled(one), is_logarithmic(one.output)
    history, positive = test.history, one.times > 0
    hours = one.times[positive] / SECONDS_PER_HOUR
    curve = factor * one.value[positive]
    low, high, lowest, highest = (
        factor * v[positive] for v in (one.band.low, one.band.high, one.band.lowest, one.band.highest)
    )
    measured_hours, measured = _measured(test, one.output, factor)
    finite = np.concatenate([v[np.isfinite(v)] for v in (curve, low, high, measured)])
    finite = finite if finite.size else np.zeros(1)
    top = float(finite.max(initial=1e-12))
    bottom = (
        max(SHOWN_RATIO * top, 1e-12) if logarithmic else float(min(finite.min(initial=0.0), 0.0 if top > 0 else top))
    )
    if not logarithmic and finite.size and finite.min() > 0.4 * top:
        bottom = float(finite.min()) - 0.1 * (top - float(finite.min()))
    ceiling = 1.3 * top if logarithmic else top + 0.05 * abs(top - bottom)

    set_range(axes, "y", bottom, ceiling, logarithmic=logarithmic, most=6)
    bottom, ceiling = axes.get_ylim()

    def clipped(v: Floats) -> Floats:
        return np.clip(v, bottom, ceiling)

    axes.fill_between(hours, clipped(lowest), clipped(highest), color="#3b6fb6", alpha=0.15, lw=0)
    axes.fill_between(hours, clipped(low), clipped(high), color="#3b6fb6", alpha=0.3, lw=0)
    axes.plot(hours, curve, color="#1f3f73", lw=1.3)
    if measured.size:
        axes.plot(measured_hours, measured, ".", ms=3, color="black", alpha=0.6)
    last = float(history.times[-1]) / SECONDS_PER_HOUR
    start = float(hours[0]) if logarithmic else 0.0
    end = _time_end(test, last)
    set_range(axes, "x", start, end, logarithmic=logarithmic, most=6)
    axes.set_xlim(0.95 * start if logarithmic else 0.0, 1.03 * end)
    _draw_times(axes, test, one, bottom, ceiling)
    axes.set_ylabel(axis_label(one.output), fontsize=8)
    axes.tick_params(labelsize=7, labelbottom=False)
    axes.grid(alpha=0.25)
    if first:
        axes.set_title(wrapped(f"{test.name}: {history.condition}", 4.4, 11.0), fontsize=8)


def _last(test: TestForecast) -> float:
    """h, the end of the time axis."""
    return _time_end(test, float(test.history.times[-1]) / SECONDS_PER_HOUR)


def _time_end(test: TestForecast, last: float) -> float:
    """h, the end of the time axis: that of the test, or of an interval that begins before it, up to LONGEST_AXIS."""
    end = last
    for time in sorted((t for t in test.times if np.isfinite(t.low)), key=lambda t: t.low):
        if time.low / SECONDS_PER_HOUR < end:
            end = max(end, min(time.high / SECONDS_PER_HOUR, LONGEST_AXIS * last))
    return end


def _measured(test: TestForecast, output: str, factor: float) -> tuple[Floats, Floats]:
    history = test.history
    if output not in history.outputs:
        return np.zeros(0), np.zeros(0)
    used = usable_frames(history, output) & (history.times > 0)
    return history.times[used] / SECONDS_PER_HOUR, factor * history.outputs[output][used]


def _draw_times(axes: Axes, test: TestForecast, one: OutputForecast, bottom: float, top: float) -> None:
    """Intervals of times, the median marked: at the value that is reached, and of rupture at the upper edge."""
    right = axes.get_xlim()[1]
    for time in test.times:
        is_rupture = not time.output
        if not is_rupture and time.output != one.output:
            continue
        below = top * (bottom / top) ** BELOW_EDGE if is_logarithmic(one.output) else top - BELOW_EDGE * (top - bottom)
        level = below if is_rupture else _scaled(one) * time.target
        if not bottom <= level <= top or not time.low / SECONDS_PER_HOUR <= right:
            continue
        low, high = time.low / SECONDS_PER_HOUR, min(time.high / SECONDS_PER_HOUR, right)
        colour = RUPTURE_COLOUR if is_rupture else TIME_COLOUR
        axes.plot([low, high], [level, level], color=colour, lw=2.2, solid_capstyle="butt", zorder=4)
        if time.high / SECONDS_PER_HOUR > right:
            axes.plot([right], [level], ">", color=colour, ms=5, clip_on=False, zorder=5)
        if np.isfinite(time.median) and time.median / SECONDS_PER_HOUR <= right:
            axes.plot([time.median / SECONDS_PER_HOUR], [level], "|", color=colour, ms=9, mew=2, zorder=5)
        if np.isfinite(time.measured) and not time.censored:
            axes.plot([time.measured / SECONDS_PER_HOUR], [level], "x", color="black", ms=5, zorder=6)


def _draw_shares(axes: Axes, above: Axes, one: OutputForecast, parts: dict[str, str]) -> None:
    """Stacked shares of the variance over time, on the axis of the panel above."""
    positive = (one.times > 0) & np.isfinite(one.value)
    hours = one.times[positive] / SECONDS_PER_HOUR
    for part, share in one.shares.items():
        if part not in parts and np.nanmax(share[positive], initial=0.0) >= NAMED_SHARE:
            taken = [c for c in parts.values() if c in DIMENSION_COLOURS]
            parts[part] = PART_COLOURS.get(part) or DIMENSION_COLOURS[len(taken) % len(DIMENSION_COLOURS)]
    if hours.size:
        stacked = np.stack([100 * values[positive] for values in one.shares.values()])
        axes.stackplot(hours, stacked, colors=[parts.get(part, UNNAMED) for part in one.shares], lw=0)
        logarithmic = is_logarithmic(one.output)
        upper = above.get_xlim()
        axes.set_xscale("log" if logarithmic else "linear")
        set_range(axes, "x", *upper, logarithmic=logarithmic, most=6)
        axes.set_xlim(*upper)
    axes.set(ylim=(0, 100), xlabel="time, h")
    axes.set_ylabel("variance, %", fontsize=8)
    axes.tick_params(labelsize=7)


def _time_style(*, rupture: bool) -> dict[str, Any]:
    """Of the interval of a time in the legend."""
    return {"color": RUPTURE_COLOUR if rupture else TIME_COLOUR, "lw": 2.2, "marker": "|", "ms": 9, "mew": 2}


def _legend(figure: Figure, parts: dict[str, str], level: float, ruptures: set[bool], *, measured: bool) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    per_cent = f"{100 * level:g} %"
    handles = [
        Line2D([], [], color="#1f3f73", lw=1.3, label="identified law"),
        Patch(color="#3b6fb6", alpha=0.45, label=f"{per_cent} of measured values"),
        Patch(color="#3b6fb6", alpha=0.15, label=f"{per_cent} of whole curves"),
        *([Line2D([], [], color="black", marker=".", ls="", label="measured")] if measured else []),
        *(
            Line2D([], [], **_time_style(rupture=r), label=f"time to {word}: median, {per_cent}")
            for r, word in ((False, "a value"), (True, "rupture"))
            if r in ruptures
        ),
        *(Patch(color=colour, label=f"variance by {part}") for part, colour in parts.items()),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=7)
