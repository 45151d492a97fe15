"""The implicit stage of a law with internal variables: damped Newton's method in (x, z)."""

from __future__ import annotations

from math import isfinite, log
from typing import Any

import numpy as np
from numba import njit

from creepkit.arrays import Floats
from creepkit.integration.elimination import solve_dense
from creepkit.integration.problem import (
    NO_RATE,
    NO_SOLUTION,
    NOT_FINITE,
    SOLVED,
    TOO_MANY,
    Axes,
    StageProblem,
    StageIterate,
    stress_derivative,
    unknown_of_increment,
    write_point,
    increment_and_stress,
)
from creepkit.kernels.interface import POINT_SIZE, STRAIN, data_pointer

_COUPLED_ITERATIONS = 80
_HALVINGS = 12
_LONGEST_CORRECTION = 5.0


@njit(cache=True, error_model="numpy")
def solve_stage_with_states(
    update: Any,
    theta: Floats,
    axes: Axes,
    problem: StageProblem,
    states: Floats,
    row: Floats,
    out: Floats,
    guess: float,
    tolerance: float,
) -> tuple[float, int]:
    """Damped Newton's method in (x, z) for laws with internal variables."""
    if problem.trial < 0.0:
        return 0.0, NO_SOLUTION
    size = 1 + states.size
    matrix, step = np.empty((size, size)), np.empty((size, 1))
    x, creeps = unknown_of_increment(problem, guess), problem.trial > 0.0
    last, halvings = np.zeros(size), 0
    for _ in range(_COUPLED_ITERATIONS):
        now = increment_and_stress(problem, x) if creeps else StageIterate(0.0, 0.0, 0.0, 0.0, 0.0)
        write_point(row, axes, now.stress, problem.strain + now.increment)
        update(1, data_pointer(row), data_pointer(theta), data_pointer(out))
        creeps = creeps and not out[0] < NO_RATE
        if not _finite(out, size, creeps):
            halvings += 1
            if halvings > _HALVINGS:
                return 0.0, NOT_FINITE
            x = _correct(x, row, last, -0.5)
            for i in range(size):
                last[i] *= 0.5
            continue
        _newton_system(axes, problem, states, row, out, now, creeps, matrix, step)
        if not solve_dense(matrix, step):
            return 0.0, NO_SOLUTION
        damping = min(1.0, _LONGEST_CORRECTION / max(abs(step[0, 0]), 1e-300))
        for i in range(size):
            last[i] = damping * step[i, 0]
        x = _correct(x, row, last, 1.0)
        halvings = 0
        if _small(last, row, tolerance):
            now = increment_and_stress(problem, x) if creeps else now
            write_point(row, axes, now.stress, problem.strain + now.increment)
            return now.increment, SOLVED
    return 0.0, TOO_MANY


@njit(cache=True, error_model="numpy")
def _correct(x: float, row: Floats, step: Floats, factor: float) -> float:
    """Add a multiple of a step to the states in `row`; return the new x."""
    for i in range(1, step.size):
        row[POINT_SIZE + i - 1] += factor * step[i]
    return float(x + factor * step[0])


@njit(cache=True, error_model="numpy")
def _finite(out: Floats, size: int, creeps: bool) -> bool:
    """Whether what Newton's method needs of the entry's output is finite."""
    total = 0.0
    for i in range(0 if creeps else 1, size):
        total += out[i]
    return isfinite(total)


@njit(cache=True, error_model="numpy")
def _small(step: Floats, row: Floats, tolerance: float) -> bool:
    if abs(step[0]) > tolerance:
        return False
    for i in range(1, step.size):
        value = row[POINT_SIZE + i - 1]
        if abs(step[i]) > tolerance * max(abs(value), 1e-12):
            return False
    return True


@njit(cache=True, error_model="numpy")
def _newton_system(
    axes: Axes,
    problem: StageProblem,
    states: Floats,
    row: Floats,
    out: Floats,
    now: StageIterate,
    creeps: bool,
    matrix: Floats,
    right: Floats,
) -> None:
    """Jacobian and minus the residual of [ln D - ln w - ln f, z - z0 - w g] in (x, z)."""
    size = matrix.shape[0]
    width = POINT_SIZE + size - 1
    for i in range(size):
        start = size + i * width
        factor = problem.weight if i > 0 else 1.0 if creeps else 0.0
        by_strain = now.increment * now.increment_slope * out[start + STRAIN]
        by_stress = now.stress * now.stress_slope * stress_derivative(out, start, axes)
        matrix[i, 0] = -factor * (by_strain + by_stress) if creeps else 0.0
        for j in range(1, size):
            matrix[i, j] = -factor * out[start + POINT_SIZE + j - 1] if factor > 0.0 else 0.0
        matrix[i, i] += 1.0 if i > 0 or not creeps else now.increment_slope
        if i > 0:
            right[i, 0] = states[i - 1] + problem.weight * out[i] - row[POINT_SIZE + i - 1]
    right[0, 0] = log(problem.weight) + out[0] - now.log_increment if creeps else 0.0
