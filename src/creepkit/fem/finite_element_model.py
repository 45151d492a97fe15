"""The finite element model of a mesh: equation numbers, and what the compiled core reads of it."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.core import CoreStructure, address
from creepkit.errors import SolveError
from creepkit.fem.mesh import SIDES, Mesh, discretize
from creepkit.fem.solvable_model import SensitivityDirections

TILE = 8
"""Side of the tiles in which the core keeps banded matrices."""


@dataclass(frozen=True, eq=False)
class FiniteElementModel:
    """A mesh ready to be simulated; displacements are kept as (2 nodes,) numbers, u_r and u_z in turn.

    nodes : (nodes, 2) mm, radius r and height z. elements : (elements, 8) nodes of each element.
    by_radius, by_height, over_radius : (elements, 4, 8) 1/mm, see fem.mesh.Discretization.
    weights : (elements, 4) mm^3, area of the section that belongs to a point, times its radius.
    equations : (2 nodes,) number of the equation of a displacement, -1 where it is held.
    size, width : number of equations, half-bandwidth.
    pressed : (edges, 3) nodes of the sides under pressure. top : (top,) nodes of the observed surface.
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
        """Nodes of the observed surface."""
        return self.top.size

    def held_motion(self, pattern: Floats | None) -> Floats:
        """Displacement of the held nodes for a unit of motion, (2 nodes,), mm.

        pattern : (nodes, 2) mm, the same node by node; None for no motion.
        """
        return np.zeros(self.equations.size) if pattern is None else np.ravel(pattern)

    def displacements(self, coordinates: Floats) -> Floats:
        """Displacements of the nodes, (steps, nodes, 2), mm.

        coordinates : (steps, displacement_count) mm, what the core keeps of each step.
        """
        return coordinates.reshape(len(coordinates), -1, 2)

    def core_directions(self, directions: SensitivityDirections) -> tuple[Floats, Floats, Floats]:
        """What the core needs of directions that move the nodes, for each unit of the G numbers of the geometry.

        Velocity gradients (G, elements, 4, 2, 2) and hoop strains (G, elements, 4) of all points, those of the copy
        included (see CompiledModel), and velocities (G, 2 nodes) of the nodes, mm.
        """
        padded = self.compiled.padded
        gradients, hoops = (
            np.array([padded(a) for a in values]) for values in (directions.gradients, directions.hoops)
        )
        return gradients, hoops, directions.velocities

    def __getstate__(self) -> dict[str, object]:
        """All but the addresses for the core, which another process makes for itself."""
        return {name: value for name, value in self.__dict__.items() if name != "compiled"}


def finite_element_model(mesh: Mesh) -> FiniteElementModel:
    """Prepare a mesh; refuse one that is empty or inverted, that nothing holds or that is pressed from within."""
    if not mesh.elements.size:
        raise SolveError("the mesh has no elements; give the eight nodes of each")
    at = discretize(mesh)
    _refuse_wrong_sides(mesh)
    free = ~mesh.held.ravel()
    if free.all() or not mesh.held[:, 1].any():
        raise SolveError("nothing holds the mesh along its axis; hold u_z somewhere")
    equations = np.where(free, np.cumsum(free) - 1, -1)
    numbers = equations[np.stack([2 * mesh.elements, 2 * mesh.elements + 1], axis=1)]
    return FiniteElementModel(
        nodes=mesh.nodes,
        elements=mesh.elements,
        by_radius=at.by_radius,
        by_height=at.by_height,
        over_radius=np.ascontiguousarray(at.over_radius),
        weights=np.ascontiguousarray(at.weights),
        equations=equations,
        size=int(free.sum()),
        width=_half_bandwidth(numbers.reshape(len(numbers), 16)),
        pressed=mesh.pressed,
        top=mesh.top,
    )


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
        *((name, ctypes.c_int64) for name in ("elements", "nodes", "size", "half_bandwidth", "pressed", "observed")),
        *((name, ctypes.c_void_p) for name in (
            "coordinates", "by_radius", "by_height", "over_radius", "weights", "points_first", "connectivity",
            "equations", "places", "pressed_nodes", "pressed_places", "observed_nodes",
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
            "places": _places(numbers, model.size, model.width),
            "pressed_nodes": model.pressed,
            "pressed_places": _places(sides, model.size, model.width),
            "observed_nodes": model.top,
        }
        self._kept = {name: np.ascontiguousarray(array) for name, array in self._kept.items()}
        self.structure = _ModelStructure(
            self.elements, len(model.nodes), model.size, model.width, len(model.pressed), len(model.top),
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


def _places(numbers: Ints, size: int, width: int) -> Ints:
    """Places (elements, 3, nodes, nodes) of the blocks rr, rz, zz in the lower triangle in tiles.

    numbers : (elements, 2, nodes) of the equations, -1 where held. What belongs to held displacements goes to the place
        behind the last. The tiles are those of banded_matrix.hpp of the core.
    """
    blocks, diagonals = -(-size // TILE), -(-width // TILE) + 1
    unused = (blocks + diagonals) * diagonals * TILE**2
    result = []
    for i, j in ((0, 0), (0, 1), (1, 1)):
        one, other = numbers[:, i, :, None], numbers[:, j, None, :]
        column, row = np.minimum(one, other), np.maximum(one, other)
        tile = (column // TILE) * diagonals + row // TILE - column // TILE
        result.append(np.where(column >= 0, tile * TILE**2 + (column % TILE) * TILE + row % TILE, unused))
    return np.stack(result, axis=1)
