"""Plots of uncertainty: profile likelihood, pairs of posterior samples, correlation, bands of creep rates."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.records import ZERO_CELSIUS
from creepkit.report.figures import empty_figure, save_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.inverse.uncertainty.correlation import Correlation
    from creepkit.inverse.uncertainty.model_averaging import RateBand
    from creepkit.inverse.uncertainty.posterior import PosteriorSamples
    from creepkit.inverse.uncertainty.profile_likelihood import ProfileLikelihood


MAX_DRAWS = 2000
"""Draws in a panel of pairs; more are a blot."""


LOGARITHMIC_RATIO = 30.0
"""Ratio of largest to smallest value beyond which an axis is logarithmic."""


def profile_figure(profile: ProfileLikelihood, path: str | Path | None = None) -> Figure:
    """The rise of chi-square over the quantity, its limit, and the parabola of Laplace's approximation."""
    figure, axes = _figure_and_axes(5.2, 4.2)
    logarithmic = (
        bool((profile.values > 0).all()) and float(profile.values.max() / profile.values.min()) > LOGARITHMIC_RATIO
    )
    axes.plot(profile.values, profile.chi_square, "o-", ms=4, color="C0", label="profile")
    low, high = profile.laplace
    scale = np.log if low > 0 and logarithmic else np.asarray
    grid = np.geomspace(low, high, 80) if low > 0 and logarithmic else np.linspace(low, high, 80)
    middle, half = 0.5 * (scale(low) + scale(high)), 0.5 * (scale(high) - scale(low))
    axes.plot(grid, profile.limit * ((scale(grid) - middle) / half) ** 2, "--", color="C1", label="Laplace")
    axes.axhline(profile.limit, color="black", lw=0.8, label=f"{100 * profile.level:g} %")
    for end in (profile.low, profile.high):
        if end is not None:
            axes.axvline(end, color="black", lw=0.8, ls=":")
    unit = "" if profile.unit == "1" else f", {profile.unit}"
    axes.set_xlim(*_with_margin(profile.values, logarithmic))
    axes.set(xlabel=f"{profile.name}{unit}", ylabel="rise of chi-square", ylim=(0.0, 1.6 * profile.limit))
    if logarithmic:
        axes.set_xscale("log")
    axes.legend(fontsize=8)
    axes.grid(alpha=0.25)
    return save_figure(figure, path)


def _with_margin(values: Floats, logarithmic: bool) -> tuple[float, float]:
    ends = np.log(values[[0, -1]]) if logarithmic else values[[0, -1]]
    margin = 0.08 * float(np.ptp(ends)) + 1e-12
    lower, upper = float(ends[0]) - margin, float(ends[1]) + margin
    return (float(np.exp(lower)), float(np.exp(upper))) if logarithmic else (lower, upper)


def pairs_figure(samples: PosteriorSamples, path: str | Path | None = None) -> Figure:
    """Histograms of every parameter and clouds of every pair, in the author's units, coefficients as log10."""
    from matplotlib.figure import Figure

    columns = _columns(samples)
    count = len(columns)
    figure = Figure(figsize=(1.2 + 2.0 * count, 1.0 + 2.0 * count), layout="constrained")
    panels = np.atleast_2d(np.asarray(figure.subplots(count, count, squeeze=False)))
    names = list(columns)
    for row, first in enumerate(names):
        for column, second in enumerate(names):
            _draw_pair(panels[row, column], columns, (first, second), (row, column), count)
    figure.suptitle(f"{samples.coordinates.law.title or samples.coordinates.law.name}: posterior", fontsize=11)
    return save_figure(figure, path)


def _columns(samples: PosteriorSamples) -> dict[str, Floats]:
    """{label: (draws,)}, at most SHOWN draws."""
    table = samples.coordinates.law.table
    stride = max(len(samples.u) // MAX_DRAWS, 1)
    return {
        f"log10 {name}" if table[name].scale == "log" else name: (
            np.log10(values[::stride]) if table[name].scale == "log" else values[::stride]
        )
        for name, values in samples.values.items()
    }


def _draw_pair(
    axes: Axes, columns: dict[str, Floats], names: tuple[str, str], position: tuple[int, int], count: int
) -> None:
    (first, second), (row, column) = names, position
    if column > row:
        axes.set_visible(False)
        return
    if row == column:
        axes.hist(columns[first], bins=40, color="C0", alpha=0.7)
        for share in np.quantile(columns[first], (0.025, 0.5, 0.975)):
            axes.axvline(float(share), color="black", lw=0.8, ls=":")
        axes.set_yticks([])
    else:
        axes.plot(columns[second], columns[first], ".", ms=1.5, color="C0", alpha=0.3, rasterized=True)
    if row == count - 1:
        axes.set_xlabel(second)
    if column == 0 and row > 0:
        axes.set_ylabel(first)
    axes.tick_params(labelsize=7)


def correlation_figure(correlation: Correlation, path: str | Path | None = None) -> Figure:
    """The matrix in colours from -1 to 1, with its numbers."""
    count = len(correlation.names)
    figure, axes = _figure_and_axes(2.0 + 0.8 * count, 1.6 + 0.8 * count)
    image = axes.imshow(correlation.matrix, vmin=-1.0, vmax=1.0, cmap="RdBu_r")
    for row in range(count):
        for column in range(count):
            value = correlation.matrix[row, column]
            axes.text(column, row, f"{value:.2f}", ha="center", va="center", fontsize=8,
                      color="white" if abs(value) > 0.6 else "black")  # fmt: skip
    axes.set_xticks(range(count), correlation.names, rotation=45, ha="right")
    axes.set_yticks(range(count), correlation.names)
    axes.set_title(correlation.title, fontsize=10)
    figure.colorbar(image, ax=axes, shrink=0.8, label="correlation")
    return save_figure(figure, path)


def rate_bands_figure(bands: Sequence[RateBand], path: str | Path | None = None) -> Figure:
    """Rates over stress with their bands: lighter with the temperature's uncertainty, darker without."""
    if not bands:
        raise FitError("there are no bands to draw")
    figure, axes = _figure_and_axes(5.6, 4.6)
    for k, band in enumerate(bands):
        colour = f"C{k % 10}"
        label = f"{band.temperature - ZERO_CELSIUS:.0f} $\\pm$ {band.temperature_uncertainty:g} °C"
        axes.fill_between(band.stress, band.low, band.high, color=colour, alpha=0.2, lw=0)
        axes.fill_between(band.stress, *band.parameter_band, color=colour, alpha=0.35, lw=0)
        axes.plot(band.stress, band.rate, color=colour, lw=1.4, label=label)
    axes.set(xscale="log", yscale="log", xlabel="stress, MPa", ylabel="creep rate, 1/s")
    axes.grid(alpha=0.25, which="both")
    axes.legend(fontsize=8, title="95 %: law and temperature (dark: law alone)", title_fontsize=7)
    axes.set_title("\n".join(dict.fromkeys(band.name for band in bands)), fontsize=9)
    return save_figure(figure, path)


def _figure_and_axes(width: float, height: float) -> tuple[Figure, Any]:
    figure = empty_figure(width, height)
    return figure, figure.subplots()
