"""Simulation of a body under a load history, and its sensitivities."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.errors import SolveError
from creepkit.fem.assembly import point_workspace
from creepkit.fem.banded_system import FiniteElementModel
from creepkit.fem.mesh import GeometryDerivative
from creepkit.fem.point_sensitivities import SensitivityDirections, sensitivity_workspace
from creepkit.fem.step_record import (
    DEFLECTION_LIMIT,
    LAW_FAILED,
    LIMIT_LOAD,
    LOST_CONVERGENCE,
    REACHED_END,
    STATE_LIMIT,
    STRAIN_LIMIT,
    TOO_MANY_STEPS,
    SolverSettings,
    StepRecord,
    solver_workspace,
)
from creepkit.fem.time_integration import DONE, integrate_program
from creepkit.fem.time_integration import differentiate_program as replay
from creepkit.fem.time_interpolation import TimeInterpolation
from creepkit.integration.time_discretisation import SDIRK2, merge_programs
from creepkit.kernels.interface import CompiledLaw
from creepkit.records import Program, Status

REASONS = {
    REACHED_END: "",
    DEFLECTION_LIMIT: "the surface reached the deflection limit",
    STRAIN_LIMIT: "creep strain reached the strain limit",
    STATE_LIMIT: "an internal variable reached its limit",
    LIMIT_LOAD: "no equilibrium with a larger pressure: limit load",
    LOST_CONVERGENCE: "equilibrium was lost while the load was constant",
    TOO_MANY_STEPS: "the cap on steps was reached",
    LAW_FAILED: "the law gave no finite rate at a point",
}
"""What each ending means, in words."""


_STATUS = {
    REACHED_END: Status.COMPLETE,
    DEFLECTION_LIMIT: Status.RUPTURED,
    STRAIN_LIMIT: Status.RUPTURED,
    STATE_LIMIT: Status.RUPTURED,
    LIMIT_LOAD: Status.RUPTURED,
}


@dataclass(frozen=True)
class LoadHistory:
    """What a body goes through: programs of pressure MPa, temperature K, modulus E MPa, and motion of held nodes.

    pattern : (nodes, 2) mm of displacement of the held nodes for a unit of motion; None holds them still.
    end : s. poisson : Poisson's ratio.
    """

    pressure: Program
    temperature: Program
    modulus: Program
    end: float
    poisson: float = 0.3
    motion: Program = field(default_factory=lambda: Program.constant(0.0))
    pattern: Floats | None = None

    @cached_property
    def segments(self) -> Floats:
        """The programs merged, (segments, 10)."""
        return merge_programs(self.pressure, self.temperature, self.modulus, self.motion, end=self.end)


@dataclass(frozen=True, eq=False)
class Simulation:
    """A finished simulation: its accepted steps, and how it ended.

    times : (steps,) s, from rest at 0 on.
    displacements : (steps, nodes, 2) mm, u_r and u_z.
    mises : (steps, points) MPa, von Mises stress of the Cauchy stress.
    values : (steps, points, 4 + S) creep components, equivalent creep strain and states, or None if not kept.
    status, end_time, reason : how it ended; s.
    iterations : (4,) accepted and rejected steps; equilibrium iterations with and without a new tangent.
    timeline : interpolation between the accepted steps.
    beta : exponent of the time transformation (see integration.time_discretisation).
    positions : (steps, 2) where each step began in its segment, and its length, in the transformed time.
    record : what `differentiate` replays, if kept.
    """

    times: Floats
    displacements: Floats
    mises: Floats
    values: Floats | None
    status: Status
    end_time: float
    reason: str
    iterations: Ints
    timeline: TimeInterpolation
    beta: float
    positions: Floats
    record: StepRecord | None = None

    def at(self, values: Floats, times: Floats) -> Floats:
        """Values (steps, ...) of the accepted steps at other times, (times, ...); NaN after the end."""
        return self.timeline.interpolate(values, times)


def simulate(
    law: CompiledLaw,
    theta: Floats,
    model: FiniteElementModel,
    load_history: LoadHistory,
    *,
    settings: SolverSettings | None = None,
    keep_points: bool = False,
    keep_stages: bool = False,
    same_steps_as: Simulation | None = None,
) -> Simulation:
    """Simulate one body under its load history; theta : (P,) internal parameters.

    keep_points : keep strains and states of all points; keep_stages : keep what `differentiate` needs.
    same_steps_as : make the very steps of another simulation, so that the two may be differenced.
    """
    settings = settings or SolverSettings()
    theta = np.ascontiguousarray(theta, dtype=float)
    beta = float(np.asarray(law.leading_exponent(theta))) if same_steps_as is None else same_steps_as.beta
    script = np.zeros((0, 2)) if same_steps_as is None else same_steps_as.positions
    record = _record(law, model, load_history, settings, keep_points, keep_stages)
    pattern = np.zeros(model.equations.size)
    if load_history.pattern is not None:
        pattern[:] = np.ravel(load_history.pattern)
    ended = integrate_program(
        law.update, theta, beta, load_history.poisson, model, load_history.segments, pattern, np.array(law.initial),
        np.array(law.limits), settings, SDIRK2, solver_workspace(model, law.states, SDIRK2.stages), script, record,
    )  # fmt: skip
    n = ended.records
    return Simulation(
        times=record.times[:n].copy(),
        displacements=record.displacements[:n].reshape(n, -1, 2).copy(),
        mises=record.mises[:n].copy(),
        values=record.values[:n].copy() if keep_points else None,
        status=_STATUS.get(ended.code, Status.NOT_CONVERGED),
        end_time=float(ended.time),
        reason=REASONS[int(ended.code)],
        iterations=record.counts,
        timeline=TimeInterpolation.from_steps(record.times[:n], record.segments[:n], load_history.segments, beta),
        beta=beta,
        positions=record.places[:n].copy(),
        record=record if keep_stages else None,
    )


def _record(
    law: CompiledLaw,
    body: FiniteElementModel,
    load_history: LoadHistory,
    settings: SolverSettings,
    keep_points: bool,
    keep_stages: bool,
) -> StepRecord:
    """Room for as many steps as the settings allow; memory is only taken where it is written."""
    rows, size, points = (
        settings.max_steps + len(load_history.segments) + 2,
        body.equations.size,
        4 * len(body.elements),
    )
    kept, values = rows if keep_stages else 0, 4 + law.states
    return StepRecord(
        times=np.zeros(rows),
        segments=np.zeros(rows, np.int64),
        displacements=np.zeros((rows, size)),
        values=np.zeros((rows if keep_points else 0, points, values)),
        mises=np.zeros((rows, points)),
        counts=np.zeros(4, np.int64),
        places=np.zeros((rows, 2)),
        stages=np.zeros((kept, SDIRK2.stages, size)),
        slopes=np.zeros((kept, SDIRK2.stages, points, values)),
    )


@dataclass(frozen=True, eq=False)
class SurfaceSensitivities:
    """Derivatives of a simulation.

    surface : (steps, top, C) of u_z of the observed nodes, to the law's internal parameters, then to the directions
        of the load program, then to the numbers of the geometry.
    times : (steps, D) of the times of the steps, s, to the directions.
    """

    surface: Floats
    times: Floats


def sensitivities(
    law: CompiledLaw, theta: Floats, model: FiniteElementModel, load_history: LoadHistory, simulation: Simulation, *,
    directions: Floats | None = None, velocities: Sequence[tuple[GeometryDerivative, Floats]] = (),
) -> SurfaceSensitivities:  # fmt: skip
    """Exact derivatives of a simulation that kept its stages.

    directions : (D, segments, 10) derivatives of `load_history.segments`.
    velocities : for each number of the geometry its GeometryChange and the velocities (nodes, 2) of the nodes.
    """
    if simulation.record is None:
        raise SolveError("this simulation kept no stages; simulate with keep_stages=True to differentiate it")
    theta = np.ascontiguousarray(theta, dtype=float)
    segments = load_history.segments
    along = np.zeros((0, *segments.shape)) if directions is None else np.ascontiguousarray(directions, dtype=float)
    points = (len(velocities), *model.weights.shape)
    columns = SensitivityDirections(
        along,
        np.array([g.gradient for g, _ in velocities]).reshape(*points, 2, 2),
        np.array([g.hoop for g, _ in velocities]).reshape(points),
        np.array([np.ravel(v) for _, v in velocities]).reshape(len(velocities), model.equations.size),
    )
    count, total = simulation.times.size, theta.size + len(along) + len(velocities)
    surface, times = np.zeros((count, model.top.size, total)), np.zeros((count, len(along)))
    flag = replay(
        law.sensitivity, theta, simulation.beta, load_history.poisson, model, segments, columns, SDIRK2,
        np.array(law.initial), simulation.record, count, point_workspace(law.states, theta.size),
        sensitivity_workspace(model, law.states, SDIRK2.stages, total, len(along)), surface, times,
    )  # fmt: skip
    if flag != DONE:
        surface[:] = np.nan
    return SurfaceSensitivities(surface, times)
