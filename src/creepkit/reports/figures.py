"""Figures that need no display, the panels and axes that all of them share, and how they are written to files."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, TypeAlias

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import SAID, ReportError, restated
from creepkit.files.writing import replace_on_success

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


RESOLUTION = 130
"""Dots per inch of figures that are written as pixels."""


LARGEST_PIXELS = 4000
"""Of the longer side of a figure that is written; the resolution of a larger one is lowered to it."""


def empty_figure(width: float, height: float) -> Figure:
    """A figure without panels, of a width and height in inches; it needs no display."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def plotted(record: object, figure: Any, panel: Any, path: Any, axes: Any) -> Figure:
    """The figure of a record by the first of two functions, or by the second its leading panel within axes."""
    from matplotlib.axes import Axes

    for name, given, kinds in (("path", path, (str, Path)), ("ax", axes, (Axes,))):
        if given is not None and not isinstance(given, kinds):
            kind = type(given).__name__
            raise ReportError(
                f"{name} of plot() is {kind}; write plot('fit.png'), or plot(ax=ax) with matplotlib's axes"
            )
    if axes is None:
        return save_figure(figure(record), path)
    panel(axes, record)
    return save_figure(axes.get_figure(root=True), path, axes)


def panels_of(width: float, height: float, *shape: int, **options: Any) -> tuple[Figure, Any]:
    """The same with panels: one, or rows and columns of them, as matplotlib's subplots() has them."""
    figure = empty_figure(width, height)
    return figure, figure.subplots(*shape, **options)


def panel_grid(
    count: int, most_columns: int, width: float, height: float, *, part: Any = None, **options: Any
) -> tuple[Figure, list[Axes]]:
    """A figure, or a part of one, with panels of a width and height in inches, and these; no empty frames.

    most_columns : side by side. options : as matplotlib's subplots() has them.
    """
    columns = max(1, min(most_columns, count))
    rows = max(1, -(-count // columns))
    figure = empty_figure(width * columns, height * rows) if part is None else part
    panels = list(figure.subplots(rows, columns, squeeze=False, **options).flat)
    for axes in panels[count:]:
        axes.set_visible(False)
    return figure, panels[:count]


def make_folder(folder: Path) -> None:
    """Make a folder for figures where there is none; ReportError where it cannot be made."""
    with restated(OSError, ReportError, f"{folder}: no plots can be written there ({SAID}); name another folder"):
        folder.mkdir(parents=True, exist_ok=True)


def check_picture_format(path: Path) -> None:
    """ReportError for a name that is not that of a picture."""
    from matplotlib.backend_bases import FigureCanvasBase

    if path.suffix.lower().lstrip(".") not in FigureCanvasBase.get_supported_filetypes():
        raise ReportError(f"{path}: '{path.suffix}' is no format of pictures; name a .png, .svg or .pdf file")


def save_figure(figure: Figure, path: str | Path | None, drawn: Axes | None = None) -> Figure:
    """The figure, written whole or not at all where a path is given; ReportError where it cannot be.

    A dollar in the name of a test or of a law is a dollar: only powers of ten on axes are formulas. drawn : the axes
    of which this holds; by default all.
    """
    from matplotlib.text import Text

    for text in (drawn or figure).findobj(Text):
        if "$" in text.get_text() and not POWER_OF_TEN.fullmatch(text.get_text()):
            text.set_parse_math(False)
    if path is not None:
        target = Path(path)
        check_picture_format(target)
        resolution = min(RESOLUTION, LARGEST_PIXELS / max(figure.get_size_inches()))
        with replace_on_success(target, ReportError) as temporary:
            figure.savefig(temporary, dpi=resolution, format=target.suffix.lower().lstrip("."))
    return figure


POWER_OF_TEN = re.compile(r"\$(\\mathdefault\{[^$]*\}|([\d.]+\\times)?10\^\{-?\d+\})\$")
"""Labels of logarithmic axes."""


MOST_LABELS = 8
"""Labels along an axis at most."""


MANTISSAS = (
    (1.0, 1.2, 1.4, 1.6, 1.8, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 6.0, 7.0, 8.0, 9.0),
    (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0),
    (1.0, 2.0, 5.0),
    (1.0, 3.0),
    (1.0,),
)
"""Labels within a decade of a logarithmic axis, the finest first."""


PLAIN_NUMBERS = (1e-3, 1e5)
"""Between these, labels of a logarithmic axis are written out; others are powers of ten."""


PLAIN_DECADES = (1e-3, 1e3)
"""The same of an axis with a label a decade: its numbers are powers of ten anyhow, and shorter as such."""


OVERHANG = 0.03
"""Of an axis: by so much data may lie beyond the last label."""


def set_range(
    axes: Axes, which: Literal["x", "y"], low: float, high: float, *, logarithmic: bool = False, most: int = MOST_LABELS
) -> None:
    """Extend the range of an axis beyond low and high to round numbers, so that it has a label at either end.

    most : labels at most. The range of a logarithmic axis is above zero. The panel gets a faint grid.
    """
    axes.grid(alpha=0.25)
    axis = axes.xaxis if which == "x" else axes.yaxis
    if logarithmic:
        overhang = (high / low) ** OVERHANG
        labels = logarithmic_labels(low * overhang, high / overhang, most)
        (axes.set_xscale if which == "x" else axes.set_yscale)("log")
        _format_logarithmic(axis, labels)
    else:
        from matplotlib.ticker import MaxNLocator

        overhang = OVERHANG * (high - low)
        locator = MaxNLocator(most - 1, steps=[1, 2, 2.5, 5, 10])
        labels = np.asarray(locator.tick_values(low + overhang * (low != 0.0), high - overhang))
    axis.set_ticks(list(labels))
    ends = min(float(labels[0]), low), max(float(labels[-1]), high)
    (axes.set_xlim if which == "x" else axes.set_ylim)(*ends)


def span(
    axes: Axes,
    which: str,
    *values: Any,
    logarithmic: bool = False,
    margin: float = 1.0,
    zero: bool = False,
    most: int = 6,
) -> None:
    """Ranges of axes that show all of these values that can be drawn, arrays of any shape; which : "x", "y" or "xy".

    margin : factor by which the range goes beyond them to either side. zero : whether it begins at zero or below.
    """
    known = np.concatenate([np.zeros(int(zero)), *(np.ravel(np.asarray(one, float)) for one in values)])
    known = known[np.isfinite(known) & ((known > 0) | (not logarithmic))]
    if known.size:
        low, high = float(known.min()), float(known.max())
        for axis in which:
            set_range(axes, axis, low / margin, high * margin, logarithmic=logarithmic, most=most)  # type: ignore[arg-type]


MOST_NAMED = 12
"""Curves that a panel names."""


class Course(NamedTuple):
    """What is drawn over time. times, values : (points,). hollow : (points,) which are not used, None where all are."""

    name: str
    times: Any
    values: Any
    hollow: Any = None


Panels: TypeAlias = Mapping[str, Sequence[Course]]
"""{label of an axis: what is drawn over time in its panel}."""


def over_time(panels: Panels, time: str = "time, h") -> Figure:
    """A panel for each label, one below the other; time : label of their common axis."""
    figure, every = panel_grid(len(panels), 1, 7.0, 2.6, sharex=True)
    for axes, label in zip(every, panels, strict=True):
        draw_over_time(axes, {label: panels[label]}, "")
    every[-1].set_xlabel(time)
    return figure


def draw_over_time(axes: Axes, panels: Panels, time: str = "time, h") -> None:
    """The first of the panels, in axes."""
    label, courses = next(iter(panels.items()))
    for k, one in enumerate(courses):
        style: Any = {"lw": 1.0, "marker": "." if one.hollow is not None else "", "ms": 3}
        (line,) = axes.plot(one.times, one.values, label=one.name if k < MOST_NAMED else None, **style)
        if one.hollow is not None:
            axes.plot(one.times[one.hollow], one.values[one.hollow], "o", mfc="none", color=line.get_color())
    axes.set(xlabel=time, ylabel=label)
    axes.grid(alpha=0.25)
    if len(courses) > 1:
        place_legend(axes)


def draw_parity(axes: Axes, *values: Any, logarithmic: bool = False, margin: float = 1.0, factor: float = 0.0) -> None:
    """Equal axes over measured and predicted values, and the line on which they agree; factor : a band about it."""
    span(axes, "xy", *values, logarithmic=logarithmic, margin=margin)
    ends = np.array(axes.get_xlim())
    axes.set_ylim(*ends)
    axes.plot(ends, ends, "k-", lw=1.0, alpha=0.7)
    if factor:
        axes.fill_between(
            ends, ends / factor, ends * factor, color="black", alpha=0.08, lw=0, label=f"factor of {factor:g}"
        )
    axes.set_xlim(*ends)


def logarithmic_labels(low: float, high: float, most: int = MOST_LABELS) -> Floats:
    """(labels,) at most `most` round numbers from one at or below low to one at or above high, both above zero."""
    first, last = int(np.floor(np.log10(low) + 1e-9)), int(np.ceil(np.log10(high) - 1e-9))
    for mantissas in MANTISSAS:
        candidates = np.array([m * 10.0**d for d in range(first, last + 1) for m in mantissas])
        below, above = candidates <= low * (1 + 1e-9), candidates >= high * (1 - 1e-9)
        labels = candidates[np.flatnonzero(below)[-1] : np.flatnonzero(above)[0] + 1]
        if 2 <= labels.size <= most:
            return np.asarray(labels)
    stride = max(1, int(np.ceil((last - first) / (most - 1))))
    return np.asarray(10.0 ** np.arange(first, max(last, first + 1) + stride, stride, dtype=float))


def _format_logarithmic(axis: Any, labels: Floats) -> None:
    """Numbers written out where they are of a usual size, powers of ten elsewhere; other ticks have no label."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter, NullLocator

    decades = bool(np.allclose(labels[1:] / labels[:-1], 10.0))
    smallest, largest = PLAIN_DECADES if decades else PLAIN_NUMBERS
    plain = labels[0] >= smallest * (1 - 1e-9) and labels[-1] <= largest * (1 + 1e-9)
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}" if plain else power_of_ten(value)))
    axis.set_minor_locator(LogLocator(subs=tuple(range(2, 10)), numticks=20) if decades else NullLocator())
    axis.set_minor_formatter(NullFormatter())


def power_of_ten(value: float) -> str:
    """A number above zero as mantissa and power of ten."""
    exponent = int(np.floor(np.log10(value) + 1e-9))
    mantissa = value / 10.0**exponent
    return f"$10^{{{exponent}}}$" if abs(mantissa - 1.0) < 1e-6 else f"${mantissa:g}\\times10^{{{exponent}}}$"


BELOW_LABELS, LEGEND_WIDTH = 34.0, 56
"""Points below a panel where the labels of its axis end, and characters of a line of the legend below these."""


def place_legend(axes: Axes, title: str | None = None, size: float = 8.0, *, below: bool = False) -> None:
    """The legend of a panel to its right, or below the labels of a narrow one, where it covers no data."""
    from matplotlib.transforms import ScaledTranslation

    labels = axes.get_legend_handles_labels()[1]
    place: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (1.0, 1.0)}
    if below and labels:
        columns = max(1, min(len(labels), LEGEND_WIDTH // (max(map(len, labels)) + 6)))
        moved = axes.transAxes + ScaledTranslation(0.0, -BELOW_LABELS / 72.0, axes.figure.dpi_scale_trans)
        place = {"loc": "upper center", "bbox_to_anchor": (0.5, 0.0), "bbox_transform": moved, "ncols": columns}
    if labels:
        axes.legend(fontsize=size, title=title, title_fontsize=size, frameon=not below, **place)


def wrapped(text: str, figure_width: float, size: float = 10.0) -> str:
    """Lines of a text that fit a width in inches at a font size in points."""
    characters = max(30, int(figure_width * 72.0 / (0.55 * size)))
    return "\n".join(line for paragraph in text.splitlines() for line in wrap(paragraph, characters))


def shortened(name: str, most: int = 32) -> str:
    """A name of a test on an axis; of a longer one the beginning and the end, which tells it from its neighbours."""
    end = 2 * most // 3
    return name if len(name) <= most else f"{name[: most - end - 1]}…{name[-end:]}"
