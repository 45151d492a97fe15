"""A reduced-order model of a body: few modes of displacement, integrals over few weighted points.

A ReducedBasis is what is trained (see `fem.reduced_order_training`); together with the finite element model of a mesh
with the same numbering it gives the ReducedOrderModel that the compiled core simulates. Nodes may lie elsewhere than in
training: modes are displacements of nodes, and gradients and weights of the points follow from the mesh at hand.
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from creepkit.arrays import Floats, Ints, frozen, set_fields
from creepkit.core import CoreStructure, address
from creepkit.errors import SolveError
from creepkit.fem.finite_element_model import FiniteElementModel, SensitivityDirections
from creepkit.fem.mesh import SIDE_SLOPES, SIDE_VALUES, SIDE_WEIGHTS

BLOCK = 8
"""Modes and points are kept in blocks of so many."""


@dataclass(frozen=True, eq=False)
class ReducedBasis:
    """Modes and points of a reduced-order model.

    modes : (modes, nodes, 2) mm, zero where a displacement is held.
    points : (points,) number 4 element + point of each integration point that is used.
    factors : (points, 5, 5) by which its first Piola-Kirchhoff stress 11, 12, 21, 22, 33 is multiplied, beside its
        weight in finite elements.
    """

    modes: Floats
    points: Ints
    factors: Floats

    def __post_init__(self) -> None:
        set_fields(self, modes=frozen(self.modes), points=frozen(self.points, dtype=np.int64))
        object.__setattr__(self, "factors", frozen(self.factors))

    def leading(self, count: int) -> ReducedBasis:
        """The first modes, at the same points: a coarser basis."""
        return ReducedBasis(self.modes[:count], self.points, self.factors)


def mode_gradients(model: FiniteElementModel, modes: Floats, points: Ints) -> Floats:
    """Changes (points, 5, modes) of the deformation gradient's F11, F12, F21, F22 and F33 with each mode.

    modes : (modes, nodes, 2) mm. points : (points,) number 4 element + point of each integration point.
    """
    element, place = points // 4, points % 4
    nodes = model.elements[element]
    by_radius, by_height, over_radius = (
        shapes[element, place][:, None] for shapes in (model.by_radius, model.by_height, model.over_radius)
    )
    radial, axial = (np.moveaxis(modes[:, :, i], 0, 1)[nodes] for i in (0, 1))  # (points, 8, modes)
    parts = ((by_radius, radial), (by_height, radial), (by_radius, axial), (by_height, axial), (over_radius, radial))
    return np.concatenate([shapes @ values for shapes, values in parts], axis=1)


@dataclass(frozen=True, eq=False)
class ReducedOrderModel:
    """A reduced-order model of one mesh, ready to be simulated as a FiniteElementModel is.

    model : finite elements of the mesh. basis : modes and points of that mesh or of one with the same numbering.
    """

    model: FiniteElementModel
    basis: ReducedBasis

    entry: ClassVar[str] = "creepkit_simulate_reduced"
    """The function of the core that simulates it."""

    def __post_init__(self) -> None:
        if self.basis.modes.shape[1:] != self.model.nodes.shape:
            raise SolveError(
                f"the modes are those of a mesh of {self.basis.modes.shape[1]} nodes, the mesh at hand has "
                f"{len(self.model.nodes)}; train a reduced-order model for it"
            )

    @cached_property
    def compiled(self) -> CompiledReducedModel:
        """The model as the core reads it; made once."""
        return CompiledReducedModel(self.model, self.basis)

    @property
    def displacement_count(self) -> int:
        """Numbers of a state of displacement: those of the modes, in whole blocks."""
        return self.compiled.width

    @property
    def point_count(self) -> int:
        """Points whose state is kept."""
        return self.basis.points.size

    @property
    def observed_count(self) -> int:
        """Nodes of the observed surface."""
        return self.model.top.size

    def held_motion(self, pattern: Floats | None) -> Floats:
        """Nothing, (0,): held nodes stay where they are; SolveError for a pattern (nodes, 2) of motion, mm."""
        if pattern is not None:
            raise SolveError("a reduced-order model does not move held nodes; simulate its finite elements")
        return np.zeros(0)

    def displacements(self, coordinates: Floats) -> Floats:
        """Displacements of the nodes, (steps, nodes, 2), mm.

        coordinates : (steps, displacement_count) factors of the modes, those added up to whole blocks last.
        """
        modes = self.basis.modes
        return np.asarray(coordinates[:, : len(modes)] @ modes.reshape(len(modes), -1)).reshape(-1, *modes.shape[1:])

    def core_directions(self, directions: SensitivityDirections) -> tuple[Floats, Floats, Floats, Floats]:
        """What the core needs of directions that move the nodes, for each unit of the G numbers of the geometry.

        Velocity gradients (G, points, 2, 2) and hoop strains (G, points) of the points in whole blocks, and changes
        (G, side points, 3) of r, dr/dx and dz/dx at the Gauss points of the pressed sides at rest, mm; no dead forces.
        """
        chosen, count = self.compiled.points, len(directions.velocities)
        gradients = directions.gradients.reshape(count, self.model.weights.size, 2, 2)[:, chosen]
        hoops = directions.hoops.reshape(count, self.model.weights.size)[:, chosen]
        velocities = directions.velocities.reshape(count, *self.model.nodes.shape)
        at_sides = velocities[:, self.model.pressed]  # (G, sides, 3, 2)
        changes = [at_sides[..., 0] @ SIDE_VALUES.T, *(at_sides[..., i] @ SIDE_SLOPES.T for i in (0, 1))]
        sides = np.stack(changes, axis=-1).reshape(count, 3 * len(self.model.pressed), 3)
        return gradients, hoops, sides, np.zeros((count, 0))


class _ModelStructure(CoreStructure):
    """Mirrors ReducedOrderModel of src/core/reduced_order_model.hpp."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("modes", "points", "side_points", "observed", "limited", "measured")),
        *((name, ctypes.c_void_p) for name in (
            "gradients", "points_first", "weights", "factors", "sides", "side_modes", "surface", "measures",
        )),
    )  # fmt: skip


class CompiledReducedModel:
    """Arrays of a reduced-order model in the order of the core.

    width : modes in whole blocks.
    points : (points,) number of each one used, with copies of the first without weight up to whole blocks.
    arrays : {field of the core's model: array}. structure : for calls of the core.
    """

    def __init__(self, model: FiniteElementModel, basis: ReducedBasis) -> None:
        modes, count = basis.modes, len(basis.modes)
        self.width = -(-count // BLOCK) * BLOCK
        pad = -basis.points.size % BLOCK
        self.points = np.concatenate([basis.points, np.repeat(basis.points[:1], pad)])
        narrow = mode_gradients(model, modes, self.points)
        by_block = narrow.reshape(-1, BLOCK, 5, count).transpose(0, 3, 2, 1)
        weights = model.weights.ravel()[self.points] * (np.arange(self.points.size) < basis.points.size)
        factors = basis.factors[np.minimum(np.arange(self.points.size), basis.points.size - 1)]
        sides, side_modes = _sides(model, modes)
        observed = modes[:, model.top, 1]
        limited = _in_blocks(observed if model.top.size else modes.reshape(count, -1))
        pressed = modes[:, np.unique(model.pressed)].reshape(count, -1)
        kept = {
            "gradients": self._padded(narrow),
            "points_first": by_block,
            "weights": weights,
            "factors": factors.reshape(-1, BLOCK, 25).transpose(0, 2, 1),
            "sides": sides,
            "side_modes": self._padded(side_modes),
            "surface": self._padded(observed.T),
            "measures": np.concatenate([limited, _in_blocks(pressed)], axis=1),
        }
        self.arrays = {name: np.ascontiguousarray(array, dtype=float) for name, array in kept.items()}
        self.structure = _ModelStructure(
            count, self.points.size, len(sides), model.top.size, limited.shape[1], self.arrays["measures"].shape[1],
            *(address(array) for array in self.arrays.values()),
        )  # fmt: skip

    def _padded(self, values: Floats) -> Floats:
        """Values (..., modes) with zeros for the modes added, (..., width)."""
        return np.pad(values, [(0, 0)] * (values.ndim - 1) + [(0, self.width - values.shape[-1])])


def _in_blocks(values: Floats) -> Floats:
    """Values (modes, displacements) with zeros up to whole blocks."""
    return np.pad(values, ((0, 0), (0, -values.shape[1] % BLOCK)))


def _sides(model: FiniteElementModel, modes: Floats) -> tuple[Floats, Floats]:
    """Gauss points of the sides under pressure, x from -1 to 1 along each side.

    (points, 4) weight, then r, dr/dx and dz/dx at rest, mm; (points, 4, modes) changes of u_r, u_z, du_r/dx and du_z/dx
    with each of the modes (modes, nodes, 2), mm.
    """
    at_rest, moving = model.nodes[model.pressed], np.moveaxis(modes, 0, -1)[model.pressed]  # (sides, 3, 2, modes)
    rest = [at_rest[..., 0] @ SIDE_VALUES.T, *(at_rest[..., i] @ SIDE_SLOPES.T for i in (0, 1))]
    weights = np.broadcast_to(SIDE_WEIGHTS, rest[0].shape)
    parts = [np.einsum("gn,snm->sgm", shapes, moving[:, :, i])
             for shapes in (SIDE_VALUES, SIDE_SLOPES) for i in (0, 1)]  # fmt: skip
    return np.stack([weights, *rest], axis=-1).reshape(-1, 4), np.stack(parts, axis=2).reshape(-1, 4, len(modes))
