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
    call_entry,
)
from creepkit.kernels.rate_jumps import find_rate_jump
from creepkit.records import Program, Status
from creepkit.specimens.finite_element_tests import FiniteElementTest, Reduction, solver_settings
from creepkit.specimens.run import Run, run_from_outputs

if TYPE_CHECKING:
    from creepkit.kernels.interface import CompiledLaw
    from creepkit.language import CreepLaw


STRESS_FIELD, CREEP_STRAIN_FIELD = "stress", "creep strain"


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
        simulation = test.simulate(kernel, theta, reduction.settings, reduction.model_of(piece))
    status, end_time, reason = simulation.status, simulation.end_time, simulation.reason
    if reduction is None:
        rate_failure = rate_failure_of(kernel, theta, simulation, test.load_history.temperature)
        if rate_failure is not None:
            status, end_time, reason = Status.NOT_CONVERGED, *rate_failure
    rows = simulation.at(piece.observed_outputs(test.load, simulation), test.history.times)
    return run_from_outputs(
        piece.run_kind, test.stated_history(), piece.outputs, rows, status, end_time, reason, test=test,
        simulation=simulation, states=tuple(map(str, law.states)),
    )  # fmt: skip


def uniaxial_points(stresses: Floats, strains: Floats, states: Floats, time: float, temperature: float) -> Floats:
    """Points of a law, (points, 6 + S), under uniaxial stress; stress and strain a little above zero at least.

    stresses : (points,) MPa. strains : (points,). states : (points, S).
    """
    points = np.zeros((stresses.size, POINT_SIZE + states.shape[1]))
    points[:, STRESS] = points[:, PRINCIPAL_STRESS] = np.maximum(stresses, 1e-3)
    points[:, MEAN_STRESS] = points[:, STRESS] / 3.0
    points[:, STRAIN], points[:, TIME], points[:, TEMPERATURE] = np.maximum(strains, 1e-9), time, temperature
    points[:, POINT_SIZE:] = states
    return points


def missing_rate_message(law: CompiledLaw, theta: Floats, points: Floats) -> str:
    """The first of these points where the law has no rate, or one without derivatives, in words; empty when none is.

    theta : (parameters,) internal values. points : (points, 6 + S).
    Kernels floor what they take logarithms of: where an equation has no number, such as the logarithm of something
    negative, its rate may look small instead, but then its derivatives are not finite. A rate too large for a number
    is one: its logarithm is what the integration works with.
    """
    rates, flags = call_entry(law, "update", points, theta)
    if not flags:
        return ""
    bad = np.flatnonzero(~np.isfinite(rates).all(axis=1))
    point = points[bad[:1]]
    stress, strain, time, temperature = point[0, [STRESS, STRAIN, TIME, TEMPERATURE]]
    return (
        f"law has no finite creep rate, or none with derivatives, at a stress of {stress:.4g} MPa, a creep strain of "
        f"{strain:.3g}, {time:.4g} s and {temperature:.4g} K"
    )


def rate_jump_message(law: CompiledLaw, theta: Floats, point: Floats, stresses: tuple[float, float]) -> str:
    """Where the creep rate jumps between two stresses, MPa, in words; empty where it does not.

    theta : (parameters,) internal values. point : (6 + S,), whose stresses are replaced.
    A point whose stress meets a jump would have to creep at a rate between the two: no implicit step finds one.
    """

    def log_rates(levels: Floats) -> Floats:
        states = np.tile(point[POINT_SIZE:], (levels.size, 1))
        strains = np.full(levels.size, point[STRAIN])
        rows = uniaxial_points(levels, strains, states, float(point[TIME]), float(point[TEMPERATURE]))
        return np.asarray(call_entry(law, "update", rows, theta)[0][:, 0])

    jump = find_rate_jump(log_rates, *stresses)
    if jump is None:
        return ""
    before, after = np.exp([jump.before, jump.after])
    return (
        f"the law's creep rate jumps from {before:.3g} to {after:.3g} 1/s at a stress of {jump.place:.4g} MPa, where "
        "no equilibrium is found; let the branches of the law meet there, or blend them"
    )


def rate_failure_of(
    kernel: CompiledLaw, theta: Floats, simulation: Simulation, temperature: Program
) -> tuple[float, str] | None:
    """Until when the law had a creep rate, s, and where it has none: at any step, and beyond an early end.

    theta : (parameters,) internal values. None where it always has one.
    A simulation that stopped was on its way to other stresses, at most a few times those that it had.
    """
    assert simulation.values is not None
    temperatures = temperature.at(simulation.times)
    for k in range(1, simulation.times.size):
        strains, states = simulation.values[k, :, EQUIVALENT_STRAIN], simulation.values[k, :, EQUIVALENT_STRAIN + 1 :]
        points = uniaxial_points(
            simulation.mises[k], strains, states, float(simulation.times[k]), float(temperatures[k])
        )
        reason = missing_rate_message(kernel, theta, points)
        if reason:
            return float(simulation.times[k - 1]), reason
    if simulation.status is Status.COMPLETE:
        return None
    stresses = np.geomspace(0.1, 4.0, 9) * float(np.max(simulation.mises, initial=1.0))
    worst = simulation.values[-1, np.argmax(simulation.values[-1, :, EQUIVALENT_STRAIN])]
    strains, states = np.full(9, worst[EQUIVALENT_STRAIN]), np.tile(worst[EQUIVALENT_STRAIN + 1 :], (9, 1))
    reason = missing_rate_message(
        kernel,
        theta,
        uniaxial_points(stresses, strains, states, max(simulation.end_time, 1.0), float(temperatures[-1])),
    )
    if not reason and simulation.status is Status.NOT_CONVERGED:
        end, last = simulation.end_time, float(temperatures[-1])
        point = uniaxial_points(stresses[:1], strains[:1], states[:1], end, last)[0]
        jump = rate_jump_message(kernel, theta, point, (float(stresses[0]), float(stresses[-1])))
        reason = f"{simulation.reason}: {jump}" if jump else ""
    return (simulation.end_time, reason) if reason else None
