"""Matplotlib figures that need no display, and the one way in which they are written to files."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from creepkit.errors import CreepkitError, FitError
from creepkit.files.writing import check_target, replace_on_success

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


def check_figure_target(path: Path, error_type: type[CreepkitError] = FitError) -> None:
    """Raise an error of `error_type` where a figure could not be written to `path`; for before the work it shows."""
    from matplotlib.backend_bases import FigureCanvasBase

    check_target(path, error_type)
    folder, problem = path.absolute().parent, ""
    if path.suffix.lower().lstrip(".") not in FigureCanvasBase.get_supported_filetypes():
        problem = f"'{path.suffix}' is no format of pictures"
    elif not folder.is_dir():
        problem = f"there is no folder {path.parent}"
    elif not os.access(folder, os.W_OK):
        problem = f"the folder {path.parent} is not open to writing"
    if problem:
        raise error_type(f"{path}: the plot cannot be written ({problem}); name a .png, .svg or .pdf file")


def save_figure(figure: Figure, path: str | Path | None, error_type: type[CreepkitError] = FitError) -> Figure:
    """The figure, written whole or not at all where a path is given; an error of `error_type` where it cannot be."""
    if path is not None:
        target = Path(path)
        check_figure_target(target, error_type)
        with replace_on_success(target, error_type) as temporary:
            figure.savefig(temporary, dpi=RESOLUTION, format=target.suffix.lower().lstrip("."))
    return figure
