"""Text and plots of uncertainty: profile likelihood, posterior samples, correlation, model average, rate bands."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Floats
from creepkit.records.units import celsius_text
from creepkit.reports.blocks import aligned
from creepkit.reports.figures import empty_figure, panels_of, place_legend_right, save_figure, set_range

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.inverse.uncertainty.correlation import Correlation
    from creepkit.inverse.uncertainty.importance_sampling import PosteriorSamples
    from creepkit.inverse.uncertainty.model_averaging import ModelAverage
    from creepkit.inverse.uncertainty.profile_likelihood import ProfileLikelihood


MAX_DRAWS = 2000
"""Draws in a panel of pairs; more hide one another."""


LOGARITHMIC_RATIO = 30.0
"""Ratio of largest to smallest value beyond which an axis is logarithmic."""


def profile_text(profile: ProfileLikelihood) -> str:
    """One line: the best value and the interval by the profile."""
    unit = _unit_text(profile.unit)
    low, high = (f"{end:.4g}" if end is not None else "open" for end in (profile.low, profile.high))
    interval = f"{100 * profile.level:g} % interval [{low}, {high}] by its profile"
    return "; ".join([f"{profile.name} = {profile.best:.5g}{unit}, {interval}", *profile.notes])


def _unit_text(unit: str) -> str:
    return "" if unit == "1" else f" {unit}"


def profile_figure(profile: ProfileLikelihood, path: str | Path | None = None) -> Figure:
    """The rise of chi-square over the quantity, its limit, and the parabola of Laplace's approximation."""
    figure, axes = panels_of(6.0, 4.2)
    low, high = profile.laplace
    positive = bool((profile.values > 0).all()) and low > 0
    logarithmic = positive and float(profile.values.max() / profile.values.min()) > LOGARITHMIC_RATIO
    curve, rise = _profile_curve(profile, positive)
    axes.plot(curve, rise, "-", color="C0", label="profile")
    axes.plot(profile.values, profile.chi_square, "o", ms=4, color="C0")
    scale = np.log if positive else np.asarray
    grid = np.geomspace(low, high, 80) if positive else np.linspace(low, high, 80)
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
        set_range(axes, "x", *axes.get_xlim(), logarithmic=True, most=6)
    place_legend_right(axes)
    return save_figure(figure, path)


def _profile_curve(profile: ProfileLikelihood, positive: bool) -> tuple[Floats, Floats]:
    """(points,) values and rises of chi-square between those of a profile: its signed root is nearly straight."""
    values = np.log(profile.values) if positive else profile.values
    root = np.sqrt(np.maximum(profile.chi_square, 0.0)) * np.sign(profile.values - profile.best)
    grid = np.unique(np.concatenate([values, np.linspace(values[0], values[-1], 300)]))
    return (np.exp(grid) if positive else grid), np.interp(grid, values, root) ** 2


def _with_margin(values: Floats, logarithmic: bool) -> tuple[float, float]:
    ends = np.log(values[[0, -1]]) if logarithmic else values[[0, -1]]
    margin = 0.08 * float(np.ptp(ends)) + 1e-12 * float(np.abs(ends).max())
    lower, upper = float(ends[0]) - margin, float(ends[1]) + margin
    return (float(np.exp(lower)), float(np.exp(upper))) if logarithmic else (lower, upper)


def posterior_text(samples: PosteriorSamples) -> str:
    """The median and 95 % interval of every parameter."""
    width = max(len(name) for name in samples.coordinates.names)
    lines = [f"{len(samples.u)} draws from the posterior"]
    for name, param in samples.coordinates.law.table.items():
        median, low, high = samples.interval(name)
        lines.append(f"  {name:{width}} = {median:.5g}  [{low:.4g}, {high:.4g}]{_unit_text(param.unit)}")
    return "\n".join([*lines, *(f"  note: {note}" for note in samples.notes)])


def pairs_figure(samples: PosteriorSamples, path: str | Path | None = None) -> Figure:
    """Histograms of every parameter and clouds of every pair, in the author's units, coefficients as log10."""
    columns = _columns(samples)
    count = len(columns)
    figure = empty_figure(1.2 + 2.0 * count, 1.0 + 2.0 * count)
    panels = np.atleast_2d(np.asarray(figure.subplots(count, count, squeeze=False)))
    names = list(columns)
    for row, first in enumerate(names):
        for column, second in enumerate(names):
            _draw_pair(panels[row, column], columns, (first, second), (row, column), count)
    figure.suptitle(f"{samples.coordinates.law.title or samples.coordinates.law.name}: posterior", fontsize=11)
    return save_figure(figure, path)


def _columns(samples: PosteriorSamples) -> dict[str, Floats]:
    """{label: (draws,)}, at most MAX_DRAWS draws."""
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
    from matplotlib.ticker import MaxNLocator, NullLocator

    (first, second), (row, column) = names, position
    if column > row:
        axes.set_visible(False)
        return
    if row == column:
        axes.hist(columns[first], bins=40, color="C0", alpha=0.7)
        for quantile in np.quantile(columns[first], (0.025, 0.5, 0.975)):
            axes.axvline(float(quantile), color="black", lw=0.8, ls=":")
    else:
        axes.plot(columns[second], columns[first], ".", ms=1.5, color="C0", alpha=0.3, rasterized=True)
    if row == count - 1:
        axes.set_xlabel(second)
    if column == 0 and row > 0:
        axes.set_ylabel(first)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(3) if axis is axes.xaxis or row != column else NullLocator())
    axes.tick_params(labelsize=7)
    axes.tick_params(axis="x", labelbottom=row == count - 1)
    axes.tick_params(axis="y", labelleft=column == 0)


def correlation_text(correlation: Correlation) -> str:
    """The matrix with its names, four digits."""
    rows = [(name, *(f"{v:.4f}" for v in row)) for name, row in zip(correlation.names, correlation.matrix, strict=True)]
    return "\n".join(aligned(("", *correlation.names), rows, numeric=range(1, 1 + len(rows))))


def model_average_text(average: ModelAverage) -> str:
    """One line: the laws with their weights, rate and local exponent at the reference point."""
    reference = average.fits[0].reference
    rate, low, high = (float(v) for v in average.rate(reference.stress))
    exponent, exponent_low, exponent_high = (float(v) for v in average.local_exponent(reference.stress))
    names = ", ".join(f"{fit.law.name} ({w:.2g})" for fit, w in zip(average.fits, average.weights, strict=True))
    return (
        f"over the laws {names}: rate at {reference.stress:.4g} MPa, {celsius_text(reference.temperature)} {rate:.3g} "
        f"[{low:.3g}, {high:.3g}] 1/s, local stress exponent {exponent:.3g} [{exponent_low:.3g}, {exponent_high:.3g}]"
    )
