"""FiniteElementRun: one simulated test with stresses and strains at all integration points."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from creepkit import kernels
from creepkit.arrays import ArrayLike, Floats
from creepkit.errors import SolveError, nearest
from creepkit.fem.finite_element_model import FiniteElementModel
from creepkit.fem.mesh import GAUSS_POINTS, shape_functions
from creepkit.fem.simulation import Simulation
from creepkit.fem.solver import EQUIVALENT_STRAIN
from creepkit.kernels.interface import (
    MEAN_STRESS,
    POINT_SIZE,
    PRINCIPAL_STRESS,
    STRAIN,
    STRESS,
    TEMPERATURE,
    TIME,
    CompiledLaw,
    call_entry,
)
from creepkit.records import Program, Status
from creepkit.specimens.finite_element_tests import FiniteElementTest, Reduction, solver_settings
from creepkit.specimens.run import Run, run_from_outputs

if TYPE_CHECKING:
    from creepkit.language import CreepLaw


STRESS_FIELD, CREEP_STRAIN_FIELD = "stress", "creep strain"


SETTLING, RESTING = 0.01, 1e-3
"""Shares of the creep at first and of the time at last, and of the mean rate, in which no stress is counted."""


class FieldValues(NamedTuple):
    """A quantity at the integration points.

    points : (points, 2) r and z at rest, mm. values : (times, points).
    """

    points: Floats
    values: Floats


@dataclass(frozen=True, eq=False, kw_only=True)
class FiniteElementRun(Run):
    """A test simulated by finite elements.

    `times` below are s and by default those of the run. A number instead of an array takes its axis away from the
    result; a time after the end is refused, for nothing is known there. At the time of a sudden change of load the
    state before it is meant.

    test : the test piece with its lengths, its finite elements and its load history. simulation : the accepted steps.
    states : names of the law's internal variables.
    """

    test: FiniteElementTest = field(repr=False)
    simulation: Simulation = field(repr=False)
    states: tuple[str, ...] = ()

    @property
    def model(self) -> FiniteElementModel:
        """The finite elements."""
        return self.test.model

    def displacements(self, times: ArrayLike | None = None) -> Floats:
        """Displacements of all nodes, (times, nodes, 2) mm, u_r and u_z.

        times : number or (times,) s, by default those of the frames.
        """
        return self._at(self.simulation.displacements, times)

    def field(self, name: str = STRESS_FIELD, times: ArrayLike | None = None) -> FieldValues:
        """Von Mises "stress" (MPa), equivalent "creep strain" or a state of the law by its name, at all points.

        times : number or (times,) s, by default those of the frames.
        """
        values = self._at(self._field_at_steps(name), times)
        return FieldValues(
            self.point_coordinates, np.maximum(values, 0.0) if name in (STRESS_FIELD, CREEP_STRAIN_FIELD) else values
        )

    @property
    def point_coordinates(self) -> Floats:
        """(points, 2) r and z of the integration points at rest, mm; four an element, in the order of the mesh."""
        body = self.model
        return np.asarray(
            np.einsum("pa,eai->epi", shape_functions(GAUSS_POINTS), body.nodes[body.elements]).reshape(-1, 2)
        )

    @property
    def creep_stress(self) -> tuple[Floats, Floats]:
        """Von Mises stress of each step, MPa, the mean over the body by how much creeps, and that growth, mm^3.

        (steps,) each, of the steps from one accepted time to the next; NaN where nothing creeps.
        """
        stress, creep = self.simulation.mises, self._field_at_steps(CREEP_STRAIN_FIELD)
        growth = np.maximum(np.diff(creep, axis=0), 0.0) * self.model.weights.ravel()
        with np.errstate(invalid="ignore"):
            return (growth * 0.5 * (stress[1:] + stress[:-1])).sum(axis=1) / growth.sum(axis=1), growth.sum(axis=1)

    @property
    def creep_stress_range(self) -> Floats:
        """The least and the largest of that stress from the first frame after zero to the last, (2,) MPa.

        But for the first SETTLING of the creep, which elastic peaks and ramps leave, the last SETTLING of the time, in
        which a body bursts, and where creep all but rests: at less than RESTING of its mean rate.
        """
        stress, growth = self.creep_stress
        times, end = self.simulation.times, min(self.end_time, float(self.times[-1]))
        first = float(np.min(self.times[self.times > 0.0], initial=end))
        followed = (times[1:] >= first) & (times[1:] <= max((1.0 - SETTLING) * end, first))
        total = growth[followed].sum()
        seen = followed & (growth.cumsum() >= SETTLING * total) & (growth > RESTING * total / end * np.diff(times))
        seen = seen if seen.any() else np.isfinite(stress)
        return np.array([stress[seen].min(), stress[seen].max()])

    def _field_at_steps(self, name: str) -> Floats:
        """Values of a field at the accepted steps, (steps, points)."""
        if self.simulation.values is None:
            raise SolveError(f"run '{self.name}' is of a reduced-order model, which keeps displacements and no fields")
        if name == STRESS_FIELD:
            return self.simulation.mises
        known = (CREEP_STRAIN_FIELD, *self.states)
        if name not in known:
            raise SolveError(f"a {self.specimen} run has no field '{name}'; {nearest(name, (STRESS_FIELD, *known))}")
        return np.asarray(self.simulation.values[:, :, EQUIVALENT_STRAIN + known.index(name)])

    def _at(self, steps: Floats, times: ArrayLike | None) -> Floats:
        """Values (steps, ...) at times, (times, ...), or (...) at one time; refuses times after the end."""
        wanted = self.times if times is None else np.asarray(times, float)
        reach = self.end_time
        outside = ~((wanted >= 0.0) & (wanted <= reach * (1 + 1e-12)))
        if outside.any():
            why = f" ({self.reason})" if self.reason else ""
            time = float(np.atleast_1d(wanted)[np.atleast_1d(outside)][0])
            raise SolveError(
                f"run '{self.name}': nothing is known at {time:g} s; the simulation reaches from 0 to {reach:g} s{why}"
            )
        rows = self.simulation.at(steps, wanted)
        return rows if wanted.ndim else np.asarray(rows[0])


def run_test(
    test: FiniteElementTest, law: CreepLaw, values: Mapping[str, float], reduction: Reduction | None = None
) -> Any:
    """Simulate one test and keep all of it, as the kind of run of its specimen has it."""
    kernel, piece = kernels.lower(law, "compiled"), test.piece
    theta = law.to_internal(law.values(values))[0]
    if reduction is None:
        simulation = test.simulate(kernel, theta, solver_settings(piece), keep_points=True)
    else:
        simulation = test.simulate(kernel, theta, reduction.settings, reduction.model_of(piece, piece))
    status, end_time, reason = simulation.status, simulation.end_time, simulation.reason
    failure = None if reduction else last_finite_rate(kernel, theta, simulation, test.load_history.temperature)
    if failure is not None:
        status, end_time, reason = Status.NOT_CONVERGED, failure, "the law has no finite creep rate, or no derivatives"
    if status is Status.NOT_CONVERGED:
        reason += "; 'creepkit check' says where the rate of a law is no number, or jumps"
    rows = simulation.at(piece.observed_outputs(test.load, simulation), test.history.times)
    return run_from_outputs(
        piece.run_kind, test.history, piece.outputs, rows, status, end_time, reason, test=test,
        simulation=simulation, states=tuple(map(str, law.states)), **piece.taken_for_granted(test.history),
    )  # fmt: skip


def last_finite_rate(law: CompiledLaw, theta: Floats, simulation: Simulation, temperature: Program) -> float | None:
    """The last step, s, before a law has no rate at stresses, strains and states of the body; None where it has one.

    theta : (parameters,) internal values. Kernels floor what they take logarithms of: where an equation has no number,
    such as the logarithm of something negative, its rate may look small, but then its derivatives are not finite.
    """
    assert simulation.values is not None
    strains = simulation.values[1:, :, EQUIVALENT_STRAIN:]
    points = np.empty((*strains.shape[:2], POINT_SIZE + strains.shape[2] - 1))
    points[..., STRESS] = points[..., PRINCIPAL_STRESS] = np.maximum(simulation.mises[1:], 1e-3)
    points[..., MEAN_STRESS] = points[..., STRESS] / 3.0
    points[..., STRAIN] = np.maximum(strains[..., 0], 1e-9)
    points[..., TIME] = simulation.times[1:, None]
    points[..., TEMPERATURE] = temperature.at(simulation.times[1:])[:, None]
    points[..., POINT_SIZE:] = strains[..., 1:]
    if not call_entry(law, "update", points.reshape(-1, points.shape[2]), theta)[1]:
        return None
    wrong = next(k for k, of_step in enumerate(points) if call_entry(law, "update", of_step, theta)[1])
    return float(simulation.times[wrong])
