"""Meshes from files: three tables of nodes, elements and sets, or an input deck of Abaqus or CalculiX.

Four-node elements become eight-node ones by nodes in the middle of their straight sides.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from creepkit.checked_arguments import checked
from creepkit.errors import SolveError, nearest, quoted
from creepkit.fem.input_deck import MESH_FILE, builder_from_deck, parse_index, parse_number
from creepkit.fem.mesh import Mesh
from creepkit.fem.mesh_builder import ElementNodes, MeshBuilder
from creepkit.files.json_documents import read_json
from creepkit.files.reading import read_text


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


@checked
def read_input_deck(path: str | Path, *, pressed: str | None = None, top: str | None = "top") -> Mesh:
    """Read the mesh of an Abaqus or CalculiX deck of CAX4, CAX4R, CAX8 or CAX8R elements; its steps are not read.

    *NODE, *ELEMENT, *NSET, *ELSET, *SURFACE and *BOUNDARY make the mesh. The pressed sides are those of the *SURFACE
    called `pressed`, or else all that *DLOAD and *DSLOAD press. `top` is the node set of the observed surface.
    """
    return builder_from_deck(Path(path), pressed, top).mesh()


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
