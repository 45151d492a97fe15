"""The plot of an identification: measured against identified, residuals over time, and rates with their band."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.errors import FitError
from creepkit.records import ZERO_CELSIUS, History

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.inverse.identification import Identification

COLOURS = "viridis"
CROWDED = 12
"""Above this many tests, curves are coloured by temperature and not named one by one."""


def figure_of(fit: Identification, path: str | Path | None = None) -> Figure:
    """Draw three panels: strain over time, ln(identified / measured) over time, rate over stress with 95 % bands."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    if not fit.histories:
        raise FitError("this identification was loaded without its histories: read them and call fit.on(histories)")
    figure = Figure(figsize=(13.5, 4.8), layout="constrained")
    FigureCanvasAgg(figure)
    curves, residuals, rates = figure.subplots(1, 3, width_ratios=(1.25, 1.0, 1.0))
    colours = _colours(fit.histories)
    found = fit.predict()
    for k, history in enumerate(fit.histories):
        offset = fit.misfits[k].offset
        _draw_test(
            curves, residuals, history, found.of(k)[:, 0], offset, colours[k], named=len(fit.histories) <= CROWDED
        )
    _draw_rates(rates, fit)
    _finish(figure, (curves, residuals, rates), fit)
    if path is not None:
        figure.savefig(path, dpi=130)
    return figure


def _draw_test(
    curves: Axes, residuals: Axes, history: History, predicted: Any, offset: float, colour: Any, *, named: bool
) -> None:
    hours = history.times / 3600.0
    measured, used = history.outputs["strain"] - offset, history.used & (history.times > 0)
    label = history.condition if named else None
    curves.plot(hours[used], 100 * measured[used], ".", ms=3, color=colour, alpha=0.55, label=label)
    curves.plot(hours[used], 100 * predicted[used], "-", lw=1.2, color=colour)
    good = used & (measured > 0) & (predicted > 0)
    residuals.plot(hours[good], np.log(predicted[good] / measured[good]), "-", lw=0.9, color=colour, alpha=0.8)


def _draw_rates(axes: Axes, fit: Identification) -> None:
    stresses = [v for h in fit.histories for v in h.loading.program().values if v > 0]
    grid = np.geomspace(0.8 * min(stresses), 1.25 * max(stresses), 60)
    warmth = np.array([float(np.mean(h.temperature_program().values)) for h in fit.histories])
    levels = np.unique(np.round(warmth, 0))
    levels = levels[np.linspace(0, levels.size - 1, min(levels.size, 5)).round().astype(int)]
    for T, colour in zip(levels, _shades(levels), strict=True):
        rate, low, high = fit.rate(grid, np.full_like(grid, T))
        axes.fill_between(grid, low, high, color=colour, alpha=0.25, lw=0)
        axes.plot(grid, rate, color=colour, lw=1.4, label=f"{T - ZERO_CELSIUS:.0f} C")
    axes.legend(fontsize=8, title="identified, 95 % band", title_fontsize=8)
    axes.set_title(f"rate at strain {fit.reference.strain:.1e}, {fit.reference.time / 3600:.3g} h", fontsize=10)


def _finish(figure: Figure, panels: tuple[Axes, Axes, Axes], fit: Identification) -> None:
    curves, residuals, rates = panels
    for axes, x, y in (
        (curves, "time, h", "creep strain, %"),
        (residuals, "time, h", "ln (identified / measured)"),
        (rates, "stress, MPa", "creep rate, 1/s"),
    ):
        axes.set_xscale("log")
        axes.set_xlabel(x)
        axes.set_ylabel(y)
        axes.grid(alpha=0.25, which="major")
    curves.set_yscale("log")
    rates.set_yscale("log")
    smallest = min(float(np.min(h.outputs["strain"][h.used], initial=1.0, where=h.outputs["strain"][h.used] > 0))
                   for h in fit.histories)  # fmt: skip
    top = max(float(np.max(h.outputs["strain"][h.used])) for h in fit.histories)
    curves.set_ylim(100 * max(smallest / 1.5, top * 1e-3), 200 * top)
    residuals.axhline(0, color="black", lw=0.8)
    residuals.set_ylim(-_reach(fit), _reach(fit))
    curves.set_title("measured less loading strain (dots), identified (lines)", fontsize=10)
    residuals.set_title(f"rms of ln strain {fit.rms:.3g}, loading strains taken off", fontsize=10)
    if len(fit.histories) <= CROWDED:
        curves.legend(fontsize=7, loc="lower right")
    figure.suptitle(f"{fit.law.title or fit.law.name}   ({len(fit.histories)} tests)", fontsize=11)


def _reach(fit: Identification) -> float:
    """Half height of the residual panel: wide enough for nearly all tests."""
    return float(np.clip(4.0 * fit.rms, 0.1, 4.0))


def _colours(histories: tuple[History, ...]) -> list[Any]:
    warmth = np.array([float(np.mean(h.temperature_program().values)) for h in histories])
    if np.ptp(warmth) < 2.0:
        from matplotlib import colormaps

        return [colormaps["tab10"](k % 10) for k in range(len(histories))]
    return _shades(warmth)


def _shades(warmth: Any) -> list[Any]:
    from matplotlib import colormaps

    span = max(float(np.ptp(warmth)), 1e-9)
    return [colormaps[COLOURS](0.9 * float(v - np.min(warmth)) / span) for v in warmth]
