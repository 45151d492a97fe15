"""Time integration of the reduced-order model for many candidates and tests, with complex-step sensitivities."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from creepkit.arrays import Floats, Ints
from creepkit.kernels.interface import STRAIN
from creepkit.specimens.bulge.reduced_order.deflection_curves import DimpleCurves
from creepkit.specimens.bulge.reduced_order.rate_features import rate_feature_derivatives, rate_features
from creepkit.specimens.bulge.reduced_order.step_equations import (
    AMPLITUDE_COLUMN,
    CREEP_DEFLECTION,
    FAST,
    FIRST_STEP_COLUMN,
    SLOW,
    STATES,
    STRAIN_STATE,
    TRAJECTORY_COLUMNS,
    advance_state,
    write_node_outputs,
    write_step_outputs,
)
from creepkit.specimens.bulge.reduced_order.step_sensitivities import differentiate_step
from creepkit.specimens.bulge.reduced_order.step_solution import (
    ELASTIC,
    NUISANCE_DIRECTIONS,
    PRESSURE,
    TIMES,
    FeatureFactors,
    ReducedCandidate,
    ReducedSensitivities,
    ReducedWorkspace,
    end_of,
    evaluate_probes,
    real_node,
    reduced_workspace,
    sensitivity_workspace,
    solve_step,
    virgin_state,
)


@njit(cache=True, error_model="numpy")
def evaluate_law(update: Any, sensitivity: Any, theta: Floats, work: ReducedWorkspace, full: Floats) -> None:
    """What the law says at the solution."""
    evaluate_probes(update, theta, work.rows, work.law_values)
    evaluate_probes(sensitivity, theta, work.rows, full)


REACHED_END, RUPTURED, NOT_CONVERGED = range(3)
"""Ends; values of records.Status."""


_FIRST_RATE = 1e-9
"""1/s, the first guess."""


@njit(cache=True, error_model="numpy")
def integrate_candidate(
    update: Any,
    sensitivity: Any,
    rate: Any,
    test: Floats,
    count: int,
    candidate: ReducedCandidate,
    dimple: DimpleCurves,
    factors: FeatureFactors,
    tolerance: float,
    work: ReducedWorkspace,
    slopes: ReducedSensitivities,
    out: Floats,
    changes: Floats,
) -> tuple[int, float]:
    """Integrate to the last of `count` nodes, or to where the dimple ruptures; how that ended and when, s.

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
            rate_features(
                rate,
                theta,
                work.rows[0],
                log_rate,
                factors.stress,
                factors.strain,
                work.wide,
                work.feature_values,
                out[j, len(TRAJECTORY_COLUMNS) :],
            )
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
                    sensitivity,
                    theta,
                    work.rows[0],
                    log_rate,
                    slopes.along,
                    slopes.bent,
                    factors.stress,
                    factors.strain,
                    work.wide,
                    slopes.wide_full,
                    changes[j, len(TRAJECTORY_COLUMNS) :],
                )
            if j == 1:
                changes[0, FIRST_STEP_COLUMN:] = changes[1, FIRST_STEP_COLUMN:]
        share = rupture_fraction(test, j, candidate, before, state)
        if share >= 0.0:
            out[j, AMPLITUDE_COLUMN] = min(out[j, AMPLITUDE_COLUMN], candidate.deflection_limit)
            _stay(out, changes, j + 1, count)
            return RUPTURED, test[TIMES, j - 1] + share * (test[TIMES, j] - test[TIMES, j - 1])
    return REACHED_END, test[TIMES, count - 1]


@njit(cache=True, error_model="numpy")
def rupture_fraction(test: Floats, j: int, candidate: ReducedCandidate, before: Floats, state: Floats) -> float:
    """The share of the step to node j after which the dimple has ruptured; -1 if it has not."""
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
    update: Any,
    sensitivity: Any,
    rate: Any,
    first: int,
    last: int,
    theta: Floats,
    beta: Floats,
    beta_slopes: Floats,
    modulus_change: Floats,
    counts: Ints,
    tests: Floats,
    curves: Floats,
    slopes: Floats,
    redistribution: Floats,
    row: Ints,
    grid: tuple[float, float],
    initial: Floats,
    limits: Floats,
    ends: tuple[float, float],
    factors: FeatureFactors,
    tolerance: float,
    out: Floats,
    changes: Floats,
    status: Ints,
    end_times: Floats,
) -> None:
    """March the candidates from `first` to before `last` through all tests; arrays as in trajectories.

    tests : (candidates or 1, tests, 8, nodes) as in step_solution.
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
                theta[c], beta[c], beta_slopes[c], modulus_change[e, k], initial, limits, ends[0], ends[1]
            )
            r = row[e, k]
            dimple = DimpleCurves(curves[r], slopes[r], redistribution[r], grid[0], grid[1])
            status[c, k], end_times[c, k] = integrate_candidate(
                update,
                sensitivity,
                rate,
                tests[e, k],
                counts[k],
                candidate,
                dimple,
                factors,
                tolerance,
                work,
                slopes_work,
                out[c, k],
                changes[c, k] if exact else nothing,
            )
