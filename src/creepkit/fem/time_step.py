"""One time step: its stages, Newton's method for equilibrium, and the estimated error of the displacements."""

from __future__ import annotations

from math import exp, isfinite, sqrt
from typing import Any, NamedTuple

from numba import njit

from creepkit.arrays import Floats
from creepkit.fem.assembly import BALANCED, RATE_UNDEFINED, ForceWorkspace, PointStates, assemble, error_forces
from creepkit.fem.banded_system import FiniteElementModel, factorize, solve_factorized
from creepkit.fem.material_point import EQUIVALENT_STRAIN, PointWorkspace, StageConditions
from creepkit.fem.step_record import (
    END,
    END_MODULUS,
    END_MOTION,
    END_PRESSURE,
    FINAL_TEMPERATURE,
    MODULUS,
    MOTION,
    PRESSURE,
    START,
    START_TEMPERATURE,
    SolverSettings,
    SolverWorkspace,
    StepRecord,
    copy,
)
from creepkit.integration.time_discretisation import (
    Tableau,
    TimeTransformation,
    linear_time,
    position,
    power_law_time,
    transformed_time,
)

CONVERGED, NO_STRESS, UNSTABLE, TOO_FAR, TOO_MANY, UNDEFINED = range(6)
"""Flags: found; a point had no solution; the tangent is not positive definite; corrections grow; too many of them; the
law gave no finite rate."""


_ITERATIONS = 16


_LOOSE = 0.03
"""Tolerance of the points' own equations in the first pass, from which the displacements move anyway."""


_KEEP = 0.3
"""The tangent is kept while each correction is at most this share of the one before."""


class EquilibriumResult(NamedTuple):
    """Flag, and how many passes with and without a new tangent it took."""

    flag: int
    full: int
    light: int


@njit(cache=True, error_model="numpy", inline="always")
def solve_equilibrium(
    update: Any,
    theta: Floats,
    body: FiniteElementModel,
    stage: StageConditions,
    displacement: Floats,
    points: PointStates,
    room: PointWorkspace,
    forces: ForceWorkspace,
    tolerance: float,
    longest: float,
    tight: float,
) -> EquilibriumResult:
    """Bring `displacement` (2 nodes,) to equilibrium; corrections below `tolerance`, mm, end the search.

    longest : mm, corrections are cut to this. tight : tolerance of the points' own equations once near.
    """
    before, size, factor, full, light = 0.0, 0.0, 1.0, 0, 0
    for iteration in range(_ITERATIONS):
        stiff = iteration == 0 or factor < 1.0 or (iteration > 1 and size > _KEEP * before)
        local = max(tight, _LOOSE) if iteration == 0 else tight
        flag = assemble(update, theta, body, stage, displacement, points, room, forces, stiff, local)
        if flag != BALANCED:
            return EquilibriumResult(UNDEFINED if flag == RATE_UNDEFINED and iteration < 2 else NO_STRESS, full, light)
        if stiff:
            full += 1
            if not factorize(forces.band, body.size, body.width, forces.block):
                return EquilibriumResult(UNSTABLE, full, light)
        else:
            light += 1
        solve_factorized(forces.band, body.size, body.width, forces.residual)
        before, size = size, _largest(forces.residual, body.size)
        if not isfinite(size) or (iteration > 6 and size > before):
            return EquilibriumResult(TOO_FAR, full, light)
        factor = min(1.0, longest / size) if size > 0.0 else 1.0
        for k in range(displacement.size):
            equation = body.equations[k]
            if equation >= 0:
                displacement[k] -= factor * forces.residual[equation]
        if size <= tolerance:
            return EquilibriumResult(CONVERGED, full, light)
    return EquilibriumResult(TOO_MANY, full, light)


@njit(cache=True, error_model="numpy")
def _largest(values: Floats, size: int) -> float:
    worst = 0.0
    for k in range(size):
        if not isfinite(values[k]):
            return float(values[k])
        worst = max(worst, abs(values[k]))
    return worst


@njit(cache=True, error_model="numpy")
def stage_at(segment: Floats, poisson: float, time: float, weight: float) -> StageConditions:
    """What all points share at a time of a segment."""
    share = (time - segment[START]) / (segment[END] - segment[START])
    modulus = segment[MODULUS] + share * (segment[END_MODULUS] - segment[MODULUS])
    return StageConditions(
        weight,
        time,
        segment[START_TEMPERATURE] + share * (segment[FINAL_TEMPERATURE] - segment[START_TEMPERATURE]),
        modulus / (3.0 * (1.0 - 2.0 * poisson)),
        modulus / (2.0 * (1.0 + poisson)),
        segment[PRESSURE] + share * (segment[END_PRESSURE] - segment[PRESSURE]),
    )


@njit(cache=True, error_model="numpy")
def segment_transformation(segment: Floats, beta: float) -> TimeTransformation:
    """t^beta from time zero, for a law whose strain begins as t^beta; plain time while the load rises from nothing."""
    start, length = segment[START], segment[END] - segment[START]
    if beta >= 1.0 or (start == 0.0 and segment[PRESSURE] == 0.0):
        return linear_time(start, length)
    if start == 0.0:
        return power_law_time(start, length, beta)
    return TimeTransformation(start, length, max(beta, 0.05), start)


@njit(cache=True, error_model="numpy")
def set_stage_history(points: PointStates, tableau: Tableau, h: float, i: int) -> None:
    """Write the history of stage `i`."""
    for k in range(points.value.shape[0]):
        for v in range(points.value.shape[1]):
            total = points.value[k, v]
            for j in range(i):
                total += h * tableau.a[i, j] * points.slopes[j, k, v]
            points.base[k, v] = total


@njit(cache=True, error_model="numpy")
def set_slopes(points: PointStates, share: float, i: int) -> None:
    """Write the slopes of stage `i` from its increments; share : gamma h."""
    inverse = 1.0 / share
    for k in range(points.value.shape[0]):
        rate = points.increments[k] * inverse
        slopes, direction = points.slopes[i, k], points.directions[k]
        for v in range(EQUIVALENT_STRAIN):
            slopes[v] = rate * direction[v]
        slopes[EQUIVALENT_STRAIN] = rate
        for v in range(EQUIVALENT_STRAIN + 1, slopes.size):
            slopes[v] = (points.states[k, v - EQUIVALENT_STRAIN - 1] - points.base[k, v]) * inverse


@njit(cache=True, error_model="numpy")
def finish_step(points: PointStates, tableau: Tableau, h: float) -> tuple[float, float]:
    """Move the points to the end of the step; return the largest equivalent creep strain."""
    last, worst = tableau.c.size - 1, 0.0
    for k in range(points.value.shape[0]):
        for v in range(points.value.shape[1]):
            total = points.value[k, v]
            for i in range(tableau.c.size):
                total += h * tableau.a[last, i] * points.slopes[i, k, v]
            points.value[k, v] = total
        worst = max(worst, points.value[k, EQUIVALENT_STRAIN])
    return worst, 0.0


@njit(cache=True, error_model="numpy")
def largest_displacement(body: FiniteElementModel, u: Floats) -> float:
    """Largest displacement of the observed surface, or of the whole body if none is observed, mm."""
    worst = 0.0
    if body.top.size > 0:
        for k in range(body.top.size):
            worst = max(worst, abs(u[2 * body.top[k] + 1]))
        return worst
    for k in range(u.size):
        worst = max(worst, abs(u[k]))
    return worst


@njit(cache=True, error_model="numpy")
def prescribe_motion(body: FiniteElementModel, pattern: Floats, motion: float, u: Floats) -> None:
    """Put held nodes where the motion takes them."""
    for k in range(pattern.size):
        if body.equations[k] < 0:
            u[k] = motion * pattern[k]


@njit(cache=True, error_model="numpy", inline="always")
def attempt_step(
    update: Any, theta: Floats, clock: TimeTransformation, poisson: float, body: FiniteElementModel, segment: Floats,
    pattern: Floats, settings: SolverSettings, tableau: Tableau, rooms: SolverWorkspace, record: StepRecord, first: int,
    rows: int, s: float, h: float,
) -> tuple[int, float]:  # fmt: skip
    """Try one step from `s`; the displacement ends where the last stage does.

    Return a flag and the error over what is allowed.
    """
    points, forces, u, start, stage_u = rooms.points, rooms.forces, rooms.displacement, rooms.start, rooms.stages
    last = tableau.c.size - 1
    scale = 0.01 + largest_displacement(body, start)
    tight = min(1e-3, sqrt(settings.newton))
    stage = stage_at(segment, poisson, segment[START], 0.0)
    for i in range(tableau.c.size):
        now = transformed_time(clock, s + tableau.c[i] * h)
        share = tableau.a[i, i] * h
        stage = stage_at(segment, poisson, now.time, share * exp(now.log_pace))
        set_stage_history(points, tableau, h, i)
        _guess(points, share, i, last)
        _predict(record, first, rows, stage_u, i, start, clock, segment, s, tableau, h, u)
        motion = segment[MOTION] + (segment[END_MOTION] - segment[MOTION]) * (now.time - clock.start) / clock.length
        prescribe_motion(body, pattern, motion, u)
        outcome = solve_equilibrium(
            update, theta, body, stage, u, points, rooms.point, forces, settings.newton * scale, 1.0, tight
        )
        record.counts[2] += outcome.full
        record.counts[3] += outcome.light
        if outcome.flag != CONVERGED:
            return outcome.flag, 0.0
        set_slopes(points, share, i)
        copy(u, stage_u[i])
    error_forces(body, stage, u, points, h * tableau.error, forces)
    solve_factorized(forces.band, body.size, body.width, forces.residual)
    error = 0.0
    for k in range(body.size):
        error = max(error, abs(forces.residual[k]))
    return CONVERGED, error / (settings.tolerance * scale)


@njit(cache=True, error_model="numpy")
def _guess(points: PointStates, share: float, i: int, last: int) -> None:
    """Guess increments and states of stage `i` from the stage (or the step) before."""
    before = i - 1 if i > 0 else last
    for k in range(points.value.shape[0]):
        increment = points.slopes[before, k, EQUIVALENT_STRAIN] * share
        points.increments[k], points.trials[k, 0] = increment if increment > 0.0 else 1e-6, -1.0
        for v in range(points.states.shape[1]):
            at = EQUIVALENT_STRAIN + 1 + v
            points.states[k, v] = points.base[k, at] + share * points.slopes[before, k, at]


@njit(cache=True, error_model="numpy")
def _predict(
    record: StepRecord, first: int, rows: int, stage_u: Floats, i: int, start: Floats, clock: TimeTransformation,
    segment: Floats, s: float, tableau: Tableau, h: float, u: Floats,
) -> None:  # fmt: skip
    """Guess the displacements of stage `i` along a straight line through what was found last."""
    if i > 0:
        ratio = tableau.c[i] / tableau.c[i - 1]
        for k in range(u.size):
            u[k] = start[k] + ratio * (stage_u[i - 1, k] - start[k])
        return
    if rows - 1 > first:
        back = s - position(clock, record.times[rows - 2])
        ratio = tableau.c[0] * h / back
        for k in range(u.size):
            u[k] = start[k] + ratio * (start[k] - record.displacements[rows - 2, k])
