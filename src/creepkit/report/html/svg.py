"""Figures as SVG within a page: thinned, with text as text, with identifiers of their own, always the same bytes.

What matplotlib writes is made shorter: identifiers that nothing refers to go, numbers have a hundredth of a point, round
dots of one colour become one path with round ends. The colours are those of the figure on a transparent ground.
"""

from __future__ import annotations

import io
import re
from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING
from xml.etree import ElementTree

from creepkit.report.figures import POWER_OF_TEN, save_figure
from creepkit.report.html.elements import printable
from creepkit.report.html.thinning import thin_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LONGEST_LABEL = 160
"""Characters of one line of text in a figure."""


_SVG, _XLINK = "{http://www.w3.org/2000/svg}", "{http://www.w3.org/1999/xlink}"
_SETTINGS = {"svg.fonttype": "none", "svg.hashsalt": "creepkit", "path.simplify": False, "svg.image_inline": True}
_FONTS = "system-ui, 'DejaVu Sans', Verdana, sans-serif"
_NUMBER = re.compile(r"-?\d+\.\d+(?:e-?\d+)?|-?\d+e-\d+")
_REFERENCE = re.compile(r"url\(#([^)]+)\)")
_CIRCLE = re.compile(r"M 0 (-?[\d.]+)\s*C ")
_GEOMETRY = ("d", "transform", "x", "y", "width", "height", "points")


def svg_text(figure: Figure, identifier: str, title: str, description: str) -> str:
    """A figure as an <svg> element, with its title and description for those who do not see it.

    identifier : letters and digits, of its own in the page: all identifiers of the figure begin with it.
    """
    import matplotlib

    for axes in figure.axes:
        axes.patch.set_alpha(0.0)
    figure.patch.set_alpha(0.0)
    save_figure(figure, None)  # a dollar in a name is a dollar
    _shorten_texts(figure)
    figure.draw_without_rendering()  # axes have their places and ranges from here on
    thin_figure(figure)
    buffer = io.StringIO()
    with matplotlib.rc_context(_SETTINGS):
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    root = ElementTree.fromstring(buffer.getvalue())
    width = float(str(root.get("viewBox")).split()[2])
    _strip(root)
    _rename(root, identifier)
    _join_dots(root)
    _hoist_styles(root)
    view_box = str(root.get("viewBox"))
    root.attrib.clear()
    root.attrib.update(
        {
            "viewBox": _rounded(view_box),
            "role": "img",
            "aria-labelledby": f"{identifier}-t {identifier}-d",
            "font-family": _FONTS,
            "style": f"max-width:{4 * width / 3:.0f}px",
        }
    )
    for position, (tag, text) in enumerate((("title", title), ("desc", description))):
        element = ElementTree.Element(tag, {"id": f"{identifier}-{tag[0]}"})
        element.text = printable(text)
        root.insert(position, element)
    return ElementTree.tostring(root, encoding="unicode")


def _shorten_texts(figure: Figure) -> None:
    """Names in labels and legends on a line of bounded length, without characters that cannot be seen."""
    from matplotlib.text import Text
    from matplotlib.ticker import FixedFormatter

    for text in figure.findobj(Text):
        content: str = text.get_text()  # type: ignore[attr-defined]
        if content and not POWER_OF_TEN.fullmatch(content):
            lines = [printable(line, LONGEST_LABEL) for line in content.split("\n")]
            text.set_text("\n".join(lines))  # type: ignore[attr-defined]
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            formatter = axis.get_major_formatter()
            if isinstance(formatter, FixedFormatter):
                formatter.seq = [printable(label, LONGEST_LABEL // 2) for label in formatter.seq]


def _strip(root: ElementTree.Element) -> None:
    """Without namespaces, metadata, styles of every element, and positions of more than a hundredth of a point."""
    for parent in list(root.iter()):
        for child in list(parent):
            if child.tag in (f"{_SVG}metadata", f"{_SVG}style"):
                parent.remove(child)
    for element in root.iter():
        element.tag = element.tag.removeprefix(_SVG)
        if element.tag != "text" and element.tag != "tspan":
            element.text = None
        if element.tag != "tspan":
            element.tail = None
        href = element.attrib.pop(f"{_XLINK}href", None)
        if href is not None:
            element.set("href", href)
        for name in _GEOMETRY:
            if name in element.attrib:
                element.set(name, _compact(element.attrib[name]) if name == "d" else _rounded(element.attrib[name]))
        if "style" in element.attrib:
            element.set("style", _short_style(element.attrib["style"]))
    for defs in list(root.iter("defs")):
        if not len(defs):
            next(parent for parent in root.iter() if defs in list(parent)).remove(defs)


def _short_style(style: str) -> str:
    style = re.sub(r"font: (?:(bold|italic|\d00) )?([\d.]+)px [^;]*", r"font-size: \2px", style)
    return re.sub(r"\s*([:;])\s*", r"\1", style).strip("; ")


def _rounded(text: str) -> str:
    return _NUMBER.sub(lambda match: f"{float(match[0]):.2f}".rstrip("0").rstrip(".").replace("-0", "-0"), text)


def _compact(path: str) -> str:
    """Path data without blanks that say nothing."""
    return re.sub(r"\s*([A-Za-z])\s*", r"\1", _rounded(path)).replace("\n", " ").strip()


def _references(element: ElementTree.Element) -> Iterator[str]:
    for name, value in element.attrib.items():
        if name == "href" and value.startswith("#"):
            yield value[1:]
        yield from _REFERENCE.findall(value)


def _rename(root: ElementTree.Element, identifier: str) -> None:
    """Identifiers that are referred to, by number; no others."""
    used = {name for element in root.iter() for name in _references(element)}
    known = [element.get("id", "") for element in root.iter() if element.get("id") in used]
    names = {old: f"{identifier}-{number}" for number, old in enumerate(dict.fromkeys(known))}
    for element in root.iter():
        if "id" in element.attrib:
            old = element.attrib.pop("id")
            if old in names:
                element.set("id", names[old])
        for attribute, value in list(element.attrib.items()):
            if attribute == "href" and value.startswith("#"):
                element.set(attribute, f"#{names[value[1:]]}")
            elif "url(#" in value:
                element.set(attribute, _REFERENCE.sub(lambda match: f"url(#{names[match[1]]})", value))


def _join_dots(root: ElementTree.Element) -> None:
    """Round dots of one colour as one path of points with round ends, a third of the length of an element each."""
    shapes = {str(e.get("id")): e for e in root.iter("path") if e.get("id") is not None}
    for group in list(root.iter("g")):
        dots = list(group)
        if len(dots) < 3 or any(dot.tag != "use" for dot in dots):
            continue
        alike = {(dot.get("href"), dot.get("style")) for dot in dots}
        href, style = next(iter(alike))
        circle = _CIRCLE.match(_spaced(shapes[str(href)[1:]].get("d", ""))) if href else None
        colours = dict(part.split(":", 1) for part in str(style).split(";") if ":" in part)
        if len(alike) != 1 or circle is None or colours.get("fill") != colours.get("stroke"):
            continue
        width = 2 * abs(float(circle[1])) + float(colours.get("stroke-width", "1"))
        opacity = f";stroke-opacity:{colours['fill-opacity']}" if "fill-opacity" in colours else ""
        path = ElementTree.Element(
            "path",
            {
                "d": "".join(f"M{dot.get('x')} {dot.get('y')}h0" for dot in dots),
                "style": f"fill:none;stroke:{colours['fill']};stroke-width:{width:.3g};stroke-linecap:round{opacity}",
            },
        )
        for dot in dots:
            group.remove(dot)
        group.append(path)
    _drop_unused(root)


def _spaced(path: str) -> str:
    return re.sub(r"([A-Za-z])", r" \1 ", path).strip()


def _drop_unused(root: ElementTree.Element) -> None:
    used = {name for element in root.iter() for name in _references(element)}
    for parent in list(root.iter()):
        for child in list(parent):
            empty = child.tag in ("g", "defs") and not len(child) and "id" not in child.attrib
            if empty or (parent.tag == "defs" and child.get("id") not in used):
                parent.remove(child)
    for parent in list(root.iter()):
        for child in list(parent):
            if child.tag in ("g", "defs") and not len(child):
                parent.remove(child)


def _hoist_styles(root: ElementTree.Element) -> None:
    """A style that all elements of a group share stands at the group."""
    for group in root.iter("g"):
        styles = Counter(child.get("style") for child in group)
        if len(group) > 2 and len(styles) == 1 and None not in styles and "style" not in group.attrib:
            group.set("style", str(group[0].get("style")))
            for child in group:
                del child.attrib["style"]
