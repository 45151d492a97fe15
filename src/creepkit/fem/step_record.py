"""Settings, workspace and record of the accepted steps."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from creepkit.arrays import Floats, Ints
from creepkit.fem.assembly import ForceWorkspace, PointStates, force_workspace, point_workspace, virgin_points
from creepkit.fem.banded_system import FiniteElementModel
from creepkit.fem.material_point import EQUIVALENT_STRAIN, PointWorkspace

(REACHED_END, DEFLECTION_LIMIT, STRAIN_LIMIT, STATE_LIMIT, LIMIT_LOAD, LOST_CONVERGENCE, TOO_MANY_STEPS, LAW_FAILED) = (
    range(8)
)
"""Codes of an ending; whatever it is, the history so far is kept."""


START, END, PRESSURE, END_PRESSURE, START_TEMPERATURE, FINAL_TEMPERATURE, MODULUS, END_MODULUS, MOTION, END_MOTION = (
    range(10)
)
"""Columns of a segment: times s, pressures MPa, temperatures K, moduli E MPa, motion of held nodes, at both ends."""


class SolverSettings(NamedTuple):
    """How accurately, and how far, to simulate.

    tolerance : estimated error of a step's displacements over (0.01 mm + the largest of them).
    newton : last correction of equilibrium over the same.
    first : s, the first step after a change of load; each next one is at most the time elapsed since plus this.
    deflection_limit : mm, displacement of the observed surface at which the body has burst.
    strain_limit : creep strain at which a point has burst. max_steps : cap on steps, accepted and rejected.
    """

    tolerance: float = 1e-2
    newton: float = 1e-4
    first: float = 10.0
    deflection_limit: float = 3.0
    strain_limit: float = 1.0
    max_steps: int = 1000


class StepRecord(NamedTuple):
    """Accepted steps: (records,) times s, segment of each; displacements (records, 2 nodes); and if kept, the points.

    values : (records or 0, points, V). mises : (records, points) MPa. counts : (4,) accepted, rejected, full and light
    passes of equilibrium. places : (records, 2) where a step began and its length, in its transformed time.
    stages, slopes : if kept, what the stages found: displacements (records or 0, stages, 2 nodes), and d value/ds
    (records or 0, stages, points, V).
    """

    times: Floats
    segments: Ints
    displacements: Floats
    values: Floats
    mises: Floats
    counts: Ints
    places: Floats
    stages: Floats
    slopes: Floats


class SolverWorkspace(NamedTuple):
    """Working arrays of a simulation: points, one point, forces, and displacements in mm.

    displacement, start : (2 nodes,) now and at the start of the step; stages : (stages, 2 nodes) at the stages.
    """

    points: PointStates
    point: PointWorkspace
    forces: ForceWorkspace
    displacement: Floats
    start: Floats
    stages: Floats


class Termination(NamedTuple):
    """Number of records, code, time s."""

    records: int
    code: int
    time: float


def solver_workspace(body: FiniteElementModel, states: int, stages: int) -> SolverWorkspace:
    """Allocate the working arrays."""
    size = body.equations.size
    return SolverWorkspace(
        virgin_points(4 * len(body.elements), states, stages),
        point_workspace(states, 0),
        force_workspace(body),
        np.zeros(size),
        np.zeros(size),
        np.zeros((stages, size)),
    )


@njit(cache=True, error_model="numpy")
def make_virgin(points: PointStates, initial: Floats) -> None:
    """Virgin points."""
    for k in range(points.value.shape[0]):
        points.increments[k] = 0.0
        points.mises[k] = 0.0
        for v in range(points.value.shape[1]):
            points.value[k, v] = initial[v - EQUIVALENT_STRAIN - 1] if v > EQUIVALENT_STRAIN else 0.0
            for i in range(points.slopes.shape[0]):
                points.slopes[i, k, v] = 0.0
        for i in range(initial.size):
            points.states[k, i] = initial[i]


@njit(cache=True, error_model="numpy")
def copy(source: Floats, target: Floats) -> None:
    """Copy a vector."""
    for k in range(source.size):
        target[k] = source[k]


@njit(cache=True, error_model="numpy")
def record_step(
    record: StepRecord, ended: Termination, time: float, n: int, u: Floats, points: PointStates
) -> Termination:
    """Write a row of the record."""
    row = ended.records
    record.times[row], record.segments[row] = time, n
    copy(u, record.displacements[row])
    if record.stages.shape[0] > 0 and record.places[row, 1] == 0.0:
        copy(u, record.stages[row, 0])
    copy(points.mises, record.mises[row])
    if record.values.shape[0] > 0:
        for k in range(points.value.shape[0]):
            copy(points.value[k], record.values[row, k])
    return Termination(row + 1, REACHED_END, time)
