"""The finite element model of a mesh: equation numbers, and what the compiled core reads of it."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np

from creepkit.arrays import Bools, Floats, Ints
from creepkit.core import CoreStructure, address
from creepkit.errors import SolveError
from creepkit.fem.mesh import SIDES, GeometryDerivative, Mesh, discretize

TILE = 8
"""Side of the tiles in which the core keeps banded matrices."""


class RigidContact(NamedTuple):
    """A rigid circle of the section that sides may touch without friction: a sphere on the axis, or a ring.

    sides : (edges, 3) first, middle and last node of the element sides that may touch it.
    centre, edge : nodes, of no element: its centre and a point of it.
    stiffness : MPa/mm, pressure for each mm that it is penetrated. smoothing : mm, gap at which pressure begins; at a
        penetration of as much its slope is the stiffness.
    moves : whether it moves freely along the axis; then centre and edge must be a plane.
    """

    sides: Ints
    centre: int
    edge: int
    stiffness: float
    smoothing: float
    moves: bool


@dataclass(frozen=True, eq=False)
class SensitivityDirections:
    """What is differentiated to beside the P parameters of the law: C = P + D + G columns.

    segments : (D, segments, 10) change of the load history's segments, in the units of their columns.
    gradients : (G, elements, 4, 2, 2) and
    hoops : (G, elements, 4), see fem.mesh.GeometryDerivative.
    velocities : (G, 2 nodes) mm, all three for each unit of a number of the geometry.
    forces : (G, nodes, 2) N/rad, change of the dead forces of a unit of the load, for each unit of that number; None
        where there are no such forces, or they stay.
    """

    segments: Floats
    gradients: Floats
    hoops: Floats
    velocities: Floats
    forces: Floats | None = None


@dataclass(frozen=True, eq=False)
class AxialConstraints:
    """Dead forces on a mesh, faces that stay plane, rigid bodies it touches, and what is observed.

    forces : (nodes, 2) N/rad in r and z for a unit of the load, whatever the deformation; None for none.
    planes : of each face (nodes,) that have one u_z.
    controlled : number of the plane whose u_z is the motion of the load history; None for none.
    observed : (observed,) displacements, 2 node + 0 for u_r or + 1 for u_z; None for u_z of the mesh's top.
    contacts : rigid circles that the mesh may touch, of which one at most moves.
    """

    forces: Floats | None = None
    planes: tuple[Ints, ...] = ()
    controlled: int | None = None
    observed: Ints | None = None
    contacts: tuple[RigidContact, ...] = ()


@dataclass(frozen=True, eq=False)
class FiniteElementModel:
    """A mesh ready to be simulated; displacements are kept as (2 nodes,) numbers, u_r and u_z in turn.

    nodes : (nodes, 2) mm, radius r and height z. elements : (elements, 8) nodes of each element.
    by_radius, by_height, over_radius : (elements, 4, 8) 1/mm, see fem.mesh.Discretization.
    weights : (elements, 4) mm^3, area of the section that belongs to a point, times its radius.
    equations : (2 nodes,) number of the equation of a displacement, -1 where it is held; one for all u_z of a plane.
    size, width : number of equations, half-bandwidth.
    pressed : (edges, 3) nodes of the sides under pressure. top : (top,) nodes of the observed surface.
    observed : (observed,) observed displacements, 2 node + 0 for u_r or + 1 for u_z.
    dead : (size,) N/rad on each equation for a unit of the load, or (0,).
    controlled : number of the equation whose displacement is the motion; -1 for none.
    contacts : (contact sides, 5) nodes of a side that may touch a rigid circle, of its centre and of a point of it.
    contact_laws : (contact sides, 2) MPa/mm and mm, stiffness and smoothing of that contact.
    bordered : number of the equation, the last, of a circle that moves freely; -1 for none.
    """

    nodes: Floats
    elements: Ints
    by_radius: Floats
    by_height: Floats
    over_radius: Floats
    weights: Floats
    equations: Ints
    size: int
    width: int
    pressed: Ints
    top: Ints
    observed: Ints
    dead: Floats = field(default_factory=lambda: np.zeros(0))
    controlled: int = -1
    contacts: Ints = field(default_factory=lambda: np.zeros((0, 5), dtype=np.int64))
    contact_laws: Floats = field(default_factory=lambda: np.zeros((0, 2)))
    bordered: int = -1

    entry: ClassVar[str] = "creepkit_simulate"
    """The function of the core that simulates it."""

    @cached_property
    def compiled(self) -> CompiledModel:
        """The model as the core reads it; made once."""
        return CompiledModel(self)

    @property
    def displacement_count(self) -> int:
        """Numbers of a state of displacement."""
        return self.equations.size

    @property
    def point_count(self) -> int:
        """Points whose state is kept."""
        return self.weights.size

    @property
    def observed_count(self) -> int:
        """Observed displacements, and the force of a controlled one."""
        return self.observed.size + (self.controlled >= 0)

    def held_motion(self, pattern: Floats | None) -> Floats:
        """Displacement of the held nodes for a unit of motion, (2 nodes,), mm.

        pattern : (nodes, 2) mm, the same node by node; None for no motion but that of the controlled displacement.
        """
        if pattern is not None:
            return np.ravel(pattern)
        return np.where((self.equations >= 0) & (self.equations == self.controlled), 1.0, 0.0)

    def displacements(self, coordinates: Floats) -> Floats:
        """Displacements of the nodes, (steps, nodes, 2), mm.

        coordinates : (steps, displacement_count) mm, what the core keeps of each step.
        """
        return coordinates.reshape(len(coordinates), -1, 2)

    def core_directions(self, directions: SensitivityDirections) -> tuple[Floats, Floats, Floats, Floats]:
        """What the core needs of directions that move the nodes, for each unit of the G numbers of the geometry.

        Velocity gradients (G, elements, 4, 2, 2) and hoop strains (G, elements, 4) of all points, those of the copy
        included (see CompiledModel), velocities (G, 2 nodes) of the nodes, mm, and changes (G, size or 0) of the dead
        forces, N/rad.
        """
        padded = self.compiled.padded
        gradients, hoops = (
            np.array([padded(a) for a in values]) for values in (directions.gradients, directions.hoops)
        )
        forces = np.zeros((len(gradients), self.dead.size))
        if directions.forces is not None and self.dead.size:
            forces = np.array([self.on_equations(each) for each in directions.forces]).reshape(forces.shape)
        return gradients, hoops, directions.velocities, forces

    def geometry_derivative(self, velocity: Floats) -> GeometryDerivative:
        """What exact shape derivatives need when the nodes move.

        velocity : (nodes, 2) mm for each unit of the number of the geometry.
        """
        moves = velocity[self.elements]
        slopes = (self.by_radius, self.by_height)
        gradient = np.stack([np.einsum("epa,eai->epi", each, moves) for each in slopes], axis=3)
        return GeometryDerivative(gradient, np.einsum("epa,ea->ep", self.over_radius, moves[:, :, 0]))

    def on_equations(self, forces: Floats) -> Floats:
        """Forces (size,) on the equations, N/rad; forces : (nodes, 2) N/rad on the nodes."""
        free = self.equations >= 0
        return np.asarray(np.bincount(self.equations[free], np.ravel(forces)[free], self.size), dtype=float)

    def __getstate__(self) -> dict[str, object]:
        """All but the addresses for the core, which another process makes for itself."""
        return {name: value for name, value in self.__dict__.items() if name != "compiled"}


def finite_element_model(mesh: Mesh, constraints: AxialConstraints | None = None) -> FiniteElementModel:
    """Prepare a mesh; refuse one that is empty or inverted, that nothing holds or that is pressed from within.

    constraints : dead forces, faces that stay plane and what is observed; without them u_z of the top is.
    """
    constraints = constraints or AxialConstraints()
    if not mesh.elements.size:
        raise SolveError("the mesh has no elements; give the eight nodes of each")
    at = discretize(mesh)
    _refuse_wrong_sides(mesh)
    free = ~mesh.held.ravel()
    if free.all() or not mesh.held[:, 1].any():
        raise SolveError("nothing holds the mesh along its axis; hold u_z somewhere")
    equations = _equation_numbers(free, constraints.planes)
    numbers = equations[np.stack([2 * mesh.elements, 2 * mesh.elements + 1], axis=1)]
    controlled = -1
    if constraints.controlled is not None:
        controlled = int(equations[2 * constraints.planes[constraints.controlled][0] + 1])
    observed = 2 * mesh.top + 1 if constraints.observed is None else np.asarray(constraints.observed, dtype=np.int64)
    model = FiniteElementModel(
        nodes=mesh.nodes,
        elements=mesh.elements,
        by_radius=at.by_radius,
        by_height=at.by_height,
        over_radius=np.ascontiguousarray(at.over_radius),
        weights=np.ascontiguousarray(at.weights),
        equations=equations,
        size=int(equations.max(initial=-1)) + 1,
        width=_half_bandwidth(numbers.reshape(len(numbers), 16)),
        pressed=mesh.pressed,
        top=mesh.top,
        observed=observed,
        controlled=controlled,
    )
    if constraints.contacts:
        model = _with_contacts(model, constraints.contacts)
    if constraints.forces is None or not constraints.forces.any():
        return model
    return replace(model, dead=model.on_equations(constraints.forces))


def _with_contacts(model: FiniteElementModel, contacts: Sequence[RigidContact]) -> FiniteElementModel:
    """The model with what it may touch; SolveError unless a circle that moves has the last equation."""
    moving = [2 * each.centre + 1 for each in contacts if each.moves]
    if len(moving) > 1:
        raise SolveError(f"{len(moving)} rigid bodies of a section move freely; allowed is one")
    bordered = int(model.equations[moving[0]]) if moving else -1
    if moving and bordered != model.size - 1:
        raise SolveError("the rigid body that moves must have the last node of the mesh that is free")
    rows = [np.hstack([each.sides, np.tile([each.centre, each.edge], (len(each.sides), 1))]) for each in contacts]
    laws = [np.tile([each.stiffness, each.smoothing], (len(each.sides), 1)) for each in contacts]
    return replace(model, contacts=np.vstack(rows), contact_laws=np.vstack(laws), bordered=bordered)


def _equation_numbers(free: Bools, planes: Sequence[Ints]) -> Ints:
    """Number of the equation of each displacement, (2 nodes,), -1 where it is held.

    free : (2 nodes,) whether it is not. planes : of each face (nodes,) with one u_z, of which none may be held.
    """
    master = np.arange(free.size)
    for nodes in planes:
        axial = 2 * np.unique(nodes) + 1
        if not free[axial].all():
            raise SolveError("a face that stays plane has a node whose u_z is held; hold the face or let it move")
        if (master[axial] != axial).any():
            raise SolveError("two faces that stay plane share a node; make one face of them")
        master[axial] = axial[0]
    own = free & (master == np.arange(free.size))
    return np.where(free, (np.cumsum(own) - 1)[master], -1)


def _refuse_wrong_sides(mesh: Mesh) -> None:
    """Refuse a pressed side that is no side of the outline, or runs the wrong way: its pressure would be suction."""
    sides = {tuple(side) for side in mesh.elements[:, SIDES].reshape(-1, 3).tolist()}
    for first, middle, last in mesh.pressed.tolist():
        forward, backward = (first, middle, last) in sides, (last, middle, first) in sides
        if forward and not backward:
            continue
        which = f"the pressed side of nodes {first}, {middle} and {last}"
        if backward and not forward:
            raise SolveError(
                f"{which} runs against the order of its element, so that pressure would pull at it; give its nodes in "
                f"the order {last}, {middle}, {first}"
            )
        where = "lies between two elements" if forward else "is no side of an element"
        raise SolveError(f"{which} {where}; name the first, middle and last node of sides of the outline")


class _ModelStructure(CoreStructure):
    """Mirrors FiniteElementModel of src/core/finite_element_model.hpp."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in (
            "elements", "nodes", "size", "half_bandwidth", "pressed", "observed", "controlled", "dead_forces",
            "contact_sides", "bordered",
        )),
        *((name, ctypes.c_void_p) for name in (
            "coordinates", "by_radius", "by_height", "over_radius", "weights", "points_first", "connectivity",
            "equations", "tied", "places", "pressed_nodes", "pressed_places", "observed_displacements", "dead",
            "contacts", "contact_laws",
        )),
    )  # fmt: skip


class CompiledModel:
    """Arrays of a model in the order of the core; elements in pairs, an odd last one followed by a copy of no weight.

    elements : number of them, the copy included. structure : for calls of the core.
    """

    def __init__(self, model: FiniteElementModel) -> None:
        pad = len(model.elements) % 2
        self.elements = len(model.elements) + pad
        by_radius, by_height, over_radius = (
            self.padded(a) for a in (model.by_radius, model.by_height, model.over_radius)
        )
        shapes = np.stack([by_radius, by_height, over_radius])  # (3, elements, points, nodes)
        paired = shapes.reshape(3, -1, 8, 8).transpose(1, 3, 0, 2)  # (pairs, nodes, 3, points)
        weights = self.padded(model.weights).copy()
        weights[len(model.elements) :] = 0.0
        connectivity = self.padded(model.elements)
        numbers = model.equations[np.stack([2 * connectivity, 2 * connectivity + 1], axis=1)]
        sides = model.equations[np.stack([2 * model.pressed, 2 * model.pressed + 1], axis=1)]
        self._kept = {
            "coordinates": model.nodes,
            "by_radius": by_radius,
            "by_height": by_height,
            "over_radius": over_radius,
            "weights": weights,
            "points_first": paired,
            "connectivity": connectivity,
            "equations": model.equations,
            "tied": _shares_equation(numbers).astype(np.int64),
            "places": _places(numbers, model.size, model.width),
            "pressed_nodes": model.pressed,
            "pressed_places": _places(sides, model.size, model.width),
            "observed_displacements": model.observed,
            "dead": model.dead,
            "contacts": model.contacts,
            "contact_laws": model.contact_laws,
        }
        self._kept = {name: np.ascontiguousarray(array) for name, array in self._kept.items()}
        self.structure = _ModelStructure(
            self.elements, len(model.nodes), model.size, model.width, len(model.pressed), len(model.observed),
            model.controlled, len(model.dead), len(model.contacts), model.bordered,
            *(address(array) for array in self._kept.values()),
        )  # fmt: skip

    def padded(self, values: Any) -> Any:
        """Values (elements, ...) of the elements, in any unit, with those of the copy."""
        return np.concatenate([values, values[-1:]]) if len(values) < self.elements else values


def _half_bandwidth(numbers: Ints) -> int:
    """Largest distance between two equations of one element; numbers : (elements, unknowns), -1 where held."""
    high = numbers.max(axis=1)
    low = np.where(numbers >= 0, numbers, np.iinfo(np.int64).max).min(axis=1)
    return int(np.max(np.where(high >= 0, high - low, 0), initial=0))


def _shares_equation(numbers: Ints) -> Bools:
    """Whether two displacements of an element have one equation, (elements,).

    numbers : (elements, 2, nodes) of the equations, -1 where held.
    """
    ordered = np.sort(numbers.reshape(len(numbers), -1), axis=1)
    return np.asarray(((ordered[:, 1:] == ordered[:, :-1]) & (ordered[:, 1:] >= 0)).any(axis=1))


def _places(numbers: Ints, size: int, width: int) -> Ints:
    """Places (elements, 3, nodes, nodes) of the blocks rr, rz, zz in the lower triangle in tiles.

    numbers : (elements, 2, nodes) of the equations, -1 where held. What belongs to held displacements goes to the place
        behind the last, and so does the second half of the blocks rr and zz, which is the same as the first, but where
        two displacements share an equation. The tiles are those of banded_matrix.hpp of the core.
    """
    blocks, diagonals = -(-size // TILE), -(-width // TILE) + 1
    unused = (blocks + diagonals) * diagonals * TILE**2
    result = []
    for i, j in ((0, 0), (0, 1), (1, 1)):
        one, other = numbers[:, i, :, None], numbers[:, j, None, :]
        column, row = np.minimum(one, other), np.maximum(one, other)
        tile = (column // TILE) * diagonals + row // TILE - column // TILE
        second = np.tri(one.shape[1], k=-1, dtype=bool) & (one != other) if i == j else False
        wanted = (column >= 0) & ~np.asarray(second)
        result.append(np.where(wanted, tile * TILE**2 + (column % TILE) * TILE + row % TILE, unused))
    return np.stack(result, axis=1)
