"""Meshes from files: tables of nodes and of quadrilaterals, and named sets of both.

Four-node elements become eight-node ones by nodes in the middle of their straight sides, and are turned anticlockwise.
What a mesh cannot be, such as one that is inverted, is refused where it is made (see fem.mesh) or prepared.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.checked_arguments import checked
from creepkit.errors import SolveError, nearest, quoted
from creepkit.fem.mesh import SIDES, Mesh, outline, renumbered
from creepkit.files.json_documents import read_json
from creepkit.files.reading import FileKind, read_text

MESH_FILE = FileKind("a mesh", SolveError, "a mesh is read from text files in UTF-8", maximum_bytes=500_000_000)


_ON_AXIS = 1e-9
"""Nodes nearer to the axis, mm, are on it: programs write such numbers for zero."""


_CORNERS, _MIDDLES = ("n1", "n2", "n3", "n4"), ("n5", "n6", "n7", "n8")


_OTHER_SENSE = (0, 3, 2, 1, 7, 6, 5, 4)
"""Nodes of an element whose sense is turned; its side k, from 0 on, becomes side 3 - k."""


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
    places, quads = _rows(Path(nodes), ("r_mm", "z_mm")), _rows(Path(elements), _CORNERS, _MIDDLES)
    node_of, element_of = ({label: k for k, label in enumerate(labels)} for labels in (places, quads))
    for element, corners in quads.items():
        if unknown := [int(node) for node in corners if node not in node_of]:
            raise SolveError(f"{elements}: element {element} names node {unknown[0]}, which is not among the nodes")
    groups = _Sets(Path(sets))
    at = np.array(list(places.values())).reshape(-1, 2)
    at[np.abs(at[:, 0]) < _ON_AXIS, 0] = 0.0
    body = np.array([[node_of[int(node)] for node in corners] for corners in quads.values()], dtype=np.int64)
    r, z = np.moveaxis(at[body[:, :4]], 2, 0)
    turned = (r * np.roll(z, -1, axis=1) - np.roll(r, -1, axis=1) * z).sum(axis=1) < 0.0
    body[turned] = body[turned][:, _OTHER_SENSE[: body.shape[1]]]
    body, at = _with_middles(body, at)
    fixed = np.zeros(at.shape, dtype=bool)
    for name in held:
        fixed[groups.members(name, node_of, "node")] = True
    edges = outline(body)
    made = edges[edges[:, 1] >= len(places)]
    fixed[made[:, 1]] = fixed[made[:, 0]] & fixed[made[:, 2]]
    names = [(f"{pressed}_S{side + 1}", side) for side in range(4)]
    faces = sorted((k, side) for name, side in names for k in groups.members(name, element_of, "element", ()))
    loaded = [body[k, SIDES[3 - side if turned[k] else side]] for k, side in faces]
    if not loaded or not fixed[:, 1].any():
        missing = "node whose z is held" if loaded else "pressed side"
        raise SolveError(f"{sets}: the mesh has no {missing}; say by a set which are")
    surface = _line_of(edges, at, [] if top is None else groups.members(top, node_of, "node"), Path(sets))
    kept, where = np.unique(body, return_inverse=True)
    new = np.full(len(at), -1)
    new[kept] = np.arange(kept.size)
    return renumbered(Mesh(at[kept], where.reshape(body.shape), fixed[kept], new[np.array(loaded)], new[surface]))


def _with_middles(body: Ints, at: Floats) -> tuple[Ints, Floats]:
    """Elements of eight nodes, and the places of all nodes, those of new middles last."""
    if body.shape[1] == 8:
        return body, at
    ends = np.sort(body[:, SIDES[:, [0, 2]]].reshape(-1, 2), axis=1)
    sides, which = np.unique(ends, axis=0, return_inverse=True)
    return np.hstack([body, len(at) + which.reshape(-1, 4)]), np.vstack([at, at[sides].mean(axis=1)])


def _line_of(edges: Ints, at: Floats, chosen: Sequence[int], path: Path) -> Ints:
    """The nodes of the edges (edges, 3) of the outline between chosen nodes, from the axis outwards."""
    chain = [edge[::-1] for edge in edges if {*edge[[0, 2]].tolist()} <= {*chosen}]
    chain.sort(key=lambda edge: float(at[edge[1], 0]))
    line = [node for edge in chain for node in edge[:2]] + [edge[2] for edge in chain[-1:]]
    joined = all(one[2] == other[0] for one, other in pairwise(chain))
    if len(chosen) and not (chain and joined and at[line[0], 0] == 0.0 and {*chosen} <= {*line}):
        raise SolveError(
            f"{path}: the nodes of the top are not one line of element sides from the axis outwards; "
            "give the nodes of such a line, or none"
        )
    return np.array(line, dtype=np.int64)


class _Sets:
    """Named lists of nodes and elements in a JSON file."""

    def __init__(self, path: Path) -> None:
        self.path, self.content = path, read_json(path, MESH_FILE)
        if not isinstance(self.content, dict):
            raise SolveError(f'{path}: holds no object; write sets by name, such as {{"top": [1, 6]}}')

    def members(self, name: str, known: Mapping[int, int], what: str, default: Any = None) -> list[int]:
        """The rows of a set's nodes or elements; SolveError where it is missing and has no default."""
        labels = self.content.get(name, default)
        if labels is None:
            raise SolveError(f"{self.path}: there is no set '{name}'; {nearest(name, self.content)}")
        if not isinstance(labels, list | tuple) or not all(type(label) is int for label in labels):
            raise SolveError(
                f"{self.path}: set '{name}' is not a list of {what} numbers; write one such as [1, 6, 147]"
            )
        if unknown := [label for label in labels if label not in known]:
            raise SolveError(f"{self.path}: set '{name}' names {what} {unknown[0]}, which is not among the {what}s")
        return [known[label] for label in labels]


def _rows(path: Path, columns: Sequence[str], more: Sequence[str] = ()) -> dict[int, list[float]]:
    """{id: numbers of its row}; the columns `more` belong to it when all of them are there."""
    lines, rows = csv.reader(read_text(path, MESH_FILE).splitlines()), dict[int, list[float]]()
    try:
        names = [name.strip() for name in next(lines, [])]
        if missing := [name for name in ("id", *columns) if name not in names]:
            found = quoted(", ".join(names), 200) or "nothing"
            raise SolveError(f"{path}:1: missing column '{missing[0]}'; found: {found}")
        wanted = ["id", *columns, *(more if set(more) <= set(names) else ())]
        for cells in filter(None, lines):
            try:
                label, *numbers = (float(cells[names.index(name)]) for name in wanted)
            except (ValueError, IndexError):
                label, numbers = 0.0, []
            if not (label >= 1 and label % 1 == 0 and label not in rows and np.isfinite(numbers).all()):
                raise SolveError(
                    f"{path}:{lines.line_num}: '{quoted(', '.join(cells), 60)}' is no row; write a whole number from 1 "
                    f"on that no other row has, and finite numbers under {', '.join(wanted[1:])}"
                )
            rows[int(label)] = numbers
    except csv.Error as error:
        raise SolveError(f"{path}:{lines.line_num}: no line of a CSV table ({error}); look for stray quotes") from None
    if not rows:
        raise SolveError(f"{path}: holds no row below its head; give at least one")
    return rows
