"""Simulation of a body under a load history, and its sensitivities."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.errors import SolveError
from creepkit.fem import solver
from creepkit.fem.finite_element_model import FiniteElementModel, SensitivityDirections
from creepkit.fem.mesh import GeometryDerivative
from creepkit.fem.solver import LoadProgram, SolvableModel, SolverSettings
from creepkit.fem.time_interpolation import TimeInterpolation
from creepkit.integration.time_discretisation import merge_programs
from creepkit.kernels.interface import CompiledLaw
from creepkit.records import Program, Status

REASONS = {
    solver.REACHED_END: "",
    solver.DEFLECTION_LIMIT: "the surface reached the deflection limit",
    solver.STRAIN_LIMIT: "creep strain reached the strain limit",
    solver.STATE_LIMIT: "an internal variable reached its limit",
    solver.LIMIT_LOAD: "no equilibrium with a larger load: limit load",
    solver.LOST_CONVERGENCE: "equilibrium was lost while the load did not rise",
    solver.TOO_MANY_STEPS: "the cap on steps was reached",
    solver.LAW_FAILED: "the law gave no finite rate at a point",
    solver.SINGULAR_TANGENT: "the tangent was singular, so that there are no derivatives",
}
"""What each ending means, in words."""


STATUS = {
    solver.REACHED_END: Status.COMPLETE,
    solver.DEFLECTION_LIMIT: Status.RUPTURED,
    solver.STRAIN_LIMIT: Status.RUPTURED,
    solver.STATE_LIMIT: Status.RUPTURED,
    solver.LIMIT_LOAD: Status.RUPTURED,
    **dict.fromkeys(
        (solver.LOST_CONVERGENCE, solver.TOO_MANY_STEPS, solver.LAW_FAILED, solver.SINGULAR_TANGENT),
        Status.NOT_CONVERGED,
    ),
}
"""Each ending as a status."""


@dataclass(frozen=True)
class LoadHistory:
    """What a body goes through: programs of pressure MPa, temperature K, modulus E MPa, and motion of held nodes.

    pressure : or the load that the model's dead forces are for, in its unit.
    pattern : (nodes, 2) mm of displacement of the held nodes for a unit of motion; None is that of the model.
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
        """The programs merged, (segments, 10); columns as in fem.solver.LoadProgram."""
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
    reactions : (steps,) N/rad, force of the displacement that the motion controls; zeros where none is.
    sensitivities : if asked for, (steps, observed, C) mm, of the observed displacements, to the law's parameters,
        then to the directions of the load program, then to the numbers of the geometry. Where the motion controls a
        displacement, its force in N/rad comes after the observed ones.
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
    reactions: Floats
    sensitivities: Floats | None = None

    def at(self, values: Floats, times: Floats) -> Floats:
        """Values (steps, ...) of the accepted steps at other times, (times, ...); NaN after the end."""
        return self.timeline.interpolate(values, times)


def sensitivity_directions(
    model: FiniteElementModel,
    load_history: LoadHistory,
    segments: Floats | None = None,
    velocities: Sequence[tuple[GeometryDerivative, Floats]] = (),
    forces: Floats | None = None,
) -> SensitivityDirections:
    """What to differentiate to beside the law's parameters.

    segments : (D, segments, 10) derivatives of `load_history.segments`.
    velocities : for each number of the geometry its GeometryDerivative and the velocities (nodes, 2) of the nodes, mm.
    forces : (G, nodes, 2) N/rad, what each of them changes of the model's dead forces; None for nothing.
    """
    along = np.zeros((0, *load_history.segments.shape)) if segments is None else np.asarray(segments, dtype=float)
    points = (len(velocities), *model.weights.shape)
    return SensitivityDirections(
        along,
        np.array([g.gradient for g, _ in velocities]).reshape(*points, 2, 2),
        np.array([g.hoop for g, _ in velocities]).reshape(points),
        np.array([np.ravel(v) for _, v in velocities]).reshape(len(velocities), model.equations.size),
        forces,
    )


def simulate(
    law: CompiledLaw,
    theta: Floats,
    model: SolvableModel,
    load_history: LoadHistory,
    *,
    settings: SolverSettings | None = None,
    keep_points: bool = False,
    same_steps_as: Simulation | None = None,
    directions: SensitivityDirections | None = None,
) -> Simulation:
    """Simulate one body under its load history; theta : (P,) internal parameters.

    keep_points : keep strains and states of all points.
    same_steps_as : make the very steps of another simulation, so that the two may be differenced.
    directions : differentiate the accepted steps to the law's parameters and to these (`sensitivity_directions`).
    """
    theta = np.ascontiguousarray(theta, dtype=float)
    if theta.shape != (len(law.names),):
        raise SolveError(
            f"theta has the shape {theta.shape}, but the law needs {len(law.names)} numbers: {', '.join(law.names)}"
        )
    beta = float(np.asarray(law.leading_exponent(theta))) if same_steps_as is None else same_steps_as.beta
    script = np.zeros((0, 2)) if same_steps_as is None else same_steps_as.positions
    pattern = model.held_motion(load_history.pattern)
    segments = load_history.segments
    record = solver.solve(
        law, theta, model, LoadProgram(beta, load_history.poisson, segments, pattern, script),
        settings or SolverSettings(), keep_points=keep_points, directions=directions,
    )  # fmt: skip
    return Simulation(
        times=record.times,
        displacements=model.displacements(record.displacements),
        mises=record.mises,
        values=record.values,
        status=STATUS[record.code],
        end_time=float(record.time),
        reason=REASONS[record.code],
        iterations=record.counts,
        timeline=TimeInterpolation.from_steps(record.times, record.segments, segments, beta),
        beta=beta,
        positions=record.positions,
        reactions=record.reactions,
        sensitivities=record.surface,
    )
