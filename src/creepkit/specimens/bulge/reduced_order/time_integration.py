"""Time integration of the reduced-order model for many candidates and tests, with complex-step sensitivities."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from creepkit.arrays import Floats, Ints
from creepkit.integration.stage_problem import solve_dense
from creepkit.kernels.interface import MEAN_STRESS, PRINCIPAL_STRESS, STRAIN, STRESS, data_pointer
from creepkit.specimens.bulge.reduced_order.deflection_curves import LOG_GROWTH, DimpleCurves
from creepkit.specimens.bulge.reduced_order.step_equations import (
    AMPLITUDE_COLUMN,
    CREEP_DEFLECTION,
    FAST,
    FIRST_STEP_COLUMN,
    PROBES,
    SLOW,
    STATES,
    STRAIN_STATE,
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
    ELASTIC,
    NUISANCE_DIRECTIONS,
    PRESSURE,
    TIMES,
    FeatureFactors,
    ReducedCandidate,
    ReducedSensitivities,
    ReducedWorkspace,
    complex_node,
    end_of,
    midpoint_time,
    real_node,
    reduced_workspace,
    sensitivity_workspace,
    solve_step,
    virgin_state,
)


@njit(cache=True, error_model="numpy")
def evaluate_law(update: Any, sensitivity: Any, theta: Floats, work: ReducedWorkspace, full: Floats) -> None:
    """What the law says at the solution."""
    update(PROBES, data_pointer(work.rows), data_pointer(theta), data_pointer(work.said))
    sensitivity(PROBES, data_pointer(work.rows), data_pointer(theta), data_pointer(full))


@njit(cache=True, error_model="numpy")
def differentiate_step(
    test: Floats, j: int, candidate: ReducedCandidate, dimple: DimpleCurves, before: Floats, state: Floats, unknown: Floats,
    toughness: float, work: ReducedWorkspace, slopes: ReducedSensitivities, changes: Floats,
) -> None:  # fmt: skip
    """Derivatives of what is told of node j along all directions, and of the state there."""
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
    test: Floats, j: int, candidate: ReducedCandidate, dimple: DimpleCurves, state: Floats, toughness: float, slopes: ReducedSensitivities,
    changes: Floats,
) -> None:  # fmt: skip
    """Of what is told of node j itself."""
    parameters, moved, told, values = candidate.theta.size, slopes.state, slopes.told, slopes.values
    for d in range(changes.shape[2]):
        for i in range(state.size):
            moved[i] = complex(state[i], COMPLEX_STEP * slopes.tangents[d, i])
        node = complex_node(test, j, j, d - parameters, candidate.stiffer, 0.5 + 0j, 0j, 0j)
        turned = complex(toughness, COMPLEX_STEP * slopes.turned[d])
        write_node_outputs(node, moved, turned, dimple, _thicker(d, parameters), test[TIMES, j], values, told)
        for c in range(FIRST_STEP_COLUMN):
            changes[j, c, d] = told[c].imag / COMPLEX_STEP


@njit(cache=True, error_model="numpy")
def _differentiate_step_outputs(
    test: Floats, j: int, candidate: ReducedCandidate, dimple: DimpleCurves, before: Floats, unknown: Floats, work: ReducedWorkspace,
    slopes: ReducedSensitivities,
) -> None:  # fmt: skip
    """Of the state after a step and what is told of the step: along each unknown, along each direction, then both."""
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
            test, j - 1, j, d - parameters, candidate.stiffer, complex(share.real, slower * share.imag),
            complex(time.real, slower * time.imag), complex(weight.real, slower * weight.imag),
        )  # fmt: skip
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
    """One direction: what must be zero, into `left`; the state after, the middle's point and what is told, to ends."""
    rows, values, state, told = slopes.rows, slopes.values, slopes.state, slopes.told
    fast, slow = state[FAST], state[SLOW]
    middle = write_probes(node, state, slopes.unknown, dimple, _thicker(direction, parameters), rows, values)
    _law_along(work.said, slopes.full, work.logs, rows, direction, parameters, slopes.logs, slopes.rates)
    now = step_exponents(node, fast, slow, values, dimple.redistribution, middle, slopes.logs)
    step_residual(node, state, slopes.unknown, values[LOG_GROWTH], now, slopes.logs[0], slopes.rates, slopes.left)
    advance_state(state, slopes.unknown, middle, now, work.gains)
    write_step_outputs(rows[0, STRAIN], now, slopes.logs[0], told)
    told[0], told[1] = now.place, slopes.logs[0]  # columns of nodes are free here
    point, first = state.size, state.size + rows.shape[1]
    for i in range(point):
        ends[i] = state[i].imag / COMPLEX_STEP
    for i in range(rows.shape[1]):
        ends[point + i] = rows[0, i].imag / COMPLEX_STEP
    for c in range(told.size):
        ends[first + c] = told[c].imag / COMPLEX_STEP


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
    said: Floats, full: Floats, known: Floats, rows: Any, direction: int, parameters: int, logs: Any, rates: Any
) -> None:
    """ln of rates and the rates of states along a direction, in which the rows have imaginary parts.

    said, full : of `update` and `sensitivity`; known : (PROBES,) ln of rates.
    """
    width, outputs = rows.shape[1], 1 + rates.size
    own = 0 <= direction < parameters
    for k in range(PROBES):
        total = 0.0
        for i in range(width):
            total += said[k, outputs + i] * rows[k, i].imag
        if own and full[k, 0] > 0.0:
            total += COMPLEX_STEP * full[k, outputs * (1 + width) + direction] / full[k, 0]
        logs[k] = complex(known[k], total)
    for v in range(rates.size):
        total = 0.0
        for i in range(width):
            total += said[0, outputs + (1 + v) * width + i] * rows[0, i].imag
        if own:
            total += COMPLEX_STEP * full[0, outputs * (1 + width) + (1 + v) * parameters + direction]
        rates[v] = complex(said[0, 1 + v], total)


@njit(cache=True, error_model="numpy")
def _thicker(direction: int, parameters: int) -> complex:
    return COMPLEX_STEP * 1j if direction == parameters else 0j


_LARGEST = 5.0
"""Decades; features are bent towards it smoothly."""


_LOG_10 = float(np.log(10.0))


@njit(cache=True, error_model="numpy")
def rate_features(
    rate: Any, theta: Floats, point: Floats, log_rate: float, stress_factors: Floats, strain_factors: Floats,
    rows: Floats, said: Floats, out: Floats,
) -> None:  # fmt: skip
    """log10 of the rate at (strain factors) x (stress factors) of a point over the rate there; log_rate : ln of that.

    rows (features, 6 + S), said : room for the law.
    """
    _around(point, stress_factors, strain_factors, rows)
    rate(rows.shape[0], data_pointer(rows), data_pointer(theta), data_pointer(said))
    columns = point.size - 5  # the rate, then each state's
    for k in range(rows.shape[0]):
        out[k] = (np.log(max(said[k * columns], 1e-300)) - log_rate) / _LOG_10
    for k in range(rows.shape[0]):
        out[k] /= _bent(out[k])


@njit(cache=True, error_model="numpy")
def _bent(value: float) -> float:
    """(1 + (value / largest)^4)^(1/4)."""
    square = (value / _LARGEST) * (value / _LARGEST)
    return float(np.sqrt(np.sqrt(1.0 + square * square)))


@njit(cache=True, error_model="numpy")
def _around(point: Floats, stress_factors: Floats, strain_factors: Floats, rows: Floats) -> None:
    """Write the point (6 + S,) for all factors, (features, 6 + S)."""
    k = 0
    for c in strain_factors:
        for s in stress_factors:
            for i in range(point.size):
                rows[k, i] = point[i]
            for i in (STRESS, PRINCIPAL_STRESS, MEAN_STRESS):
                rows[k, i] *= s
            rows[k, STRAIN] *= c
            k += 1


@njit(cache=True, error_model="numpy")
def rate_feature_derivatives(
    sensitivity: Any, theta: Floats, point: Floats, log_rate: float, changes: Floats, log_rate_changes: Floats,
    stress_factors: Floats, strain_factors: Floats, rows: Floats, said: Floats, out: Floats,
) -> None:  # fmt: skip
    """Derivatives of the features, (features, directions), the parameters first.

    changes : (directions, 6 + S) of the point; log_rate_changes : (directions,) of ln of the rate there.
    """
    _around(point, stress_factors, strain_factors, rows)
    sensitivity(rows.shape[0], data_pointer(rows), data_pointer(theta), data_pointer(said))
    width, parameters = point.size, theta.size
    outputs = width - 5
    columns = outputs * (1 + width + parameters)
    for k in range(rows.shape[0]):
        first = k * columns
        rate = max(said[first], 1e-300)
        value = (np.log(rate) - log_rate) / _LOG_10
        bend = _bent(value)
        scale = 1.0 / (bend * bend * bend * bend * bend * _LOG_10)
        s, c = stress_factors[k % stress_factors.size], strain_factors[k // stress_factors.size]
        for i in range(width):
            said[first + outputs + i] *= (
                s if i in (STRESS, PRINCIPAL_STRESS, MEAN_STRESS) else (c if i == STRAIN else 1.0)
            )
        for p in range(changes.shape[0]):
            total = said[first + outputs * (1 + width) + p] if p < parameters else 0.0
            for i in range(width):
                total += said[first + outputs + i] * changes[p, i]
            out[k, p] = scale * (total / rate - log_rate_changes[p])


__all__ = [
    "NUISANCE_DIRECTIONS",
    "FeatureFactors",
    "ReducedCandidate",
    "ReducedSensitivities",
    "ReducedWorkspace",
    "integrate_candidate",
    "reduced_workspace",
    "sensitivity_workspace",
]


REACHED_END, BURST, NOT_CONVERGED = range(3)
"""Ends; values of records.Status."""


_FIRST_RATE = 1e-9
"""1/s, the first guess."""


@njit(cache=True, error_model="numpy")
def integrate_candidate(
    update: Any, sensitivity: Any, rate: Any, test: Floats, count: int, candidate: ReducedCandidate, dimple: DimpleCurves,
    factors: FeatureFactors, tolerance: float, work: ReducedWorkspace, slopes: ReducedSensitivities, out: Floats, changes: Floats,
) -> tuple[int, float]:  # fmt: skip
    """March to the last of `count` nodes, or to where the dimple bursts; how that ended and when, s.

    test : (8, nodes). out : (nodes, columns and features). changes : (nodes, columns and features, P + 3), or no nodes
    where derivatives are not wanted.
    """
    theta, initial = candidate.theta, candidate.initial
    state, unknown = virgin_state(test, initial), np.zeros(2 + initial.size)
    before = state.copy()
    exact, log_rate, gap, toughness = changes.shape[0] > 0, np.log(_FIRST_RATE), 3.0, 0.5
    slopes.tangents[:] = 0.0
    for j in range(1, count):
        before[:] = state
        instant = test[TIMES, j] <= test[TIMES, j - 1]
        if instant:
            state[FAST] += test[PRESSURE, j] - test[PRESSURE, j - 1]
            state[SLOW] += test[PRESSURE, j] - test[PRESSURE, j - 1]
            out[j, FIRST_STEP_COLUMN:] = out[j - 1, FIRST_STEP_COLUMN:]
        else:
            node = real_node(test, j, candidate.beta)
            unknown[0], unknown[1] = log_rate + node.log_weight, log_rate + node.log_weight + gap
            unknown[2:] = state[STATES:]
            middle, now = solve_step(update, theta, node, state, unknown, dimple, tolerance, work)
            log_rate, gap, toughness = work.logs[0], unknown[1] - unknown[0], now.place
            if not np.isfinite(log_rate + unknown.sum()):
                _stay(out, changes, j, count)
                return NOT_CONVERGED, test[TIMES, j - 1]
            advance_state(state, unknown, middle, now, work.gains)
            write_step_outputs(work.rows[0, STRAIN], now, log_rate, out[j])
            rate_features(rate, theta, work.rows[0], log_rate, factors.stress, factors.strain, work.wide,
                     work.wide_said, out[j, len(TRAJECTORY_COLUMNS):])  # fmt: skip
        write_node_outputs(end_of(test, j), state, toughness, dimple, 0.0, test[TIMES, j], work.values, out[j])
        if j == 1:
            write_node_outputs(
                end_of(test, 0),
                virgin_state(test, initial),
                toughness,
                dimple,
                0.0,
                test[TIMES, 0],
                work.values,
                out[0],
            )
            out[0, FIRST_STEP_COLUMN:] = out[1, FIRST_STEP_COLUMN:]
        if exact:
            if not instant:
                evaluate_law(update, sensitivity, theta, work, slopes.full)
            differentiate_step(test, j, candidate, dimple, before, state, unknown, toughness, work, slopes, changes)
            if not instant:
                rate_feature_derivatives(
                    sensitivity, theta, work.rows[0], log_rate, slopes.along, slopes.bent, factors.stress,
                    factors.strain, work.wide, slopes.wide_full, changes[j, len(TRAJECTORY_COLUMNS):],
                )  # fmt: skip
            if j == 1:
                changes[0, FIRST_STEP_COLUMN:] = changes[1, FIRST_STEP_COLUMN:]
        share = burst_fraction(test, j, candidate, before, state)
        if share >= 0.0:
            out[j, AMPLITUDE_COLUMN] = min(out[j, AMPLITUDE_COLUMN], candidate.deflection_limit)
            _stay(out, changes, j + 1, count)
            return BURST, test[TIMES, j - 1] + share * (test[TIMES, j] - test[TIMES, j - 1])
    return REACHED_END, test[TIMES, count - 1]


@njit(cache=True, error_model="numpy")
def burst_fraction(test: Floats, j: int, candidate: ReducedCandidate, before: Floats, state: Floats) -> float:
    """The share of the step to node j after which the dimple has burst; -1 if it has not."""
    reached = test[ELASTIC, j] + state[CREEP_DEFLECTION]
    if reached > candidate.deflection_limit:
        last = test[ELASTIC, j - 1] + before[CREEP_DEFLECTION]
        return float(min(max((candidate.deflection_limit - last) / (reached - last), 0.0), 1.0))
    broken = state[STRAIN_STATE] > candidate.strain_limit
    for v in range(candidate.limits.size):
        broken = broken or state[STATES + v] >= candidate.limits[v]
    return 1.0 if broken else -1.0


@njit(cache=True, error_model="numpy")
def _stay(out: Floats, changes: Floats, first: int, count: int) -> None:
    """Nodes from `first` on are as the one before."""
    for j in range(first, count):
        out[j] = out[j - 1]
        if changes.shape[0]:
            changes[j] = changes[j - 1]


@njit(cache=True, error_model="numpy", nogil=True)
def integrate_candidates(
    update: Any, sensitivity: Any, rate: Any, first: int, last: int, theta: Floats, beta: Floats, beta_slopes: Floats,
    stiffer: Floats, counts: Ints, tests: Floats, curves: Floats, slopes: Floats, redistribution: Floats,
    row: Ints, grid: tuple[float, float], initial: Floats, limits: Floats, ends: tuple[float, float], factors: FeatureFactors,
    tolerance: float, out: Floats, changes: Floats, status: Ints, end_times: Floats,
) -> None:  # fmt: skip
    """March the candidates from `first` to before `last` through all tests; arrays as in `reduced_courses`.

    tests : (candidates or 1, tests, 8, nodes) as in `reduced_problem`.
    """
    exact = changes.shape[0] > 0
    directions = theta.shape[1] + len(NUISANCE_DIRECTIONS) if exact else 0
    count = factors.stress.size * factors.strain.size
    work = reduced_workspace(initial.size, count)
    slopes_work = sensitivity_workspace(initial.size, theta.shape[1], count, directions, len(TRAJECTORY_COLUMNS))
    nothing = np.zeros((0, out.shape[3], directions))
    for c in range(first, last):
        e = c if tests.shape[0] > 1 else 0
        for k in range(counts.size):
            candidate = ReducedCandidate(
                theta[c], beta[c], beta_slopes[c], stiffer[e, k], initial, limits, ends[0], ends[1]
            )
            r = row[e, k]
            dimple = DimpleCurves(curves[r], slopes[r], redistribution[r], grid[0], grid[1])
            status[c, k], end_times[c, k] = integrate_candidate(
                update, sensitivity, rate, tests[e, k], counts[k], candidate, dimple, factors, tolerance, work,
                slopes_work, out[c, k], changes[c, k] if exact else nothing,
            )  # fmt: skip
