"""The march through a load program: stages, error control, step lengths, and the record of accepted steps."""

from __future__ import annotations

from math import sqrt
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from creepkit.arrays import Floats, Ints
from creepkit.fem.band import solve_factorized
from creepkit.fem.body import Body
from creepkit.fem.element import Forces, Points, clear, error_forces, forces_of, point_room, points_of
from creepkit.fem.equilibrium import FOUND, UNSTABLE, balance
from creepkit.fem.material import EQUIVALENT, PointRoom, Stage
from creepkit.fem.strain import Three
from creepkit.integration.clock import Clock, moment, plain, position, virgin
from creepkit.integration.tableau import Tableau

(
    REACHED_END,
    DEFLECTION_LIMIT,
    STRAIN_LIMIT,
    STATE_LIMIT,
    LIMIT_LOAD,
    LOST_CONVERGENCE,
    TOO_MANY_STEPS,
) = range(7)
"""Codes of an ending; whatever it is, the history so far is kept."""

START, END, PRESSURE, END_PRESSURE, WARMTH, END_WARMTH, MODULUS, END_MODULUS, MOTION, END_MOTION = range(10)
"""Columns of a segment: times s, pressures MPa, temperatures K, moduli E MPa, and the motion of held nodes, at both ends."""


class Settings(NamedTuple):
    """How accurately, and how far, to march.

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


class Record(NamedTuple):
    """Accepted steps: (records,) times s, segment of each; displacements (records, 2 nodes); and if kept, the points.

    values : (records or 0, points, V). mises : (records, points) MPa. counts : (4,) accepted, rejected, full and light
    passes of equilibrium. For sensitivities, where the step began and its length in the position of its clock, (records, 2)
    `places`; and, if kept, what the stages found: displacements (records or 0, stages, 2 nodes) in `stages`, and
    `slopes` (records or 0, stages, points, V).
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


class Rooms(NamedTuple):
    """Working arrays of a march: points, one point, forces; displacements (2 nodes,) now, at the start of the step, and
    (stages, 2 nodes) at the stages.
    """

    points: Points
    point: PointRoom
    forces: Forces
    displacement: Floats
    start: Floats
    stages: Floats


class Ended(NamedTuple):
    """Number of records, code, time s."""

    records: int
    code: int
    time: float


@njit(cache=True, error_model="numpy")
def stage_at(segment: Floats, poisson: float, time: float, weight: float, tolerance: float) -> Stage:
    """What all points share at a time of a segment."""
    share = (time - segment[START]) / (segment[END] - segment[START])
    modulus = segment[MODULUS] + share * (segment[END_MODULUS] - segment[MODULUS])
    return Stage(
        weight,
        time,
        segment[WARMTH] + share * (segment[END_WARMTH] - segment[WARMTH]),
        modulus / (3.0 * (1.0 - 2.0 * poisson)),
        modulus / (2.0 * (1.0 + poisson)),
        segment[PRESSURE] + share * (segment[END_PRESSURE] - segment[PRESSURE]),
        tolerance,
    )


@njit(cache=True, error_model="numpy")
def clock_of(segment: Floats, beta: float) -> Clock:
    """t^beta from time zero, for a law whose strain begins as t^beta; plain time while the load rises from nothing."""
    start, length = segment[START], segment[END] - segment[START]
    if beta >= 1.0 or (start == 0.0 and segment[PRESSURE] == 0.0):
        return plain(start, length)
    if start == 0.0:
        return virgin(start, length, beta)
    return Clock(start, length, max(beta, 0.05), start)


@njit(cache=True, error_model="numpy")
def set_base(points: Points, tableau: Tableau, h: float, i: int) -> None:
    """Write the history of stage `i`."""
    for k in range(points.value.shape[0]):
        for v in range(points.value.shape[1]):
            total = points.value[k, v]
            for j in range(i):
                total += h * tableau.a[i, j] * points.slopes[j, k, v]
            points.base[k, v] = total


@njit(cache=True, error_model="numpy")
def set_slopes(points: Points, share: float, i: int) -> None:
    """Write the slopes of stage `i` from its increments; share : gamma h."""
    inverse = 1.0 / share
    for k in range(points.value.shape[0]):
        rate = points.increments[k] * inverse
        slopes, direction = points.slopes[i, k], points.directions[k]
        for v in range(EQUIVALENT):
            slopes[v] = rate * direction[v]
        slopes[EQUIVALENT] = rate
        for v in range(EQUIVALENT + 1, slopes.size):
            slopes[v] = (points.states[k, v - EQUIVALENT - 1] - points.base[k, v]) * inverse


@njit(cache=True, error_model="numpy")
def finish(points: Points, tableau: Tableau, h: float) -> tuple[float, float]:
    """Move the points to the end of the step; return the largest equivalent creep strain."""
    last, worst = tableau.c.size - 1, 0.0
    for k in range(points.value.shape[0]):
        for v in range(points.value.shape[1]):
            total = points.value[k, v]
            for i in range(tableau.c.size):
                total += h * tableau.a[last, i] * points.slopes[i, k, v]
            points.value[k, v] = total
        worst = max(worst, points.value[k, EQUIVALENT])
    return worst, 0.0


@njit(cache=True, error_model="numpy")
def copy(source: Floats, target: Floats) -> None:
    """Copy a vector."""
    for k in range(source.size):
        target[k] = source[k]


@njit(cache=True, error_model="numpy")
def _start(points: Points, initial: Floats) -> None:
    """Virgin points."""
    for k in range(points.value.shape[0]):
        points.increments[k] = 0.0
        points.mises[k] = 0.0
        for v in range(points.value.shape[1]):
            points.value[k, v] = initial[v - EQUIVALENT - 1] if v > EQUIVALENT else 0.0
            for i in range(points.slopes.shape[0]):
                points.slopes[i, k, v] = 0.0
        for i in range(initial.size):
            points.states[k, i] = initial[i]


def rooms_of(body: Body, states: int, stages: int) -> Rooms:
    """Allocate the working arrays."""
    size = body.equations.size
    return Rooms(
        points_of(4 * len(body.elements), states, stages),
        point_room(states, 0),
        forces_of(body),
        np.zeros(size),
        np.zeros(size),
        np.zeros((stages, size)),
    )


@njit(cache=True, error_model="numpy", nogil=True)
def march(
    update: Any,
    theta: Floats,
    beta: float,
    poisson: float,
    body: Body,
    segments: Floats,
    pattern: Floats,
    initial: Floats,
    limits: Floats,
    settings: Settings,
    tableau: Tableau,
    rooms: Rooms,
    script: Floats,
    record: Record,
) -> Ended:
    """Run the program; fill `record` from its first row on, which holds the body at rest.

    segments : (segments, 10). pattern : (2 nodes,) displacement of held nodes for a unit of motion, mm.
    initial, limits : (S,) states. script : (records, 2) places of another march, to make the very same steps; (0, 2) for
    steps by error control.
    """
    points, room, forces, u = rooms.points, rooms.point, rooms.forces, rooms.displacement
    _start(points, initial)
    clear(u)
    ended = Ended(1, REACHED_END, 0.0)
    before = (0.0, 0.0, 0.0)
    for n in range(segments.shape[0]):
        segment = segments[n]
        if _jumps(before, segment):
            ended = _jump(update, theta, poisson, body, segment, n, pattern, before, settings, rooms, record, ended)
            if ended.code != REACHED_END:
                return ended
        ended = _segment(
            update, theta, clock_of(segment, beta), poisson, body, segment, n, pattern, limits, initial, settings, tableau,
            rooms, script, record, ended,
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


@njit(cache=True, error_model="numpy")
def largest_rise(body: Body, u: Floats) -> float:
    """Largest displacement of the observed surface, or of the whole body if none is observed, mm."""
    worst = 0.0
    if body.top.size > 0:
        for k in range(body.top.size):
            worst = max(worst, abs(u[2 * body.top[k] + 1]))
        return worst
    for k in range(u.size):
        worst = max(worst, abs(u[k]))
    return worst


@njit(cache=True, error_model="numpy", inline="always")
def _jump(
    update: Any, theta: Floats, poisson: float, body: Body, segment: Floats, n: int, pattern: Floats, before: Three,
    settings: Settings, rooms: Rooms, record: Record, ended: Ended,
) -> Ended:  # fmt: skip
    """The elastic change at a sudden change of load, in as many parts as it needs; recorded at the segment's start."""
    points, u, start = rooms.points, rooms.displacement, rooms.start
    done, part = 0.0, 1.0
    copy(u, start)
    for k in range(points.value.shape[0]):
        for v in range(points.value.shape[1]):
            points.base[k, v] = points.value[k, v]
    target = stage_at(segment, poisson, segment[START], 0.0, 1e-6)
    for _ in range(60):
        now = min(1.0, done + part)
        pressure = before[0] + now * (target.pressure - before[0])
        stage = Stage(0.0, target.time, target.temperature, target.bulk, target.shear, pressure, target.tolerance)
        motion = before[2] + now * (segment[MOTION] - before[2])
        hold(body, pattern, motion, u)
        newton = settings.newton * (0.01 + largest_rise(body, u))
        outcome = balance(update, theta, body, stage, u, points, rooms.point, rooms.forces, newton, 1.0)
        record.counts[2] += outcome.full
        record.counts[3] += outcome.light
        if outcome.flag == FOUND:
            done = now
            copy(u, start)
            if done == 1.0:
                return keep(record, ended, segment[START], n, u, points)
        else:
            copy(start, u)
            part *= 0.25
            if part < 1e-5:
                break
    return Ended(ended.records, LIMIT_LOAD, segment[START])


@njit(cache=True, error_model="numpy")
def hold(body: Body, pattern: Floats, motion: float, u: Floats) -> None:
    """Put held nodes where the motion takes them."""
    for k in range(pattern.size):
        if body.equations[k] < 0:
            u[k] = motion * pattern[k]


@njit(cache=True, error_model="numpy")
def keep(record: Record, ended: Ended, time: float, n: int, u: Floats, points: Points) -> Ended:
    """Write a row of the record."""
    row = ended.records
    record.times[row], record.segments[row] = time, n
    copy(u, record.displacements[row])
    copy(points.mises, record.mises[row])
    if record.values.shape[0] > 0:
        for k in range(points.value.shape[0]):
            copy(points.value[k], record.values[row, k])
    return Ended(row + 1, REACHED_END, time)


@njit(cache=True, error_model="numpy", inline="always")
def _segment(
    update: Any, theta: Floats, clock: Clock, poisson: float, body: Body, segment: Floats, n: int, pattern: Floats,
    limits: Floats, initial: Floats, settings: Settings, tableau: Tableau, rooms: Rooms, script: Floats, record: Record,
    ended: Ended,
) -> Ended:  # fmt: skip
    """March over one segment in the position s of its clock, from 0 to 1."""
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
            return Ended(ended.records, TOO_MANY_STEPS, ended.time)
        outcome, error = _step(
            update, theta, clock, poisson, body, segment, pattern, settings, tableau, rooms, record, first,
            ended.records, s, h,
        )  # fmt: skip
        if outcome != FOUND or not (error <= 1.0 or told):
            copy(start, u)
            record.counts[1] += 1
            failures += 1
            h *= 0.25 if outcome != FOUND else max(0.2, 0.9 / sqrt(error))
            if failures > 12 or h < 1e-12:
                code = LIMIT_LOAD if outcome == UNSTABLE or _rises(segment) else LOST_CONVERGENCE
                return Ended(ended.records, code, ended.time)
            continue
        failures = 0
        record.counts[0] += 1
        worst, _ = finish(points, tableau, h)
        row = ended.records
        record.places[row, 0], record.places[row, 1] = s, h
        if record.stages.shape[0] > 0:
            for i in range(tableau.c.size):
                copy(rooms.stages[i], record.stages[row, i])
                for k in range(points.value.shape[0]):
                    copy(points.slopes[i, k], record.slopes[row, i, k])
        s = 1.0 if h == 1.0 - s else s + h
        time = segment[END] if s == 1.0 else moment(clock, s).time
        elapsed = time - segment[START]
        ended = keep(record, ended, time, n, u, points)
        copy(u, start)
        if largest_rise(body, u) >= settings.deflection_limit:
            return Ended(ended.records, DEFLECTION_LIMIT, time)
        if worst >= settings.strain_limit:
            return Ended(ended.records, STRAIN_LIMIT, time)
        if _failed(points, limits, initial):
            return Ended(ended.records, STATE_LIMIT, time)
        h *= min(4.0, max(0.3, 0.9 / sqrt(max(error, 1e-12))))
    return ended


@njit(cache=True, error_model="numpy")
def _rises(segment: Floats) -> bool:
    return bool(segment[END_PRESSURE] != segment[PRESSURE])


@njit(cache=True, error_model="numpy")
def _failed(points: Points, limits: Floats, initial: Floats) -> bool:
    """Whether a state of any point has passed its limit."""
    for i in range(limits.size):
        up = limits[i] > initial[i]
        for k in range(points.value.shape[0]):
            value = points.value[k, EQUIVALENT + 1 + i]
            if (up and value >= limits[i]) or (not up and value <= limits[i]):
                return True
    return False


@njit(cache=True, error_model="numpy", inline="always")
def _step(
    update: Any, theta: Floats, clock: Clock, poisson: float, body: Body, segment: Floats, pattern: Floats,
    settings: Settings, tableau: Tableau, rooms: Rooms, record: Record, first: int, rows: int, s: float, h: float,
) -> tuple[int, float]:  # fmt: skip
    """Try one step from `s`; the displacement ends where the last stage does.

    Return a flag and the error over what is allowed.
    """
    points, forces, u, start, stage_u = rooms.points, rooms.forces, rooms.displacement, rooms.start, rooms.stages
    last = tableau.c.size - 1
    scale = 0.01 + largest_rise(body, start)
    stage = stage_at(segment, poisson, segment[START], 0.0, 1e-3)
    for i in range(tableau.c.size):
        now = moment(clock, s + tableau.c[i] * h)
        share = tableau.a[i, i] * h
        stage = stage_at(segment, poisson, now.time, share * np.exp(now.log_pace), 1e-3)
        set_base(points, tableau, h, i)
        _guess(points, share, i, last)
        _predict(record, first, rows, stage_u, i, start, clock, segment, s, tableau, h, u)
        motion = segment[MOTION] + (segment[END_MOTION] - segment[MOTION]) * (now.time - clock.start) / clock.length
        hold(body, pattern, motion, u)
        outcome = balance(update, theta, body, stage, u, points, rooms.point, forces, settings.newton * scale, 1.0)
        record.counts[2] += outcome.full
        record.counts[3] += outcome.light
        if outcome.flag != FOUND:
            return outcome.flag, 0.0
        set_slopes(points, share, i)
        copy(u, stage_u[i])
    error_forces(body, stage, u, points, h * tableau.error, forces)
    solve_factorized(forces.band, body.size, body.width, forces.residual)
    error = 0.0
    for k in range(body.size):
        error = max(error, abs(forces.residual[k]))
    return FOUND, error / (settings.tolerance * scale)


@njit(cache=True, error_model="numpy")
def _guess(points: Points, share: float, i: int, last: int) -> None:
    """Guess increments and states of stage `i` from the stage (or the step) before."""
    before = i - 1 if i > 0 else last
    for k in range(points.value.shape[0]):
        increment = points.slopes[before, k, EQUIVALENT] * share
        points.increments[k] = increment if increment > 0.0 else 1e-6
        for v in range(points.states.shape[1]):
            at = EQUIVALENT + 1 + v
            points.states[k, v] = points.base[k, at] + share * points.slopes[before, k, at]


@njit(cache=True, error_model="numpy")
def _predict(
    record: Record, first: int, rows: int, stage_u: Floats, i: int, start: Floats, clock: Clock, segment: Floats, s: float,
    tableau: Tableau, h: float, u: Floats,
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
