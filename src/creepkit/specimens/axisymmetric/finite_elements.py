"""AxisymmetricTest: one test of an axisymmetric specimen, whose author states section and observation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TypeVar

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import SolveError
from creepkit.fem.finite_element_model import FiniteElementModel
from creepkit.fem.mesh import GeometryDerivative, Mesh, geometry_derivative
from creepkit.fem.section import Section
from creepkit.fem.simulation import Simulation
from creepkit.records import Output, dimension_named
from creepkit.specimens.axisymmetric.displacements import Displacements
from creepkit.specimens.axisymmetric.settings import AxisymmetricSettings
from creepkit.specimens.finite_element_tests import FiniteElementTest

LENGTH_STEP = 1e-4
"""Relative step of central differences of meshes and of outputs to a length; nodes are nearly linear in lengths."""

DISPLACEMENT_STEP = 1e-4
"""Relative step, of the largest of it, of central differences of outputs to an observed displacement."""

_Made = TypeVar("_Made")


def _kept(make: Callable[..., _Made]) -> Callable[..., _Made]:
    """What is made of a test piece, kept, for a fit needs it a thousand times; made anew for one without a hash."""
    cached = lru_cache(maxsize=256)(make)

    def made(piece: AxisymmetricSettings, *names: str) -> _Made:
        try:
            hash(piece)
        except TypeError:
            return make(piece, *names)
        return cached(piece, *names)

    return made


@dataclass(frozen=True, eq=False)
class PreparedSection:
    """A section ready to be simulated; order : the displacements that are observed, 2 node + component."""

    section: Section
    model: FiniteElementModel
    order: tuple[int, ...]


@_kept
def prepared_section(piece: AxisymmetricSettings, load: str) -> PreparedSection:
    """The section of a test piece; SolveError, beginning with the specimen's name, where it cannot be made."""
    try:
        section = piece.section(load)
        notes = Displacements(section)
        with np.errstate(all="ignore"):
            found = piece.observe(notes)
        for name in piece.outputs:
            if name not in found:
                raise SolveError(f"observe() gave no '{name}'; it gives {', '.join(piece.outputs)}")
        order = tuple(sorted(set(notes.asked)))
        return PreparedSection(section, section.model(np.array(order, dtype=np.int64)), order)
    except SolveError as error:
        raise SolveError(f"specimen '{piece.name}' under {load}: {error}") from error


@dataclass(frozen=True, eq=False)
class AxisymmetricTest(FiniteElementTest):
    """One test of an axisymmetric specimen."""

    piece: AxisymmetricSettings

    @classmethod
    def model_of(cls, piece: AxisymmetricSettings, load: str) -> FiniteElementModel:
        """The finite elements of the section under a load."""
        return prepared_section(piece, load).model

    @classmethod
    def motion_of(cls, piece: AxisymmetricSettings, load: str) -> float | None:
        """mm of u_z for a unit of the load, where it moves a side."""
        section = prepared_section(piece, load).section
        return None if section.controlled is None else section.motion

    @cached_property
    def body(self) -> PreparedSection:
        """The section."""
        return prepared_section(self.piece, self.history.loading.quantity)

    @property
    def outputs(self) -> tuple[Output, ...]:
        """Those of the specimen."""
        return self.piece.outputs

    def quantities(self, simulation: Simulation) -> Floats:
        """What is observed in each accepted step, (steps, observed): displacements, mm, then the force, N."""
        flat = simulation.displacements.reshape(len(simulation.times), -1)
        columns = [flat[:, list(self.body.order)]]
        if self.body.section.controlled is not None:
            columns.append(2.0 * np.pi * simulation.reactions[:, None])
        return np.concatenate(columns, axis=1)

    def observed(self, simulation: Simulation) -> Floats:
        """Outputs in each accepted step, (steps, outputs)."""
        return self._observe(self.piece, self.quantities(simulation))

    def differentiated(self, simulation: Simulation) -> tuple[Floats, Floats]:
        """As `observed`, and derivatives (steps, outputs, columns): central differences of the author's function."""
        assert simulation.sensitivities is not None
        quantities, change = self.quantities(simulation), np.array(simulation.sensitivities)
        if self.body.section.controlled is not None:
            change[:, -1] *= 2.0 * np.pi
        slopes = [np.zeros((len(quantities), len(self.outputs), 0))]
        for k in range(quantities.shape[1]):
            move = np.zeros(quantities.shape[1])
            move[k] = DISPLACEMENT_STEP * max(float(np.abs(quantities[:, k]).max()), self.piece.resolution)
            up, down = (self._observe(self.piece, quantities + sign * move) for sign in (1.0, -1.0))
            slopes.append(((up - down) / (2.0 * move[k]))[..., None])
        columns = self.columns(simulation, np.concatenate(slopes, axis=-1), change)
        return self._observe(self.piece, quantities), columns

    def _observe(self, piece: AxisymmetricSettings, quantities: Floats) -> Floats:
        """Outputs (steps, outputs) in their units, from what is observed, quantities (steps, observed), mm and N."""
        found = piece.observe(Displacements(self.body.section, quantities, self.body.order))
        rows = [np.broadcast_to(np.asarray(found[name], dtype=float), len(quantities)) for name in piece.outputs]
        return np.stack(rows, axis=1)

    def length_derivative(self, key: str, simulation: Simulation) -> Floats:
        """Derivative (steps, outputs) of the outputs to a length at the same displacements."""
        longer, shorter, step = _neighbours(self.piece, key)
        up, down = (self._observe(piece, self.quantities(simulation)) for piece in (longer, shorter))
        return (up - down) / (2.0 * step)

    def movement(self, key: str) -> tuple[GeometryDerivative, Floats, Floats]:
        """How points, nodes (nodes, 2), mm, and dead forces (nodes, 2), N/rad, move with a length."""
        return _movement(self.piece, self.history.loading.quantity, key)


def _neighbours(piece: AxisymmetricSettings, key: str) -> tuple[AxisymmetricSettings, AxisymmetricSettings, float]:
    """The test piece with a length a little larger and a little smaller, within its bounds, and the step, mm."""
    known = dimension_named(piece, key)
    assert known is not None
    value, (low, high) = float(getattr(piece, known.name)), known.bounds
    step = LENGTH_STEP * value
    middle = min(max(value, low + step), high - step)
    longer, shorter = (piece.replace(**{known.name: middle + s}) for s in (step, -step))
    return longer, shorter, step


@_kept
def _movement(piece: AxisymmetricSettings, load: str, key: str) -> tuple[GeometryDerivative, Floats, Floats]:
    """By central differences of the section."""
    section = prepared_section(piece, load).section
    longer, shorter, step = _neighbours(piece, key)
    up, down = longer.section(load), shorter.section(load)
    if not (up.has_topology_of(section) and down.has_topology_of(section)):
        raise SolveError(
            f"specimen '{piece.name}': another '{key}' makes another mesh, not the same one with its nodes moved; let "
            "numbers of elements, and what is held, not depend on lengths"
        )
    velocity = (up.nodes - down.nodes) / (2.0 * step)
    force = (up.forces - down.forces) / (2.0 * step)
    mesh = Mesh(section.nodes, section.elements, section.held, section.pressed, np.zeros(0, dtype=np.int64))
    return geometry_derivative(mesh, velocity), velocity, force
