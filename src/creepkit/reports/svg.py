"""Figures of a page as SVG: text as text, thinned, with identifiers of their own, always the same bytes.

The ground of a figure is transparent; its colours are those of a figure on white. A narrow screen scrolls it.
"""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np
from markupsafe import Markup

from creepkit.arrays import Bools, Floats
from creepkit.errors import CreepkitError
from creepkit.reports.blocks import Paragraph, Picture, printable
from creepkit.reports.figures import save_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LEGIBLE = 9.0
"""Pixels of 1/96 inch: the smallest text to which a narrow screen shrinks a figure."""


MOST_MARKS, FEW_MARKS = 3000, 300
"""Marks of a figure above which its collections, but for those of few marks, become pictures of pixels: maps of
measured points."""


FEW_DOTS = 8
"""Dots up to which each is a mark of its own."""


_SETTINGS: dict[Any, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "creepkit",
    "path.simplify_threshold": 0.3,
    "svg.image_inline": True,
}
_FONTS = "system-ui, 'DejaVu Sans', Verdana, sans-serif"
_SVG, _XLINK = "{http://www.w3.org/2000/svg}", "{http://www.w3.org/1999/xlink}"


class PageFigures:
    """Turns figures into pictures of a page, and counts them."""

    def __init__(self, prefix: str = "f") -> None:
        self.count, self.prefix = 0, prefix

    def picture(
        self,
        draw: Callable[[], Figure | Mapping[str, Figure]],
        title: str,
        description: str,
        caption: str,
        *,
        shows_values: bool = False,
    ) -> Picture | Paragraph:
        """What `draw` draws with its alternative text (title and description) and a caption, which gets its number.

        It draws one figure, or panels as {what it shows: figure}. Their own headings are left out: the page says the
        same above them. A figure that cannot be drawn is a paragraph that says why.
        """
        try:
            drawn = draw()
        except CreepkitError as error:
            return Paragraph(f"{title}: no figure, for {error}", "note")
        self.count += 1
        panels, svgs = drawn if isinstance(drawn, Mapping) else {"": drawn}, []
        for k, (name, figure) in enumerate(panels.items()):
            figure.suptitle("")
            identifier = f"{self.prefix}{self.count}{chr(ord('a') + k) if name else ''}"
            svgs.append(svg_text(figure, identifier, f"{title}: {name}" if name else title, description))
        return Picture(Markup("".join(svgs)), f"Figure {self.count}. {caption}", shows_values)


def svg_text(figure: Figure, identifier: str, title: str, description: str) -> str:
    """A figure as an <svg> element, with its title and description for those who do not see it.

    identifier : letters and digits, of its own in the page: all identifiers and classes of the figure begin with it.
    """
    import matplotlib
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.text import Text

    for ground in (figure.patch, *(axes.patch for axes in figure.axes)):
        ground.set_visible(False)
    save_figure(figure, None)  # a dollar in a name is a dollar
    buffer = io.StringIO()
    with warnings.catch_warnings(), matplotlib.rc_context(_SETTINGS):
        warnings.filterwarnings("ignore", "Glyph", UserWarning)  # the browser has other fonts
        engine = figure.get_layout_engine()
        if engine is not None:
            engine.execute(figure)  # axes have their places and ranges from here on
            figure.set_layout_engine("none")
        artists: list[Any] = figure.findobj()
        texts = [one for one in artists if isinstance(one, Text) and one.get_text() and one.get_visible()]
        _thin(figure, artists)
        canvas: Any = FigureCanvasSVG(figure)
        canvas.print_svg(buffer, metadata={"Date": None})
    lines = (line if line.isprintable() else printable(line, len(line) + 1) for line in buffer.getvalue().split("\n"))
    root = ElementTree.fromstring("\n".join(lines))
    _compact(root, identifier)
    # pixels of 1/96 inch of points of 1/72 inch: as wide as it was drawn, and the least at which it can be read
    natural = 4.0 * float(str(root.get("viewBox")).split()[2]) / 3.0
    letters = 4.0 * min((float(text.get_fontsize()) for text in texts), default=10.0) / 3.0
    legible = natural * min(1.0, LEGIBLE / letters)
    root.attrib = {
        "viewBox": str(root.get("viewBox")),
        "role": "img",
        "aria-labelledby": f"{identifier}-t {identifier}-d",
        "font-family": _FONTS,
        "style": f"--legible-width:{legible:.0f}px;max-width:{natural:.0f}px",
    }
    for position, (tag, text) in enumerate((("title", title), ("desc", description))):
        element = ElementTree.Element(tag, {"id": f"{identifier}-{tag[0]}"})
        element.text = printable(text)
        root.insert(position, element)
    return ElementTree.tostring(root, encoding="unicode")


# ---- fewer bytes -----------------------------------------------------------------------------------------------------


def _thin(figure: Figure, artists: Sequence[Any]) -> None:
    """Bands and dots of a figure that has been laid out reduced to what a screen shows; matplotlib does it of lines.

    artists : all of the figure.
    """
    from matplotlib.collections import PathCollection, PolyCollection
    from matplotlib.lines import Line2D
    from matplotlib.path import Path

    every: list[list[Any]] = [
        [one for one in artists if isinstance(one, kind)] for kind in (Line2D, PolyCollection, PathCollection)
    ]
    lines, bands, maps = every
    with np.errstate(all="ignore"):
        for line in (one for one in lines if one.get_linestyle() in ("None", "none", " ", "")):
            points = np.column_stack([line.get_xdata(orig=False), line.get_ydata(orig=False)])
            shown = line.get_transform().transform(points) * (72.0 / float(figure.dpi))
            kept = points[kept_dots(shown, max(0.5 * float(line.get_markersize()), 1.0))]
            if line.get_marker() == "." and len(kept) > FEW_DOTS and line.axes is not None:
                line.axes.add_artist(_dots(line, kept))
                kept = kept[:0]
            line.set_data(*kept.T)
        for band in bands:
            shape = band.get_transform()
            paths = [shape.transform_path(Path(path.vertices)).cleaned(simplify=True) for path in band.get_paths()]
            band.set_verts([shape.inverted().transform(path.vertices[:-1]) for path in paths])
    counts = {one: np.size(one.get_offsets()) // 2 for one in maps}
    for one, count in counts.items():
        if sum(counts.values()) > MOST_MARKS and count > FEW_MARKS:
            one.set_rasterized(True)


def _dots(line: Any, points: Floats) -> Any:
    """One path with a round stroke of no length for each dot of a line, a quarter of the bytes of a mark each."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    path = Path(np.repeat(points, 2, axis=0), np.tile([Path.MOVETO, Path.LINETO], len(points)))
    path.should_simplify = False
    width = 0.5 * float(line.get_markersize()) + float(line.get_markeredgewidth())
    look = {"color": line.get_markerfacecolor(), "alpha": line.get_alpha(), "zorder": line.get_zorder()}
    return PathPatch(path, fill=False, lw=width, capstyle="round", transform=line.get_transform(), **look)


def kept_dots(points: Floats, size: float) -> Bools:
    """(points,) which dots to draw: the first in each square cell of side `size`. points : (points, 2) 1/72 inch."""
    keep = np.zeros(len(points), bool)
    shown = np.flatnonzero(np.isfinite(points).all(axis=1))
    _, first = np.unique(np.floor(points[shown] / size), axis=0, return_index=True)
    keep[shown[first]] = True
    return keep


def _compact(root: ElementTree.Element, identifier: str) -> None:
    """The same marks on the same places: a tenth of a point each, styles as classes, no groups that say nothing."""
    used = dict.fromkeys(re.findall(r'#([\w-]+)[")]', ElementTree.tostring(root, encoding="unicode")))
    names = {name: f"{identifier}-{k}" for k, name in enumerate(used)}
    styles: dict[str, str] = {}
    for element in root.iter():
        element.tag = element.tag.removeprefix(_SVG)
        element.text = element.text if element.tag in ("text", "tspan") else None
        element.tail = element.tail if element.tag == "tspan" else None
        attributes, element.attrib = element.attrib, {}
        for name, value in attributes.items():
            if name == "id" and value in names:
                element.set("id", names[value])
            elif name == "style":
                style = re.sub(r"font:\s*([a-z]+\s+|\d00\s+)*([\d.]+px)[^;]*", r"font-size:\2", value)
                style = re.sub(r"font-family:[^;]*;?", "", style)  # that of the figure
                style = re.sub(r"\s*([:;])\s*", r"\1", style).strip(";")
                element.set("class", styles.setdefault(style, f"{identifier}c{len(styles)}"))
            elif name in (f"{_XLINK}href", "clip-path"):
                href = re.sub(r"#([\w-]+)", lambda found: f"#{names[found[1]]}", value)
                element.set(name.removeprefix(_XLINK), href)
            elif name != "id" and not value.startswith("rotate(-0 "):
                value = re.sub(r"-?\d+\.\d+(e-?\d+)?", lambda found: f"{float(found[0]):.1f}".removesuffix(".0"), value)
                if name == "d":
                    value = re.sub(r"\s*([A-Za-z])\s+|\s*\n\s*", r"\1", value).strip()
                    value = re.sub(r"M([^A-Z]+)L\1(?![^MA-Z])", r"M\1h0", value)  # dots
                element.set(name, value)
    _without_groups(root)
    sheet = ElementTree.Element("style")
    sheet.text = "".join(f".{name}{{{style}}}" for style, name in styles.items())
    root.insert(0, sheet)


def _without_groups(parent: ElementTree.Element) -> None:
    """Groups without attributes replaced by what is in them, and no metadata."""
    inner: list[ElementTree.Element] = []
    for child in parent:
        if child.tag not in ("metadata", "style"):
            _without_groups(child)
            inner += [*child] if child.tag == "g" and not child.attrib else [child]
    parent[:] = inner
