"""Sensitivities of one step of the reduced-order model, by complex step along parameters and nuisances."""

from __future__ import annotations

from typing import Any

from numba import njit

from creepkit.arrays import Floats
from creepkit.integration.stage_problem import solve_dense
from creepkit.kernels.interface import STRAIN
from creepkit.specimens.bulge.reduced_order.deflection_curves import LOG_GROWTH, DimpleCurves
from creepkit.specimens.bulge.reduced_order.step_equations import (
    FAST,
    FIRST_STEP_COLUMN,
    PROBES,
    SLOW,
    TRAJECTORY_COLUMNS,
    StepData,
    advance_state,
    step_exponents,
    step_residual,
    write_node_outputs,
    write_probes,
    write_step_outputs,
)
from creepkit.specimens.bulge.reduced_order.step_solution import (
    COMPLEX_STEP,
    TIMES,
    ReducedCandidate,
    ReducedSensitivities,
    ReducedWorkspace,
    complex_node,
    midpoint_time,
    virgin_state,
)


@njit(cache=True, error_model="numpy")
def differentiate_step(
    test: Floats,
    j: int,
    candidate: ReducedCandidate,
    dimple: DimpleCurves,
    before: Floats,
    state: Floats,
    unknown: Floats,
    toughness: float,
    work: ReducedWorkspace,
    slopes: ReducedSensitivities,
    changes: Floats,
) -> None:
    """Derivatives of the columns of node j along all directions, and of the state there."""
    if test[TIMES, j] > test[TIMES, j - 1]:
        _differentiate_step_outputs(test, j, candidate, dimple, before, unknown, work, slopes)
        first = slopes.ends.shape[1] - len(TRAJECTORY_COLUMNS)
        for d in range(changes.shape[2]):
            for c in range(FIRST_STEP_COLUMN, len(TRAJECTORY_COLUMNS)):
                changes[j, c, d] = slopes.ends[unknown.size + d, first + c]
    else:
        changes[j, FIRST_STEP_COLUMN:] = changes[j - 1, FIRST_STEP_COLUMN:]
        slopes.turned[:] = 0.0
    _differentiate_node(test, j, candidate, dimple, state, toughness, slopes, changes)
    if j == 1:
        tangents = slopes.tangents.copy()
        slopes.tangents[:] = 0.0
        _differentiate_node(
            test, 0, candidate, dimple, virgin_state(test, candidate.initial), toughness, slopes, changes
        )
        slopes.tangents[:] = tangents


@njit(cache=True, error_model="numpy")
def _differentiate_node(
    test: Floats,
    j: int,
    candidate: ReducedCandidate,
    dimple: DimpleCurves,
    state: Floats,
    toughness: float,
    slopes: ReducedSensitivities,
    changes: Floats,
) -> None:
    """Of the columns of node j itself."""
    parameters, moved, recorded, values = candidate.theta.size, slopes.state, slopes.recorded, slopes.values
    for d in range(changes.shape[2]):
        for i in range(state.size):
            moved[i] = complex(state[i], COMPLEX_STEP * slopes.tangents[d, i])
        node = complex_node(test, j, j, d - parameters, candidate.modulus_change, 0.5 + 0j, 0j, 0j)
        turned = complex(toughness, COMPLEX_STEP * slopes.turned[d])
        write_node_outputs(
            node, moved, turned, dimple, _thickness_step(d, parameters), test[TIMES, j], values, recorded
        )
        for c in range(FIRST_STEP_COLUMN):
            changes[j, c, d] = recorded[c].imag / COMPLEX_STEP


@njit(cache=True, error_model="numpy")
def _differentiate_step_outputs(
    test: Floats,
    j: int,
    candidate: ReducedCandidate,
    dimple: DimpleCurves,
    before: Floats,
    unknown: Floats,
    work: ReducedWorkspace,
    slopes: ReducedSensitivities,
) -> None:
    """Of the state after a step and the columns of the step: along each unknown, along each direction, then both."""
    parameters, size, ends = candidate.theta.size, unknown.size, slopes.ends
    share, time, weight = midpoint_time(test[TIMES, j - 1], test[TIMES, j], candidate.beta + COMPLEX_STEP * 1j)
    for k in range(ends.shape[0]):
        d = k - size
        for i in range(before.size):
            slopes.state[i] = complex(before[i], COMPLEX_STEP * slopes.tangents[d, i] if d >= 0 else 0.0)
        for i in range(size):
            slopes.unknown[i] = complex(unknown[i], COMPLEX_STEP if i == k else 0.0)
        slower = candidate.beta_slopes[d] if 0 <= d < parameters else 0.0
        node = complex_node(
            test,
            j - 1,
            j,
            d - parameters,
            candidate.modulus_change,
            complex(share.real, slower * share.imag),
            complex(time.real, slower * time.imag),
            complex(weight.real, slower * weight.imag),
        )
        _along(node, d, parameters, dimple, work, slopes, ends[k])
        for i in range(size):
            if d < 0:
                slopes.matrix[i, k] = slopes.left[i].imag / COMPLEX_STEP
            else:
                slopes.right[i, d] = -slopes.left[i].imag / COMPLEX_STEP
    solve_dense(slopes.matrix, slopes.right)
    _combine(size, before.size, slopes)


@njit(cache=True, error_model="numpy")
def _along(
    node: StepData,
    direction: int,
    parameters: int,
    dimple: DimpleCurves,
    work: ReducedWorkspace,
    slopes: ReducedSensitivities,
    ends: Floats,
) -> None:
    """One direction: what must be zero, into `left`; the state after, the middle's point and its columns, to ends."""
    rows, values, state, recorded = slopes.rows, slopes.values, slopes.state, slopes.recorded
    fast, slow = state[FAST], state[SLOW]
    middle = write_probes(node, state, slopes.unknown, dimple, _thickness_step(direction, parameters), rows, values)
    _law_along(work.law_values, slopes.full, work.logs, rows, direction, parameters, slopes.logs, slopes.rates)
    now = step_exponents(node, fast, slow, values, dimple.redistribution, middle, slopes.logs)
    step_residual(node, state, slopes.unknown, values[LOG_GROWTH], now, slopes.logs[0], slopes.rates, slopes.left)
    advance_state(state, slopes.unknown, middle, now, work.gains)
    write_step_outputs(rows[0, STRAIN], now, slopes.logs[0], recorded)
    recorded[0], recorded[1] = now.place, slopes.logs[0]  # columns of nodes are free here
    point, first = state.size, state.size + rows.shape[1]
    for i in range(point):
        ends[i] = state[i].imag / COMPLEX_STEP
    for i in range(rows.shape[1]):
        ends[point + i] = rows[0, i].imag / COMPLEX_STEP
    for c in range(recorded.size):
        ends[first + c] = recorded[c].imag / COMPLEX_STEP


@njit(cache=True, error_model="numpy")
def _combine(size: int, states: int, slopes: ReducedSensitivities) -> None:
    """Add to each direction what the unknowns do, and hand it on."""
    ends, right, width = slopes.ends, slopes.right, slopes.along.shape[1]
    for d in range(right.shape[1]):
        for k in range(size):
            for i in range(ends.shape[1]):
                ends[size + d, i] += right[k, d] * ends[k, i]
        for i in range(states):
            slopes.tangents[d, i] = ends[size + d, i]
        for i in range(width):
            slopes.along[d, i] = ends[size + d, states + i]
        slopes.turned[d], slopes.bent[d] = ends[size + d, states + width], ends[size + d, states + width + 1]


@njit(cache=True, error_model="numpy")
def _law_along(
    law_values: Floats, full: Floats, known: Floats, rows: Any, direction: int, parameters: int, logs: Any, rates: Any
) -> None:
    """ln of rates and the rates of states along a direction, in which the rows have imaginary parts.

    law_values, full : of `update` and `sensitivity`; known : (PROBES,) ln of rates.
    """
    width, outputs = rows.shape[1], 1 + rates.size
    own = 0 <= direction < parameters
    for k in range(PROBES):
        total = 0.0
        for i in range(width):
            total += law_values[k, outputs + i] * rows[k, i].imag
        if own and full[k, 0] > 0.0:
            total += COMPLEX_STEP * full[k, outputs * (1 + width) + direction] / full[k, 0]
        logs[k] = complex(known[k], total)
    for v in range(rates.size):
        total = 0.0
        for i in range(width):
            total += law_values[0, outputs + (1 + v) * width + i] * rows[0, i].imag
        if own:
            total += COMPLEX_STEP * full[0, outputs * (1 + width) + (1 + v) * parameters + direction]
        rates[v] = complex(law_values[0, 1 + v], total)


@njit(cache=True, error_model="numpy")
def _thickness_step(direction: int, parameters: int) -> complex:
    return COMPLEX_STEP * 1j if direction == parameters else 0j
