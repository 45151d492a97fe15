"""The plot of a penalty's path: shares of terms over the strength, and what they cost in misfit."""

from __future__ import annotations

from pathlib import Path as File
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Floats
from creepkit.figures import blank, written

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.inverse.sparsity.path import Path

LEAST_RISE = 0.1
"""Rises of chi-square below this are drawn there: the axis is logarithmic."""


def figure_of(path: Path, file: str | File | None = None) -> Figure:
    """Shares on the left axis, the rise of chi-square on the right one."""
    figure = blank(7.2, 4.4)
    axes = figure.subplots()
    places = _places(path.strengths)
    for label, share in zip(path.labels, path.shares.T, strict=True):
        axes.plot(places, share, "o-", ms=4, lw=1.6, label=label)
    axes.axvline(places[path.chosen], color="black", lw=1.0, ls=":", label="chosen by BIC")
    axes.axhspan(0.0, 0.05, color="black", alpha=0.06, lw=0)
    axes.set(xscale="log", ylim=(0, 1.05), xlabel="strength of the penalty", ylabel="contribution of each term")
    _ticks(axes, path, places)
    axes.grid(alpha=0.25)
    _misfit(axes, path, places)
    axes.legend(fontsize=8, loc="center left")
    axes.set_title(f"{path.penalty}: terms below 5 % (grey) are dropped", fontsize=10)
    return written(figure, file)


def _places(strengths: Floats) -> Floats:
    """Where strengths are drawn: none stands to the left of the weakest."""
    weakest = strengths[1] if strengths.size > 1 else 1.0
    return np.array([weakest / 3.0, *strengths[1:]])


def _ticks(axes: Axes, path: Path, places: Floats) -> None:
    axes.set_xticks(places, ["none", *(f"{s:.2g}" if s < 100 else f"{s:.0f}" for s in path.strengths[1:])])
    axes.minorticks_off()


def _misfit(axes: Axes, path: Path, places: Floats) -> None:
    """The rise of chi-square over the sum without penalty."""
    right = axes.twinx()
    rise = np.maximum(path.chi_square - path.chi_square[0], LEAST_RISE)
    right.plot(places, rise, "s--", color="grey", ms=3, lw=1.0)
    right.set(yscale="log", ylabel="rise of chi-square (grey squares)")
