"""Matplotlib figures that need no display, and their files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from creepkit.errors import CreepkitError, FitError

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def empty_figure(width: float, height: float) -> Figure:
    """A figure without panels, inches; it needs no display."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def save_figure(figure: Figure, path: str | Path | None, error_type: type[CreepkitError] = FitError) -> Figure:
    """The figure, written to `path` where one is given; `error` where it cannot be."""
    if path is not None:
        try:
            figure.savefig(path, dpi=130)
        except (OSError, ValueError) as found:
            message = str(found).splitlines()[0]
            raise error_type(
                f"{path}: the plot cannot be written ({message}); name a .png, .svg or .pdf file"
            ) from None
    return figure
