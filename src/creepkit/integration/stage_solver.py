"""Newton's method for the implicit stage of one material point, without and with internal variables.

Unknown are the creep increment D and the states z at the end of the stage:

    D = w f(sigma, p0 + D, t, T, z)                 z = z0 + w g(sigma, p0 + D, t, T, z)
    sigma = (trial - k D) exp(load D)

with w the weight of the stage in s, p0 and z0 the history, trial the stress in MPa without further creep, and k = 3G in
a finite element, E in relaxation, 0 under prescribed stress. load = 1 is uniaxial tension under constant load, else 0.
The unknown of the iteration is x = ln[D / (1 - k D/trial)].
"""

from __future__ import annotations

from math import exp, inf, isfinite, log
from typing import Any

import numpy as np
from numba import njit

from creepkit.arrays import Floats
from creepkit.integration.stage_problem import (
    NO_RATE,
    NO_SOLUTION,
    NOT_FINITE,
    SOLVED,
    TOO_MANY,
    Axes,
    StageIterate,
    StageProblem,
    increment_and_stress,
    solve_dense,
    stress_derivative,
    unknown_of_increment,
    write_point,
)
from creepkit.kernels.interface import POINT_SIZE, STRAIN, data_pointer

_ITERATIONS = 80


_NEAR_ITERATIONS = 4


@njit(cache=True, error_model="numpy")
def solve_stage(
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
    """Solve a stage; return the increment D and a flag.

    update : compiled entry; theta : (P,); states : (S,) z0.
    row : (6 + S,) in: time and temperature of the stage, and a guess of the states; out: the solution.
    out : ((1 + S)(7 + S),) workspace for the entry's output.
    guess : of the increment; any positive number will do.
    tolerance : on the last Newton correction of ln D (and of the states, relative); the error left is its square.
    """
    if states.size > 0:
        return solve_stage_with_states(update, theta, axes, problem, states, row, out, guess, tolerance)
    if problem.trial <= 0.0:
        write_point(row, axes, 0.0, problem.strain)
        return 0.0, SOLVED if problem.trial == 0.0 else NO_SOLUTION
    return _solve_scalar(update, theta, axes, problem, row, out, guess, tolerance)


@njit(cache=True, error_model="numpy")
def _solve_scalar(
    update: Any,
    theta: Floats,
    axes: Axes,
    problem: StageProblem,
    row: Floats,
    out: Floats,
    guess: float,
    tolerance: float,
) -> tuple[float, int]:
    """Newton's method in x, bracketed: it cannot fail where the rate falls with strain and rises with stress."""
    x, low, high, before = unknown_of_increment(problem, guess), -inf, inf, inf
    log_weight = log(problem.weight)
    for _ in range(_ITERATIONS):
        now = increment_and_stress(problem, x)
        write_point(row, axes, now.stress, problem.strain + now.increment)
        update(1, data_pointer(row), data_pointer(theta), data_pointer(out))
        nothing = out[0] < NO_RATE
        if nothing and now.stress > 0.99 * problem.trial:
            write_point(row, axes, problem.trial, problem.strain)
            return 0.0, SOLVED
        residual = inf if nothing else now.log_increment - log_weight - out[0]
        if not isfinite(residual) and not nothing:
            return 0.0, NOT_FINITE
        slope = _slope(now, out, axes) if not nothing else 1.0
        if residual > 0.0:
            high = x
        else:
            low = x
        if not slope > 0.0 and not (isfinite(low) and isfinite(high)):
            return 0.0, NO_SOLUTION
        step = -residual / slope if slope > 0.0 else inf
        if abs(step) <= tolerance:
            now = increment_and_stress(problem, x + step)
            write_point(row, axes, now.stress, problem.strain + now.increment)
            return now.increment, SOLVED
        if not low < x + step < high or abs(step) > 0.5 * before:
            step = _cautious(x, step, low, high)
        before = abs(step)
        x += step
    return 0.0, TOO_MANY


@njit(cache=True, error_model="numpy")
def _slope(now: StageIterate, out: Floats, axes: Axes) -> float:
    """d(ln D - ln w - ln f)/dx; between 1 and the stress exponent for a hardening law under prescribed strain."""
    by_strain = now.increment * now.increment_slope * out[1 + STRAIN]
    by_stress = now.stress * now.stress_slope * stress_derivative(out, 1, axes)
    return float(now.increment_slope - by_strain - by_stress)


@njit(cache=True, error_model="numpy")
def _cautious(x: float, step: float, low: float, high: float) -> float:
    """Bisect a closed bracket; in an open one Newton's step is kept, but not beyond 60 in ln D."""
    if isfinite(low) and isfinite(high):
        return 0.5 * (low + high) - x
    return min(max(step, -60.0), 60.0)


@njit(cache=True, error_model="numpy")
def solve_stage_near_guess(
    update: Any,
    theta: Floats,
    axes: Axes,
    problem: StageProblem,
    row: Floats,
    out: Floats,
    guess: float,
    tolerance: float,
) -> tuple[float, int]:
    """As `solve`, for a law without states under k > 0, from a good guess: no bracket and half of the logarithms.

    TOO_MANY when the guess was not good enough. A finite element asks for little else, nearly always
    from next to the answer.
    """
    increment, log_weight = guess, log(problem.weight)
    share = problem.stiffness * increment / problem.trial
    for _ in range(_NEAR_ITERATIONS):
        if not 1e-280 < share < 0.9999:
            break
        elastic = 1.0 - share
        stress = problem.trial * elastic
        write_point(row, axes, stress, problem.strain + increment)
        update(1, data_pointer(row), data_pointer(theta), data_pointer(out))
        if out[0] < NO_RATE:
            break
        residual = log(increment) - log_weight - out[0]
        slope = elastic * (1.0 - increment * out[1 + STRAIN]) + share * stress * stress_derivative(out, 1, axes)
        step = -residual / slope
        if not (slope > 0.0 and abs(step) < 1.0):
            break
        ratio = share / elastic * exp(step)
        share = ratio / (1.0 + ratio)
        increment = problem.trial / problem.stiffness * share
        if abs(step) <= tolerance:
            write_point(row, axes, problem.trial * (1.0 - share), problem.strain + increment)
            return increment, SOLVED
    return 0.0, TOO_MANY


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
