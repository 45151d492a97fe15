"""Exact derivatives of the one-degree-of-freedom march.

What must be zero in a step and what is told of it are taken in complex numbers along each direction, with the law's own
derivatives put in.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from creepkit.arrays import Floats
from creepkit.integration.elimination import eliminate
from creepkit.kernels.interface import STRAIN, pointer
from creepkit.specimens.reduced_curves import Dimple
from creepkit.specimens.reduced_observed import COLUMNS, OF_STEP, observe, observe_step
from creepkit.specimens.reduced_problem import EFFECTS, TINY, Candidate, Room, Test, complex_node, virgin
from creepkit.specimens.reduced_step import FAST, PROBES, SLOW, Node, advance, ask, pace, residual


@njit(cache=True, error_model="numpy")
def consult(update: Any, sensitivity: Any, theta: Floats, work: Room) -> None:
    """What the law says at the solution."""
    update(PROBES, pointer(work.rows), pointer(theta), pointer(work.said))
    sensitivity(PROBES, pointer(work.rows), pointer(theta), pointer(work.full))


@njit(cache=True, error_model="numpy")
def _law_along(work: Room, rows: Any, direction: int, parameters: int, logs: Any, rates: Any) -> None:
    """ln of rates and the rates of states along a direction, in which the rows have imaginary parts."""
    width, outputs = rows.shape[1], 1 + rates.size
    for k in range(PROBES):
        total = 0.0
        for i in range(width):
            total += work.said[k, outputs + i] * rows[k, i].imag
        if direction < parameters and work.full[k, 0] > 0.0:
            total += TINY * work.full[k, outputs * (1 + width) + direction] / work.full[k, 0]
        logs[k] = work.logs[k] + 1j * total
    for v in range(rates.size):
        total = 0.0
        for i in range(width):
            total += work.said[0, outputs + (1 + v) * width + i] * rows[0, i].imag
        if direction < parameters:
            total += TINY * work.full[0, outputs * (1 + width) + (1 + v) * parameters + direction]
        rates[v] = work.said[0, 1 + v] + 1j * total


@njit(cache=True, error_model="numpy")
def differentiate(
    test: Test, j: int, instant: bool, candidate: Candidate, dimple: Dimple, before: Floats, unknown: Floats,
    toughness: float, work: Room, out: Floats, changes: Floats,
) -> None:  # fmt: skip
    """Derivatives of what is told of node j along all directions, and of the state there."""
    parameters, size = candidate.theta.size, unknown.size
    directions = parameters + len(EFFECTS)
    rows = np.zeros((PROBES, work.rows.shape[1]), dtype=np.complex128)
    logs, rates = np.zeros(PROBES, dtype=np.complex128), np.zeros(size - 2, dtype=np.complex128)
    left, told = np.zeros(size, dtype=np.complex128), np.zeros(len(COLUMNS), dtype=np.complex128)
    moved, state = unknown + 0j, before + 0j
    matrix, right = np.zeros((size, size)), np.zeros((size, directions))
    if not instant:
        node = complex_node(test, j, candidate, directions)
        for k in range(size):
            moved[k] += TINY * 1j
            middle = ask(node, state, moved, dimple, 0j, rows)
            _law_along(work, rows, parameters, parameters, logs, rates)
            now = pace(node, state, moved, dimple, 0j, middle, logs)
            residual(node, state, moved, middle, now, logs, rates, left)
            matrix[:, k] = left.imag / TINY
            moved[k] = unknown[k] + 0j
        for d in range(directions):
            node, thicker = complex_node(test, j, candidate, d), _thicker(d, parameters)
            state[:] = before + TINY * 1j * work.tangents[d]
            middle = ask(node, state, moved, dimple, thicker, rows)
            _law_along(work, rows, d, parameters, logs, rates)
            now = pace(node, state, moved, dimple, thicker, middle, logs)
            residual(node, state, moved, middle, now, logs, rates, left)
            right[:, d] = -left.imag / TINY
        eliminate(matrix, right)
    for d in range(directions):
        node, thicker = complex_node(test, j, candidate, d), _thicker(d, parameters)
        state[:] = before + TINY * 1j * work.tangents[d]
        told[:] = 0.0
        if instant:
            for c in range(OF_STEP, changes.shape[1]):
                changes[j, c, d] = changes[j - 1, c, d]
            state[FAST] += test.pressure[j] - test.pressure[j - 1]
            state[SLOW] += test.pressure[j] - test.pressure[j - 1]
            turned = toughness + 0j
        else:
            moved[:] = unknown + TINY * 1j * right[:, d]
            middle = ask(node, state, moved, dimple, thicker, rows)
            _law_along(work, rows, d, parameters, logs, rates)
            now = pace(node, state, moved, dimple, thicker, middle, logs)
            advance(state, moved, now, work.gains)
            observe_step(rows[0, STRAIN], now, logs[0], told)
            for c in range(OF_STEP, len(COLUMNS)):
                changes[j, c, d] = told[c].imag / TINY
            work.along[d] = rows[0].imag / TINY
            work.bent[d] = logs[0].imag / TINY
            turned = now.place
        observe(node, state, turned, dimple, thicker, test.times[j], told)
        for c in range(OF_STEP):
            changes[j, c, d] = told[c].imag / TINY
        work.tangents[d] = state.imag / TINY
        if j == 1:
            start = Node(
                node.pressure0, node.pressure0, node.temperature0, node.temperature0, node.modulus0, node.modulus0,
                node.elastic0, node.elastic0, node.share, node.time, node.log_weight,
            )  # fmt: skip
            observe(start, virgin(test, candidate) + 0j, turned, dimple, thicker, test.times[0], told)
            for c in range(OF_STEP):
                changes[0, c, d] = told[c].imag / TINY


@njit(cache=True, error_model="numpy")
def _thicker(direction: int, parameters: int) -> complex:
    return TINY * 1j if direction == parameters else 0j
