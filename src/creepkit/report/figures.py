"""Matplotlib figures that need no display, and the one way in which they are written to files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from creepkit.errors import CreepkitError, FitError

if TYPE_CHECKING:
    from matplotlib.figure import Figure


RESOLUTION = 130
"""Dots per inch of figures that are written as pixels."""


def empty_figure(width: float, height: float) -> Figure:
    """A figure without panels, of a width and height in inches; it needs no display."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def make_folder(folder: Path, error_type: type[CreepkitError] = FitError) -> None:
    """Make a folder for figures where there is none; an error of `error_type` where it cannot be made."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise error_type(f"{folder}: no plots can be written there ({error.strerror}); name another folder") from None


def save_figure(figure: Figure, path: str | Path | None, error_type: type[CreepkitError] = FitError) -> Figure:
    """The figure, written to `path` where one is given; an error of `error_type` where it cannot be."""
    if path is not None:
        try:
            figure.savefig(path, dpi=RESOLUTION)
        except (OSError, ValueError) as error:
            message = str(error).splitlines()[0]
            raise error_type(
                f"{path}: the plot cannot be written ({message}); name a .png, .svg or .pdf file"
            ) from None
    return figure
