"""One point differentiated: its history, how creep and states answer, and the stresses that follow at fixed strain."""

from __future__ import annotations

from typing import Any

from numba import njit

from creepkit.arrays import Floats
from creepkit.fem.columns import BY_MOMENT, BY_STIFFNESS, BY_LOAD_TEMPERATURE, BY_WEIGHT, SensitivityWorkspace, SensitivityDirections
from creepkit.fem.material import EQUIVALENT_STRAIN, ElasticPredictor, PointWorkspace, StageConditions, axes_of, strain_derivatives, problem_of
from creepkit.fem.strain import DIFFERENCE, HOOP, SHEAR, SUM, Five, Four, Kinematics
from creepkit.integration.problem import write_point
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
    differentiate_stage,
)
from creepkit.integration.tableau import Tableau
from creepkit.kernels.interface import POINT_SIZE, TEMPERATURE, TIME, data_pointer


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
    if not differentiate_stage(axes, problem, increment, stress, full[1 : 1 + states], point.gradient, point.matrix, response):
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
    stage: StageConditions, elastic: ElasticPredictor, moduli: tuple[Four, Four, Four, Four], increment: float, base: Floats, own: Floats,
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
def shape_sensitivity(columns: SensitivityDirections, q: int, e: int, g: int, at: Kinematics, P: Five, tangent: Floats) -> Five:
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
