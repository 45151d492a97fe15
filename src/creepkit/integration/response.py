"""How a solved stage answers to small changes: exact derivatives by the implicit function theorem.

The finite element solver takes its consistent tangent from here, the integrator the sensitivities to the parameters.
With F(D, z; inputs) = 0 the equations of `integration.stage`, each column solves  F_(D,z) (dD, dz) = -F_input.
"""

from __future__ import annotations

from math import exp

from numba import njit

from creepkit.arrays import Floats
from creepkit.integration.elimination import solve_dense
from creepkit.integration.problem import Axes, StageProblem, stress_derivative
from creepkit.kernels.interface import MEAN_STRESS, POINT_SIZE, PRINCIPAL_STRESS, STRAIN, TEMPERATURE, TIME

INPUTS = 7
BY_TRIAL, BY_STRAIN, BY_TIME, BY_TEMPERATURE, BY_LOG_WEIGHT, BY_PRINCIPAL, BY_MEAN = range(INPUTS)
"""Columns of a response; those of the S initial states z0 and of the P parameters follow."""


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
    matrix : (1 + S, 1 + S), room.
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
