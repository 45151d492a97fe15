"""What the one-degree-of-freedom march is given: a test, a candidate, room to work; and the nodes of its steps."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from creepkit.arrays import Floats
from creepkit.kernels.interface import POINT_SIZE
from creepkit.specimens.reduced_curves import CURVES
from creepkit.specimens.reduced_dual import exp, log
from creepkit.specimens.reduced_step import FAST, PROBES, SLOW, STATES, StepData

NUISANCE_DIRECTIONS = ("thickness", "modulus", "temperature")
"""Directions of derivatives after the law's parameters: mm, relative, K."""
COMPLEX_STEP = 2.0**-100
"""Scale of imaginary parts; to divide by a power of two is to multiply."""


TIMES, PRESSURE, TEMPERATURES, MODULUS, SOFTENING, ELASTIC, ELASTIC_THICKNESS, ELASTIC_MODULUS = range(8)
"""Rows of a test, (8, nodes): time s, pressure MPa, temperature K, modulus MPa and its slope to temperature, elastic
deflection mm with its derivatives to thickness and to ln of the modulus. One array, for each costs at every call.
"""


class ReducedCandidate(NamedTuple):
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


class FeatureFactors(NamedTuple):
    """Factors on stress (.,) and on strain (.,) of the features."""

    stress: Floats
    strain: Floats


class ReducedWorkspace(NamedTuple):
    """Working arrays: for the law at the probes and at the features, for curves and Newton's method.

    rows (PROBES, 6 + S), said (PROBES, .) of `update`; wide, wide_said at features; values (CURVES,).
    """

    rows: Floats
    said: Floats
    wide: Floats
    wide_said: Floats
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
    told: Any
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
        np.zeros((PROBES, width)), np.zeros((PROBES, size * (1 + width))), np.zeros((count, width)),
        np.zeros(count * size), np.zeros(CURVES), np.zeros(PROBES), np.zeros(states), np.ones(states),
        np.zeros((2 + states, 1)), np.zeros((2 + states, 2 + states)),
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def sensitivity_workspace(states: int, parameters: int, count: int, directions: int, columns: int) -> ReducedSensitivities:
    """Allocate for `count` features and some directions of derivatives (none: 0) of as many columns of a course."""
    width, size, some = POINT_SIZE + states, 2 + states, 1 if directions > 0 else 0
    said = (1 + states) * (1 + width + parameters)
    kind = np.complex128
    return ReducedSensitivities(
        np.zeros((PROBES, width), kind), np.zeros(CURVES, kind), np.zeros(PROBES, kind), np.zeros(states, kind),
        np.zeros(size, kind), np.zeros(STATES + states, kind), np.zeros(size, kind), np.zeros(columns, kind),
        np.zeros((PROBES, said)), np.zeros(some * count * said), np.zeros((size, size)), np.zeros((size, directions)),
        np.zeros((size + directions, STATES + states + width + columns)), np.zeros((directions, STATES + states)),
        np.zeros((directions, width)), np.zeros(directions), np.zeros(directions),
    )  # fmt: skip


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
        test[PRESSURE, i], test[PRESSURE, j], test[TEMPERATURES, i], test[TEMPERATURES, j], test[MODULUS, i],
        test[MODULUS, j], test[ELASTIC, i], test[ELASTIC, j], share, time, weight,
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def end_of(test: Floats, j: int) -> StepData:
    """Node j by itself."""
    P, T, E, D = test[PRESSURE, j], test[TEMPERATURES, j], test[MODULUS, j], test[ELASTIC, j]
    return StepData(P, P, T, T, E, E, D, D, 0.5, test[TIMES, j], 0.0)


@njit(cache=True, error_model="numpy")
def complex_node(test: Floats, i: int, j: int, effect: int, stiffer: float, share: Any, time: Any, weight: Any) -> StepData:
    """What lies between nodes i and j along one of the EFFECTS (none: less than 0).

    stiffer : relative change of the modulus; share, time, weight : of the clock, with derivatives.
    """
    warm = COMPLEX_STEP * 1j if effect == 2 else 0j
    first, last = _change(test, i, effect, stiffer), _change(test, j, effect, stiffer)
    return StepData(
        test[PRESSURE, i], test[PRESSURE, j], test[TEMPERATURES, i] + warm, test[TEMPERATURES, j] + warm,
        test[MODULUS, i] + COMPLEX_STEP * 1j * first, test[MODULUS, j] + COMPLEX_STEP * 1j * last,
        test[ELASTIC, i] + COMPLEX_STEP * 1j * _lifted(test, i, effect, first),
        test[ELASTIC, j] + COMPLEX_STEP * 1j * _lifted(test, j, effect, last), share, time, weight,
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def _change(test: Floats, j: int, effect: int, stiffer: float) -> float:
    """Derivative of the modulus to an effect."""
    if effect == 1:
        return test[MODULUS, j] / (1.0 + stiffer)  # type: ignore[no-any-return]
    return test[SOFTENING, j] if effect == 2 else 0.0


@njit(cache=True, error_model="numpy")
def _lifted(test: Floats, j: int, effect: int, change: float) -> float:
    """Derivative of the elastic deflection to an effect that changes the modulus so."""
    if effect == 0:
        return test[ELASTIC_THICKNESS, j]  # type: ignore[no-any-return]
    return test[ELASTIC_MODULUS, j] * change / test[MODULUS, j]  # type: ignore[no-any-return]
