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

from math import exp, inf, isfinite, log, log1p
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from creepkit.arrays import Floats
from creepkit.integration.elimination import eliminate
from creepkit.kernels.interface import MEAN, POINT_SIZE, PRINCIPAL, STRAIN, STRESS, pointer

SOLVED, NOT_FINITE, NO_SOLUTION, TOO_MANY = range(4)
"""Flags of a stage: solved; the rate is not finite; no increment satisfies the equation; iterations used up."""

_ITERATIONS = 80
_HALVINGS = 12
_LONGEST_CORRECTION = 5.0
_NO_RATE = -600.0
"""ln of a rate, 1/s, below which nothing creeps (a law whose terms are off, or a stress of zero)."""


class Axes(NamedTuple):
    """Largest principal and mean stress as straight lines in the equivalent stress: offset + slope sigma, MPa."""

    principal: float
    principal_slope: float
    mean: float
    mean_slope: float


UNIAXIAL = Axes(0.0, 1.0, 0.0, 1.0 / 3.0)
"""Uniaxial tension: the largest principal stress is the stress, the mean stress a third of it."""


class Problem(NamedTuple):
    """What a stage is solved for: trial stress and k in MPa, load 0 or 1, weight w in s, strain p0 so far."""

    trial: float
    stiffness: float
    load: float
    weight: float
    strain: float


class Unfolded(NamedTuple):
    """An iterate x in plain terms: D, ln D, stress in MPa, and d(ln D)/dx, d(ln sigma)/dx."""

    increment: float
    log_increment: float
    stress: float
    increment_slope: float
    stress_slope: float


@njit(cache=True, error_model="numpy")
def unfold(problem: Problem, x: float) -> Unfolded:
    """Turn the unknown x into increment and stress."""
    amount = exp(min(x, 700.0))
    if problem.stiffness > 0.0:
        ratio = problem.stiffness * amount / problem.trial
        elastic = 1.0 / (1.0 + ratio)
        return Unfolded(amount * elastic, x - log1p(ratio), problem.trial * elastic, elastic, elastic - 1.0)
    stress = problem.trial * exp(problem.load * min(amount, 700.0)) if problem.load > 0.0 else problem.trial
    return Unfolded(amount, x, stress, 1.0, problem.load * amount)


@njit(cache=True, error_model="numpy")
def fold(problem: Problem, increment: float) -> float:
    """The unknown x of a guessed increment, kept off the ends of its range."""
    guess = max(increment, 1e-300)
    if problem.stiffness == 0.0:
        return log(guess)
    share = min(problem.stiffness * guess / problem.trial, 0.999)
    return log(guess) - log1p(-share) if share < 0.999 else log(999.0 * problem.trial / problem.stiffness)


@njit(cache=True, error_model="numpy")
def place(row: Floats, axes: Axes, stress: float, strain: float) -> None:
    """Write stress and strain into a kernel's row; time, temperature and states are there already."""
    row[STRESS] = stress
    row[STRAIN] = strain
    row[PRINCIPAL] = axes.principal + axes.principal_slope * stress
    row[MEAN] = axes.mean + axes.mean_slope * stress


@njit(cache=True, error_model="numpy")
def along_stress(slopes: Floats, start: int, axes: Axes) -> float:
    """Derivative to the equivalent stress, principal and mean stress following it; a gradient begins at `start`."""
    return float(
        slopes[start + STRESS]
        + axes.principal_slope * slopes[start + PRINCIPAL]
        + axes.mean_slope * slopes[start + MEAN]
    )


@njit(cache=True, error_model="numpy")
def solve(
    update: Any,
    theta: Floats,
    axes: Axes,
    problem: Problem,
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
        return _solve_coupled(update, theta, axes, problem, states, row, out, guess, tolerance)
    if problem.trial <= 0.0:
        place(row, axes, 0.0, problem.strain)
        return 0.0, SOLVED if problem.trial == 0.0 else NO_SOLUTION
    return _solve_scalar(update, theta, axes, problem, row, out, guess, tolerance)


@njit(cache=True, error_model="numpy")
def _solve_scalar(
    update: Any,
    theta: Floats,
    axes: Axes,
    problem: Problem,
    row: Floats,
    out: Floats,
    guess: float,
    tolerance: float,
) -> tuple[float, int]:
    """Newton's method in x, bracketed: it cannot fail where the rate falls with strain and rises with stress."""
    x, low, high, before = fold(problem, guess), -inf, inf, inf
    log_weight = log(problem.weight)
    for _ in range(_ITERATIONS):
        now = unfold(problem, x)
        place(row, axes, now.stress, problem.strain + now.increment)
        update(1, pointer(row), pointer(theta), pointer(out))
        if out[0] < _NO_RATE:
            place(row, axes, problem.trial, problem.strain)
            return 0.0, SOLVED
        residual = now.log_increment - log_weight - out[0]
        if not isfinite(residual):
            return 0.0, NOT_FINITE
        slope = _slope(now, out, axes)
        if residual > 0.0:
            high = x
        else:
            low = x
        if not slope > 0.0 and not (isfinite(low) and isfinite(high)):
            return 0.0, NO_SOLUTION
        step = -residual / slope if slope > 0.0 else inf
        if abs(step) <= tolerance:
            now = unfold(problem, x + step)
            place(row, axes, now.stress, problem.strain + now.increment)
            return now.increment, SOLVED
        if not low < x + step < high or abs(step) > 0.5 * before:
            step = _cautious(x, step, low, high)
        before = abs(step)
        x += step
    return 0.0, TOO_MANY


@njit(cache=True, error_model="numpy")
def _slope(now: Unfolded, out: Floats, axes: Axes) -> float:
    """d(ln D - ln w - ln f)/dx; between 1 and the stress exponent for a hardening law under prescribed strain."""
    by_strain = now.increment * now.increment_slope * out[1 + STRAIN]
    by_stress = now.stress * now.stress_slope * along_stress(out, 1, axes)
    return float(now.increment_slope - by_strain - by_stress)


@njit(cache=True, error_model="numpy")
def _cautious(x: float, step: float, low: float, high: float) -> float:
    """Bisect a closed bracket; in an open one Newton's step is kept, but not beyond 60 in ln D."""
    if isfinite(low) and isfinite(high):
        return 0.5 * (low + high) - x
    return min(max(step, -60.0), 60.0)


@njit(cache=True, error_model="numpy")
def _solve_coupled(
    update: Any,
    theta: Floats,
    axes: Axes,
    problem: Problem,
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
    x, creeps = fold(problem, guess), problem.trial > 0.0
    last, halvings = np.zeros(size), 0
    for _ in range(_ITERATIONS):
        now = unfold(problem, x) if creeps else Unfolded(0.0, 0.0, 0.0, 0.0, 0.0)
        place(row, axes, now.stress, problem.strain + now.increment)
        update(1, pointer(row), pointer(theta), pointer(out))
        creeps = creeps and not out[0] < _NO_RATE
        if not _finite(out, size, creeps):
            halvings += 1
            if halvings > _HALVINGS:
                return 0.0, NOT_FINITE
            x = _correct(x, row, last, -0.5)
            for i in range(size):
                last[i] *= 0.5
            continue
        _newton_system(axes, problem, states, row, out, now, creeps, matrix, step)
        if not eliminate(matrix, step):
            return 0.0, NO_SOLUTION
        damping = min(1.0, _LONGEST_CORRECTION / max(abs(step[0, 0]), 1e-300))
        for i in range(size):
            last[i] = damping * step[i, 0]
        x = _correct(x, row, last, 1.0)
        halvings = 0
        if _small(last, row, tolerance):
            now = unfold(problem, x) if creeps else now
            place(row, axes, now.stress, problem.strain + now.increment)
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
    problem: Problem,
    states: Floats,
    row: Floats,
    out: Floats,
    now: Unfolded,
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
        by_stress = now.stress * now.stress_slope * along_stress(out, start, axes)
        matrix[i, 0] = -factor * (by_strain + by_stress) if creeps else 0.0
        for j in range(1, size):
            matrix[i, j] = -factor * out[start + POINT_SIZE + j - 1] if factor > 0.0 else 0.0
        matrix[i, i] += 1.0 if i > 0 or not creeps else now.increment_slope
        if i > 0:
            right[i, 0] = states[i - 1] + problem.weight * out[i] - row[POINT_SIZE + i - 1]
    right[0, 0] = log(problem.weight) + out[0] - now.log_increment if creeps else 0.0
