"""Meshes of eight-node quadrilaterals: shape functions, integration points, quality.

Serendipity functions as in Zienkiewicz and Taylor, The Finite Element Method, vol. 1, with 2 x 2 integration points.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from creepkit.arrays import Bools, Floats, Ints, frozen
from creepkit.errors import SolveError

CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
"""Corners of the reference element; mid-side nodes follow, on the sides 1-2, 2-3, 3-4 and 4-1."""


MOST_ELEMENTS = 1_000_000
"""Of a mesh that is generated; one of a specimen has 50 to some thousands."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """A half section of a body of revolution, in mm.

    nodes : (nodes, 2) radius r >= 0 and height z.
    elements : (elements, 8) nodes of each element, four corners anticlockwise (r to the right, z up), then the nodes
        in the middle of the sides 1-2, 2-3, 3-4, 4-1.
    held : (nodes, 2) whether u_r and u_z are prescribed (zero unless a motion is given); u_r is held on the axis.
    pressed : (edges, 3) sides under pressure: first, middle and last node, in the order of the element they belong to
        (the solid lies to the left).
    top : (top nodes,) corner and middle nodes of the observed surface in turn, from the axis outwards; an odd number,
        or none.
    """

    nodes: Floats
    elements: Ints
    held: Bools
    pressed: Ints
    top: Ints

    def __post_init__(self) -> None:
        freeze = object.__setattr__
        freeze(self, "nodes", frozen(self.nodes))
        if self.nodes.ndim != 2 or self.nodes.shape[1] != 2 or not np.isfinite(self.nodes).all():
            raise SolveError("a mesh needs nodes of two finite coordinates, r and z in mm")
        freeze(self, "elements", frozen(self.elements, dtype=np.int64))
        held = np.array(self.held, bool)
        if held.shape != self.nodes.shape:
            raise SolveError(
                f"held of the mesh has the shape {held.shape}; give u_r and u_z of each of its {len(self.nodes)} nodes"
            )
        held[self.nodes[:, 0] <= 0.0, 0] = True
        freeze(self, "held", frozen(held, dtype=np.bool_))
        freeze(self, "pressed", frozen(np.reshape(self.pressed, (-1, 3)), dtype=np.int64))
        freeze(self, "top", frozen(self.top, dtype=np.int64))
        if (self.nodes[:, 0] < 0).any():
            k = int(np.argmin(self.nodes[:, 0]))
            raise SolveError(f"node {k} of the mesh has a radius of {self.nodes[k, 0]:g} mm; it must not be negative")
        if self.elements.size and (self.elements.ndim != 2 or self.elements.shape[1] != 8):
            raise SolveError(
                f"the elements of the mesh have the shape {self.elements.shape}; give each a row of its eight nodes"
            )
        for name, array in (("elements", self.elements), ("pressed", self.pressed), ("top", self.top)):
            if array.size and not 0 <= array.min() <= array.max() < len(self.nodes):
                missing = array.min() if array.min() < 0 else array.max()
                raise SolveError(f"the mesh has {len(self.nodes)} nodes, but its {name} name node {missing}")

    def moved(self, nodes: Floats) -> Mesh:
        """The same mesh with its nodes elsewhere."""
        return replace(self, nodes=nodes)


GAUSS_POINTS = CORNERS / np.sqrt(3.0)
"""The 2 x 2 Gauss points (4, 2) of the reference element, each near the corner of its number; all weights are 1."""


class Discretization(NamedTuple):
    """A mesh at the four integration points of each element.

    by_radius, by_height : (elements, 4, 8) 1/mm, derivatives of the shape functions to r and to z.
    over_radius : (elements, 4, 8) 1/mm, shape functions divided by the radius of the point.
    weights : (elements, 4) mm^3, area of the section that belongs to a point, times its radius.
    points : (elements, 4, 2) mm, r and z.
    """

    by_radius: Floats
    by_height: Floats
    over_radius: Floats
    weights: Floats
    points: Floats


class GeometryDerivative(NamedTuple):
    """How the points move with a number of the geometry: 1 over the unit of that number, as velocities are mm over it.

    gradient : (elements, 4, 2, 2) derivative of the velocity's component (first of the two) to r and z.
    hoop : (elements, 4) radial velocity over the radius.
    """

    gradient: Floats
    hoop: Floats


def shape_functions(places: Floats) -> Floats:
    """Values (places, 8) of the shape functions at places (places, 2) of the reference element."""
    x, y = places[:, :1], places[:, 1:]
    cx, cy = CORNERS.T
    corner = 0.25 * (1 + x * cx) * (1 + y * cy) * (x * cx + y * cy - 1)
    below_above = 0.5 * (1 - x**2) * (1 + y * np.array([-1.0, 1.0]))
    right_left = 0.5 * (1 + x * np.array([1.0, -1.0])) * (1 - y**2)
    return np.hstack([corner, _alternate(below_above, right_left)])


def shape_gradients(places: Floats) -> Floats:
    """Derivatives (places, 8, 2) to the two local coordinates at places (places, 2)."""
    x, y = places[:, :1], places[:, 1:]
    cx, cy = CORNERS.T
    up, right = np.array([-1.0, 1.0]), np.array([1.0, -1.0])
    by_x = 0.25 * cx * (1 + y * cy) * (2 * x * cx + y * cy)
    by_y = 0.25 * cy * (1 + x * cx) * (x * cx + 2 * y * cy)
    by_x = np.hstack([by_x, _alternate(-x * (1 + y * up), 0.5 * right * (1 - y**2))])
    by_y = np.hstack([by_y, _alternate(0.5 * (1 - x**2) * up, -(1 + x * right) * y)])
    return np.stack([by_x, by_y], axis=2)


def discretize(mesh: Mesh) -> Discretization:
    """Everything an integral over the mesh needs; an inverted element is refused."""
    refuse_inverted(mesh)
    nodes = mesh.nodes[mesh.elements]
    values = shape_functions(GAUSS_POINTS)
    points = np.einsum("pa,eai->epi", values, nodes)
    tangents = local_tangents(nodes, GAUSS_POINTS)
    slopes = np.einsum("epji,pai->epja", np.linalg.inv(tangents), shape_gradients(GAUSS_POINTS))
    return Discretization(
        by_radius=np.ascontiguousarray(slopes[:, :, 0]),
        by_height=np.ascontiguousarray(slopes[:, :, 1]),
        over_radius=values / points[:, :, :1],
        weights=np.linalg.det(tangents) * points[:, :, 0],
        points=points,
    )


def local_tangents(nodes: Floats, places: Floats) -> Floats:
    """Derivatives (elements, places, 2 local, 2) of r and z to the local coordinates, mm.

    nodes : (elements, 8, 2) mm, of each element. places : (places, 2) of the reference element.
    """
    return np.asarray(np.einsum("pai,eaj->epij", shape_gradients(places), nodes))


def refuse_inverted(mesh: Mesh) -> None:
    """Raise SolveError when an element is turned inside out at a corner or at an integration point."""
    places = np.vstack([CORNERS, GAUSS_POINTS])
    areas = np.linalg.det(local_tangents(mesh.nodes[mesh.elements], places))
    bad = np.flatnonzero(~(areas > 0).all(axis=1))
    if bad.size:
        worst = mesh.nodes[mesh.elements[bad[0], :4]].mean(axis=0)
        raise SolveError(
            f"element {bad[0]} of the mesh, near r = {worst[0]:.4g} mm, z = {worst[1]:.4g} mm, is inverted "
            f"({bad.size} of {len(areas)} elements are); number its corners anticlockwise and keep its middle nodes "
            "near the middle of its sides, or change the refinement of a mesh that was made here"
        )


def _alternate(first: Floats, second: Floats) -> Floats:
    """Columns of two arrays (places, 2) in turn, (places, 4): the middles of the sides 1-2, 2-3, 3-4, 4-1."""
    return np.stack([first, second], axis=2).reshape(len(first), 4)


SIDES = np.array([[0, 4, 1], [1, 5, 2], [2, 6, 3], [3, 7, 0]])
"""First, middle and last node of each side of an element."""


_SIDE_PLACES = np.sqrt(0.6) * np.array([-1.0, 0.0, 1.0])


SIDE_WEIGHTS = np.array([5.0, 8.0, 5.0]) / 9.0
"""(Gauss points,) of a side, x from -1 to 1 from its first node to its last."""


SIDE_VALUES = np.stack(
    [0.5 * _SIDE_PLACES * (_SIDE_PLACES - 1), 1 - _SIDE_PLACES**2, 0.5 * _SIDE_PLACES * (_SIDE_PLACES + 1)], axis=1
)
"""(Gauss points, nodes) shape functions of a side there."""


SIDE_SLOPES = np.stack([_SIDE_PLACES - 0.5, -2 * _SIDE_PLACES, _SIDE_PLACES + 0.5], axis=1)
"""(Gauss points, nodes) their derivatives to x."""


def half_bandwidth(elements: Ints) -> int:
    """Diagonals beside the main one in a matrix of two unknowns a node; elements : (elements, 8) nodes of each."""
    return int(2 * np.ptp(elements, axis=1).max() + 1)


def outline(elements: Ints) -> Ints:
    """Nodes (edges, 3) of the element sides that belong to one element only, first, middle and last.

    elements : (elements, 8) nodes of each element.
    """
    sides = elements[:, SIDES].reshape(-1, 3)
    _, first, count = np.unique(np.sort(sides[:, [0, 2]], axis=1), axis=0, return_index=True, return_counts=True)
    return np.asarray(sides[np.sort(first[count == 1])])


def order_by_neighbours(elements: Ints, count: int) -> Ints:
    """The nodes (count,) in the order of reverse Cuthill and McKee; elements : (elements, 8) nodes of each."""
    from scipy.sparse import coo_array  # loaded when it is needed, not when creepkit starts
    from scipy.sparse.csgraph import reverse_cuthill_mckee

    pairs = elements[:, :, None], elements[:, None, :]
    rows, columns = (np.broadcast_to(pair, (len(elements), 8, 8)).ravel() for pair in pairs)
    graph = coo_array((np.ones(rows.size), (rows, columns)), shape=(count, count))
    return np.asarray(reverse_cuthill_mckee(graph.tocsr(), symmetric_mode=True).astype(np.int64))


def renumbered(mesh: Mesh) -> Mesh:
    """The mesh numbered by reverse Cuthill-McKee, by radius or as it was, whichever has the smallest bandwidth."""
    count = len(mesh.nodes)
    orders = [np.arange(count), order_by_neighbours(mesh.elements, count), np.lexsort(mesh.nodes.T[::-1])]
    best = min(orders, key=lambda order: half_bandwidth(np.argsort(order)[mesh.elements]))
    new = np.argsort(best)
    return Mesh(mesh.nodes[best], new[mesh.elements], mesh.held[best], new[mesh.pressed], new[mesh.top])


class StripMesh(NamedTuple):
    """Nodes and elements of a strip, and its four sides as node numbers.

    nodes : (nodes, 2) mm. elements : (elements, 8) nodes of each, in the order that `Mesh` asks for.
    inner, outer : (columns, 3) nodes of the element sides along the two lines, the solid to their left.
    first, last : (2 layers + 1,) nodes of the first and of the last column line, from the inner side.
    inner_line, outer_line : (2 columns + 1,) corner and middle nodes along the two lines, from the first column on.
    """

    nodes: Floats
    elements: Ints
    inner: Ints
    outer: Ints
    first: Ints
    last: Ints
    inner_line: Ints
    outer_line: Ints


def check_elements(count: int) -> None:
    """SolveError, before any memory is taken, for a mesh of more elements than can be solved for."""
    if count > MOST_ELEMENTS:
        raise SolveError(
            f"a mesh of {count} elements is asked for; at most {MOST_ELEMENTS} are made; lower its refinement, or its "
            "numbers of columns and layers"
        )


def strip_mesh(inner: Floats, outer: Floats, breaks: Floats) -> StripMesh:
    """The strip whose column lines run straight from `inner` to `outer`.

    inner, outer : (2 columns + 1, 2) mm, ends of the column lines, those of mid-columns included; each lies on its
        curve, so the sides of the elements are parabolas through three points of it.
    breaks : (layers + 1,) rising from 0 on the inner side to 1 on the outer side.
    With `layers` layers the half-bandwidth of a matrix of two unknowns a node is 6 layers + 9.
    """
    numbers = _strip_numbers(len(inner) // 2, len(breaks) - 1)  # first, for this refuses what memory cannot hold
    return StripMesh(strip_nodes(inner, outer, breaks), *numbers)


@lru_cache(maxsize=64)
def _strip_numbers(columns: int, layers: int) -> tuple[Ints, ...]:
    """All of a StripMesh but its nodes; kept, for nodes move and numbers stay."""
    check_elements(columns * layers)
    start = (3 * layers + 2) * np.arange(columns + 1)
    middle = start[:-1] + 2 * layers + 1
    a, b, j = start[:-1, None], start[1:, None], np.arange(layers)
    corners = [a + 2 * j, b + 2 * j, b + 2 * j + 2, a + 2 * j + 2]
    middles = [middle[:, None] + j, b + 2 * j + 1, middle[:, None] + j + 1, a + 2 * j + 1]
    elements = np.stack(corners + middles, axis=2)
    first = np.arange(2 * layers + 1)
    lines = (_interleaved(start + 2 * k, middle + k) for k in (0, layers))
    parts = elements.reshape(-1, 8), elements[:, 0, [0, 4, 1]], elements[:, -1, [2, 6, 3]], first, start[-1] + first
    return tuple(frozen(part, dtype=np.int64) for part in (*parts, *lines))


def strip_nodes(inner: Floats, outer: Floats, breaks: Floats) -> Floats:
    """The nodes of a strip, (nodes, 2), mm; linear in the two sides: velocities of the sides give those of the nodes.

    inner, outer : (2 columns + 1, 2) mm, ends of the column lines. breaks : (layers + 1,) from 0 to 1.
    """
    fine = np.empty(2 * len(breaks) - 1)
    fine[::2], fine[1::2] = breaks, 0.5 * (breaks[:-1] + breaks[1:])
    lines, middles = (
        (1 - places[:, None]) * inner[first::2, None] + places[:, None] * outer[first::2, None]
        for first, places in ((0, fine), (1, breaks))
    )
    columns = np.concatenate([lines[:-1], middles], axis=1)
    return np.concatenate([columns.reshape(-1, 2), lines[-1]])


def _interleaved(corners: Ints, middles: Ints) -> Ints:
    line = np.empty(corners.size + middles.size, dtype=np.int64)
    line[::2], line[1::2] = corners, middles
    return line
