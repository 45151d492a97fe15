"""Axisymmetric: a specimen in finite elements of which its author states the section, the load and what is observed."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.checked_arguments import checked
from creepkit.errors import SAID, SolveError, refuse_unknown, restated
from creepkit.fem.finite_element_model import FiniteElementModel
from creepkit.fem.mesh import GeometryDerivative
from creepkit.fem.section import Section
from creepkit.records import dimension_named
from creepkit.specimens.finite_element_specimen import FiniteElementSpecimen
from creepkit.specimens.test_piece import kept

if TYPE_CHECKING:
    from creepkit.fem.simulation import Simulation

LENGTH_STEP = 1e-4
"""Relative step of central differences of meshes and of outputs to a length; nodes are nearly linear in lengths."""

DISPLACEMENT_STEP = 1e-4
"""Relative step, of the largest of it, of central differences of outputs to an observed displacement."""


@checked
class Displacements:
    """What `observe` is given: displacements of named points of the section in each step, mm, and a force, N."""

    def __init__(self, section: Section, values: Floats | None = None, order: Sequence[int] = ()) -> None:
        """Note what is asked for, where there are no values (steps, observed) mm, N.

        order : which displacement each column is, 2 node + component; the force of a moved side comes last.
        """
        self._section, self._values, self._order = section, values, list(order)
        self.asked: list[int] = []

    def radial(self, point: str) -> Floats:
        """u_r of a point, (steps,) mm, outwards."""
        return self._displacement(point, 0)

    def axial(self, point: str) -> Floats:
        """u_z of a point, (steps,) mm."""
        return self._displacement(point, 1)

    @property
    def force(self) -> Floats:
        """Axial force on the side that the load moves, (steps,) N over the whole circumference."""
        if self._section.controlled is None:
            raise SolveError("only a side that the load moves has a force to be observed; see Section.move")
        return np.ones(1) if self._values is None else np.asarray(self._values[:, -1])

    def _displacement(self, point: str, component: int) -> Floats:
        points = self._section.points
        refuse_unknown(point, points, SolveError, f"a section has no point '{point}' to observe")
        number = 2 * points[point] + component
        if self._values is None:
            self.asked.append(number)
            return np.zeros(1)
        return np.asarray(self._values[:, self._order.index(number)])


@checked
@dataclass(frozen=True, kw_only=True)
class Axisymmetric(FiniteElementSpecimen, ABC):
    """A body of revolution in creep at finite strain, simulated by finite elements.

    A subclass is a frozen dataclass whose lengths are fields made by `ck.dimension`. It states `name`, `title`,
    `outputs` and `loads`, and writes two methods: `section`, the mesh of its half section with what holds it and what
    the load does to it, and `observe`, the outputs from displacements of named points. Candidates and tests in threads,
    lengths, elastic data, temperature and load programs, the end of a test with its reason, nuisance parameters and
    exact derivatives to the law's parameters and to all of these come with it.

    tolerance : estimated error of a step, over the largest observed displacement plus `resolution` mm.
    refinement : what `self.elements(count)` multiplies numbers of elements by.
    resolution : mm, below which the size of a displacement does not matter.
    deflection_limit : mm, observed displacement at which the test ends. strain_limit : creep strain at which a point
        has ruptured. max_steps : cap on the steps of one simulation, so on its cost.
    threads : simulations that run at the same time; None for one on each core.
    """

    @abstractmethod
    def section(self, load: str) -> Section:
        """The half section, held and loaded for one unit of a load; see `ck.Section`.

        load : name of the load that a test imposes. Lengths move nodes and change forces, but not numbers of elements.
        """

    @abstractmethod
    def observe(self, displacements: Displacements) -> Mapping[str, ArrayLike]:
        """{output: (steps,)} in its unit, from displacements of the section's points, and the force of a moved side.

        Every step stands for itself; the functions are smooth.
        """

    def elements(self, count: int) -> int:
        """A number of elements of a mesh at this specimen's refinement, one at least."""
        return max(1, round(count * self.refinement))

    # ---- as a specimen in finite elements -----------------------------------------------------------------------

    def finite_elements(self, load: str) -> FiniteElementModel:
        """The finite elements of the section under a load."""
        return prepared_section(self, load).model

    def motion(self, load: str) -> float | None:
        """mm of u_z for a unit of the load, where it moves a side."""
        section = prepared_section(self, load).section
        return None if section.controlled is None else section.motion

    def observed(self, load: str, simulation: Simulation) -> Floats:
        """Displacements in each accepted step, mm, then the force, N, (steps, observed)."""
        body = prepared_section(self, load)
        columns = [simulation.displacements.reshape(len(simulation.times), -1)[:, list(body.order)]]
        if body.section.controlled is not None:
            columns.append(2.0 * np.pi * simulation.reactions[:, None])
        return np.concatenate(columns, axis=1)

    def observed_outputs(self, load: str, simulation: Simulation) -> Floats:
        """Outputs in each accepted step, (steps, outputs)."""
        return _outputs(self, prepared_section(self, load), self.observed(load, simulation))

    def observe_with_derivatives(self, load: str, simulation: Simulation) -> tuple[Floats, Floats]:
        """Outputs, and derivatives (steps, outputs, observed): central differences of the author's function."""
        body, quantities = prepared_section(self, load), self.observed(load, simulation)
        slopes = [np.zeros((len(quantities), len(self.outputs), 0))]
        for k in range(quantities.shape[1]):
            move = np.zeros(quantities.shape[1])
            move[k] = DISPLACEMENT_STEP * max(float(np.abs(quantities[:, k]).max()), self.resolution)
            up, down = (_outputs(self, body, quantities + sign * move) for sign in (1.0, -1.0))
            slopes.append(((up - down) / (2.0 * move[k]))[..., None])
        return _outputs(self, body, quantities), np.concatenate(slopes, axis=-1)

    def length_derivative(self, load: str, key: str, simulation: Simulation) -> Floats:
        """Derivative (steps, outputs) of the outputs to a length at the same displacements."""
        body, quantities = prepared_section(self, load), self.observed(load, simulation)
        longer, shorter, step = _neighbours(self, key)
        up, down = (_outputs(piece, body, quantities) for piece in (longer, shorter))
        return (up - down) / (2.0 * step)

    def movement(self, load: str, key: str) -> tuple[GeometryDerivative, Floats, Floats]:
        """How points, nodes (nodes, 2), mm, and dead forces (nodes, 2), N/rad, move with a length."""
        return _movement(self, load, key)


@dataclass(frozen=True, eq=False)
class PreparedSection:
    """A section ready to be simulated; order : the displacements that are observed, 2 node + component."""

    section: Section
    model: FiniteElementModel
    order: tuple[int, ...]


@kept
def prepared_section(piece: Axisymmetric, load: str) -> PreparedSection:
    """The section of a test piece; SolveError, beginning with the specimen's name, where it cannot be made."""
    with restated(SolveError, SolveError, f"specimen '{piece.name}' under {load}: {SAID}"):
        section = piece.section(load)
        notes = Displacements(section)
        with np.errstate(all="ignore"):
            found = piece.observe(notes)
        for name in piece.outputs:
            if name not in found:
                raise SolveError(f"observe() gave no '{name}'; it gives {', '.join(piece.outputs)}")
        order = tuple(sorted(set(notes.asked)))
        return PreparedSection(section, section.model(np.array(order, dtype=np.int64)), order)


def _outputs(piece: Axisymmetric, body: PreparedSection, quantities: Floats) -> Floats:
    """Outputs (steps, outputs) in their units, from what is observed, quantities (steps, observed), mm and N."""
    found = piece.observe(Displacements(body.section, quantities, body.order))
    rows = [np.broadcast_to(np.asarray(found[name], dtype=float), len(quantities)) for name in piece.outputs]
    return np.stack(rows, axis=1)


def _neighbours(piece: Axisymmetric, key: str) -> tuple[Axisymmetric, Axisymmetric, float]:
    """The test piece with a length a little larger and a little smaller, within its bounds, and the step, mm."""
    known = dimension_named(piece, key)
    assert known is not None
    value, (low, high) = float(getattr(piece, known.name)), known.bounds
    step = LENGTH_STEP * value
    middle = min(max(value, low + step), high - step)
    longer, shorter = (piece.replace(**{known.name: middle + s}) for s in (step, -step))
    return longer, shorter, step


@kept
def _movement(piece: Axisymmetric, load: str, key: str) -> tuple[GeometryDerivative, Floats, Floats]:
    """By central differences of the section."""
    body = prepared_section(piece, load)
    longer, shorter, step = _neighbours(piece, key)
    up, down = longer.section(load), shorter.section(load)
    if not (up.has_topology_of(body.section) and down.has_topology_of(body.section)):
        raise SolveError(
            f"specimen '{piece.name}': another '{key}' makes another mesh, not the same one with its nodes moved; let "
            "numbers of elements, and what is held, not depend on lengths"
        )
    velocity = (up.nodes - down.nodes) / (2.0 * step)
    force = (up.forces - down.forces) / (2.0 * step)
    return body.model.geometry_derivative(velocity), velocity, force
