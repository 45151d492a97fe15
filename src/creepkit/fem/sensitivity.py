"""Sensitivities of a march: exact derivatives of the discrete scheme at frozen places of its steps.

A march that kept its stages is replayed. At each stage R(u; history, inputs) = 0 is differentiated: the exact
(unsymmetric) tangent is factorised once, and every column, a law parameter, a direction of the load program or a
number of the geometry, is one more right-hand side. With K du = -dR at fixed u known, each point's creep and states
follow by the response of its local equations. Steps keep their places s in a segment; where a column moves the ends of
segments, as a jump time does, the times of the steps move with them and their own derivatives are returned.
"""

from __future__ import annotations

from math import exp
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from creepkit.arrays import Floats, Ints
from creepkit.fem.band import eliminate_rows, solve_rows
from creepkit.fem.body import Body
from creepkit.fem.element import deformation, gather
from creepkit.fem.march import (
    END,
    END_MODULUS,
    END_PRESSURE,
    END_WARMTH,
    MODULUS,
    PRESSURE,
    START,
    WARMTH,
    Record,
    clock_of,
    stage_at,
)
from creepkit.fem.material import (
    EQUIVALENT,
    Elastic,
    PointRoom,
    Stage,
    axes_of,
    elastic_part,
    following,
    log_stress,
    problem_of,
    tangent_moduli,
)
from creepkit.fem.pressure import side_force, side_stiffness
from creepkit.fem.strain import (
    DIFFERENCE,
    HOOP,
    SHEAR,
    SUM,
    Five,
    Four,
    Kinematics,
    energy_slopes,
    kinematics,
    piola_tangent,
    strain_change,
    to_gradient,
)
from creepkit.integration.clock import moment
from creepkit.integration.problem import place
from creepkit.integration.response import (
    BY_LOG_WEIGHT,
    BY_MEAN,
    BY_PRINCIPAL,
    BY_STRAIN,
    BY_TEMPERATURE,
    BY_TIME,
    BY_TRIAL,
    INPUTS,
    gradient_of_sensitivity,
    respond,
)
from creepkit.integration.tableau import Tableau
from creepkit.kernels.interface import POINT_SIZE, TEMPERATURE, TIME, pointer

DONE, SINGULAR = range(2)

_FAST = {"reassoc", "contract", "nsz"}
_NUDGE = 1e-4
"""Share of a segment's length by which its ends are moved to difference its clock."""


class Columns(NamedTuple):
    """What is differentiated to, C = P + D + G columns: P law parameters, then these.

    directions : (D, segments, 10) change of the load program.
    gradients, hoops : (G, elements, 4, 2, 2) and (G, elements, 4), see fem.shape.GeometryChange.
    velocities : (G, 2 nodes) mm.
    """

    directions: Floats
    gradients: Floats
    hoops: Floats
    velocities: Floats


class ChangeRoom(NamedTuple):
    """Working arrays; V = 4 + S, R = 1 + S.

    value : (points, V); change : (points, V, C); rates : (stages, points, V, C) changes of the slopes;
    base : (points, V, C); own : (points, R, C) change of D and of the states at fixed strain; follow : (points, R, 4).
    rows : (size, 2 width + 1) tangent; right : (C, size). element : (4, 8, 8); products : (10, 8);
    local : (2, 8) displacements; force : (2, 8, 3), (2, 8); element_right : (16, C); moved : (16, C).
    inputs : (5, D) change of pressure, time, temperature, ln E and ln weight. side, sides, ends : of a pressed side.
    history : (V,) of a stage; by_strain : (4, 5).
    """

    value: Floats
    change: Floats
    rates: Floats
    base: Floats
    own: Floats
    follow: Floats
    rows: Floats
    right: Floats
    element: Floats
    products: Floats
    local: Floats
    force: Floats
    element_right: Floats
    moved: Floats
    inputs: Floats
    side: Floats
    sides: Floats
    ends: Floats
    history: Floats
    by_strain: Floats
    stress_change: Floats
    gradient_change: Floats


def change_room(body: Body, states: int, stages: int, columns: int, directions: int) -> ChangeRoom:
    """Allocate the working arrays."""
    points, size = 4 * len(body.elements), 4 + states
    return ChangeRoom(
        value=np.zeros((points, size)),
        change=np.zeros((points, size, columns)),
        rates=np.zeros((stages, points, size, columns)),
        base=np.zeros((points, size, columns)),
        own=np.zeros((points, 1 + states, columns)),
        follow=np.zeros((points, 1 + states, 4)),
        rows=np.zeros((body.size, 2 * body.width + 1)),
        right=np.zeros((columns, body.size)),
        element=np.zeros((4, 8, 8)),
        products=np.zeros((10, 8)),
        local=np.zeros((2, 8)),
        force=np.zeros((16, 3)),
        element_right=np.zeros((16, columns)),
        moved=np.zeros((16, columns)),
        inputs=np.zeros((5, directions)),
        side=np.zeros((2, 3)),
        sides=np.zeros((4, 3, 3)),
        ends=np.zeros((2, 3)),
        history=np.zeros(size),
        by_strain=np.zeros((4, 5)),
        stress_change=np.zeros((3, columns)),
        gradient_change=np.zeros((5, columns)),
    )


BY_PRESSURE, BY_MOMENT, BY_WARMTH, BY_STIFFNESS, BY_WEIGHT = range(5)
"""Rows of ChangeRoom.inputs."""


@njit(cache=True, error_model="numpy", nogil=True)
def differentiate(
    sensitivity: Any,
    theta: Floats,
    beta: float,
    poisson: float,
    body: Body,
    segments: Floats,
    columns: Columns,
    tableau: Tableau,
    initial: Floats,
    record: Record,
    count: int,
    point: PointRoom,
    room: ChangeRoom,
    surface: Floats,
    times: Floats,
) -> int:
    """Fill `surface` (records, top, C), changes of u_z of the observed nodes, and `times` (records, D), s.

    record : of a march that kept its stages; count : its rows. The first row is the body at rest.
    """
    _start(room, initial)
    for row in range(1, count):
        n = record.segments[row]
        segment, s, h = segments[n], record.places[row, 0], record.places[row, 1]
        if h == 0.0:
            _set_inputs(segments, columns.directions, n, beta, 0.0, True, room.inputs)
            stage = stage_at(segment, poisson, segment[START], 0.0, 1e-6)
            if not _stage(
                sensitivity,
                theta,
                stage,
                body,
                columns,
                tableau,
                record,
                row,
                0,
                0.0,
                point,
                room,
                record.displacements[row],
            ):
                return SINGULAR
            _write_times(columns.directions, n, START, times[row])
        else:
            for i in range(tableau.c.size):
                place_now = s + tableau.c[i] * h
                now = moment(clock_of(segment, beta), place_now)
                weight = tableau.a[i, i] * h * exp(now.log_pace)
                stage = stage_at(segment, poisson, now.time, weight, 1e-6)
                _set_inputs(segments, columns.directions, n, beta, place_now, False, room.inputs)
                if not _stage(
                    sensitivity,
                    theta,
                    stage,
                    body,
                    columns,
                    tableau,
                    record,
                    row,
                    i,
                    h,
                    point,
                    room,
                    record.stages[row, i],
                ):
                    return SINGULAR
            for d in range(times.shape[1]):
                times[row, d] = room.inputs[BY_MOMENT, d]
            _advance(record, row, tableau, h, room)
        for k in range(body.top.size):
            equation = body.equations[2 * body.top[k] + 1]
            for c in range(surface.shape[2]):
                surface[row, k, c] = room.right[c, equation] if equation >= 0 else 0.0
    return DONE


@njit(cache=True, error_model="numpy")
def _start(room: ChangeRoom, initial: Floats) -> None:
    for k in range(room.value.shape[0]):
        for v in range(room.value.shape[1]):
            room.value[k, v] = initial[v - EQUIVALENT - 1] if v > EQUIVALENT else 0.0
            for c in range(room.change.shape[2]):
                room.change[k, v, c] = 0.0


@njit(cache=True, error_model="numpy")
def _write_times(directions: Floats, n: int, column: int, times: Floats) -> None:
    for d in range(directions.shape[0]):
        times[d] = directions[d, n, column]


@njit(cache=True, error_model="numpy")
def _set_inputs(
    segments: Floats, directions: Floats, n: int, beta: float, s: float, at_start: bool, inputs: Floats
) -> None:
    """Change of pressure, time, temperature, ln E and ln weight with each direction, at place `s` of segment `n`."""
    segment = segments[n]
    length = segment[END] - segment[START]
    now = moment(clock_of(segment, beta), s) if not at_start else moment(clock_of(segment, 1.0), 1e-300)
    share = 0.0 if at_start else (now.time - segment[START]) / length
    modulus = segment[MODULUS] + share * (segment[END_MODULUS] - segment[MODULUS])
    for d in range(directions.shape[0]):
        change = directions[d, n]
        longer = change[END] - change[START]
        later, slower = change[START], 0.0
        if not at_start and (change[START] != 0.0 or longer != 0.0):
            step = _NUDGE * length
            up = moment(clock_of(segment + step * change, beta), s)
            down = moment(clock_of(segment - step * change, beta), s)
            later, slower = (up.time - down.time) / (2.0 * step), (up.log_pace - down.log_pace) / (2.0 * step)
        along = 0.0 if at_start else (later - change[START] - share * longer) / length
        inputs[BY_PRESSURE, d] = (
            change[PRESSURE] + share * (change[END_PRESSURE] - change[PRESSURE])
            + along * (segment[END_PRESSURE] - segment[PRESSURE])
        )  # fmt: skip
        inputs[BY_WARMTH, d] = (
            change[WARMTH] + share * (change[END_WARMTH] - change[WARMTH])
            + along * (segment[END_WARMTH] - segment[WARMTH])
        )  # fmt: skip
        stiffer = change[MODULUS] + share * (change[END_MODULUS] - change[MODULUS])
        inputs[BY_STIFFNESS, d] = (stiffer + along * (segment[END_MODULUS] - segment[MODULUS])) / modulus
        inputs[BY_MOMENT, d] = later
        inputs[BY_WEIGHT, d] = slower


@njit(cache=True, error_model="numpy")
def _advance(record: Record, row: int, tableau: Tableau, h: float, room: ChangeRoom) -> None:
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


@njit(cache=True, error_model="numpy")
def _stage(
    sensitivity: Any,
    theta: Floats,
    stage: Stage,
    body: Body,
    columns: Columns,
    tableau: Tableau,
    record: Record,
    row: int,
    i: int,
    h: float,
    point: PointRoom,
    room: ChangeRoom,
    displacement: Floats,
) -> bool:
    """Changes of the displacements (left in room.right) and of the slopes of stage `i`; False when singular."""
    share = tableau.a[i, i] * h
    _clear(room.rows)
    _clear(room.right)
    _assemble(
        sensitivity, theta, stage, body, columns, tableau, record.slopes, row, i, h, share, point, room, displacement
    )
    _press(body, stage.pressure, columns, theta.size, displacement, room)
    size, width = body.size, body.width
    if not eliminate_rows(room.rows, size, width):
        return False
    solve_rows(room.rows, size, width, room.right)
    if h > 0.0:
        _follow(body, stage, columns, theta.size, record.slopes, row, i, h, share, tableau, room, displacement)
    return True


@njit(cache=True, error_model="numpy")
def _clear(values: Floats) -> None:
    for i in range(values.shape[0]):
        for j in range(values.shape[1]):
            values[i, j] = 0.0


@njit(cache=True, error_model="numpy")
def _history(
    slopes: Floats, row: int, i: int, k: int, h: float, tableau: Tableau, value: Floats, change: Floats, rates: Floats,
    history: Floats, base: Floats,
) -> None:  # fmt: skip
    """History of point `k` in stage `i`, (V,), and its changes."""
    for v in range(history.size):
        total = value[k, v]
        for c in range(base.shape[2]):
            base[k, v, c] = change[k, v, c]
        for j in range(i):
            factor = h * tableau.a[i, j]
            total += factor * slopes[row, j, k, v]
            for c in range(base.shape[2]):
                base[k, v, c] += factor * rates[j, k, v, c]
        history[v] = total


@njit(cache=True, error_model="numpy")
def _assemble(
    sensitivity: Any,
    theta: Floats,
    stage: Stage,
    body: Body,
    columns: Columns,
    tableau: Tableau,
    slopes: Floats,
    row: int,
    i: int,
    h: float,
    share: float,
    point: PointRoom,
    room: ChangeRoom,
    displacement: Floats,
) -> None:
    """Exact tangent, and minus the out-of-balance forces of every column at fixed displacements."""
    elements, equations, weights = body.elements, body.equations, body.weights
    by_radius, by_height, over_radius = body.by_radius, body.by_height, body.over_radius
    value, change, rates, base, own, follow = room.value, room.change, room.rates, room.base, room.own, room.follow
    local, force, right, element_right = room.local, room.force, room.right, room.element_right
    element, products, history, tangent, dy = (
        room.element,
        room.products,
        room.history,
        point.tangent,
        room.stress_change,
    )
    parameters, count = theta.size, right.shape[0]
    directions = columns.directions.shape[0]
    wide = history.reshape(1, history.size)
    for e in range(elements.shape[0]):
        gather(elements, e, displacement, local)
        for a in range(4):
            for b in range(8):
                for c in range(8):
                    element[a, b, c] = 0.0
        _clear(element_right)
        for g in range(4):
            k = 4 * e + g
            _history(slopes, row, i, k, h, tableau, value, change, rates, history, base)
            at = kinematics(deformation(by_radius, by_height, over_radius, e, g, local))
            elastic = elastic_part(stage, at, wide, 0)
            increment = share * slopes[row, i, k, EQUIVALENT] if h > 0.0 else 0.0
            _answer(sensitivity, theta, stage, elastic, slopes, row, i, k, share, increment, h > 0.0, point, room)
            by = (follow[k, 0, 0], follow[k, 0, 1], follow[k, 0, 2], follow[k, 0, 3])
            moduli = tangent_moduli(stage, elastic, increment, by, False)
            stress = log_stress(stage, elastic, increment)
            energy = energy_slopes(at, stress)
            piola_tangent(at, moduli, stress, energy, tangent)
            weight = weights[e, g]
            add_full_stiffness(by_radius, by_height, over_radius, e, g, tangent, weight, products, element)
            _stress_changes(stage, elastic, moduli, increment, base, own, k, dy)
            _unit_forces(at, by_radius, by_height, over_radius, e, g, weight, force)
            for a in range(16):
                fa, fb, fc = force[a, 0], force[a, 1], force[a, 2]
                for c in range(count):
                    element_right[a, c] -= fa * dy[0, c] + fb * dy[1, c] + fc * dy[2, c]
            P = to_gradient(at.F, energy)
            for d in range(directions):
                stiffer = room.inputs[BY_STIFFNESS, d]
                if stiffer != 0.0:
                    _add_column(
                        by_radius, by_height, over_radius, e, g, P, -weight * stiffer, parameters + d, element_right
                    )
            for q in range(columns.gradients.shape[0]):
                moved = _shape_change(columns, q, e, g, at, P, tangent)
                _add_column(
                    by_radius, by_height, over_radius, e, g, moved, -weight, parameters + directions + q, element_right
                )
        _scatter(elements, equations, e, body.width, element, room.rows, element_right, right)


@njit(cache=True, error_model="numpy")
def _answer(
    sensitivity: Any,
    theta: Floats,
    stage: Stage,
    elastic: Elastic,
    slopes: Floats,
    row: int,
    i: int,
    k: int,
    share: float,
    increment: float,
    creeps: bool,
    point: PointRoom,
    room: ChangeRoom,
) -> None:
    """How D and the states of point `k` answer: to w and tr E (room.follow), and to all else (room.own)."""
    own, follow, base, history = room.own, room.follow, room.base, room.history
    states, columns, parameters = own.shape[1] - 1, own.shape[2], theta.size
    for v in range(1 + states):
        for j in range(4):
            follow[k, v, j] = 0.0
        for c in range(columns):
            own[k, v, c] = base[k, EQUIVALENT + v, c] if v > 0 else 0.0
    if not creeps or not (increment > 0.0 or states > 0):
        return
    axes, problem = axes_of(elastic), problem_of(stage, elastic, history[EQUIVALENT])
    line, full, response = point.row, point.out, point.response
    line[TIME], line[TEMPERATURE] = stage.time, stage.temperature
    for v in range(states):
        line[POINT_SIZE + v] = history[EQUIVALENT + 1 + v] + share * slopes[row, i, k, EQUIVALENT + 1 + v]
    stress = problem.trial - problem.stiffness * increment
    place(line, axes, stress, problem.strain + increment)
    sensitivity(1, pointer(line), pointer(theta), pointer(full))
    gradient_of_sensitivity(full, problem, increment, point.gradient)
    start = (1 + states) * (1 + line.size)
    for v in range(1 + states):
        for p in range(parameters):
            slope = full[start + v * parameters + p]
            response[v, INPUTS + states + p] = problem.weight * slope if increment > 0.0 or v > 0 else 0.0
    if not respond(axes, problem, increment, stress, full[1 : 1 + states], point.gradient, point.matrix, response):
        return
    for v in range(1 + states):
        by = (response[v, BY_TRIAL], response[v, BY_PRINCIPAL], response[v, BY_MEAN])
        along = following(stage, elastic, increment, by)
        follow[k, v, 0], follow[k, v, 1], follow[k, v, 2], follow[k, v, 3] = along
        by_strain = response[v, BY_STRAIN]
        for c in range(columns):
            own[k, v, c] = by_strain * base[k, EQUIVALENT, c]
        for z in range(states):
            by_state = response[v, INPUTS + z]
            for c in range(columns):
                own[k, v, c] += by_state * base[k, EQUIVALENT + 1 + z, c]
        for p in range(parameters):
            own[k, v, p] += response[v, INPUTS + states + p]
        stiffer = response[v, BY_TRIAL] * stress + (response[v, BY_MEAN] + response[v, BY_PRINCIPAL]) * elastic.mean
        for d in range(room.inputs.shape[1]):
            own[k, v, parameters + d] += (
                response[v, BY_TIME] * room.inputs[BY_MOMENT, d]
                + response[v, BY_TEMPERATURE] * room.inputs[BY_WARMTH, d]
                + response[v, BY_LOG_WEIGHT] * room.inputs[BY_WEIGHT, d]
                + stiffer * room.inputs[BY_STIFFNESS, d]
            )


@njit(cache=True, error_model="numpy")
def _stress_changes(
    stage: Stage, elastic: Elastic, moduli: tuple[Four, Four, Four, Four], increment: float, base: Floats, own: Floats,
    k: int, dy: Floats,
) -> None:  # fmt: skip
    """Changes (3, C) of y, conjugate to w, at fixed strain: w falls as the history rises, D changes on its own."""
    a00 = moduli[HOOP][HOOP] - moduli[HOOP][SUM] - moduli[SUM][HOOP] + moduli[SUM][SUM]
    a10 = moduli[DIFFERENCE][HOOP] - moduli[DIFFERENCE][SUM]
    a20 = moduli[SHEAR][HOOP] - moduli[SHEAR][SUM]
    a01 = moduli[HOOP][DIFFERENCE] - moduli[SUM][DIFFERENCE]
    a02 = moduli[HOOP][SHEAR] - moduli[SUM][SHEAR]
    a11, a12 = moduli[DIFFERENCE][DIFFERENCE], moduli[DIFFERENCE][SHEAR]
    a21, a22 = moduli[SHEAR][DIFFERENCE], moduli[SHEAR][SHEAR]
    factor = 3.0 * stage.shear / elastic.equivalent if increment > 0.0 else 0.0
    d0, d1, d2 = factor * elastic.hoop, factor * elastic.difference / 3.0, factor * elastic.shear / 3.0
    for c in range(dy.shape[1]):
        w0, w1, w2, q = base[k, 0, c], base[k, 1, c], base[k, 2, c], own[k, 0, c]
        dy[0, c] = -(a00 * w0 + a01 * w1 + a02 * w2) - d0 * q
        dy[1, c] = -(a10 * w0 + a11 * w1 + a12 * w2) - d1 * q
        dy[2, c] = -(a20 * w0 + a21 * w1 + a22 * w2) - d2 * q


@njit(cache=True, error_model="numpy")
def _unit_forces(
    at: Kinematics, by_r: Floats, by_z: Floats, over_r: Floats, e: int, g: int, weight: float, force: Floats
) -> None:
    """Nodal forces (16, 3), first radial then axial, of unit stresses y."""
    third = weight / 3.0
    first = to_gradient(at.F, energy_slopes(at, (-third, 0.0, 2.0 * third, 0.0)))
    second = to_gradient(at.F, energy_slopes(at, (0.0, weight, 0.0, 0.0)))
    other = to_gradient(at.F, energy_slopes(at, (0.0, 0.0, 0.0, weight)))
    for a in range(8):
        x, y, h = by_r[e, g, a], by_z[e, g, a], over_r[e, g, a]
        force[a, 0] = x * first[0] + y * first[1] + h * first[4]
        force[a, 1] = x * second[0] + y * second[1] + h * second[4]
        force[a, 2] = x * other[0] + y * other[1] + h * other[4]
        force[8 + a, 0] = x * first[2] + y * first[3]
        force[8 + a, 1] = x * second[2] + y * second[3]
        force[8 + a, 2] = x * other[2] + y * other[3]


@njit(cache=True, error_model="numpy")
def _add_column(
    by_r: Floats, by_z: Floats, over_r: Floats, e: int, g: int, P: Five, factor: float, column: int, right: Floats
) -> None:
    """Add `factor` times the nodal forces of the stress P to one column of (16, C)."""
    for a in range(8):
        x, y, h = by_r[e, g, a], by_z[e, g, a], over_r[e, g, a]
        right[a, column] += factor * (x * P[0] + y * P[1] + h * P[4])
        right[8 + a, column] += factor * (x * P[2] + y * P[3])


@njit(cache=True, error_model="numpy")
def gradient_shift(columns: Columns, q: int, e: int, g: int, F: Five) -> Five:
    """Change of F as the nodes move with geometry number `q` and keep their displacements: -(F - 1) grad V."""
    V = columns.gradients
    v11, v12, v21, v22 = V[q, e, g, 0, 0], V[q, e, g, 0, 1], V[q, e, g, 1, 0], V[q, e, g, 1, 1]
    h11, h12, h21, h22 = F[0] - 1.0, F[1], F[2], F[3] - 1.0
    return (
        -(h11 * v11 + h12 * v21),
        -(h11 * v12 + h12 * v22),
        -(h21 * v11 + h22 * v21),
        -(h21 * v12 + h22 * v22),
        -(F[4] - 1.0) * columns.hoops[q, e, g],
    )


@njit(cache=True, error_model="numpy")
def _shape_change(columns: Columns, q: int, e: int, g: int, at: Kinematics, P: Five, tangent: Floats) -> Five:
    """Change of the stress that a point's nodal forces are made of, volume and gradients of the shape included."""
    F = gradient_shift(columns, q, e, g, at.F)
    V = columns.gradients
    v11, v12, v21, v22 = V[q, e, g, 0, 0], V[q, e, g, 0, 1], V[q, e, g, 1, 0], V[q, e, g, 1, 1]
    hoop = columns.hoops[q, e, g]
    grow = v11 + v22 + hoop
    return (
        _dot(tangent, 0, F) + P[0] * grow - (P[0] * v11 + P[1] * v12),
        _dot(tangent, 1, F) + P[1] * grow - (P[0] * v21 + P[1] * v22),
        _dot(tangent, 2, F) + P[2] * grow - (P[2] * v11 + P[3] * v12),
        _dot(tangent, 3, F) + P[3] * grow - (P[2] * v21 + P[3] * v22),
        _dot(tangent, 4, F) + P[4] * (grow - hoop),
    )


@njit(cache=True, error_model="numpy")
def _dot(A: Floats, i: int, F: Five) -> float:
    return float(A[i, 0] * F[0] + A[i, 1] * F[1] + A[i, 2] * F[2] + A[i, 3] * F[3] + A[i, 4] * F[4])


@njit(cache=True, error_model="numpy", fastmath=_FAST)
def add_full_stiffness(
    by_r: Floats, by_z: Floats, over_r: Floats, e: int, g: int, A: Floats, weight: float, products: Floats,
    element: Floats,
) -> None:  # fmt: skip
    """Add the stiffness of a point to the blocks rr, rz, zr, zz of (4, 8, 8)."""
    for b in range(8):
        x, y, h = weight * by_r[e, g, b], weight * by_z[e, g, b], weight * over_r[e, g, b]
        for j in range(5):
            products[j, b] = A[j, 0] * x + A[j, 1] * y + A[j, 4] * h
            products[5 + j, b] = A[j, 2] * x + A[j, 3] * y
    for a in range(8):
        x, y, h = by_r[e, g, a], by_z[e, g, a], over_r[e, g, a]
        for b in range(8):
            element[0, a, b] += x * products[0, b] + y * products[1, b] + h * products[4, b]
            element[1, a, b] += x * products[5, b] + y * products[6, b] + h * products[9, b]
            element[2, a, b] += x * products[2, b] + y * products[3, b]
            element[3, a, b] += x * products[7, b] + y * products[8, b]


@njit(cache=True, error_model="numpy")
def _scatter(
    elements: Ints, equations: Ints, e: int, width: int, element: Floats, rows: Floats, element_right: Floats,
    right: Floats,
) -> None:  # fmt: skip
    for i in range(2):
        for a in range(8):
            row = equations[2 * elements[e, a] + i]
            if row < 0:
                continue
            for c in range(right.shape[0]):
                right[c, row] += element_right[8 * i + a, c]
            for j in range(2):
                for b in range(8):
                    column = equations[2 * elements[e, b] + j]
                    if column >= 0:
                        rows[row, width + column - row] += element[2 * i + j, a, b]


@njit(cache=True, error_model="numpy")
def _press(
    body: Body, pressure: float, columns: Columns, parameters: int, displacement: Floats, room: ChangeRoom
) -> None:
    """The pressure's exact load stiffness, and its forces in the columns that change it or move the surface."""
    directions = columns.directions.shape[0]
    ends, sides, side = room.ends, room.sides, room.side
    for k in range(body.pressed.shape[0]):
        nodes = body.pressed[k]
        for a in range(3):
            for i in range(2):
                ends[i, a] = body.nodes[nodes[a], i] + displacement[2 * nodes[a] + i]
        side_force(ends[0], ends[1], side)
        side_stiffness(ends[0], ends[1], sides)
        for a in range(3):
            for i in range(2):
                row = body.equations[2 * nodes[a] + i]
                if row < 0:
                    continue
                for d in range(directions):
                    room.right[parameters + d, row] += room.inputs[BY_PRESSURE, d] * side[i, a]
                for b in range(3):
                    for j in range(2):
                        slope = pressure * sides[2 * i + j, a, b]
                        for q in range(columns.velocities.shape[0]):
                            room.right[parameters + directions + q, row] += (
                                slope * columns.velocities[q, 2 * nodes[b] + j]
                            )
                        column = body.equations[2 * nodes[b] + j]
                        if column >= 0:
                            room.rows[row, body.width + column - row] -= slope


@njit(cache=True, error_model="numpy")
def _follow(
    body: Body,
    stage: Stage,
    columns: Columns,
    parameters: int,
    slopes: Floats,
    row: int,
    i: int,
    h: float,
    share: float,
    tableau: Tableau,
    room: ChangeRoom,
    displacement: Floats,
) -> None:
    """Changes of the slopes of stage `i`, now that the changes of the displacements are known."""
    elements, equations = body.elements, body.equations
    by_radius, by_height, over_radius = body.by_radius, body.by_height, body.over_radius
    local, moved, right, dF, by_strain = room.local, room.moved, room.right, room.gradient_change, room.by_strain
    base, own, follow, rates, value, history = room.base, room.own, room.follow, room.rates, room.value, room.history
    count, size, inverse = right.shape[0], value.shape[1], 1.0 / share
    first = parameters + columns.directions.shape[0]
    wide = history.reshape(1, history.size)
    for e in range(elements.shape[0]):
        gather(elements, e, displacement, local)
        _gather_changes(elements, equations, e, right, moved)
        for g in range(4):
            k = 4 * e + g
            for v in range(size):
                history[v] = value[k, v]
                for j in range(i):
                    history[v] += h * tableau.a[i, j] * slopes[row, j, k, v]
            at = kinematics(deformation(by_radius, by_height, over_radius, e, g, local))
            elastic = elastic_part(stage, at, wide, 0)
            _gradient_changes(by_radius, by_height, over_radius, e, g, moved, dF)
            for q in range(columns.gradients.shape[0]):
                shift = gradient_shift(columns, q, e, g, at.F)
                for j in range(5):
                    dF[j, first + q] += shift[j]
            _strain_matrix(at, by_strain)
            increment = share * slopes[row, i, k, EQUIVALENT]
            unit = 1.0 / elastic.equivalent if elastic.equivalent > 0.0 else 0.0
            n0, n1, n2 = elastic.hoop * unit, elastic.difference * unit, elastic.shear * unit
            left = increment * unit
            for c in range(count):
                along, across, hoop, shear = 0.0, 0.0, 0.0, 0.0
                for j in range(5):
                    along += by_strain[SUM, j] * dF[j, c]
                    across += by_strain[DIFFERENCE, j] * dF[j, c]
                    hoop += by_strain[HOOP, j] * dF[j, c]
                    shear += by_strain[SHEAR, j] * dF[j, c]
                trace = along + hoop
                w0, w1, w2 = hoop - trace / 3.0 - base[k, 0, c], across - base[k, 1, c], shear - base[k, 2, c]
                creep = own[k, 0, c] + follow[k, 0, 0] * w0 + follow[k, 0, 1] * w1 + follow[k, 0, 2] * w2
                creep += follow[k, 0, 3] * trace
                stretched = n0 * w0 + (n1 * w1 + n2 * w2) / 3.0
                rates[i, k, 0, c] = inverse * (creep * n0 + left * (w0 - n0 * stretched))
                rates[i, k, 1, c] = inverse * (creep * n1 + left * (w1 - n1 * stretched))
                rates[i, k, 2, c] = inverse * (creep * n2 + left * (w2 - n2 * stretched))
                rates[i, k, EQUIVALENT, c] = inverse * creep
                for z in range(1, own.shape[1]):
                    state = own[k, z, c] + follow[k, z, 0] * w0 + follow[k, z, 1] * w1 + follow[k, z, 2] * w2
                    state += follow[k, z, 3] * trace - base[k, EQUIVALENT + z, c]
                    rates[i, k, EQUIVALENT + z, c] = inverse * state


@njit(cache=True, error_model="numpy")
def _gather_changes(elements: Ints, equations: Ints, e: int, right: Floats, moved: Floats) -> None:
    """Changes of an element's displacements, (16, C), radial ones first."""
    for a in range(8):
        for i in range(2):
            row = equations[2 * elements[e, a] + i]
            for c in range(right.shape[0]):
                moved[8 * i + a, c] = right[c, row] if row >= 0 else 0.0


@njit(cache=True, error_model="numpy")
def _gradient_changes(by_r: Floats, by_z: Floats, over_r: Floats, e: int, g: int, moved: Floats, dF: Floats) -> None:
    """Changes (5, C) of the deformation gradient of a point."""
    for j in range(5):
        for c in range(dF.shape[1]):
            dF[j, c] = 0.0
    for a in range(8):
        x, y, h = by_r[e, g, a], by_z[e, g, a], over_r[e, g, a]
        for c in range(dF.shape[1]):
            u, w = moved[a, c], moved[8 + a, c]
            dF[0, c] += x * u
            dF[1, c] += y * u
            dF[2, c] += x * w
            dF[3, c] += y * w
            dF[4, c] += h * u


@njit(cache=True, error_model="numpy")
def _strain_matrix(at: Kinematics, matrix: Floats) -> None:
    """Derivatives (4, 5) of the strains to F."""
    for j in range(5):
        unit = (
            1.0 if j == 0 else 0.0, 1.0 if j == 1 else 0.0, 1.0 if j == 2 else 0.0, 1.0 if j == 3 else 0.0,
            1.0 if j == 4 else 0.0,
        )  # fmt: skip
        change = strain_change(at, unit)
        for i in range(4):
            matrix[i, j] = change[i]
