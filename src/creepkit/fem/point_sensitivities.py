"""Sensitivity directions, and the derivatives of history, creep increment and stress at one point."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from creepkit.arrays import Floats
from creepkit.fem.banded_system import FiniteElementModel
from creepkit.fem.kinematics import DIFFERENCE, HOOP, SHEAR, SUM, Five, Four, Kinematics
from creepkit.fem.material_point import (
    EQUIVALENT_STRAIN,
    ElasticPredictor,
    PointWorkspace,
    StageConditions,
    axes_of,
    problem_of,
    strain_derivatives,
)
from creepkit.fem.step_record import (
    END,
    END_MODULUS,
    END_PRESSURE,
    FINAL_TEMPERATURE,
    MODULUS,
    PRESSURE,
    START,
    START_TEMPERATURE,
)
from creepkit.fem.time_step import segment_transformation
from creepkit.integration.stage_problem import (
    BY_LOG_WEIGHT,
    BY_MEAN,
    BY_PRINCIPAL,
    BY_STRAIN,
    BY_TEMPERATURE,
    BY_TIME,
    BY_TRIAL,
    INPUTS,
    differentiate_stage,
    gradient_of_sensitivity,
    write_point,
)
from creepkit.integration.time_discretisation import Tableau, transformed_time
from creepkit.kernels.interface import POINT_SIZE, TEMPERATURE, TIME, data_pointer

LANES = 16
"""Right-hand sides are kept in multiples of this, the numbers that a processor takes at a time twice over."""


_NUDGE = 1e-4
"""Share of a segment's length by which its ends are moved to difference its time transformation."""


BY_PRESSURE, BY_MOMENT, BY_LOAD_TEMPERATURE, BY_STIFFNESS, BY_WEIGHT = range(5)
"""Rows of ChangeRoom.inputs: change of pressure, of time, of temperature, of ln E, and of ln weight."""


class SensitivityDirections(NamedTuple):
    """What is differentiated to, C = P + D + G columns: P law parameters, then these.

    directions : (D, segments, 10) change of the load program.
    gradients, hoops : (G, elements, 4, 2, 2) and (G, elements, 4), see fem.mesh.GeometryDerivative.
    velocities : (G, 2 nodes) mm.
    """

    directions: Floats
    gradients: Floats
    hoops: Floats
    velocities: Floats


class SensitivityWorkspace(NamedTuple):
    """Working arrays; V = 4 + S, R = 1 + S.

    value : (points, V); change : (points, V, C); rates : (stages, points, V, C) changes of the slopes;
    base : (points, V, C); own : (points, R, C) change of D and of the states at fixed strain; follow : (points, R, 4).
    rows : (size, 2 width + 1) tangent; right : (size, C or a little more). element : (4, 8, 8); products : (10, 8);
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


def sensitivity_workspace(
    body: FiniteElementModel, states: int, stages: int, columns: int, directions: int
) -> SensitivityWorkspace:
    """Allocate the working arrays."""
    points, size = 4 * len(body.elements), 4 + states
    return SensitivityWorkspace(
        value=np.zeros((points, size)),
        change=np.zeros((points, size, columns)),
        rates=np.zeros((stages, points, size, columns)),
        base=np.zeros((points, size, columns)),
        own=np.zeros((points, 1 + states, columns)),
        follow=np.zeros((points, 1 + states, 4)),
        rows=np.zeros((body.size, 2 * body.width + 1)),
        right=np.zeros((body.size, (columns + LANES - 1) // LANES * LANES)),
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


@njit(cache=True, error_model="numpy")
def set_input_derivatives(
    segments: Floats, directions: Floats, n: int, beta: float, s: float, at_start: bool, inputs: Floats
) -> None:
    """Change of pressure, time, temperature, ln E and ln weight with each direction, at place `s` of segment `n`."""
    segment = segments[n]
    length = segment[END] - segment[START]
    now = (
        transformed_time(segment_transformation(segment, beta), s)
        if not at_start
        else transformed_time(segment_transformation(segment, 1.0), 1e-300)
    )
    share = 0.0 if at_start else (now.time - segment[START]) / length
    modulus = segment[MODULUS] + share * (segment[END_MODULUS] - segment[MODULUS])
    for d in range(directions.shape[0]):
        change = directions[d, n]
        longer = change[END] - change[START]
        later, slower = change[START], 0.0
        if not at_start and (change[START] != 0.0 or longer != 0.0):
            step = _NUDGE * length
            up = transformed_time(segment_transformation(segment + step * change, beta), s)
            down = transformed_time(segment_transformation(segment - step * change, beta), s)
            later, slower = (up.time - down.time) / (2.0 * step), (up.log_pace - down.log_pace) / (2.0 * step)
        along = 0.0 if at_start else (later - change[START] - share * longer) / length
        inputs[BY_PRESSURE, d] = (
            change[PRESSURE] + share * (change[END_PRESSURE] - change[PRESSURE])
            + along * (segment[END_PRESSURE] - segment[PRESSURE])
        )  # fmt: skip
        inputs[BY_LOAD_TEMPERATURE, d] = (
            change[START_TEMPERATURE] + share * (change[FINAL_TEMPERATURE] - change[START_TEMPERATURE])
            + along * (segment[FINAL_TEMPERATURE] - segment[START_TEMPERATURE])
        )  # fmt: skip
        stiffer = change[MODULUS] + share * (change[END_MODULUS] - change[MODULUS])
        inputs[BY_STIFFNESS, d] = (stiffer + along * (segment[END_MODULUS] - segment[MODULUS])) / modulus
        inputs[BY_MOMENT, d] = later
        inputs[BY_WEIGHT, d] = slower


@njit(cache=True, error_model="numpy", inline="always")
def stage_history(
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


@njit(cache=True, error_model="numpy", inline="always")
def creep_response(
    sensitivity: Any,
    theta: Floats,
    stage: StageConditions,
    elastic: ElasticPredictor,
    slopes: Floats,
    row: int,
    i: int,
    k: int,
    share: float,
    increment: float,
    creeps: bool,
    point: PointWorkspace,
    room: SensitivityWorkspace,
) -> None:
    """How D and the states of point `k` answer: to w and tr E (room.follow), and to all else (room.own)."""
    own, follow, base, history = room.own, room.follow, room.base, room.history
    states, columns, parameters = own.shape[1] - 1, own.shape[2], theta.size
    for v in range(1 + states):
        for j in range(4):
            follow[k, v, j] = 0.0
        for c in range(columns):
            own[k, v, c] = base[k, EQUIVALENT_STRAIN + v, c] if v > 0 else 0.0
    if not creeps or not (increment > 0.0 or states > 0):
        return
    axes, problem = axes_of(elastic), problem_of(stage, elastic, history[EQUIVALENT_STRAIN])
    line, full, response = point.row, point.out, point.response
    line[TIME], line[TEMPERATURE] = stage.time, stage.temperature
    for v in range(states):
        line[POINT_SIZE + v] = history[EQUIVALENT_STRAIN + 1 + v] + share * slopes[row, i, k, EQUIVALENT_STRAIN + 1 + v]
    stress = problem.trial - problem.stiffness * increment
    write_point(line, axes, stress, problem.strain + increment)
    sensitivity(1, data_pointer(line), data_pointer(theta), data_pointer(full))
    gradient_of_sensitivity(full, problem, increment, point.gradient)
    start = (1 + states) * (1 + line.size)
    for v in range(1 + states):
        for p in range(parameters):
            slope = full[start + v * parameters + p]
            response[v, INPUTS + states + p] = problem.weight * slope if increment > 0.0 or v > 0 else 0.0
    if not differentiate_stage(
        axes, problem, increment, stress, full[1 : 1 + states], point.gradient, point.matrix, response
    ):
        return
    for v in range(1 + states):
        by = (response[v, BY_TRIAL], response[v, BY_PRINCIPAL], response[v, BY_MEAN])
        along = strain_derivatives(stage, elastic, increment, by)
        follow[k, v, 0], follow[k, v, 1], follow[k, v, 2], follow[k, v, 3] = along
        by_strain = response[v, BY_STRAIN]
        for c in range(columns):
            own[k, v, c] = by_strain * base[k, EQUIVALENT_STRAIN, c]
        for z in range(states):
            by_state = response[v, INPUTS + z]
            for c in range(columns):
                own[k, v, c] += by_state * base[k, EQUIVALENT_STRAIN + 1 + z, c]
        for p in range(parameters):
            own[k, v, p] += response[v, INPUTS + states + p]
        stiffer = response[v, BY_TRIAL] * stress + (response[v, BY_MEAN] + response[v, BY_PRINCIPAL]) * elastic.mean
        for d in range(room.inputs.shape[1]):
            own[k, v, parameters + d] += (
                response[v, BY_TIME] * room.inputs[BY_MOMENT, d]
                + response[v, BY_TEMPERATURE] * room.inputs[BY_LOAD_TEMPERATURE, d]
                + response[v, BY_LOG_WEIGHT] * room.inputs[BY_WEIGHT, d]
                + stiffer * room.inputs[BY_STIFFNESS, d]
            )


@njit(cache=True, error_model="numpy", inline="always")
def stress_sensitivities(
    stage: StageConditions, elastic: ElasticPredictor, moduli: tuple[Four, Four, Four, Four], increment: float,
    base: Floats, own: Floats, k: int, dy: Floats,
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
def gradient_sensitivity(columns: SensitivityDirections, q: int, e: int, g: int, F: Five) -> Five:
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
def shape_sensitivity(
    columns: SensitivityDirections, q: int, e: int, g: int, at: Kinematics, P: Five, tangent: Floats
) -> Five:
    """Change of the stress that a point's nodal forces are made of, volume and gradients of the shape included."""
    F = gradient_sensitivity(columns, q, e, g, at.F)
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
