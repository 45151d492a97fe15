"""Settings, workspace and record of the accepted steps, and interpolation in time between them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numba import njit
from scipy.interpolate import CubicSpline

from creepkit.arrays import Bools, Floats, Ints
from creepkit.fem.assembly import ForceWorkspace, PointStates, force_workspace, point_workspace, virgin_points
from creepkit.fem.banded_system import FiniteElementModel
from creepkit.fem.material_point import EQUIVALENT_STRAIN, PointWorkspace
from creepkit.integration.time_discretisation import SMALLEST_EXPONENT

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


OFFSET = 20.0
"""s; twice the first step after a change of load."""


SHORT = 0.2
"""A last step this much shorter than the one before does not count for the spline."""


@dataclass(frozen=True, eq=False)
class TimeInterpolation:
    """The accepted steps of a simulation.

    times : (steps,) s. starts : (segments reached,) s. rows : first and last step of each segment; without a jump of
    the load the first is the last one of the segment before. origins : (segments reached,) s, zero of the time y.
    exponents : (segments reached,) beta.
    """

    times: Floats
    starts: Floats
    rows: tuple[tuple[int, int], ...]
    origins: Floats
    exponents: Floats

    @classmethod
    def from_steps(cls, times: Floats, segments: Ints, program: Floats, beta: float = 1.0) -> TimeInterpolation:
        """From the rows of a record and the program (segments, 10); beta : the law's leading exponent of time."""
        rows = []
        reached = program[: int(segments[-1]) + 1]
        starts = reached[:, START].copy()
        for n, start in enumerate(starts):
            mine = np.flatnonzero(segments == n)
            at_start = np.flatnonzero((segments == n) & (times == start))
            first = int(at_start[-1]) if at_start.size else int(mine[0]) - 1
            rows.append((first, int(mine[-1])))
        # a pressure that rises from nothing gives no power of time; long after zero only the change of load matters
        young = np.where(starts == 0.0, reached[:, PRESSURE] != 0.0, starts <= OFFSET) & (beta < 1.0)
        exponents = np.where(young, max(beta, SMALLEST_EXPONENT), 1.0)
        return cls(np.array(times), starts, tuple(rows), np.where(young, 0.0, starts), exponents)

    def interpolate(self, values: Floats, times: Floats) -> Floats:
        """Values (steps, ...) at other times, (times, ...); NaN after the last step.

        At the time of a jump it is the value before it; at time zero the one after.
        """
        times = np.atleast_1d(np.asarray(times, float))
        out = np.full((times.size, *values.shape[1:]), np.nan)
        which = np.maximum(np.searchsorted(self.starts, times, side="left") - 1, 0)
        for n, (first, last) in enumerate(self.rows):
            mine = (which == n) & (times <= self.times[-1] * (1 + 1e-12))
            if mine.any():
                before, after = self._variable(n, self.times[first : last + 1]), self._variable(n, times[mine])
                kept = _spline_knots(before)
                out[mine] = _spline(before[kept], values[first : last + 1][kept], after)
        return out

    def moved(self, times: Floats, starts: Floats) -> TimeInterpolation:
        """The same steps at other times, the segments beginning at others too."""
        origins = np.where(self.origins == self.starts, self.origins + starts, self.origins)
        return replace(self, times=self.times + times, starts=self.starts + starts, origins=origins)

    def _variable(self, n: int, times: Floats) -> Floats:
        """What the values of segment `n` are smooth in."""
        first, last = self.rows[n]
        elapsed = np.maximum(times - self.origins[n], 0.0)
        if last - first == 1:  # a single step: the few seconds of a ramp, elastic and so straight
            return np.asarray(elapsed)
        return np.asarray(np.log1p((elapsed / OFFSET) ** self.exponents[n]))


def _spline_knots(places: Floats) -> Bools:
    """All knots, less the last but one where a short last step, cut off by the end, would make a slope of its error."""
    kept = np.ones(places.size, bool)
    if places.size > 3:
        before, final = np.diff(places[-3:])
        kept[-2] = final > SHORT * before
    return kept


def _spline(before: Floats, values: Floats, after: Floats) -> Floats:
    """Values at places `after` from those at `before`."""
    if before.size == 1:
        return np.repeat(values, after.size, axis=0)
    return np.asarray(CubicSpline(before, values)(after))
