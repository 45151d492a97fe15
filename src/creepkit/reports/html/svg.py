"""Figures as SVG within a page: thinned, with text as text, with identifiers of their own, always the same bytes.

The ground of a figure is transparent; its colours are those of a figure on white. A narrow screen scrolls it.
"""

from __future__ import annotations

import io
import warnings
from collections.abc import Callable
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

from creepkit.reports.figures import POWER_OF_TEN, save_figure
from creepkit.reports.html.compact_svg import compact
from creepkit.reports.html.elements import printable
from creepkit.reports.html.thinning import thin_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LONGEST_LABEL = 160
"""Characters of one line of text in a figure."""


LEGIBLE = 9.0
"""Pixels of 1/96 inch: the smallest text to which a narrow screen shrinks a figure."""


_SETTINGS: dict[Any, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "creepkit",
    "path.simplify": False,
    "svg.image_inline": True,
}
_FONTS = "system-ui, 'DejaVu Sans', Verdana, sans-serif"


def svg_text(figure: Figure, identifier: str, title: str, description: str) -> str:
    """A figure as an <svg> element, with its title and description for those who do not see it.

    identifier : letters and digits, of its own in the page: all identifiers of the figure begin with it.
    """
    import matplotlib
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    for axes in figure.axes:
        axes.patch.set_alpha(0.0)
    figure.patch.set_alpha(0.0)
    save_figure(figure, None)  # a dollar in a name is a dollar
    _shorten_texts(figure)
    buffer = io.StringIO()
    with warnings.catch_warnings(), matplotlib.rc_context(_SETTINGS):
        warnings.filterwarnings("ignore", "Glyph", UserWarning)  # the browser has other fonts
        engine = figure.get_layout_engine()
        if engine is not None:
            engine.execute(figure)  # axes have their places and ranges from here on
            figure.set_layout_engine("none")
        letters = _smallest_text(figure)
        thin_figure(figure)
        canvas: Any = FigureCanvasSVG(figure)
        canvas.print_svg(buffer, metadata={"Date": None})
    root = ElementTree.fromstring(buffer.getvalue())
    width = float(str(root.get("viewBox")).split()[2])
    compact(root, identifier)
    view_box = str(root.get("viewBox"))
    root.attrib.clear()
    root.attrib.update(
        {
            "viewBox": view_box,
            "role": "img",
            "aria-labelledby": f"{identifier}-t {identifier}-d",
            "font-family": _FONTS,
            "style": _widths(width, letters),
        }
    )
    for position, (tag, text) in enumerate((("title", title), ("desc", description))):
        element = ElementTree.Element(tag, {"id": f"{identifier}-{tag[0]}"})
        element.text = printable(text)
        root.insert(position, element)
    return ElementTree.tostring(root, encoding="unicode")


def _widths(points: float, letters: float) -> str:
    """The width that a figure was drawn for, and the least at which it can be read, pixels of 1/96 inch.

    points : its width, letters : its smallest text, both in points of 1/72 inch.
    """
    natural = 4.0 * points / 3.0
    legible = natural * min(1.0, LEGIBLE / (4.0 * letters / 3.0))
    return f"--legible-width:{legible:.0f}px;max-width:{natural:.0f}px"


def _smallest_text(figure: Figure) -> float:
    """Points of 1/72 inch."""
    from matplotlib.text import Text

    sizes = [float(text.get_fontsize()) for text in figure.findobj(Text) if text.get_text() and text.get_visible()]
    return min(sizes, default=10.0)


def _shorten_texts(figure: Figure) -> None:
    """Names in labels and legends on a line of bounded length, without characters that cannot be seen."""
    from matplotlib.text import Text
    from matplotlib.ticker import FixedFormatter, FuncFormatter

    for text in figure.findobj(Text):
        content: str = text.get_text()
        if content and not POWER_OF_TEN.fullmatch(content):
            lines = [printable(line, LONGEST_LABEL) for line in content.split("\n")]
            text.set_text("\n".join(lines))
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            formatter = axis.get_major_formatter()
            if isinstance(formatter, FuncFormatter):  # which stands for labels that are given
                formatter.func = _printable_labels(formatter.func)
            elif isinstance(formatter, FixedFormatter):
                formatter.seq = [printable(label, LONGEST_LABEL // 2) for label in formatter.seq]


def _printable_labels(label_of: Callable[..., str]) -> Callable[..., str]:
    """The same labels without characters that cannot be seen."""

    def label(*place: Any) -> str:
        text = label_of(*place)
        return text if POWER_OF_TEN.fullmatch(text) else printable(text, LONGEST_LABEL // 2)

    return label
