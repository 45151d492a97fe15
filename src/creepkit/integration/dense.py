"""What a step says between its ends: its error, its dense output, and the sensitivities of that."""

from __future__ import annotations

from math import exp

from numba import njit

from creepkit.arrays import Floats
from creepkit.integration.clock import TimeTransformation, transformed_time, transformation_derivatives
from creepkit.integration.step import StepWorkspace
from creepkit.integration.tableau import Tableau


@njit(cache=True, error_model="numpy")
def local_error(tableau: Tableau, work: StepWorkspace, h: float, v: int) -> float:
    """Estimated local error of unknown `v`."""
    total = 0.0
    for i in range(tableau.c.size):
        total += tableau.error[i] * work.slopes[i, v]
    return abs(h * total)


@njit(cache=True, error_model="numpy")
def dense_weight(tableau: Tableau, i: int, x: float) -> float:
    """Weight of stage `i` up to the share `x` of the step."""
    total = 0.0
    for q in range(tableau.dense.shape[1] - 1, -1, -1):
        total = (total + tableau.dense[i, q]) * x
    return total


@njit(cache=True, error_model="numpy")
def dense_slope(tableau: Tableau, i: int, x: float) -> float:
    """Derivative of `dense_weight` to x."""
    total = 0.0
    for q in range(tableau.dense.shape[1] - 1, -1, -1):
        total = total * x + (q + 1) * tableau.dense[i, q]
    return total


@njit(cache=True, error_model="numpy")
def dense_value(tableau: Tableau, work: StepWorkspace, h: float, x: float, v: int) -> float:
    """Unknown `v` at the share `x` of the step."""
    total = 0.0
    for i in range(tableau.c.size):
        total += dense_weight(tableau, i, x) * work.slopes[i, v]
    return float(work.value[v] + h * total)


@njit(cache=True, error_model="numpy")
def dense_sensitivity(
    clock: TimeTransformation, tableau: Tableau, work: StepWorkspace, s: float, h: float, x: float, v: int, change: Floats
) -> None:
    """Derivatives of unknown `v` at a fixed time with respect to the parameters, into `change` (P,)."""
    slope = 0.0
    for p in range(change.size):
        change[p] = work.change[v, p]
    for i in range(tableau.c.size):
        weight = h * dense_weight(tableau, i, x)
        slope += dense_slope(tableau, i, x) * work.slopes[i, v]
        for p in range(change.size):
            change[p] += weight * work.slope_changes[i, v, p]
    place_now = s + x * h
    by_beta, by_tau = transformation_derivatives(clock, place_now)
    pace = exp(transformed_time(clock, place_now).log_pace)
    for p in range(change.size):
        later = by_beta.time * work.clock_change[0, p] + by_tau.time * work.clock_change[1, p]
        change[p] -= slope * later / pace
