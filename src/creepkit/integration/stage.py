"""The implicit stage of one material point: what uniaxial tests, relaxation and finite elements have in common.

Unknown are the creep increment D and the states z at the end of the stage:

    D = w f(sigma, p0 + D, t, T, z)                 z = z0 + w g(sigma, p0 + D, t, T, z)
    sigma = (trial - k D) exp(load D)

with w the weight of the stage (gamma h dt/ds), p0 and z0 the history so far, trial the stress if nothing crept, and
k = 3G in a finite element, E in relaxation, 0 under prescribed stress. load = 1 is uniaxial tension under constant
load, whose true stress grows as exp(strain) because creep keeps the volume; else load = 0. Not both are above zero.

The unknown is x = ln[D / (1 - k D/trial)]: ln D while little has crept, and minus ln sigma when creep takes all of
the trial stress. Since kernels give ln f, the equation is nearly linear in x at both ends, for any rate.
"""

from __future__ import annotations

from math import exp, inf, isfinite, log
from typing import Any

from numba import njit

from creepkit.arrays import Floats
from creepkit.integration.coupled import solve_stage_with_states
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
from creepkit.kernels.interface import STRAIN, data_pointer

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
    out : ((1 + S)(7 + S),) room for the entry's output.
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
