"""Workspace and Newton's method for one time step of the reduced-order model."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from creepkit.arrays import Floats
from creepkit.integration.stage_problem import solve_dense
from creepkit.kernels.interface import MEAN_STRESS, POINT_SIZE, PRINCIPAL_STRESS, STRAIN, STRESS, data_pointer
from creepkit.specimens.bulge.reduced_order.deflection_curves import (
    CURVES,
    LOG_GROWTH,
    LOG_STRESS,
    DimpleCurves,
    curve_slope,
    exp,
    log,
)
from creepkit.specimens.bulge.reduced_order.step_equations import (
    FAST,
    MEAN_STRESS_RATIO,
    PROBES,
    SLOW,
    STATES,
    StepData,
    StepExponents,
    StepMidpoint,
    step_exponents,
    step_residual,
    write_probes,
)

NUISANCE_DIRECTIONS = ("thickness", "modulus", "temperature")
"""Directions of derivatives after the law's parameters: mm, relative, K."""


COMPLEX_STEP = 2.0**-100
"""Scale of imaginary parts; to divide by a power of two is to multiply."""


TIMES, PRESSURE, TEMPERATURES, MODULUS, SOFTENING, ELASTIC, ELASTIC_THICKNESS, ELASTIC_MODULUS = range(8)
"""Rows of a test, (8, nodes): time s, pressure MPa, temperature K, modulus MPa and its slope to temperature, elastic
deflection mm with its derivatives to thickness and to ln of the modulus. One array, for each costs at every call.
"""


class ReducedCandidate(NamedTuple):
    """Internal parameters (P,), exponent of the time transformation with its derivatives (P,), relative change of the
    modulus; the law's initial states and limits (S,); limits of deflection mm and strain.
    """

    theta: Floats
    beta: float
    beta_slopes: Floats
    modulus_change: float
    initial: Floats
    limits: Floats
    deflection_limit: float
    strain_limit: float


class FeatureFactors(NamedTuple):
    """Factors on stress (.,) and on strain (.,) of the features."""

    stress: Floats
    strain: Floats


class ReducedWorkspace(NamedTuple):
    """Working arrays: for the law at the probes and at the features, for curves and Newton's method.

    rows (PROBES, 6 + S), law_values (PROBES, .) of `update`; wide (6 + S, features),
    feature_values (1 + S, features) at features; values (CURVES,).
    """

    rows: Floats
    law_values: Floats
    wide: Floats
    feature_values: Floats
    values: Floats
    logs: Floats
    rates: Floats
    gains: Floats
    right: Floats
    matrix: Floats


class ReducedSensitivities(NamedTuple):
    """Working arrays of derivatives: complex ones of a step; what the law says of all its derivatives at the probes and
    at the features; and of each direction those of the state (directions, state), of the point in the middle and ln of
    the rate there, and of n'/(n' + 2).

    ends : (unknowns and directions, .) of what a step leaves to each.
    """

    rows: Any
    values: Any
    logs: Any
    rates: Any
    left: Any
    state: Any
    unknown: Any
    recorded: Any
    full: Floats
    wide_full: Floats
    matrix: Floats
    right: Floats
    ends: Floats
    tangents: Floats
    along: Floats
    bent: Floats
    turned: Floats


@njit(cache=True, error_model="numpy")
def reduced_workspace(states: int, count: int) -> ReducedWorkspace:
    """Allocate for `count` features."""
    width, size = POINT_SIZE + states, 1 + states
    return ReducedWorkspace(
        np.zeros((PROBES, width)),
        np.zeros((PROBES, size * (1 + width))),
        np.zeros((width, count)),
        np.zeros((size, count)),
        np.zeros(CURVES),
        np.zeros(PROBES),
        np.zeros(states),
        np.ones(states),
        np.zeros((2 + states, 1)),
        np.zeros((2 + states, 2 + states)),
    )


@njit(cache=True, error_model="numpy")
def sensitivity_workspace(
    states: int, parameters: int, count: int, directions: int, columns: int
) -> ReducedSensitivities:
    """Allocate for `count` features and some directions of derivatives (none: 0) of as many columns of a trajectory."""
    width, size, some = POINT_SIZE + states, 2 + states, 1 if directions > 0 else 0
    law_columns = (1 + states) * (1 + width + parameters)
    kind = np.complex128
    return ReducedSensitivities(
        np.zeros((PROBES, width), kind),
        np.zeros(CURVES, kind),
        np.zeros(PROBES, kind),
        np.zeros(states, kind),
        np.zeros(size, kind),
        np.zeros(STATES + states, kind),
        np.zeros(size, kind),
        np.zeros(columns, kind),
        np.zeros((PROBES, law_columns)),
        np.zeros((some * law_columns, count)),
        np.zeros((size, size)),
        np.zeros((size, directions)),
        np.zeros((size + directions, STATES + states + width + columns)),
        np.zeros((directions, STATES + states)),
        np.zeros((directions, width)),
        np.zeros(directions),
        np.zeros(directions),
    )


@njit(cache=True, error_model="numpy")
def virgin_state(test: Floats, initial: Floats) -> Floats:
    """The state at node 0; a load that is there already is all elastic."""
    state = np.zeros(STATES + initial.size)
    state[FAST] = state[SLOW] = test[PRESSURE, 0]
    state[STATES:] = initial
    return state


@njit(cache=True, error_model="numpy")
def midpoint_time(before: float, after: float, beta: Any) -> Any:
    """Of the middle in t^beta: the share of time before it, its time s, and ln of dt/ds times the step."""
    low = exp(beta * np.log(before)) if before > 0.0 else 0.0 * beta
    high = exp(beta * np.log(after))
    middle = exp(log(0.5 * (low + high)) / beta)
    weight = log((high - low) / beta) + (1.0 - beta) * log(middle)
    return (middle - before) / (after - before), middle, weight


@njit(cache=True, error_model="numpy")
def real_node(test: Floats, j: int, beta: float) -> StepData:
    """The step that ends at node j."""
    i = j - 1
    share, time, weight = midpoint_time(test[TIMES, i], test[TIMES, j], beta)
    return StepData(
        test[PRESSURE, i],
        test[PRESSURE, j],
        test[TEMPERATURES, i],
        test[TEMPERATURES, j],
        test[MODULUS, i],
        test[MODULUS, j],
        test[ELASTIC, i],
        test[ELASTIC, j],
        share,
        time,
        weight,
    )


@njit(cache=True, error_model="numpy")
def end_of(test: Floats, j: int) -> StepData:
    """Node j by itself."""
    P, T, E, D = test[PRESSURE, j], test[TEMPERATURES, j], test[MODULUS, j], test[ELASTIC, j]
    return StepData(P, P, T, T, E, E, D, D, 0.5, test[TIMES, j], 0.0)


@njit(cache=True, error_model="numpy")
def complex_node(
    test: Floats, i: int, j: int, effect: int, modulus_change: float, share: Any, time: Any, weight: Any
) -> StepData:
    """What lies between nodes i and j along one of the NUISANCE_DIRECTIONS (none: less than 0).

    modulus_change : relative change of the modulus; share, time, weight : of the time transformation, with derivatives.
    """
    temperature_step = COMPLEX_STEP * 1j if effect == 2 else 0j
    first, last = _change(test, i, effect, modulus_change), _change(test, j, effect, modulus_change)
    return StepData(
        test[PRESSURE, i],
        test[PRESSURE, j],
        test[TEMPERATURES, i] + temperature_step,
        test[TEMPERATURES, j] + temperature_step,
        test[MODULUS, i] + COMPLEX_STEP * 1j * first,
        test[MODULUS, j] + COMPLEX_STEP * 1j * last,
        test[ELASTIC, i] + COMPLEX_STEP * 1j * _lifted(test, i, effect, first),
        test[ELASTIC, j] + COMPLEX_STEP * 1j * _lifted(test, j, effect, last),
        share,
        time,
        weight,
    )


@njit(cache=True, error_model="numpy")
def _change(test: Floats, j: int, effect: int, modulus_change: float) -> float:
    """Derivative of the modulus to an effect."""
    if effect == 1:
        return test[MODULUS, j] / (1.0 + modulus_change)  # type: ignore[no-any-return]
    return test[SOFTENING, j] if effect == 2 else 0.0


@njit(cache=True, error_model="numpy")
def _lifted(test: Floats, j: int, effect: int, change: float) -> float:
    """Derivative of the elastic deflection to an effect that changes the modulus so."""
    if effect == 0:
        return test[ELASTIC_THICKNESS, j]  # type: ignore[no-any-return]
    return test[ELASTIC_MODULUS, j] * change / test[MODULUS, j]  # type: ignore[no-any-return]


_ITERATIONS, _STEP = 25, 4.0
"""Most Newton iterations of a step, and the largest change in one of them."""


_STILL = -600.0
"""ln of a rate that is none."""


_LOG_OVER = float(np.log(100.0))
"""Of strain, or mm, of an increment; a dimple has ruptured long before."""


@njit(cache=True, error_model="numpy")
def evaluate_probes(entry: Any, theta: Floats, rows: Floats, law_values: Floats) -> None:
    """Evaluate an entry of the law at the probes one by one: rows (PROBES, 6 + S), law_values (PROBES, .)."""
    for k in range(PROBES):
        entry(1, data_pointer(rows[k]), data_pointer(theta), data_pointer(law_values[k]))


@njit(cache=True, error_model="numpy")
def solve_step(
    update: Any,
    theta: Floats,
    node: StepData,
    state: Floats,
    unknown: Floats,
    dimple: DimpleCurves,
    tolerance: float,
    work: ReducedWorkspace,
) -> tuple[StepMidpoint, StepExponents]:
    """Newton's method for the unknowns, in place; the middle of the step and the pace then."""
    rows, law_values, values = work.rows, work.law_values, work.values
    logs, rates, right, matrix = work.logs, work.rates, work.right, work.matrix
    for iteration in range(_ITERATIONS):
        middle = write_probes(node, state, unknown, dimple, 0.0, rows, values)
        evaluate_probes(update, theta, rows, law_values)
        for k in range(PROBES):
            logs[k] = max(law_values[k, 0], _STILL) if law_values[k, 0] < 0.0 else law_values[k, 0]
        for v in range(rates.size):
            rates[v] = law_values[0, 1 + v]
        now = step_exponents(node, state[FAST], state[SLOW], values, dimple.redistribution, middle, logs)
        step_residual(node, state, unknown, values[LOG_GROWTH], now, logs[0], rates, right[:, 0])
        largest = _largest(right)
        if not np.isfinite(largest) or largest < tolerance or iteration == _ITERATIONS - 1:
            break
        _jacobian(node, unknown, rows, law_values, dimple, middle, now, matrix)
        if not solve_dense(matrix, right):
            break
        factor = min(1.0, _STEP / _largest(right))
        for k in range(unknown.size):
            unknown[k] -= factor * right[k, 0]
        unknown[0], unknown[1] = min(unknown[0], _LOG_OVER), min(unknown[1], _LOG_OVER)
    _damp(node, rows.shape[1], law_values, work.gains)
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
    node: StepData,
    unknown: Floats,
    rows: Floats,
    law_values: Floats,
    dimple: DimpleCurves,
    middle: StepMidpoint,
    now: StepExponents,
    matrix: Floats,
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
        stress_derivative = (
            law_values[0, start + STRESS]
            + law_values[0, start + PRINCIPAL_STRESS]
            + MEAN_STRESS_RATIO * law_values[0, start + MEAN_STRESS]
        )
        matrix[row, 0] = factor * law_values[0, start + STRAIN] * half_strain
        matrix[row, 1] = factor * stress_derivative * softer
        for u in range(size - 2):
            matrix[row, 2 + u] = factor * law_values[0, start + POINT_SIZE + u]
        matrix[row, row] -= 1.0
    for u in range(size - 2):
        matrix[1, 2 + u] = 0.0
    matrix[1, 0] = 1.0 + now.bend
    matrix[1, 1] = (growth_slope - now.bend * stress_slope) * half - 1.0


@njit(cache=True, error_model="numpy")
def _damp(node: StepData, width: int, law_values: Floats, gains: Floats) -> None:
    """1 where the midpoint rule serves; less where a state settles within the step and would overshoot."""
    for v in range(gains.size):
        settling = -0.5 * np.exp(node.log_weight) * law_values[0, 1 + gains.size + (1 + v) * width + POINT_SIZE + v]
        gains[v] = (1.0 + max(settling, 0.0) ** 3) ** (-1.0 / 3.0)
