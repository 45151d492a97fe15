"""Figures without a window, and their files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from creepkit.errors import CreepkitError, FitError

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def blank(width: float, height: float) -> Figure:
    """A figure without panels, inches; it needs no display."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def written(figure: Figure, path: str | Path | None, error: type[CreepkitError] = FitError) -> Figure:
    """The figure, written to `path` where one is given; `error` where it cannot be."""
    if path is not None:
        try:
            figure.savefig(path, dpi=130)
        except (OSError, ValueError) as found:
            told = str(found).splitlines()[0]
            raise error(f"{path}: the plot cannot be written ({told}); name a .png, .svg or .pdf file") from None
    return figure
