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
from creepkit.specimens.reduced_problem import EFFECTS, Candidate, Factors, Room, Test, end_of, real_node, room, virgin
from creepkit.specimens.reduced_step import CREEP, FAST, SLOW, STATES, STRAINED, advance
from creepkit.specimens.reduced_tangents import consult, differentiate

__all__ = ["EFFECTS", "Candidate", "Factors", "Room", "Test", "march", "room"]

COMPLETE, BURST, LOST = range(3)
"""Ends; values of records.Status."""

_FIRST_RATE = 1e-9
"""1/s, the first guess."""


@njit(cache=True, error_model="numpy")
def march(
    update: Any, sensitivity: Any, rate: Any, test: Test, count: int, candidate: Candidate, dimple: Dimple,
    factors: Factors, tolerance: float, work: Room, out: Floats, changes: Floats,
) -> tuple[int, float]:  # fmt: skip
    """March to the last of `count` nodes, or to where the dimple bursts; how that ended and when, s.

    out : (nodes, columns and features). changes : (nodes, columns and features, P + 3), or no nodes where derivatives
    are not wanted.
    """
    state, unknown = virgin(test, candidate), np.zeros(2 + candidate.initial.size)
    exact, log_rate, gap, toughness = changes.shape[0] > 0, np.log(_FIRST_RATE), 3.0, 0.5
    work.tangents[:] = 0.0
    for j in range(1, count):
        before = state.copy()
        instant = test.times[j] <= test.times[j - 1]
        if instant:
            state[FAST] += test.pressure[j] - test.pressure[j - 1]
            state[SLOW] += test.pressure[j] - test.pressure[j - 1]
            out[j, OF_STEP:] = out[j - 1, OF_STEP:]
        else:
            node = real_node(test, j, candidate.beta)
            unknown[0], unknown[1] = log_rate + node.log_weight, log_rate + node.log_weight + gap
            unknown[2:] = state[STATES:]
            now = solve(update, candidate.theta, node, state, unknown, dimple, tolerance, work)
            log_rate, gap, toughness = work.logs[0], unknown[1] - unknown[0], now.place
            if not np.isfinite(log_rate + unknown.sum()):
                _stay(out, changes, j, count)
                return LOST, test.times[j - 1]
            advance(state, unknown, now, work.gains)
            observe_step(work.rows[0, STRAIN], now, log_rate, out[j])
            features(rate, candidate.theta, work.rows[0], log_rate, factors.stress, factors.strain, work.wide,
                     work.wide_said, out[j, len(COLUMNS):])  # fmt: skip
        observe(end_of(test, j), state, toughness, dimple, 0.0, test.times[j], out[j])
        if j == 1:
            observe(end_of(test, 0), virgin(test, candidate), toughness, dimple, 0.0, test.times[0], out[0])
            out[0, OF_STEP:] = out[1, OF_STEP:]
        if exact:
            if not instant:
                consult(update, sensitivity, candidate.theta, work)
            differentiate(test, j, instant, candidate, dimple, before, unknown, toughness, work, out, changes)
            if not instant:
                feature_changes(
                    sensitivity, candidate.theta, work.rows[0], log_rate, work.along, work.bent, factors.stress,
                    factors.strain, work.wide, work.wide_full, changes[j, len(COLUMNS):],
                )  # fmt: skip
            if j == 1:
                changes[0, OF_STEP:] = changes[1, OF_STEP:]
        share = burst_share(test, j, candidate, before, state)
        if share >= 0.0:
            out[j, AMPLITUDE_COLUMN] = min(out[j, AMPLITUDE_COLUMN], candidate.deflection_limit)
            _stay(out, changes, j + 1, count)
            return BURST, test.times[j - 1] + share * (test.times[j] - test.times[j - 1])
    return COMPLETE, test.times[count - 1]


@njit(cache=True, error_model="numpy")
def burst_share(test: Test, j: int, candidate: Candidate, before: Floats, state: Floats) -> float:
    """The share of the step to node j after which the dimple has burst; -1 if it has not."""
    reached = test.elastic[j] + state[CREEP]
    if reached > candidate.deflection_limit:
        last = test.elastic[j - 1] + before[CREEP]
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
