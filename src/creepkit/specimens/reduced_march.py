"""The one-degree-of-freedom bulge in time: one candidate in one test, node by node, with derivatives where wanted."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from creepkit.arrays import Floats
from creepkit.kernels.interface import STRAIN
from creepkit.specimens.reduced_curves import Dimple
from creepkit.specimens.reduced_features import feature_changes, features
from creepkit.specimens.reduced_newton import solve
from creepkit.specimens.reduced_observed import AMPLITUDE_COLUMN, COLUMNS, OF_STEP, observe, observe_step
from creepkit.specimens.reduced_problem import (
    EFFECTS,
    ELASTIC,
    PRESSURE,
    TIMES,
    Candidate,
    Factors,
    Room,
    Slopes,
    end_of,
    real_node,
    room,
    slopes_room,
    virgin,
)
from creepkit.specimens.reduced_step import CREEP, FAST, SLOW, STATES, STRAINED, advance
from creepkit.specimens.reduced_tangents import consult, differentiate

__all__ = ["EFFECTS", "Candidate", "Factors", "Room", "Slopes", "march", "room", "slopes_room"]

COMPLETE, BURST, LOST = range(3)
"""Ends; values of records.Status."""

_FIRST_RATE = 1e-9
"""1/s, the first guess."""


@njit(cache=True, error_model="numpy")
def march(
    update: Any, sensitivity: Any, rate: Any, test: Floats, count: int, candidate: Candidate, dimple: Dimple,
    factors: Factors, tolerance: float, work: Room, slopes: Slopes, out: Floats, changes: Floats,
) -> tuple[int, float]:  # fmt: skip
    """March to the last of `count` nodes, or to where the dimple bursts; how that ended and when, s.

    test : (8, nodes). out : (nodes, columns and features). changes : (nodes, columns and features, P + 3), or no nodes
    where derivatives are not wanted.
    """
    theta, initial = candidate.theta, candidate.initial
    state, unknown = virgin(test, initial), np.zeros(2 + initial.size)
    before = state.copy()
    exact, log_rate, gap, toughness = changes.shape[0] > 0, np.log(_FIRST_RATE), 3.0, 0.5
    slopes.tangents[:] = 0.0
    for j in range(1, count):
        before[:] = state
        instant = test[TIMES, j] <= test[TIMES, j - 1]
        if instant:
            state[FAST] += test[PRESSURE, j] - test[PRESSURE, j - 1]
            state[SLOW] += test[PRESSURE, j] - test[PRESSURE, j - 1]
            out[j, OF_STEP:] = out[j - 1, OF_STEP:]
        else:
            node = real_node(test, j, candidate.beta)
            unknown[0], unknown[1] = log_rate + node.log_weight, log_rate + node.log_weight + gap
            unknown[2:] = state[STATES:]
            middle, now = solve(update, theta, node, state, unknown, dimple, tolerance, work)
            log_rate, gap, toughness = work.logs[0], unknown[1] - unknown[0], now.place
            if not np.isfinite(log_rate + unknown.sum()):
                _stay(out, changes, j, count)
                return LOST, test[TIMES, j - 1]
            advance(state, unknown, middle, now, work.gains)
            observe_step(work.rows[0, STRAIN], now, log_rate, out[j])
            features(rate, theta, work.rows[0], log_rate, factors.stress, factors.strain, work.wide,
                     work.wide_said, out[j, len(COLUMNS):])  # fmt: skip
        observe(end_of(test, j), state, toughness, dimple, 0.0, test[TIMES, j], work.values, out[j])
        if j == 1:
            observe(end_of(test, 0), virgin(test, initial), toughness, dimple, 0.0, test[TIMES, 0], work.values, out[0])
            out[0, OF_STEP:] = out[1, OF_STEP:]
        if exact:
            if not instant:
                consult(update, sensitivity, theta, work, slopes.full)
            differentiate(test, j, candidate, dimple, before, state, unknown, toughness, work, slopes, changes)
            if not instant:
                feature_changes(
                    sensitivity, theta, work.rows[0], log_rate, slopes.along, slopes.bent, factors.stress,
                    factors.strain, work.wide, slopes.wide_full, changes[j, len(COLUMNS):],
                )  # fmt: skip
            if j == 1:
                changes[0, OF_STEP:] = changes[1, OF_STEP:]
        share = burst_share(test, j, candidate, before, state)
        if share >= 0.0:
            out[j, AMPLITUDE_COLUMN] = min(out[j, AMPLITUDE_COLUMN], candidate.deflection_limit)
            _stay(out, changes, j + 1, count)
            return BURST, test[TIMES, j - 1] + share * (test[TIMES, j] - test[TIMES, j - 1])
    return COMPLETE, test[TIMES, count - 1]


@njit(cache=True, error_model="numpy")
def burst_share(test: Floats, j: int, candidate: Candidate, before: Floats, state: Floats) -> float:
    """The share of the step to node j after which the dimple has burst; -1 if it has not."""
    reached = test[ELASTIC, j] + state[CREEP]
    if reached > candidate.deflection_limit:
        last = test[ELASTIC, j - 1] + before[CREEP]
        return float(min(max((candidate.deflection_limit - last) / (reached - last), 0.0), 1.0))
    broken = state[STRAINED] > candidate.strain_limit
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
