"""The nonlinear problem of one implicit stage: its statement, its unknown, and its exact derivatives.

The derivatives follow from the implicit function theorem; the finite element solver takes its consistent tangent from
them, the integration its sensitivities to the parameters.
"""

from __future__ import annotations

from math import exp, log, log1p
from typing import NamedTuple

from numba import njit

from creepkit.arrays import Floats
from creepkit.integration.implicit_stage import (
    BY_LOG_WEIGHT,
    BY_MEAN,
    BY_PRINCIPAL,
    BY_STRAIN,
    BY_TEMPERATURE,
    BY_TIME,
    BY_TRIAL,
    INPUTS,
    NO_SOLUTION,
    NOT_FINITE,
    SOLVED,
    TOO_MANY,
    UNIAXIAL,
    Axes,
    StageProblem,
)
from creepkit.kernels.interface import MEAN_STRESS, POINT_SIZE, PRINCIPAL_STRESS, STRAIN, STRESS, TEMPERATURE, TIME

__all__ = [
    "BY_LOG_WEIGHT",
    "BY_MEAN",
    "BY_PRINCIPAL",
    "BY_STRAIN",
    "BY_TEMPERATURE",
    "BY_TIME",
    "BY_TRIAL",
    "INPUTS",
    "NOT_FINITE",
    "NO_RATE",
    "NO_SOLUTION",
    "SOLVED",
    "TOO_MANY",
    "UNIAXIAL",
    "Axes",
    "StageIterate",
    "StageProblem",
    "differentiate_stage",
    "gradient_of_sensitivity",
    "gradient_of_update",
    "increment_and_stress",
    "solve_dense",
    "stress_derivative",
    "unknown_of_increment",
    "write_point",
]


NO_RATE = -600.0
"""ln of a rate, 1/s, below which nothing creeps (a law whose terms are off, or a stress of zero)."""


class StageIterate(NamedTuple):
    """An iterate x in plain terms: D, ln D, stress in MPa, and d(ln D)/dx, d(ln sigma)/dx."""

    increment: float
    log_increment: float
    stress: float
    increment_slope: float
    stress_slope: float


@njit(cache=True, error_model="numpy")
def increment_and_stress(problem: StageProblem, x: float) -> StageIterate:
    """Turn the unknown x into increment and stress."""
    amount = exp(min(x, 700.0))
    if problem.stiffness > 0.0:
        ratio = problem.stiffness * amount / problem.trial
        elastic = 1.0 / (1.0 + ratio)
        return StageIterate(amount * elastic, x - log1p(ratio), problem.trial * elastic, elastic, elastic - 1.0)
    stress = problem.trial * exp(problem.load * min(amount, 700.0)) if problem.load > 0.0 else problem.trial
    return StageIterate(amount, x, stress, 1.0, problem.load * amount)


@njit(cache=True, error_model="numpy")
def unknown_of_increment(problem: StageProblem, increment: float) -> float:
    """The unknown x of a guessed increment, kept off the ends of its range."""
    guess = max(increment, 1e-300)
    if problem.stiffness == 0.0:
        return log(guess)
    share = min(problem.stiffness * guess / problem.trial, 0.999)
    return log(guess) - log1p(-share) if share < 0.999 else log(999.0 * problem.trial / problem.stiffness)


@njit(cache=True, error_model="numpy")
def write_point(row: Floats, axes: Axes, stress: float, strain: float) -> None:
    """Write stress and strain into a kernel's row; time, temperature and states are there already."""
    row[STRESS] = stress
    row[STRAIN] = strain
    row[PRINCIPAL_STRESS] = axes.principal + axes.principal_slope * stress
    row[MEAN_STRESS] = axes.mean + axes.mean_slope * stress


@njit(cache=True, error_model="numpy")
def stress_derivative(slopes: Floats, start: int, axes: Axes) -> float:
    """Derivative to the equivalent stress, principal and mean stress following it; a gradient begins at `start`."""
    return float(
        slopes[start + STRESS]
        + axes.principal_slope * slopes[start + PRINCIPAL_STRESS]
        + axes.mean_slope * slopes[start + MEAN_STRESS]
    )


@njit(cache=True, error_model="numpy")
def solve_dense(matrix: Floats, right: Floats) -> bool:
    """Solve ``matrix x = right`` in place, x left in `right`; False when the matrix is singular.

    matrix : (n, n), destroyed; right : (n, columns). Gauss elimination with row pivoting.
    """
    size = matrix.shape[0]
    for k in range(size):
        best = k
        for i in range(k + 1, size):
            if abs(matrix[i, k]) > abs(matrix[best, k]):
                best = i
        pivot = matrix[best, k]
        if not abs(pivot) > 0.0:
            return False
        if best != k:
            _swap(matrix, best, k)
            _swap(right, best, k)
        for i in range(k + 1, size):
            factor = matrix[i, k] / pivot
            if factor != 0.0:
                _subtract(matrix, i, factor, k)
                _subtract(right, i, factor, k)
    for k in range(size - 1, -1, -1):
        for i in range(k + 1, size):
            _subtract(right, k, matrix[k, i], i)
        for j in range(right.shape[1]):
            right[k, j] /= matrix[k, k]
    return True


@njit(cache=True, error_model="numpy")
def _subtract(rows: Floats, i: int, factor: float, k: int) -> None:
    for j in range(rows.shape[1]):
        rows[i, j] -= factor * rows[k, j]


@njit(cache=True, error_model="numpy")
def _swap(rows: Floats, i: int, k: int) -> None:
    for j in range(rows.shape[1]):
        rows[i, j], rows[k, j] = rows[k, j], rows[i, j]


@njit(cache=True, error_model="numpy")
def gradient_of_update(out: Floats, problem: StageProblem, increment: float, gradient: Floats) -> None:
    """Derivatives of [w f, w g] with respect to a kernel's row, (1 + S, 6 + S), from the output of `update`."""
    size, width = gradient.shape
    for i in range(size):
        factor = increment if i == 0 else problem.weight
        for j in range(width):
            slope = out[size + i * width + j]
            gradient[i, j] = factor * slope if factor != 0.0 else 0.0


@njit(cache=True, error_model="numpy")
def gradient_of_sensitivity(full: Floats, problem: StageProblem, increment: float, gradient: Floats) -> None:
    """The same from the output of `sensitivity`."""
    size, width = gradient.shape
    for i in range(size):
        factor = 0.0 if i == 0 and increment == 0.0 else problem.weight
        for j in range(width):
            slope = full[size + i * width + j]
            gradient[i, j] = factor * slope if factor != 0.0 else 0.0


@njit(cache=True, error_model="numpy")
def differentiate_stage(
    axes: Axes,
    problem: StageProblem,
    increment: float,
    stress: float,
    state_rates: Floats,
    gradient: Floats,
    matrix: Floats,
    response: Floats,
) -> bool:
    """Fill `response` with the derivatives of (D, z); False when the stage's equations are singular.

    state_rates : (S,) g at the solution; gradient : (1 + S, 6 + S) of [w f, w g].
    matrix : (1 + S, 1 + S), workspace.
    response : (1 + S, 7 + S + P); on entry its last P columns hold the derivatives of [w f, w g] to the parameters.
    """
    size = matrix.shape[0]
    growth = exp(problem.load * increment)
    by_increment = problem.load * stress - problem.stiffness * growth
    for i in range(size):
        by_stress = stress_derivative(gradient[i], 0, axes)
        matrix[i, 0] = -gradient[i, STRAIN] - by_stress * by_increment
        for j in range(1, size):
            matrix[i, j] = -gradient[i, POINT_SIZE + j - 1]
            response[i, INPUTS + j - 1] = 1.0 if i == j else 0.0
        matrix[i, i] += 1.0
        response[i, BY_TRIAL] = by_stress * growth
        response[i, BY_STRAIN] = gradient[i, STRAIN]
        response[i, BY_TIME] = gradient[i, TIME]
        response[i, BY_TEMPERATURE] = gradient[i, TEMPERATURE]
        response[i, BY_LOG_WEIGHT] = increment if i == 0 else problem.weight * state_rates[i - 1]
        response[i, BY_PRINCIPAL] = gradient[i, PRINCIPAL_STRESS]
        response[i, BY_MEAN] = gradient[i, MEAN_STRESS]
    return solve_dense(matrix, response)
