"""The SVG that matplotlib writes, said in fewer bytes: the same marks in the same order on the same places.

Identifiers that nothing refers to go, and what cannot be seen. Positions have a tenth of a point, those of a path count
from the point before. Ticks and grid lines of an axis become one path each, as do dots of one colour, round ends of
lines without length. Fonts are those of the page.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from xml.etree import ElementTree

Element = ElementTree.Element

_SVG, _XLINK = "{http://www.w3.org/2000/svg}", "{http://www.w3.org/1999/xlink}"
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e-?\d+)?")
_REFERENCE = re.compile(r"url\(#([^)]+)\)")
_CIRCLE = re.compile(r"M0 (-?[\d.]+)C")
_TICK = re.compile(r"M0 0L(-?[\d.]+) (-?[\d.]+)")
_AXIS = "axis"


def compact(root: Element, identifier: str) -> None:
    """Shorten the tree of a figure in place; its identifiers begin with `identifier`."""
    _clean(root)
    _unwrap(root)
    shapes = {f"#{e.get('id')}": e.get("d", "") for e in root.iter("path") if e.get("id")}
    for group in list(root.iter("g")):
        _join_dots(group, shapes)
        if group.attrib.pop("class", "") == _AXIS:
            _join_ticks(group, shapes)
            _join_equal(group)
    _unwrap(root)
    for parent in list(root.iter()):
        _join_neighbours(parent)
    for path in root.iter("path"):
        path.set("d", relative_path(path.get("d", "")))
    _drop_unused(root)
    _rename(root, identifier)


def _clean(root: Element) -> None:
    """Without namespaces, metadata, styles of every element, blanks, and what is invisible."""
    for parent in list(root.iter()):
        for child in list(parent):
            invisible = re.search(r"(^|[;\s])opacity:\s*0($|;)", child.get("style", "")) is not None
            if child.tag in (f"{_SVG}metadata", f"{_SVG}style") or invisible:
                parent.remove(child)
    for element in root.iter():
        element.tag = element.tag.removeprefix(_SVG)
        if element.tag not in ("text", "tspan"):
            element.text = None
        if element.tag != "tspan":
            element.tail = None
        href = element.attrib.pop(f"{_XLINK}href", None)
        if href is not None:
            element.set("href", href)
        if element.get("id", "").startswith("matplotlib.axis"):
            element.set("class", _AXIS)
        if element.tag in ("g", "text", "svg"):
            element.attrib.pop("id", None)
        for name in ("transform", "x", "y", "width", "height", "viewBox"):
            if name in element.attrib:
                element.set(name, _rounded(element.attrib[name]))
        if re.match(r"rotate\(-?0( |\))", element.get("transform", "")):
            del element.attrib["transform"]
        if "d" in element.attrib:
            blanks = re.sub(r"\s*([A-Za-z])\s*", r"\1", element.attrib["d"])
            element.set("d", re.sub(r"\s+", " ", _rounded(blanks)).strip())
        if "style" in element.attrib:
            element.set("style", _short_style(element.attrib["style"]))


def _short_style(style: str) -> str:
    style = re.sub(r"font:\s*(?:(?:bold|italic|oblique|\d00)\s+)*([\d.]+)px\s[^;]*", r"font-size: \1px", style)
    style = re.sub(r"font-family:[^;]*;?", "", style)
    style = re.sub(r"#([0-9a-f])\1([0-9a-f])\2([0-9a-f])\3\b", r"#\1\2\3", style)
    return re.sub(r"\s*([:;])\s*", r"\1", style).strip("; ")


def _rounded(text: str) -> str:
    return _NUMBER.sub(lambda match: _tenth(round(10 * float(match[0]))), text)


def _tenth(tenths: int) -> str:
    """A tenth of an integer in the fewest characters: 3, 2.5, -.4."""
    whole, rest = divmod(abs(tenths), 10)
    digits = f"{whole or ''}.{rest}" if rest else str(whole)
    return f"-{digits}" if tenths < 0 else digits


def _unwrap(root: Element) -> None:
    """Groups that say nothing are replaced by what is in them, and empty ones go."""
    changed = True
    while changed:
        changed = False
        for parent in list(root.iter()):
            for child in list(parent):
                if child.tag == "g" and not child.attrib:
                    position = list(parent).index(child)
                    parent.remove(child)
                    for offset, inner in enumerate(child):
                        parent.insert(position + offset, inner)
                    changed = True


# ---- joining ---------------------------------------------------------------------------------------------------------


def _join_dots(group: Element, shapes: dict[str, str]) -> None:
    """Neighbouring round dots of one colour as one path of lines without length, whose ends are round."""
    run: list[Element] = []
    for child in [*group, None]:
        if child is not None and child.tag == "use" and (not run or _kind(child) == _kind(run[0])):
            run.append(child)
            continue
        if len(run) > 2:
            _replace_by_path(group, run, shapes)
        run = [child] if child is not None and child.tag == "use" else []


def _kind(use: Element) -> tuple[str | None, str | None]:
    return use.get("href"), use.get("style")


def _replace_by_path(group: Element, dots: list[Element], shapes: dict[str, str]) -> None:
    circle = _CIRCLE.match(shapes.get(str(dots[0].get("href")), ""))
    style = dict(part.split(":", 1) for part in dots[0].get("style", "").split(";") if ":" in part)
    if circle is None or style.get("fill") is None or style["fill"] != style.get("stroke"):
        return
    width = 2 * abs(float(circle[1])) + float(style.get("stroke-width", "1"))
    opacity = f";stroke-opacity:{style['fill-opacity']}" if "fill-opacity" in style else ""
    path = Element(
        "path",
        {
            "d": "".join(f"M{dot.get('x')} {dot.get('y')}h0" for dot in dots),
            "style": f"fill:none;stroke:{style['fill']};stroke-width:{width:.3g};stroke-linecap:round{opacity}",
        },
    )
    group.insert(list(group).index(dots[0]), path)
    for dot in dots:
        group.remove(dot)


def _join_ticks(axis: Element, shapes: dict[str, str]) -> None:
    """Straight ticks as paths."""
    for use in list(axis):
        tick = _TICK.fullmatch(shapes.get(str(use.get("href")), "")) if use.tag == "use" else None
        if tick is not None:
            path = Element("path", {"d": f"M{use.get('x')} {use.get('y')}l{tick[1]} {tick[2]}"})
            path.set("style", f"fill:none;{use.get('style', '')}")
            axis.insert(list(axis).index(use), path)
            axis.remove(use)


def _join_equal(axis: Element) -> None:
    """Lines of one style of an axis, such as its ticks or its grid, as one path where the first of them stands."""
    first: dict[tuple[str | None, str | None], Element] = {}
    for path in list(axis):
        if path.tag != "path" or "fill:none" not in path.get("style", "") or path.get("id"):
            continue
        key = path.get("style"), path.get("clip-path")
        if key in first:
            first[key].set("d", first[key].get("d", "") + path.get("d", ""))
            axis.remove(path)
        else:
            first[key] = path


def _join_neighbours(parent: Element) -> None:
    """Neighbouring opaque lines of one style as one path, such as the four sides of a panel."""
    before: Element | None = None
    for child in list(parent):
        joined = (
            before is not None
            and child.tag == before.tag == "path"
            and child.attrib.keys() == before.attrib.keys() == {"d", "style"}
            and child.get("style") == before.get("style")
            and "fill:none" in child.get("style", "")
            and "opacity" not in child.get("style", "")
        )
        if joined and before is not None:
            before.set("d", before.get("d", "") + child.get("d", ""))
            parent.remove(child)
        else:
            before = child


def relative_path(path: str) -> str:
    """A path of absolute M, L, z and of h, l in tenths, each position from the one before; other paths as they are."""
    tokens = re.findall(r"[A-Za-z]|-?\d*\.?\d+", path)
    if set(re.findall("[A-Za-z]", path)) - set("MLzhl"):
        return path
    parts: list[str] = []
    x = y = start_x = start_y = 0
    command, position, last = "", 0, ""
    while position < len(tokens):
        if tokens[position].isalpha():
            command = tokens[position]
            position += 1
        if command == "z":
            parts.append("z")
            x, y, last = start_x, start_y, "z"
            continue
        if command == "h":
            parts.append(f"h{tokens[position]}")
            x, position, last = x + _tenths(tokens[position]), position + 1, "h"
            continue
        dx, dy = _tenths(tokens[position]), _tenths(tokens[position + 1])
        position += 2
        if command in "ML":
            dx, dy = dx - x, dy - y
        letter = "m" if command == "M" else "l"
        x, y = x + dx, y + dy
        if letter == "m":
            start_x, start_y = x, y
        pair = f"{_tenth(dx)}{'' if dy < 0 else ' '}{_tenth(dy)}"
        repeated = letter == last == "l" or (letter == "l" and last == "m")
        parts.append(f"{'' if dx < 0 else ' '}{pair}" if repeated else f"{letter}{pair}")
        last = letter
        command = "L" if command == "M" else command
    return "".join(parts)  # the first m counts from the origin


def _tenths(text: str) -> int:
    return round(10 * float(text))


# ---- identifiers -----------------------------------------------------------------------------------------------------


def _references(element: Element) -> Iterator[str]:
    for name, value in element.attrib.items():
        if name == "href" and value.startswith("#"):
            yield value[1:]
        yield from _REFERENCE.findall(value)


def _drop_unused(root: Element) -> None:
    """Definitions that nothing refers to, and groups without anything in them."""
    used = {name for element in root.iter() for name in _references(element)}
    for parent in list(root.iter("defs")):
        for child in list(parent):
            if child.get("id") not in used:
                parent.remove(child)
    empty = True
    while empty:
        empty = False
        for parent in list(root.iter()):
            for child in list(parent):
                if child.tag in ("g", "defs") and not len(child):
                    parent.remove(child)
                    empty = True


def _rename(root: Element, identifier: str) -> None:
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
