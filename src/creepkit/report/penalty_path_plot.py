"""The plot of a regularisation path: contributions of terms and rise of chi-square over the strength of the penalty."""

from __future__ import annotations

from pathlib import Path as File
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Floats
from creepkit.report.figures import empty_figure, save_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.inverse.sparsity.result import PenaltyPath


SMALLEST_DRAWN_RISE = 0.1
"""Rises of chi-square below this are drawn there: the axis is logarithmic."""


def penalty_path_figure(path: PenaltyPath, file: str | File | None = None) -> Figure:
    """Shares on the left axis, the rise of chi-square on the right one."""
    figure = empty_figure(7.2, 4.4)
    axes = figure.subplots()
    positions = _strength_positions(path.strengths)
    for label, contribution in zip(path.terms, path.contributions.T, strict=True):
        axes.plot(positions, contribution, "o-", ms=4, lw=1.6, label=label)
    axes.axvline(positions[path.chosen], color="black", lw=1.0, ls=":", label="chosen by BIC")
    axes.axhspan(0.0, 0.05, color="black", alpha=0.06, lw=0)
    axes.set(xscale="log", ylim=(0, 1.05), xlabel="strength of the penalty", ylabel="contribution of each term")
    _draw_ticks(axes, path, positions)
    axes.grid(alpha=0.25)
    _draw_chi_square(axes, path, positions)
    axes.legend(fontsize=8, loc="center left")
    axes.set_title(f"{path.penalty}: terms below 5 % (grey) are dropped", fontsize=10)
    return save_figure(figure, file)


def _strength_positions(strengths: Floats) -> Floats:
    """Where strengths are drawn: none stands to the left of the weakest."""
    weakest = strengths[1] if strengths.size > 1 else 1.0
    return np.array([weakest / 3.0, *strengths[1:]])


def _draw_ticks(axes: Axes, path: PenaltyPath, positions: Floats) -> None:
    axes.set_xticks(positions, ["none", *(f"{s:.2g}" if s < 100 else f"{s:.0f}" for s in path.strengths[1:])])
    axes.minorticks_off()


def _draw_chi_square(axes: Axes, path: PenaltyPath, positions: Floats) -> None:
    """The rise of chi-square over the sum without penalty."""
    right = axes.twinx()
    rise = np.maximum(path.chi_square - path.chi_square[0], SMALLEST_DRAWN_RISE)
    right.plot(positions, rise, "s--", color="grey", ms=3, lw=1.0)
    right.set(yscale="log", ylabel="rise of chi-square (grey squares)")
