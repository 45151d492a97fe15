"""Meshes from files: three tables of nodes, elements and sets, or an input deck of Abaqus or CalculiX.

Four-node elements become eight-node ones by nodes in the middle of their straight sides.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from creepkit.checked_arguments import checked
from creepkit.errors import LONGEST_QUOTE, SolveError, nearest, quoted
from creepkit.fem.mesh import Mesh
from creepkit.fem.mesh_builder import ElementNodes, MeshBuilder
from creepkit.files.json_documents import read_json
from creepkit.files.reading import FileKind, read_text


@checked
def read_mesh(
    nodes: str | Path,
    elements: str | Path,
    sets: str | Path,
    *,
    held: Sequence[str] = ("encastre",),
    pressed: str = "pressure_face",
    top: str | None = "top",
) -> Mesh:
    """Read a mesh from CSV tables of nodes (id, r_mm, z_mm) and quadrilaterals (id, n1 to n4 or n8), and JSON sets.

    held : sets of nodes held in r and z; nodes on the axis are held in r without being named.
    pressed : beginning of the sets of elements whose side k is pressed, as in pressure_face_S1 to pressure_face_S4;
        side 1 joins nodes 1 and 2, side 4 nodes 4 and 1.
    top : set of nodes of the observed surface, None for none.
    """
    draft = MeshBuilder(Path(sets))
    for place, label, row in _rows(Path(nodes), ("r_mm", "z_mm")):
        r, z = (parse_number(place, name, cell) for name, cell in row.items())
        draft.add_node(label, r, z, place)
    for place, label, row in _rows(Path(elements), _CORNERS, _MIDDLES):
        draft.add_element(
            label, ElementNodes(tuple(parse_index(place, name, cell) for name, cell in row.items()), place)
        )
    groups = _Sets(Path(sets), draft)
    for name in held:
        draft.hold(groups.nodes(name), r=True, z=True)
    for side in range(1, 5):
        draft.pressed |= {(element, side) for element in groups.elements(f"{pressed}_S{side}")}
    draft.top |= set(groups.nodes(top)) if top is not None else set()
    return draft.mesh()


def read_input_deck(path: str | Path, *, pressed: str | None = None, top: str | None = "top") -> Mesh:
    """Read the mesh of an Abaqus or CalculiX deck of CAX4, CAX4R, CAX8 or CAX8R elements; its steps are not read.

    *NODE, *ELEMENT, *NSET, *ELSET, *SURFACE and *BOUNDARY make the mesh. The pressed sides are those of the *SURFACE
    called `pressed`, or else all that *DLOAD and *DSLOAD press. `top` is the node set of the observed surface.
    """
    return builder_from_deck(Path(path), pressed, top).mesh()


MESH_FILE = FileKind("a mesh", SolveError, "a mesh is read from text files in UTF-8", maximum_bytes=500_000_000)


_CORNERS = ("n1", "n2", "n3", "n4")


_MIDDLES = ("n5", "n6", "n7", "n8")


class _Sets:
    """Named lists of nodes and elements in a JSON file."""

    def __init__(self, path: Path, draft: MeshBuilder) -> None:
        self.path, self.draft = path, draft
        content = read_json(path, MESH_FILE)
        if not isinstance(content, dict):
            raise SolveError(f'{path}: holds no object; write sets by name, such as {{"top": [1, 6]}}')
        self.content: dict[str, Any] = content

    def nodes(self, name: str) -> list[int]:
        """A set of nodes that must be there."""
        if name not in self.content:
            raise SolveError(f"{self.path}: there is no set '{name}'; {nearest(name, self.content)}")
        return self._members(name, self.draft.nodes, "node")

    def elements(self, name: str) -> list[int]:
        """A set of elements, empty when it is not there."""
        return self._members(name, self.draft.elements, "element") if name in self.content else []

    def _members(self, name: str, known: Mapping[int, object], what: str) -> list[int]:
        members = self.content[name]
        if not isinstance(members, list) or not all(type(member) is int for member in members):
            raise SolveError(
                f"{self.path}: set '{name}' is not a list of {what} numbers; write one such as [1, 6, 147]"
            )
        for member in members:
            if member not in known:
                raise SolveError(f"{self.path}: set '{name}' names {what} {member}, which is not among the {what}s")
        return members


def _rows(path: Path, columns: Sequence[str], more: Sequence[str] = ()) -> Iterator[tuple[str, int, dict[str, str]]]:
    """Place, number and cells of each row; the columns `more` belong to it when all of them are there."""
    lines = _csv_rows(path)
    names = [name.strip() for name in next(lines, [])]
    for name in ("id", *columns):
        if name not in names:
            raise SolveError(f"{path}:1: missing column '{name}'; found: {quoted(', '.join(names), 200) or 'nothing'}")
    wanted = [*columns, *more] if set(more) <= set(names) else columns
    for line, cells in enumerate(lines, 2):
        place = f"{path}:{line}"
        if cells and len(cells) != len(names):
            raise SolveError(f"{place}: number of cells {len(cells)}, of columns {len(names)}; write one cell a column")
        if cells:
            row = dict(zip(names, cells, strict=True))
            yield place, parse_index(place, "id", row["id"]), {name: row[name] for name in wanted}


def _csv_rows(path: Path) -> Iterator[list[str]]:
    lines = csv.reader(read_text(path, MESH_FILE).splitlines())
    try:
        yield from lines
    except csv.Error as error:
        raise SolveError(f"{path}:{lines.line_num}: no line of a CSV table ({error}); look for stray quotes") from None


T = TypeVar("T")


ELEMENT_TYPES = {"CAX4": 4, "CAX4R": 4, "CAX8": 8, "CAX8R": 8}
"""Nodes of the element types that are read."""


MOST_LABELS, LARGEST_LABEL = 10_000_000, 10**15
"""Numbers in one range of a set, and the largest number of a node or an element."""


NAMED_SUPPORTS = {"ENCASTRE": (True, True), "PINNED": (True, True), "XSYMM": (True, False), "YSYMM": (False, True)}
"""Whether r and z are held by the supports that Abaqus knows by name."""


@dataclass
class KeywordCard:
    """One *KEYWORD with its options in capitals and its data lines as (place, cells)."""

    name: str
    options: dict[str, str]
    place: str
    rows: list[tuple[str, list[str]]] = field(default_factory=list)

    def option(self, name: str) -> str:
        """An option that must be there."""
        if not self.options.get(name):
            raise SolveError(f"{self.place}: *{self.name} has no {name}; write *{self.name}, {name}=...")
        return self.options[name]


@dataclass
class InputDeck:
    """A draft and the sets and surfaces of its deck, by name in capitals."""

    draft: MeshBuilder
    node_sets: dict[str, dict[int, None]] = field(default_factory=dict)
    element_sets: dict[str, dict[int, None]] = field(default_factory=dict)
    surfaces: dict[str, set[tuple[int, int]]] = field(default_factory=dict)

    def nodes(self, place: str, cell: str) -> list[int]:
        """The node of a number, or those of a set."""
        return _members(place, cell, self.node_sets, self.draft.nodes, "node")

    def elements(self, place: str, cell: str) -> list[int]:
        """The element of a number, or those of a set."""
        return _members(place, cell, self.element_sets, self.draft.elements, "element")


def builder_from_deck(path: Path, pressed: str | None, top: str | None) -> MeshBuilder:
    """The mesh of a deck as a draft."""
    cards = list(_cards(path))
    deck = InputDeck(MeshBuilder(path))
    for steps in (_MESH, _USES):
        for card in cards:
            if card.name in steps:
                steps[card.name](deck, card)
    if pressed is not None:
        deck.draft.pressed = set(_named(path, pressed, deck.surfaces, "surface"))
    if top is not None:
        deck.draft.top = set(_named(path, top, deck.node_sets, "node set"))
    return deck.draft


def _cards(path: Path) -> Iterator[KeywordCard]:
    """The cards of a deck; a keyword line that ends in a comma goes on in the next line."""
    card: KeywordCard | None = None
    head: list[str] = []
    for line, text in enumerate(read_text(path, MESH_FILE).splitlines(), 1):
        text, place = text.strip(), f"{path}:{line}"
        if not text or text.startswith("**"):
            continue
        if text.startswith("*") or head:
            head.append(text)
            if text.endswith(","):
                continue
            if card is not None:
                yield card
            card, head = _card(place, "".join(head)), []
        elif card is not None:
            card.rows.append((place, [cell.strip() for cell in text.split(",")]))
        else:
            raise SolveError(f"{place}: data before any keyword; an input deck begins with a line such as *NODE")
    if card is not None:
        yield card


def _card(place: str, head: str) -> KeywordCard:
    name, *words = (word.strip() for word in head[1:].split(","))
    pairs = (word.partition("=") for word in words)
    options = {key.strip().upper(): value.strip().strip('"').upper() for key, _, value in pairs}
    return KeywordCard(" ".join(name.upper().split()), options, place)


def _node(deck: InputDeck, card: KeywordCard) -> None:
    for place, cells in card.rows:
        label = parse_index(place, "node", cells[0])
        r, z = (parse_number(place, name, cell or "0") for name, cell in zip("rz", [*cells[1:], "", ""], strict=False))
        deck.draft.add_node(label, r, z, place)
        _collect(deck.node_sets, card.options.get("NSET"), [label])


def _element(deck: InputDeck, card: KeywordCard) -> None:
    kind = card.option("TYPE")
    if kind not in ELEMENT_TYPES:
        raise SolveError(
            f"{card.place}: element type {quoted(kind)} is not supported; allowed are {', '.join(ELEMENT_TYPES)}"
        )
    cells: list[str] = []
    for place, row in card.rows:
        cells += [cell for cell in row if cell]
        if len(cells) <= ELEMENT_TYPES[kind] and row[-1] == "":
            continue
        if len(cells) != ELEMENT_TYPES[kind] + 1:
            raise SolveError(
                f"{place}: an element {kind} has a number and {ELEMENT_TYPES[kind]} nodes, found {len(cells)} cells"
            )
        label, *nodes = (parse_index(place, "element or node", cell) for cell in cells)
        deck.draft.add_element(label, ElementNodes(tuple(nodes), place))
        _collect(deck.element_sets, card.options.get("ELSET"), [label])
        cells = []


def _set(deck: InputDeck, card: KeywordCard) -> None:
    sets, members = (deck.node_sets, deck.nodes) if card.name == "NSET" else (deck.element_sets, deck.elements)
    name = card.option(card.name)
    sets.setdefault(name, {})
    for place, cells in card.rows:
        if "GENERATE" in card.options:
            cells = _generated(place, cells)
        for cell in cells:
            _collect(sets, name, members(place, cell) if cell else [])


def _generated(place: str, cells: list[str]) -> list[str]:
    """The numbers that first, last and step stand for; step is 1 where it is not there."""
    written = [cell for cell in cells if cell]
    if not 2 <= len(written) <= 3:
        raise SolveError(f"{place}: GENERATE needs first, last and step, found {len(written)} cells; write 1, 9, 2")
    first, last, step = (parse_index(place, "range", cell) for cell in [*written, "1"][:3])
    labels = range(first, last + 1, step)
    if last - first >= MOST_LABELS * step:
        raise SolveError(f"{place}: the range has more than {MOST_LABELS} numbers, which no mesh has; correct it")
    return [str(label) for label in labels]


def _surface(deck: InputDeck, card: KeywordCard) -> None:
    sides = deck.surfaces.setdefault(card.option("NAME"), set())
    if card.options.get("TYPE", "ELEMENT") == "ELEMENT":
        for place, cells in card.rows:
            sides |= {(element, _face(place, cells, "S")) for element in deck.elements(place, cells[0])}


def _boundary(deck: InputDeck, card: KeywordCard) -> None:
    for place, cells in card.rows:
        what = cells[1].upper() if len(cells) > 1 else ""
        if what in NAMED_SUPPORTS:
            r, z = NAMED_SUPPORTS[what]
        else:
            first, last, motion = ([*cells[1:], "", "", ""])[:3]
            begin = parse_index(place, "first direction", first)
            directions = range(begin, parse_index(place, "last direction", last or first) + 1)
            if motion and parse_number(place, "motion", motion) != 0:
                raise SolveError(
                    f"{place}: a motion of {quoted(motion)} mm is prescribed; only nodes at rest are read, with 0"
                )
            r, z = 1 in directions, 2 in directions
        deck.draft.hold(deck.nodes(place, cells[0]), r, z)


def _distributed(deck: InputDeck, card: KeywordCard) -> None:
    for place, cells in card.rows:
        label = cells[1].upper() if len(cells) > 1 else ""
        if card.name == "DSLOAD" and label == "P":
            deck.draft.pressed |= set(_named(place, cells[0], deck.surfaces, "surface"))
        elif card.name == "DLOAD" and label[:1] == "P":
            side = _face(place, cells, "P")
            deck.draft.pressed |= {(element, side) for element in deck.elements(place, cells[0])}


def _include(deck: InputDeck, card: KeywordCard) -> None:
    raise SolveError(f"{card.place}: *INCLUDE is not followed; put the included lines into {deck.draft.path.name}")


_MESH: Mapping[str, Callable[[InputDeck, KeywordCard], None]] = {
    "INCLUDE": _include,
    "NODE": _node,
    "ELEMENT": _element,
    "NSET": _set,
    "ELSET": _set,
}


_USES: Mapping[str, Callable[[InputDeck, KeywordCard], None]] = {
    "SURFACE": _surface,
    "BOUNDARY": _boundary,
    "DLOAD": _distributed,
    "DSLOAD": _distributed,
}


def _collect(sets: dict[str, dict[int, None]], name: str | None, members: list[int]) -> None:
    if name:
        sets.setdefault(name, {}).update(dict.fromkeys(members))


def _members(
    place: str, cell: str, sets: Mapping[str, Mapping[int, None]], known: Mapping[int, object], what: str
) -> list[int]:
    """One number, or the members of a set; the name of an instance before a point is dropped."""
    if not (cell.isascii() and cell.isdigit()):
        return list(_named(place, cell, sets, f"{what} set"))
    label = parse_index(place, what, cell)
    if label not in known:
        raise SolveError(f"{place}: there is no {what} {label}; name one of the {len(known)} {what}s given before")
    return [label]


def _named(place: str | Path, name: str, known: Mapping[str, Iterable[T]], what: str) -> Iterable[T]:
    key = name.upper().rpartition(".")[2]
    if key not in known:
        raise SolveError(f"{place}: there is no {what} '{quoted(name)}'; {nearest(key[:LONGEST_QUOTE], known)}")
    return known[key]


def _face(place: str, cells: list[str], letter: str) -> int:
    label = cells[1].upper() if len(cells) > 1 else ""
    if label not in {f"{letter}{k}" for k in range(1, 5)}:
        raise SolveError(
            f"{place}: '{quoted(label)}' is no side of a quadrilateral; allowed are {letter}1 to {letter}4"
        )
    return int(label[1])


_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?", re.ASCII)


def parse_number(place: str, name: str, cell: str) -> float:
    """A finite number; 1.5d0 as Fortran writes it is one too."""
    text = cell.strip()
    value = float(text.lower().replace("d", "e")) if _NUMBER.fullmatch(text) else math.nan
    if not math.isfinite(value):
        raise SolveError(f"{place}: '{name}' is {_shown(text)}; write a finite number such as 2.5")
    return value


def parse_index(place: str, name: str, cell: str) -> int:
    """A number of a node, an element or the like, from 1 on."""
    text = cell.strip()
    if not (text.isascii() and text.isdigit() and len(text) < 20 and 0 < int(text) <= LARGEST_LABEL):
        raise SolveError(f"{place}: '{name}' is {_shown(text)}; write a whole number from 1 on")
    return int(text)


def _shown(text: str) -> str:
    return f"'{quoted(text)}'" if text else "empty"
