"""What the one-degree-of-freedom march is given: a test, a candidate, room to work; and the nodes of its steps."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from creepkit.arrays import Floats
from creepkit.kernels.interface import POINT_SIZE
from creepkit.specimens.reduced_step import FAST, PROBES, SLOW, STATES, Node

EFFECTS = ("thickness", "modulus", "temperature")
"""Directions of derivatives after the law's parameters: mm, relative, K."""
TINY = 1e-30
"""Scale of imaginary parts."""


class Test(NamedTuple):
    """Of each node: time s, pressure MPa, temperature K, modulus MPa and its slope to temperature, elastic deflection
    mm with its derivatives to thickness and to ln of the modulus, (nodes,) each.
    """

    times: Floats
    pressure: Floats
    temperature: Floats
    modulus: Floats
    softening: Floats
    elastic: Floats
    elastic_thickness: Floats
    elastic_modulus: Floats


class Candidate(NamedTuple):
    """Internal parameters (P,), exponent of the clock with its derivatives (P,), relative change of the modulus; the
    law's initial states and limits (S,); limits of deflection mm and strain.
    """

    theta: Floats
    beta: float
    beta_slopes: Floats
    stiffer: float
    initial: Floats
    limits: Floats
    deflection_limit: float
    strain_limit: float


class Factors(NamedTuple):
    """Factors on stress (.,) and on strain (.,) of the features."""

    stress: Floats
    strain: Floats


class Room(NamedTuple):
    """Working arrays: for the law at the probes and at the features, and of the derivatives.

    rows (PROBES, 6 + S), said (PROBES, .) of `update`, full of `sensitivity`; wide, wide_said, wide_full at features.
    tangents : (directions, state). along : (directions, 6 + S) of the point in the middle.
    """

    rows: Floats
    said: Floats
    full: Floats
    wide: Floats
    wide_said: Floats
    wide_full: Floats
    tangents: Floats
    along: Floats
    bent: Floats
    logs: Floats
    rates: Floats
    gains: Floats
    right: Floats
    matrix: Floats


@njit(cache=True, error_model="numpy")
def room(states: int, parameters: int, count: int, directions: int) -> Room:
    """Allocate for `count` features and some directions of derivatives (none: 0)."""
    width, size = POINT_SIZE + states, 1 + states
    some = 1 if directions > 0 else 0
    return Room(
        np.zeros((PROBES, width)), np.zeros((PROBES, size * (1 + width))),
        np.zeros((some * PROBES, size * (1 + width + parameters))), np.zeros((count, width)),
        np.zeros(count * size), np.zeros(some * count * size * (1 + width + parameters)),
        np.zeros((directions, STATES + states)), np.zeros((directions, width)), np.zeros(directions),
        np.zeros(PROBES), np.zeros(states), np.ones(states),
        np.zeros((2 + states, 1)), np.zeros((2 + states, 2 + states)),
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def virgin(test: Test, candidate: Candidate) -> Floats:
    """The state at node 0; a load that is there already is all elastic."""
    state = np.zeros(STATES + candidate.initial.size)
    state[FAST] = state[SLOW] = test.pressure[0]
    state[STATES:] = candidate.initial
    return state


@njit(cache=True, error_model="numpy")
def clock(before: float, after: float, beta: Any) -> Any:
    """Of the middle in t^beta: the share of time before it, its time s, and ln of dt/ds times the step."""
    low = np.exp(beta * np.log(before)) if before > 0.0 else 0.0 * beta
    high = np.exp(beta * np.log(after))
    middle = np.exp(np.log(0.5 * (low + high)) / beta)
    weight = np.log((high - low) / beta) + (1.0 - beta) * np.log(middle)
    return (middle - before) / (after - before), middle, weight


@njit(cache=True, error_model="numpy")
def real_node(test: Test, j: int, beta: float) -> Node:
    """The step that ends at node j."""
    share, time, weight = clock(test.times[j - 1], test.times[j], beta)
    return Node(
        test.pressure[j - 1], test.pressure[j], test.temperature[j - 1], test.temperature[j], test.modulus[j - 1],
        test.modulus[j], test.elastic[j - 1], test.elastic[j], share, time, weight,
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def end_of(test: Test, j: int) -> Node:
    """Node j by itself."""
    return Node(
        test.pressure[j], test.pressure[j], test.temperature[j], test.temperature[j], test.modulus[j], test.modulus[j],
        test.elastic[j], test.elastic[j], 0.5, test.times[j], 0.0,
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def complex_node(test: Test, j: int, candidate: Candidate, direction: int) -> Node:
    """The same along one direction."""
    effect = direction - candidate.theta.size
    step = TINY * 1j
    beta = candidate.beta + (step * candidate.beta_slopes[direction] if effect < 0 else 0j)
    warm = step if effect == 2 else 0j
    i = j - 1
    share, time, weight = (0.5 + 0j, 0j, 0j)
    if test.times[j] > test.times[i]:
        share, time, weight = clock(test.times[i], test.times[j], beta)
    return Node(
        test.pressure[i] + 0j, test.pressure[j] + 0j, test.temperature[i] + warm, test.temperature[j] + warm,
        _stiffness(test, i, candidate, effect), _stiffness(test, j, candidate, effect),
        _elastic(test, i, candidate, effect), _elastic(test, j, candidate, effect), share, time, weight,
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def _stiffness(test: Test, j: int, candidate: Candidate, effect: int) -> complex:
    """Modulus along an effect."""
    change = 0.0
    if effect == 1:
        change = test.modulus[j] / (1.0 + candidate.stiffer)
    elif effect == 2:
        change = test.softening[j]
    return test.modulus[j] + TINY * 1j * change  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def _elastic(test: Test, j: int, candidate: Candidate, effect: int) -> complex:
    """Elastic deflection along an effect."""
    change = 0.0
    if effect == 0:
        change = test.elastic_thickness[j]
    elif effect > 0:
        change = test.elastic_modulus[j] * _stiffness(test, j, candidate, effect).imag / (TINY * test.modulus[j])
    return test.elastic[j] + TINY * 1j * change  # type: ignore[no-any-return]
