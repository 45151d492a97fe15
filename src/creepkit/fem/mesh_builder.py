"""Construction of a mesh from nodes and elements with numbers of their own, as a file has them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np

from creepkit.arrays import Bools, Floats, Ints
from creepkit.errors import SolveError
from creepkit.fem.mesh import CORNERS, GAUSS_POINTS, SIDES, Mesh, half_bandwidth, local_tangents, outline

_ON_AXIS = 1e-9
"""Nodes nearer to the axis, mm, are on it: programs write such numbers for zero."""


@dataclass(frozen=True)
class ElementNodes:
    """The nodes of one element by the file's numbers, four corners and perhaps four middles, and its 'file:line'."""

    nodes: tuple[int, ...]
    place: str


@dataclass
class MeshBuilder:
    """What was read of a mesh.

    nodes : r and z, mm, and place of each node. held : whether u_r and u_z of a node are held.
    pressed : sides 1 to 4 of elements. top : the observed surface, in any order.
    """

    path: Path
    nodes: dict[int, tuple[float, float, str]] = field(default_factory=dict)
    elements: dict[int, ElementNodes] = field(default_factory=dict)
    held: dict[int, tuple[bool, bool]] = field(default_factory=dict)
    pressed: set[tuple[int, int]] = field(default_factory=set)
    top: set[int] = field(default_factory=set)

    def add_node(self, number: int, r: float, z: float, place: str) -> None:
        """Add a node that must be new."""
        if number in self.nodes:
            raise SolveError(f"{place}: node {number} was already given in {self.nodes[number][2]}; keep one of them")
        if abs(r) < _ON_AXIS:
            r = 0.0
        if r < 0:
            raise SolveError(f"{place}: node {number} has a radius of {r:g} mm; allowed is 0, the axis, or more")
        self.nodes[number] = (r, z, place)

    def add_element(self, number: int, element: ElementNodes) -> None:
        """Add an element that must be new."""
        if number in self.elements:
            first = self.elements[number].place
            raise SolveError(f"{element.place}: element {number} was already given in {first}; keep one of them")
        self.elements[number] = element

    def hold(self, nodes: Iterable[int], r: bool, z: bool) -> None:
        """Hold nodes in r, z or both."""
        for node in nodes:
            before = self.held.get(node, (False, False))
            self.held[node] = (before[0] or r, before[1] or z)

    def mesh(self) -> Mesh:
        """The mesh, with middles of sides where the file has none, and numbered for a small bandwidth."""
        return _build(self)


def renumbered(mesh: Mesh) -> Mesh:
    """The mesh numbered by reverse Cuthill-McKee, by radius or as it was, whichever has the smallest bandwidth."""
    best = min(_orders(mesh), key=lambda order: half_bandwidth(_inverse(order)[mesh.elements]))
    new = _inverse(best)
    return Mesh(mesh.nodes[best], new[mesh.elements], mesh.held[best], new[mesh.pressed], new[mesh.top])


def _orders(mesh: Mesh) -> Iterator[Ints]:
    """Orders of the nodes worth trying, the present one first."""
    yield np.arange(len(mesh.nodes))
    yield order_by_neighbours(mesh.elements, len(mesh.nodes))
    yield np.lexsort(mesh.nodes.T[::-1])


def order_by_neighbours(elements: Ints, count: int) -> Ints:
    """The nodes (count,) in the order of reverse Cuthill and McKee; elements : (elements, 8) nodes of each."""
    from scipy.sparse import coo_array  # loaded when it is needed, not when creepkit starts
    from scipy.sparse.csgraph import reverse_cuthill_mckee

    pairs = elements[:, :, None], elements[:, None, :]
    rows, columns = (np.broadcast_to(pair, (len(elements), 8, 8)).ravel() for pair in pairs)
    graph = coo_array((np.ones(rows.size), (rows, columns)), shape=(count, count))
    return np.asarray(reverse_cuthill_mckee(graph.tocsr(), symmetric_mode=True).astype(np.int64))


def _inverse(order: Ints) -> Ints:
    new = np.empty_like(order)
    new[order] = np.arange(len(order))
    return new


def _build(draft: MeshBuilder) -> Mesh:
    if not draft.elements:
        raise SolveError(f"{draft.path}: the mesh has no elements; it needs quadrilaterals of four or eight nodes")
    turned = [_is_clockwise(draft, number) for number in draft.elements]
    quads = [_anticlockwise(element.nodes, turn) for element, turn in zip(draft.elements.values(), turned, strict=True)]
    middles = _middles(quads)
    made = {middle: side for side, middle in middles.items() if middle < 0}
    numbers = sorted({node for quad in quads for node in quad}) + list(made)
    new = {number: k for k, number in enumerate(numbers)}
    nodes = np.array([_place(draft, made, number) for number in numbers])
    elements = np.array([[new[n] for n in _completed(quad, middles)] for quad in quads])
    _refuse_bent(draft, nodes, elements)
    pressed = _pressed(draft, elements, turned)
    held = _held(draft, new, elements, len(made))
    _refuse_loose(draft, held, pressed)
    return renumbered(Mesh(nodes, elements, held, pressed, _top(draft, new, nodes, elements)))


def _is_clockwise(draft: MeshBuilder, number: int) -> bool:
    """Whether the corners go round clockwise; a quadrilateral that is not convex, or crosses itself, is refused."""
    element = draft.elements[number]
    for node in element.nodes:
        if node not in draft.nodes:
            raise SolveError(f"{element.place}: element {number} names node {node}, which is not among the nodes")
    places = np.array([draft.nodes[node][:2] for node in element.nodes[:4]])
    ahead = np.roll(places, -1, axis=0) - places
    back = np.roll(ahead, 1, axis=0)
    turns = back[:, 0] * ahead[:, 1] - back[:, 1] * ahead[:, 0]
    if not ((turns > 0).all() or (turns < 0).all()):
        corners = ", ".join(map(str, element.nodes[:4]))
        raise SolveError(
            f"{element.place}: element {number} is not a convex quadrilateral: its corners {corners} cross "
            "over, fold in or fall together; list them once round, in either sense"
        )
    return bool(turns[0] < 0)


def _anticlockwise(nodes: Sequence[int], turn: bool) -> tuple[int, ...]:
    """The nodes in the other sense when `turn`; side k becomes side 5 - k."""
    order = (0, 3, 2, 1, 7, 6, 5, 4)[: len(nodes)] if turn else range(len(nodes))
    return tuple(nodes[k] for k in order)


def _side(quad: Sequence[int], k: int) -> tuple[int, int]:
    """The two ends of side k, 0 to 3, whichever element looks at it."""
    a, b = quad[k], quad[(k + 1) % 4]
    return (a, b) if a < b else (b, a)


def _middles(quads: Sequence[Sequence[int]]) -> dict[tuple[int, int], int]:
    """The middle of each side by its ends; where no element has one, a new number below zero."""
    middles = {_side(quad, k): quad[4 + k] for quad in quads if len(quad) == 8 for k in range(4)}
    for quad in quads:
        for k in range(4 if len(quad) == 4 else 0):
            middles.setdefault(_side(quad, k), -1 - len(middles))
    return middles


def _completed(quad: Sequence[int], middles: Mapping[tuple[int, int], int]) -> Sequence[int]:
    return quad if len(quad) == 8 else [*quad, *(middles[_side(quad, k)] for k in range(4))]


def _place(draft: MeshBuilder, made: Mapping[int, tuple[int, int]], number: int) -> tuple[float, float]:
    if number >= 0:
        return draft.nodes[number][:2]
    (r, z, _), (other_r, other_z, _) = (draft.nodes[end] for end in made[number])
    return 0.5 * (r + other_r), 0.5 * (z + other_z)


def _refuse_bent(draft: MeshBuilder, nodes: Floats, elements: Ints) -> None:
    """Refuse an element whose middle nodes turn it inside out somewhere."""
    areas = np.linalg.det(local_tangents(nodes[elements], np.vstack([CORNERS, GAUSS_POINTS])))
    bad = np.flatnonzero((areas <= 0).any(axis=1))
    if bad.size:
        number = list(draft.elements)[bad[0]]
        raise SolveError(
            f"{draft.elements[number].place}: element {number} is turned inside out by its middle nodes; put each near "
            "the middle of its side, in the order of the sides 1-2, 2-3, 3-4, 4-1"
        )


def _pressed(draft: MeshBuilder, elements: Ints, turned: Sequence[bool]) -> Ints:
    """Nodes (sides, 3) of the pressed sides, all of which must be on the outline."""
    row = {number: k for k, number in enumerate(draft.elements)}
    free = {(int(element), int(side)) for element, side in outline(elements)}
    pressed = []
    for number, label in sorted(draft.pressed):
        element = row[number]
        side = 4 - label if turned[element] else label - 1
        if (element, side) not in free:
            raise SolveError(
                f"{draft.elements[number].place}: side {label} of element {number} is pressed, but another element "
                "lies there; press sides of the outline only"
            )
        pressed.append(elements[element, SIDES[side]])
    return np.array(pressed, dtype=np.int64).reshape(-1, 3)


def _held(draft: MeshBuilder, new: Mapping[int, int], elements: Ints, made: int) -> Bools:
    """What is held, (nodes, 2); a new middle on the outline is held where both ends of its side are."""
    held = np.zeros((len(new), 2), dtype=bool)
    for number, what in draft.held.items():
        if number in new:
            held[new[number]] |= what
    for element, side in outline(elements):
        first, middle, last = elements[element, SIDES[side]]
        if middle >= len(new) - made:
            held[middle] = held[first] & held[last]
    return held


def _refuse_loose(draft: MeshBuilder, held: Bools, pressed: Ints) -> None:
    if not pressed.size:
        raise SolveError(f"{draft.path}: the mesh has no pressed side; say which sides of which elements are pressed")
    if not held[:, 1].any():
        raise SolveError(
            f"{draft.path}: the mesh has no held nodes: nothing is held in z, so it would fly off; say which nodes are"
        )


def _top(draft: MeshBuilder, new: Mapping[int, int], nodes: Floats, elements: Ints) -> Ints:
    """The sides of the outline between the nodes of the top, from the axis outwards."""
    chosen = {new[number] for number in draft.top if number in new}
    sides = [elements[element, SIDES[side]] for element, side in outline(elements)]
    chain = [side[::-1] for side in sides if {int(side[0]), int(side[2])} <= chosen]
    chain.sort(key=lambda side: float(nodes[side[1], 0]))
    line = [node for side in chain for node in side[:2]] + [side[2] for side in chain[-1:]]
    joined = all(one[2] == other[0] for one, other in pairwise(chain))
    if chosen and not (chain and joined and nodes[line[0], 0] == 0 and chosen <= set(line)):
        raise SolveError(
            f"{draft.path}: the nodes of the top are not one line of element sides from the axis outwards; "
            "give the nodes of such a line, or none"
        )
    return np.array(line, dtype=np.int64)
