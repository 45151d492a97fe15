"""One step of the one-degree-of-freedom march, solved by Newton's method."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from creepkit.arrays import Floats
from creepkit.integration.elimination import solve_dense
from creepkit.kernels.interface import MEAN_STRESS, POINT_SIZE, PRINCIPAL_STRESS, STRAIN, STRESS, data_pointer
from creepkit.specimens.reduced_curves import LOG_GROWTH, LOG_STRESS, DimpleCurves, curve_slope
from creepkit.specimens.reduced_problem import ReducedWorkspace
from creepkit.specimens.reduced_step import FAST, MEAN_STRESS_RATIO, PROBES, SLOW, StepMidpoint, StepData, StepExponents, write_probes, step_exponents, step_residual

_ITERATIONS, _STEP = 25, 4.0
"""Most Newton iterations of a step, and the largest change in one of them."""
_STILL = -600.0
"""ln of a rate that is none."""
_LOG_OVER = float(np.log(100.0))
"""Of strain, or mm, of an increment; a dimple has burst long before."""


@njit(cache=True, error_model="numpy")
def solve_step(
    update: Any, theta: Floats, node: StepData, state: Floats, unknown: Floats, dimple: DimpleCurves, tolerance: float, work: ReducedWorkspace
) -> tuple[StepMidpoint, StepExponents]:
    """Newton's method for the unknowns, in place; the middle of the step and the pace then."""
    rows, said, values = work.rows, work.said, work.values
    logs, rates, right, matrix = work.logs, work.rates, work.right, work.matrix
    for iteration in range(_ITERATIONS):
        middle = write_probes(node, state, unknown, dimple, 0.0, rows, values)
        update(PROBES, data_pointer(rows), data_pointer(theta), data_pointer(said))
        for k in range(PROBES):
            logs[k] = max(said[k, 0], _STILL) if said[k, 0] < 0.0 else said[k, 0]
        for v in range(rates.size):
            rates[v] = said[0, 1 + v]
        now = step_exponents(node, state[FAST], state[SLOW], values, dimple.redistribution, middle, logs)
        step_residual(node, state, unknown, values[LOG_GROWTH], now, logs[0], rates, right[:, 0])
        largest = _largest(right)
        if not np.isfinite(largest) or largest < tolerance or iteration == _ITERATIONS - 1:
            break
        _jacobian(node, unknown, rows, said, dimple, middle, now, matrix)
        if not solve_dense(matrix, right):
            break
        factor = min(1.0, _STEP / _largest(right))
        for k in range(unknown.size):
            unknown[k] -= factor * right[k, 0]
        unknown[0], unknown[1] = min(unknown[0], _LOG_OVER), min(unknown[1], _LOG_OVER)
    _damp(node, rows.shape[1], said, work.gains)
    return middle, now


@njit(cache=True, error_model="numpy")
def _largest(right: Floats) -> float:
    """Largest magnitude; NaN if any is."""
    found = 0.0
    for k in range(right.shape[0]):
        size = abs(right[k, 0])
        found = size if size > found or size != size else found
    return found


@njit(cache=True, error_model="numpy")
def _jacobian(
    node: StepData, unknown: Floats, rows: Floats, said: Floats, dimple: DimpleCurves, middle: StepMidpoint, now: StepExponents, matrix: Floats
) -> None:
    """Derivatives of the residuals to the unknowns; those of local exponents, which hardly change, are left out."""
    size, width, half_strain, half = unknown.size, rows.shape[1], 0.5 * middle.strained, 0.5 * middle.grown
    stress_slope = curve_slope(LOG_STRESS, middle.at, dimple, middle.deflection)
    growth_slope = curve_slope(LOG_GROWTH, middle.at, dimple, middle.deflection)
    softer = rows[0, STRESS] * stress_slope * half
    weight = 0.5 * np.exp(node.log_weight) if size > 2 else 0.0
    for v in range(-1, size - 2):
        start = size - 1 + (1 + v) * width
        factor, row = (1.0, 0) if v < 0 else (weight, 2 + v)
        stiffer = said[0, start + STRESS] + said[0, start + PRINCIPAL_STRESS] + MEAN_STRESS_RATIO * said[0, start + MEAN_STRESS]
        matrix[row, 0] = factor * said[0, start + STRAIN] * half_strain
        matrix[row, 1] = factor * stiffer * softer
        for u in range(size - 2):
            matrix[row, 2 + u] = factor * said[0, start + POINT_SIZE + u]
        matrix[row, row] -= 1.0
    for u in range(size - 2):
        matrix[1, 2 + u] = 0.0
    matrix[1, 0] = 1.0 + now.bend
    matrix[1, 1] = (growth_slope - now.bend * stress_slope) * half - 1.0


@njit(cache=True, error_model="numpy")
def _damp(node: StepData, width: int, said: Floats, gains: Floats) -> None:
    """1 where the midpoint rule serves; less where a state settles within the step and would overshoot."""
    for v in range(gains.size):
        settling = -0.5 * np.exp(node.log_weight) * said[0, 1 + gains.size + (1 + v) * width + POINT_SIZE + v]
        gains[v] = (1.0 + max(settling, 0.0) ** 3) ** (-1.0 / 3.0)
