"""Section: the half section of a body of revolution, what holds it and what acts on it, for specimens to be made of."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Self

import numpy as np

from creepkit.arrays import ArrayLike, Bools, Floats, Ints, frozen
from creepkit.checked_arguments import checked
from creepkit.errors import SolveError, nearest, refuse_unknown
from creepkit.fem.finite_element_model import AxialConstraints, FiniteElementModel, RigidContact, finite_element_model
from creepkit.fem.mesh import SIDE_SLOPES, SIDE_VALUES, SIDE_WEIGHTS, Mesh, check_elements, outline, strip_mesh


@checked
@dataclass(frozen=True, eq=False)
class Section:
    """The half section of a body of revolution in eight-node quadrilaterals, with named sides and points.

    Made by `rectangle`, `strip` or `of_mesh`; every method returns a changed copy. u_r is held on the axis by itself.

    nodes : (nodes, 2) mm, radius r and height z. elements : (elements, 8) nodes of each, see fem.mesh.Mesh.
    sides : {name: (edges, 3)} first, middle and last node of element sides, the solid to their left.
    points : {name: node}.
    held : (nodes, 2) whether u_r and u_z are held.
    pressed : (edges, 3) element sides under the pressure of the load, which follows the deformation.
    forces : (nodes, 2) N/rad in r and z for a unit of the load, whatever the deformation.
    planes : (nodes,) those of each face that stays plane. controlled : number of the plane that the load moves, and
    motion : mm of its u_z for a unit of the load.
    contacts : rigid bodies that it may touch.
    """

    nodes: Floats
    elements: Ints
    sides: Mapping[str, Ints]
    points: Mapping[str, int]
    held: Bools = field(default_factory=lambda: np.zeros((0, 2), dtype=bool))
    pressed: Ints = field(default_factory=lambda: np.zeros((0, 3), dtype=np.int64))
    forces: Floats = field(default_factory=lambda: np.zeros((0, 2)))
    planes: tuple[Ints, ...] = ()
    controlled: int | None = None
    motion: float = 1.0
    contacts: tuple[RigidContact, ...] = ()

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "nodes", frozen(self.nodes))
        shape = self.nodes.shape
        put(self, "held", frozen(self.held if len(self.held) else np.zeros(shape, dtype=bool), dtype=np.bool_))
        put(self, "forces", frozen(self.forces if len(self.forces) else np.zeros(shape)))
        put(self, "sides", MappingProxyType({name: frozen(e, dtype=np.int64) for name, e in self.sides.items()}))
        put(self, "points", MappingProxyType({name: int(node) for name, node in self.points.items()}))

    # ---- where it comes from --------------------------------------------------------------------------------------

    @classmethod
    def rectangle(
        cls,
        corner: tuple[float, float],
        opposite: tuple[float, float],
        columns: int | ArrayLike,
        layers: int | ArrayLike,
    ) -> Self:
        """A rectangle between two corners (r, z), mm, with the sides bottom, right, top and left.

        columns, layers : numbers of elements along r and along z, or (columns + 1,) and (layers + 1,) their boundaries
            as shares from 0 to 1.
        Its corners are the points bottom_left, bottom_right, top_left and top_right. The fewer layers the faster: put
        the longer row of elements along the columns.
        """
        (r, z), (far_r, far_z) = corner, opposite
        along = _with_middles(_breaks(columns))
        lower = np.stack([r + (far_r - r) * along, np.full(along.size, z)], axis=1)
        upper = np.stack([r + (far_r - r) * along, np.full(along.size, far_z)], axis=1)
        names = {
            "inner": "bottom", "outer": "top", "first": "left", "last": "right", "inner_first": "bottom_left",
            "inner_last": "bottom_right", "outer_first": "top_left", "outer_last": "top_right",
        }  # fmt: skip
        made = cls.strip(lower, upper, layers)
        sides = {names[name]: edges for name, edges in made.sides.items()}
        return replace(made, sides=sides, points={names[name]: node for name, node in made.points.items()})

    @classmethod
    def strip(cls, inner: ArrayLike, outer: ArrayLike, layers: int | ArrayLike) -> Self:
        """A strip between two lines, with the sides inner, outer, first and last.

        inner, outer : (2 columns + 1, 2) mm, corner and middle nodes of the element sides along each line, in turn;
            going along the inner one the outer lies to the left. Nodes between them lie on straight lines.
        layers : number of elements across, or (layers + 1,) their boundaries as shares from 0, inner, to 1.
        The ends of the lines are the points inner_first, inner_last, outer_first and outer_last.
        """
        lines = [np.asarray(line, dtype=float) for line in (inner, outer)]
        if lines[0].shape != lines[1].shape or lines[0].ndim != 2 or len(lines[0]) < 3 or len(lines[0]) % 2 == 0:
            raise SolveError(
                f"the lines of a strip have the shapes {lines[0].shape} and {lines[1].shape}; both need the same odd "
                "number of points (r, z), at least three: corner and middle nodes in turn"
            )
        made = strip_mesh(lines[0], lines[1], _breaks(layers))
        first, last = made.first, made.last
        sides = {
            "inner": made.inner,
            "outer": made.outer,
            "first": np.stack([first[2::2], first[1::2], first[:-2:2]], axis=1),
            "last": np.stack([last[:-2:2], last[1::2], last[2::2]], axis=1),
        }
        points = {
            "inner_first": first[0], "inner_last": last[0], "outer_first": first[-1], "outer_last": last[-1],
        }  # fmt: skip
        return cls(made.nodes, made.elements, sides, points)

    @classmethod
    def of_mesh(cls, mesh: Mesh) -> Self:
        """The section of a mesh from elsewhere, such as `ck.read_mesh(path)`, with what is held there.

        Its pressed sides are the side pressed; the first and the last of its top nodes are the points top_first and
        top_last. `with_side` and `with_point` name others.
        """
        points = {"top_first": int(mesh.top[0]), "top_last": int(mesh.top[-1])} if mesh.top.size else {}
        sides = {"pressed": mesh.pressed} if mesh.pressed.size else {}
        return cls(mesh.nodes, mesh.elements, sides, points, held=mesh.held)

    # ---- names ----------------------------------------------------------------------------------------------------

    def with_side(self, name: str, where: Callable[[Floats, Floats], Bools]) -> Self:
        """Name those element sides of the outline of which all nodes satisfy a condition.

        where : of r (nodes,) and z (nodes,), mm: `lambda r, z: z > 9.999`.
        """
        edges = outline(self.elements)
        chosen = np.asarray(where(self.nodes[:, 0], self.nodes[:, 1]), dtype=bool)[edges].all(axis=1)
        if not chosen.any():
            raise SolveError(f"side '{name}' of a section: the condition holds on no element side of its outline")
        return replace(self, sides={**self.sides, name: edges[chosen]})

    def with_point(self, name: str, r: float, z: float, within: float = 1e-6) -> Self:
        """Name the node at (r, z), mm; SolveError where none lies so near."""
        distances = np.hypot(self.nodes[:, 0] - r, self.nodes[:, 1] - z)
        node = int(distances.argmin())
        if not distances[node] <= within:
            raise SolveError(
                f"point '{name}' of a section: no node lies at r = {r:g} mm, z = {z:g} mm; the nearest lies at "
                f"r = {self.nodes[node, 0]:g} mm, z = {self.nodes[node, 1]:g} mm"
            )
        return replace(self, points={**self.points, name: node})

    # ---- supports and loads ---------------------------------------------------------------------------------------

    def hold(self, side: str, *, r: bool = False, z: bool = False) -> Self:
        """Hold u_r, u_z or both on a side, or at a point."""
        held = np.array(self.held)
        held[self._nodes_of(side)] |= [r, z]
        return replace(self, held=held)

    def press(self, side: str) -> Self:
        """Let the load, a pressure in MPa, press on a side; it follows the deformation."""
        return replace(self, pressed=np.vstack([self.pressed, _side(self, side)]))

    def pull(self, side: str, force: float = 1.0) -> Self:
        """Let `force` N for a unit of the load act along z, evenly over a side as it is at rest; it stays a dead force.

        force : N; below zero it pushes down. A load that is itself a force needs none. The end force of a closed tube
        under pressure is pi times the square of its bore radius, N for each MPa.
        """
        edges = _side(self, side)
        shares = _shares_of_area(self.nodes, edges)
        total = 2.0 * np.pi * shares.sum()
        if not total > 0.0:
            raise SolveError(f"side '{side}' of a section has no area that a force could act on")
        forces = np.array(self.forces)
        np.add.at(forces[:, 1], edges, force / total * shares)
        return replace(self, forces=forces)

    def plane(self, side: str) -> Self:
        """Let a side stay plane: all of it has one u_z, as where a grip or a longer body holds it. It moves freely."""
        return replace(self, planes=(*self.planes, np.unique(_side(self, side))))

    def move(self, side: str, by: float = 1.0) -> Self:
        """Let the load, a displacement in mm, move a side, which stays plane; `Displacements.force` is what it needs.

        by : mm of u_z of the side for a unit of the load: 0.5 in a half model whose load is the whole elongation.
        """
        if self.controlled is not None:
            raise SolveError("the load can move one side of a section; give the others planes, forces or supports")
        return replace(self.plane(side), controlled=len(self.planes), motion=float(by))

    def touch(
        self,
        side: str,
        centre: tuple[float, float],
        edge: tuple[float, float],
        *,
        name: str,
        force: float | None = None,
        stiffness: float = 1e6,
        smoothing: float = 2e-4,
    ) -> Self:
        """Let a side touch, without friction, a rigid circle: a sphere, if its centre is on the axis, or else a ring.

        centre, edge : (r, z) mm of its centre and of a point of it, from which its radius is taken.
        name : of a new point, at the edge, that moves with it.
        force : N along z on it for a unit of the load; it then moves freely along the axis. None: it stays where it is.
        stiffness : MPa/mm, pressure for each mm that the side penetrates it (penalty method), for each area at rest.
        smoothing : mm, gap at which pressure begins to rise from zero, so that its slope has no jump.
        Other forces and rigid bodies may be added after; sides are named before.
        """
        edges, first = _side(self, side), len(self.nodes)
        free = force is not None
        contact = RigidContact(edges, first, first + 1, float(stiffness), float(smoothing), free)
        forces = np.vstack([self.forces, np.zeros((2, 2))])
        forces[first, 1] = 0.0 if force is None else force / (2.0 * np.pi)
        return replace(
            self,
            nodes=np.vstack([self.nodes, [centre, edge]]),
            points={**self.points, name: first + 1},
            held=np.vstack([self.held, [[True, not free]] * 2]),
            forces=forces,
            planes=(*self.planes, np.array([first, first + 1])) if free else self.planes,
            contacts=(*self.contacts, contact),
        )

    # ---- what it is for -------------------------------------------------------------------------------------------

    def model(self, observed: Ints) -> FiniteElementModel:
        """The finite element model; observed : (observed,) displacements, 2 node + 0 for u_r or + 1 for u_z."""
        if self.controlled is not None and (self.pressed.size or self.forces.any()):
            raise SolveError(
                "a section is moved by its load, a displacement, and pressed or pulled by it as well; make a section "
                "for each load, as section(load) is asked by its name"
            )
        mesh = Mesh(self.nodes, self.elements, self.held, self.pressed, np.zeros(0, dtype=np.int64))
        constraints = AxialConstraints(self.forces, self.planes, self.controlled, observed, self.contacts)
        return finite_element_model(mesh, constraints)

    def has_topology_of(self, other: Section) -> bool:
        """Whether two sections differ in the places of their nodes, and in the sizes of their forces, alone."""
        names = ("elements", "held", "pressed")
        same = all(np.array_equal(getattr(self, name), getattr(other, name)) for name in names)
        same &= len(self.planes) == len(other.planes)
        same &= (self.controlled, self.motion) == (other.controlled, other.motion)
        same &= all(np.array_equal(one, two) for one, two in zip(self.planes, other.planes, strict=False))
        same &= len(self.contacts) == len(other.contacts)
        for one, two in zip(self.contacts, other.contacts, strict=False):
            same &= one[1:] == two[1:] and np.array_equal(one.sides, two.sides)
        return same and dict(self.points) == dict(other.points)

    def _nodes_of(self, name: str) -> Ints:
        if name in self.points:
            return np.array([self.points[name]])
        if name not in self.sides:
            known = (*self.sides, *self.points)
            raise SolveError(f"a section has no side or point '{name}'; {nearest(name, known)}")
        return np.unique(self.sides[name])


def _side(section: Section, name: str) -> Ints:
    """The element sides (edges, 3) of a name; SolveError for an unknown one."""
    refuse_unknown(name, section.sides, SolveError, f"a section has no side '{name}'")
    return np.asarray(section.sides[name])


def _breaks(count: int | ArrayLike) -> Floats:
    """Boundaries of elements, from 0 to 1."""
    if np.ndim(count) == 0:
        number = float(np.asarray(count))
        if not (math.isfinite(number) and number == int(number) >= 1):
            raise SolveError(f"the number of elements in a row is {count!r}; allowed are whole numbers from 1 on")
        check_elements(int(number))
        return np.linspace(0.0, 1.0, int(np.asarray(count)) + 1)
    breaks = np.asarray(count, dtype=float)
    if breaks.ndim != 1 or breaks.size < 2 or breaks[0] != 0.0 or breaks[-1] != 1.0 or (np.diff(breaks) <= 0.0).any():
        raise SolveError("boundaries of elements must rise from 0 to 1, such as (0, 0.5, 1)")
    return breaks


def _with_middles(breaks: Floats) -> Floats:
    """Boundaries and middles of elements in turn."""
    fine = np.empty(2 * breaks.size - 1)
    fine[::2], fine[1::2] = breaks, 0.5 * (breaks[:-1] + breaks[1:])
    return fine


def _shares_of_area(nodes: Floats, edges: Ints) -> Floats:
    """Integrals (edges, 3) of N r over the length of each element side, mm^2: the area over 2 pi is their sum.

    nodes : (nodes, 2) mm. edges : (edges, 3).
    """
    at = nodes[edges]  # (edges, 3, 2)
    radius = at[:, :, 0] @ SIDE_VALUES.T
    length = np.linalg.norm(np.einsum("gn,eni->egi", SIDE_SLOPES, at), axis=2)
    return np.asarray((SIDE_WEIGHTS * radius * length) @ SIDE_VALUES)
