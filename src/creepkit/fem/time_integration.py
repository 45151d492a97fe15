"""Time integration over a load program, and the exact derivatives of its accepted steps."""

from __future__ import annotations

from math import exp, sqrt
from typing import Any

from numba import njit

from creepkit.arrays import Floats
from creepkit.fem.assembly import PointStates
from creepkit.fem.banded_system import FiniteElementModel, eliminate_rows, solve_rows
from creepkit.fem.kinematics import Three, clear
from creepkit.fem.material_point import EQUIVALENT_STRAIN, PointWorkspace, StageConditions
from creepkit.fem.point_sensitivities import (
    BY_MOMENT,
    SensitivityDirections,
    SensitivityWorkspace,
    set_input_derivatives,
)
from creepkit.fem.stage_sensitivities import (
    assemble_sensitivities,
    clear_rows,
    pressure_sensitivities,
    rate_sensitivities,
)
from creepkit.fem.step_record import (
    DEFLECTION_LIMIT,
    END,
    END_MODULUS,
    END_MOTION,
    END_PRESSURE,
    LAW_FAILED,
    LIMIT_LOAD,
    LOST_CONVERGENCE,
    MODULUS,
    MOTION,
    PRESSURE,
    REACHED_END,
    START,
    STATE_LIMIT,
    STRAIN_LIMIT,
    TOO_MANY_STEPS,
    SolverSettings,
    SolverWorkspace,
    StepRecord,
    Termination,
    copy,
    make_virgin,
    record_step,
)
from creepkit.fem.time_step import (
    CONVERGED,
    UNDEFINED,
    attempt_step,
    finish_step,
    largest_displacement,
    prescribe_motion,
    segment_transformation,
    solve_equilibrium,
    stage_at,
)
from creepkit.integration.time_discretisation import Tableau, TimeTransformation, position, transformed_time

_SMALLEST = 1e-9
"""Least step, as a share of the position it begins at."""


@njit(cache=True, error_model="numpy", nogil=True)
def integrate_program(
    update: Any,
    theta: Floats,
    beta: float,
    poisson: float,
    body: FiniteElementModel,
    segments: Floats,
    pattern: Floats,
    initial: Floats,
    limits: Floats,
    settings: SolverSettings,
    tableau: Tableau,
    rooms: SolverWorkspace,
    script: Floats,
    record: StepRecord,
) -> Termination:
    """Run the program; fill `record` from its first row on, which holds the body at rest.

    segments : (segments, 10). pattern : (2 nodes,) displacement of held nodes for a unit of motion, mm.
    initial, limits : (S,) states.
    script : (records, 2) positions of another simulation, to make the very same steps; (0, 2) for steps by error
        control.
    """
    make_virgin(rooms.points, initial)
    clear(rooms.displacement)
    ended = Termination(1, REACHED_END, 0.0)
    before = (0.0, 0.0, 0.0)
    for n in range(segments.shape[0]):
        segment = segments[n]
        if _jumps(before, segment):
            ended = _jump(update, theta, poisson, body, segment, n, pattern, before, settings, rooms, record, ended)
            if ended.code != REACHED_END:
                return ended
        ended = _segment(
            update, theta, segment_transformation(segment, beta), poisson, body, segment, n, pattern, limits, initial,
            settings, tableau, rooms, script, record, ended,
        )  # fmt: skip
        if ended.code != REACHED_END:
            return ended
        before = (segment[END_PRESSURE], segment[END_MODULUS], segment[END_MOTION])
    return ended


@njit(cache=True, error_model="numpy")
def _jumps(before: Three, segment: Floats) -> bool:
    """Whether load, modulus or motion is another than at the end of the segment before."""
    if segment[PRESSURE] != before[0] or segment[MOTION] != before[2]:
        return True
    return bool(before[1] != 0.0 and segment[MODULUS] != before[1])


@njit(cache=True, error_model="numpy", inline="always")
def _jump(
    update: Any, theta: Floats, poisson: float, body: FiniteElementModel, segment: Floats, n: int, pattern: Floats,
    before: Three, settings: SolverSettings, rooms: SolverWorkspace, record: StepRecord, ended: Termination,
) -> Termination:  # fmt: skip
    """The elastic change at a sudden change of load, in as many parts as it needs; recorded at the segment's start."""
    points, u, start = rooms.points, rooms.displacement, rooms.start
    done, part = 0.0, 1.0
    copy(u, start)
    for k in range(points.value.shape[0]):
        for v in range(points.value.shape[1]):
            points.base[k, v] = points.value[k, v]
    target = stage_at(segment, poisson, segment[START], 0.0)
    for _ in range(60):
        now = min(1.0, done + part)
        pressure = before[0] + now * (target.pressure - before[0])
        stage = StageConditions(0.0, target.time, target.temperature, target.bulk, target.shear, pressure)
        motion = before[2] + now * (segment[MOTION] - before[2])
        prescribe_motion(body, pattern, motion, u)
        newton = settings.newton * (0.01 + largest_displacement(body, u))
        outcome = solve_equilibrium(update, theta, body, stage, u, points, rooms.point, rooms.forces, newton, 1.0, 1e-3)
        record.counts[2] += outcome.full
        record.counts[3] += outcome.light
        if outcome.flag == CONVERGED:
            done = now
            copy(u, start)
            if done == 1.0:
                return record_step(record, ended, segment[START], n, u, points)
        else:
            copy(start, u)
            part *= 0.25
            if part < 1e-5:
                break
    return Termination(ended.records, LIMIT_LOAD, segment[START])


@njit(cache=True, error_model="numpy", inline="always")
def _segment(
    update: Any, theta: Floats, clock: TimeTransformation, poisson: float, body: FiniteElementModel, segment: Floats,
    n: int, pattern: Floats, limits: Floats, initial: Floats, settings: SolverSettings, tableau: Tableau,
    rooms: SolverWorkspace, script: Floats, record: StepRecord, ended: Termination,
) -> Termination:  # fmt: skip
    """Integrate over one segment in its transformed time s, from 0 to 1."""
    s, elapsed, length = 0.0, 0.0, segment[END] - segment[START]
    h = position(clock, segment[START] + min(settings.first, length))
    first, failures = ended.records - 1, 0
    points, u, start = rooms.points, rooms.displacement, rooms.start
    copy(u, start)
    while s < 1.0:
        reach = position(clock, segment[START] + min(2.0 * elapsed + settings.first, length))
        h = min(h, reach - s)
        if s + 1.0001 * h > 1.0:
            h = 1.0 - s
        told = ended.records < script.shape[0]
        if told:
            h = min(script[ended.records, 1], 1.0 - s)
        if record.counts[0] + record.counts[1] >= settings.max_steps:
            return Termination(ended.records, TOO_MANY_STEPS, ended.time)
        outcome, error = attempt_step(
            update, theta, clock, poisson, body, segment, pattern, settings, tableau, rooms, record,
            first if failures == 0 else ended.records, ended.records, s, h,
        )  # fmt: skip
        if outcome != CONVERGED or not (error <= 1.0 or told):
            copy(start, u)
            record.counts[1] += 1
            failures += 1
            h *= 0.25 if outcome != CONVERGED else max(0.2, 0.9 / sqrt(error))
            if failures > 12 or h < _SMALLEST * s:
                code = LIMIT_LOAD if _rises(segment) else LOST_CONVERGENCE
                code = LAW_FAILED if outcome == UNDEFINED else code
                return Termination(ended.records, code, ended.time)
            continue
        failures = 0
        record.counts[0] += 1
        worst, _ = finish_step(points, tableau, h)
        row = ended.records
        record.places[row, 0], record.places[row, 1] = s, h
        if record.stages.shape[0] > 0:
            for i in range(tableau.c.size):
                copy(rooms.stages[i], record.stages[row, i])
                for k in range(points.value.shape[0]):
                    copy(points.slopes[i, k], record.slopes[row, i, k])
        s = 1.0 if h == 1.0 - s else s + h
        time = segment[END] if s == 1.0 else transformed_time(clock, s).time
        elapsed = time - segment[START]
        ended = record_step(record, ended, time, n, u, points)
        copy(u, start)
        if largest_displacement(body, u) >= settings.deflection_limit:
            return Termination(ended.records, DEFLECTION_LIMIT, time)
        if worst >= settings.strain_limit:
            return Termination(ended.records, STRAIN_LIMIT, time)
        if _failed(points, limits, initial):
            return Termination(ended.records, STATE_LIMIT, time)
        h *= min(4.0, max(0.3, 0.9 / sqrt(max(error, 1e-12))))
    return ended


@njit(cache=True, error_model="numpy")
def _rises(segment: Floats) -> bool:
    return bool(segment[END_PRESSURE] != segment[PRESSURE])


@njit(cache=True, error_model="numpy")
def _failed(points: PointStates, limits: Floats, initial: Floats) -> bool:
    """Whether a state of any point has passed its limit."""
    for i in range(limits.size):
        up = limits[i] > initial[i]
        for k in range(points.value.shape[0]):
            value = points.value[k, EQUIVALENT_STRAIN + 1 + i]
            if (up and value >= limits[i]) or (not up and value <= limits[i]):
                return True
    return False


DONE, SINGULAR = range(2)
"""Flags: done; a tangent was singular."""


@njit(cache=True, error_model="numpy", nogil=True)
def differentiate_program(
    sensitivity: Any,
    theta: Floats,
    beta: float,
    poisson: float,
    body: FiniteElementModel,
    segments: Floats,
    columns: SensitivityDirections,
    tableau: Tableau,
    initial: Floats,
    record: StepRecord,
    count: int,
    point: PointWorkspace,
    room: SensitivityWorkspace,
    surface: Floats,
    times: Floats,
) -> int:
    """Fill `surface` (records, top, C), changes of u_z of the observed nodes, and `times` (records, D), s.

    record : of a simulation that kept its stages; count : its rows. The first row is the body at rest; a row whose step
        has no length is a sudden change of load, with one stage.
    """
    _start_sensitivities(room, initial)
    for row in range(1, count):
        n = record.segments[row]
        segment, s, h = segments[n], record.places[row, 0], record.places[row, 1]
        sudden = h == 0.0
        for i in range(1 if sudden else tableau.c.size):
            at, time, weight = s + tableau.c[i] * h, segment[START], 0.0
            if not sudden:
                now = transformed_time(segment_transformation(segment, beta), at)
                time, weight = now.time, tableau.a[i, i] * h * exp(now.log_pace)
            stage = stage_at(segment, poisson, time, weight)
            set_input_derivatives(segments, columns.directions, n, beta, at, sudden, room.inputs)
            if not _stage_sensitivities(
                sensitivity, theta, stage, body, columns, tableau, record, row, i, h, point, room
            ):
                return SINGULAR
        for d in range(times.shape[1]):
            times[row, d] = room.inputs[BY_MOMENT, d]
        if not sudden:
            _advance_sensitivities(record, row, tableau, h, room)
        for k in range(body.top.size):
            equation = body.equations[2 * body.top[k] + 1]
            for c in range(surface.shape[2]):
                surface[row, k, c] = room.right[equation, c] if equation >= 0 else 0.0
    return DONE


@njit(cache=True, error_model="numpy")
def _start_sensitivities(room: SensitivityWorkspace, initial: Floats) -> None:
    for k in range(room.value.shape[0]):
        for v in range(room.value.shape[1]):
            room.value[k, v] = initial[v - EQUIVALENT_STRAIN - 1] if v > EQUIVALENT_STRAIN else 0.0
            for c in range(room.change.shape[2]):
                room.change[k, v, c] = 0.0


@njit(cache=True, error_model="numpy")
def _advance_sensitivities(
    record: StepRecord, row: int, tableau: Tableau, h: float, room: SensitivityWorkspace
) -> None:
    """Move history and its changes to the end of the step."""
    last = tableau.c.size - 1
    value, change, rates = room.value, room.change, room.rates
    for k in range(value.shape[0]):
        for v in range(value.shape[1]):
            for i in range(tableau.c.size):
                factor = h * tableau.a[last, i]
                value[k, v] += factor * record.slopes[row, i, k, v]
                for c in range(change.shape[2]):
                    change[k, v, c] += factor * rates[i, k, v, c]


@njit(cache=True, error_model="numpy", inline="always")
def _stage_sensitivities(
    sensitivity: Any,
    theta: Floats,
    stage: StageConditions,
    body: FiniteElementModel,
    columns: SensitivityDirections,
    tableau: Tableau,
    record: StepRecord,
    row: int,
    i: int,
    h: float,
    point: PointWorkspace,
    room: SensitivityWorkspace,
) -> bool:
    """Changes of the displacements (left in room.right) and of the slopes of stage `i`; False when singular."""
    share, displacement = tableau.a[i, i] * h, record.stages[row, i]
    clear_rows(room.rows)
    clear_rows(room.right)
    assemble_sensitivities(
        sensitivity, theta, stage, body, columns, tableau, record.slopes, row, i, h, share, point, room, displacement
    )
    pressure_sensitivities(body, stage.pressure, columns, theta.size, displacement, room)
    size, width = body.size, body.width
    if not eliminate_rows(room.rows, size, width):
        return False
    solve_rows(room.rows, size, width, room.right)
    if h > 0.0:
        rate_sensitivities(
            body, stage, columns, theta.size, record.slopes, row, i, h, share, tableau, room, displacement
        )
    return True
