"""simulate: one body under a load program, and what came of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.fem.body import Body
from creepkit.fem.march import (
    DEFLECTION_LIMIT,
    LIMIT_LOAD,
    LOST_CONVERGENCE,
    REACHED_END,
    STATE_LIMIT,
    STRAIN_LIMIT,
    TOO_MANY_STEPS,
    Record,
    Settings,
    march,
    rooms_of,
)
from creepkit.fem.timeline import Timeline
from creepkit.integration.segments import segments_of
from creepkit.integration.tableau import SDIRK2
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
}
"""What each ending means, in words."""

_STATUS = {
    REACHED_END: Status.COMPLETE,
    DEFLECTION_LIMIT: Status.BURST,
    STRAIN_LIMIT: Status.BURST,
    STATE_LIMIT: Status.BURST,
    LIMIT_LOAD: Status.BURST,
}


@dataclass(frozen=True)
class Course:
    """What a body goes through: programs of pressure MPa, temperature K, modulus E MPa, and motion of held nodes.

    pattern : (nodes, 2) mm of displacement of the held nodes for a unit of motion; None holds them still.
    end : s. poisson : Poisson's ratio.
    """

    pressure: Program
    temperature: Program
    modulus: Program
    end: float
    poisson: float = 0.3
    motion: Program = Program.constant(0.0)
    pattern: Floats | None = None

    @cached_property
    def segments(self) -> Floats:
        """The programs merged, (segments, 10)."""
        return segments_of(self.pressure, self.temperature, self.modulus, self.motion, end=self.end)


@dataclass(frozen=True, eq=False)
class Simulation:
    """A march that was made: its accepted steps, and how it ended.

    times : (steps,) s, from rest at 0 on. displacements : (steps, nodes, 2) mm. mises : (steps, points) MPa.
    values : (steps, points, 4 + S) creep components, equivalent creep strain and states, or None if not kept.
    status, end_time, reason : how it ended. counts : accepted and rejected steps, full and light passes of equilibrium.
    """

    times: Floats
    displacements: Floats
    mises: Floats
    values: Floats | None
    status: Status
    end_time: float
    reason: str
    counts: Ints
    timeline: Timeline

    def at(self, values: Floats, times: Floats) -> Floats:
        """Values (steps, ...) of the accepted steps at other times, (times, ...); NaN after the end."""
        return self.timeline.interpolate(values, times)


def simulate(
    law: CompiledLaw, theta: Floats, body: Body, course: Course, *, settings: Settings | None = None,
    keep_points: bool = False,
) -> Simulation:  # fmt: skip
    """March one body through its course; theta : (P,) internal parameters."""
    settings = settings or Settings()
    theta = np.ascontiguousarray(theta, dtype=float)
    beta = float(np.asarray(law.leading(theta)))
    rows, size, points = settings.max_steps + len(course.segments) + 2, body.equations.size, 4 * len(body.elements)
    record = Record(
        np.zeros(rows),
        np.zeros(rows, np.int64),
        np.zeros((rows, size)),
        np.zeros((rows if keep_points else 0, points, 4 + law.states)),
        np.zeros((rows, points)),
        np.zeros(4, np.int64),
    )
    pattern = np.zeros(size) if course.pattern is None else np.ascontiguousarray(course.pattern, dtype=float).ravel()
    ended = march(
        law.update, theta, beta, course.poisson, body, course.segments, pattern, np.array(law.initial),
        np.array(law.limits), settings, SDIRK2, rooms_of(body, law.states, SDIRK2.stages), record,
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
        counts=record.counts,
        timeline=Timeline.of(record.times[:n], record.segments[:n], course.segments[:, 0], beta),
    )
