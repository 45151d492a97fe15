"""One Runge-Kutta step of a material point, its dense output, error estimate and sensitivities.

Sensitivities are the exact derivatives of the discrete scheme at fixed positions in the transformed time, which may
itself depend on the parameters.
"""

from __future__ import annotations

from math import exp
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from creepkit.arrays import Floats
from creepkit.integration.stage_problem import (
    BY_LOG_WEIGHT,
    BY_STRAIN,
    BY_TEMPERATURE,
    BY_TIME,
    BY_TRIAL,
    INPUTS,
    NO_SOLUTION,
    SOLVED,
    Axes,
    StageProblem,
    differentiate_stage,
    gradient_of_sensitivity,
    write_point,
)
from creepkit.integration.stage_solver import solve_stage
from creepkit.integration.time_discretisation import (
    Segment,
    Tableau,
    TimeTransformation,
    stress_rate,
    temperature_rate,
    transformation_derivatives,
    transformed_time,
)
from creepkit.kernels.interface import POINT_SIZE, TEMPERATURE, TIME, data_pointer


class StressControl(NamedTuple):
    """How stress follows strain: sigma = (driving stress - stiffness p) exp(load p); MPa, and load 0 or 1."""

    stiffness: float
    load: float
    axes: Axes


class StepWorkspace(NamedTuple):
    """Working arrays of one point: V = 1 + S unknowns (strain, then states), P parameters.

    value, change : (V,), (V, P) at the start of the step and its derivatives; new_value, new_change : at its end.
    slopes, slope_changes : (stages, V), (stages, V, P) d/ds at the stages.
    base, base_change : (V,), (V, P) history of a stage. row, out, full : for the kernel's entries.
    gradient, matrix, response : for stage_solver. clock_change : (2, P) of beta and tau.
    """

    value: Floats
    change: Floats
    new_value: Floats
    new_change: Floats
    slopes: Floats
    slope_changes: Floats
    base: Floats
    base_change: Floats
    row: Floats
    out: Floats
    full: Floats
    gradient: Floats
    matrix: Floats
    response: Floats
    clock_change: Floats


@njit(cache=True, error_model="numpy")
def step_workspace(states: int, parameters: int, stages: int) -> StepWorkspace:
    """Allocate the working arrays."""
    size, width = 1 + states, POINT_SIZE + states
    return StepWorkspace(
        np.zeros(size),
        np.zeros((size, parameters)),
        np.zeros(size),
        np.zeros((size, parameters)),
        np.zeros((stages, size)),
        np.zeros((stages, size, parameters)),
        np.zeros(size),
        np.zeros((size, parameters)),
        np.zeros(width),
        np.zeros(size * (1 + width)),
        np.zeros(size * (1 + width + parameters)),
        np.zeros((size, width)),
        np.zeros((size, size)),
        np.zeros((size, INPUTS + states + parameters)),
        np.zeros((2, parameters)),
    )


@njit(cache=True, error_model="numpy")
def _set_stage(
    drive: StressControl,
    segment: Segment,
    clock: TimeTransformation,
    tableau: Tableau,
    work: StepWorkspace,
    s: float,
    h: float,
    i: int,
) -> StageProblem:
    """Write history, time and temperature of stage `i` into the workspace; return its problem.

    Where strain starts as a high power of s, weights below zero can make its history negative: laws never see that.
    """
    for v in range(work.base.size):
        total = 0.0
        for j in range(i):
            total += tableau.a[i, j] * work.slopes[j, v]
        work.base[v] = work.value[v] + h * total
    now = transformed_time(clock, s + tableau.c[i] * h)
    elapsed = now.time - segment.start
    work.row[TIME] = now.time
    work.row[TEMPERATURE] = segment.temperature + temperature_rate(segment) * elapsed
    strain = max(work.base[0], 0.0)
    driving = segment.stress + stress_rate(segment) * elapsed
    trial = (driving - drive.stiffness * strain) * exp(drive.load * strain)
    return StageProblem(trial, drive.stiffness, drive.load, tableau.a[i, i] * h * exp(now.log_pace), strain)


@njit(cache=True, error_model="numpy")
def advance(
    update: Any,
    theta: Floats,
    drive: StressControl,
    segment: Segment,
    clock: TimeTransformation,
    tableau: Tableau,
    work: StepWorkspace,
    s: float,
    h: float,
    slope: float,
    tolerance: float,
) -> int:
    """Solve all stages from position `s` to ``s + h``; `slope` is a guess of dp/ds. Return the flag of a stage."""
    for i in range(tableau.c.size):
        problem = _set_stage(drive, segment, clock, tableau, work, s, h, i)
        share = tableau.a[i, i] * h
        for v in range(1, work.base.size):
            work.row[POINT_SIZE + v - 1] = work.base[v] + (share * work.slopes[i - 1, v] if i > 0 else 0.0)
        guess = share * (work.slopes[i - 1, 0] if i > 0 else slope)
        increment, flag = solve_stage(
            update, theta, drive.axes, problem, work.base[1:], work.row, work.out, guess, tolerance
        )
        if flag != SOLVED:
            return flag
        work.slopes[i, 0] = increment / share
        work.new_value[0] = work.base[0] + increment
        for v in range(1, work.base.size):
            work.new_value[v] = work.row[POINT_SIZE + v - 1]
            work.slopes[i, v] = (work.new_value[v] - work.base[v]) / share
    return SOLVED


@njit(cache=True, error_model="numpy")
def differentiate(
    sensitivity: Any,
    theta: Floats,
    drive: StressControl,
    segment: Segment,
    clock: TimeTransformation,
    tableau: Tableau,
    work: StepWorkspace,
    s: float,
    h: float,
) -> int:
    """Derivatives of the slopes and of the new value with respect to the parameters, after `advance`."""
    size, parameters = work.change.shape
    for i in range(tableau.c.size):
        problem = _set_stage(drive, segment, clock, tableau, work, s, h, i)
        share = tableau.a[i, i] * h
        increment = share * work.slopes[i, 0]
        for v in range(1, size):
            work.row[POINT_SIZE + v - 1] = work.base[v] + share * work.slopes[i, v]
        growth = exp(drive.load * increment)
        stress = (problem.trial - problem.stiffness * increment) * growth
        write_point(work.row, drive.axes, stress, problem.strain + increment)
        sensitivity(1, data_pointer(work.row), data_pointer(theta), data_pointer(work.full))
        gradient_of_sensitivity(work.full, problem, increment, work.gradient)
        start = size + size * work.row.size
        for v in range(size):
            for p in range(parameters):
                slope = work.full[start + v * parameters + p]
                work.response[v, INPUTS + size - 1 + p] = problem.weight * slope if stress > 0.0 or v > 0 else 0.0
        rates = work.full[1:size]
        if not differentiate_stage(
            drive.axes, problem, increment, stress, rates, work.gradient, work.matrix, work.response
        ):
            return NO_SOLUTION
        _stage_change(drive, segment, clock, tableau, work, problem, s, h, i)
    for v in range(size):
        for p in range(parameters):
            total = work.change[v, p]
            for i in range(tableau.c.size):
                total += h * tableau.a[tableau.c.size - 1, i] * work.slope_changes[i, v, p]
            work.new_change[v, p] = total
    return SOLVED


@njit(cache=True, error_model="numpy")
def _stage_change(
    drive: StressControl,
    segment: Segment,
    clock: TimeTransformation,
    tableau: Tableau,
    work: StepWorkspace,
    problem: StageProblem,
    s: float,
    h: float,
    i: int,
) -> None:
    """Chain the response of stage `i` to the changes of its history and of its time transformation."""
    size, parameters = work.change.shape
    for v in range(size):
        for p in range(parameters):
            total = 0.0
            for j in range(i):
                total += tableau.a[i, j] * work.slope_changes[j, v, p]
            work.base_change[v, p] = work.change[v, p] + h * total
    by_beta, by_tau = transformation_derivatives(clock, s + tableau.c[i] * h)
    strain = problem.strain
    trial_by_strain = drive.load * problem.trial - drive.stiffness * exp(drive.load * strain)
    trial_by_time = stress_rate(segment) * exp(drive.load * strain)
    heating = temperature_rate(segment)
    share = tableau.a[i, i] * h
    for p in range(parameters):
        beta, tau = work.clock_change[0, p], work.clock_change[1, p]
        later = by_beta.time * beta + by_tau.time * tau
        slower = by_beta.log_pace * beta + by_tau.log_pace * tau
        before = work.base_change[0, p] if work.base[0] >= 0.0 else 0.0
        trial = trial_by_strain * before + trial_by_time * later
        for v in range(size):
            answer = work.response[v]
            total = answer[INPUTS + size - 1 + p] + answer[BY_TRIAL] * trial + answer[BY_STRAIN] * before
            total += (answer[BY_TIME] + answer[BY_TEMPERATURE] * heating) * later + answer[BY_LOG_WEIGHT] * slower
            for z in range(1, size):
                total += answer[INPUTS + z - 1] * work.base_change[z, p]
            if v > 0:
                total -= work.base_change[v, p]
            work.slope_changes[i, v, p] = total / share


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
    clock: TimeTransformation,
    tableau: Tableau,
    work: StepWorkspace,
    s: float,
    h: float,
    x: float,
    v: int,
    change: Floats,
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
