"""The terms in which a stage is posed and its unknown read: the problem, the axes of stress, x and the increment."""

from __future__ import annotations

from math import exp, log, log1p
from typing import NamedTuple

from numba import njit

from creepkit.arrays import Floats
from creepkit.kernels.interface import MEAN_STRESS, PRINCIPAL_STRESS, STRAIN, STRESS

SOLVED, NOT_FINITE, NO_SOLUTION, TOO_MANY = range(4)
"""Flags of a stage: solved; the rate is not finite; no increment satisfies the equation; iterations used up."""

NO_RATE = -600.0
"""ln of a rate, 1/s, below which nothing creeps (a law whose terms are off, or a stress of zero)."""


class Axes(NamedTuple):
    """Largest principal and mean stress as straight lines in the equivalent stress: offset + slope sigma, MPa."""

    principal: float
    principal_slope: float
    mean: float
    mean_slope: float


UNIAXIAL = Axes(0.0, 1.0, 0.0, 1.0 / 3.0)
"""Uniaxial tension: the largest principal stress is the stress, the mean stress a third of it."""


class StageProblem(NamedTuple):
    """What a stage is solved for: trial stress and k in MPa, load 0 or 1, weight w in s, strain p0 so far."""

    trial: float
    stiffness: float
    load: float
    weight: float
    strain: float


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
