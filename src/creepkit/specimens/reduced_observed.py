"""Columns of a course: what is told of the one-degree-of-freedom bulge at each node."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from creepkit.specimens.reduced_curves import (
    CURVES,
    ELASTIC_SHAPE,
    ELASTIC_WIDTH,
    LOG_STRESS,
    SHAPE,
    WIDTH,
    Dimple,
    over_exponents,
    place,
    write_curves,
)
from creepkit.specimens.reduced_dual import exp
from creepkit.specimens.reduced_step import CREEP, FAST, PLACE, SLOW, STRAINED, Node, Pace

COLUMNS = (
    "elastic", "creep", "amplitude", "width", "shape", "strain", "stress", "age", "fast", "slow", "pressure", "modulus",
    "temperature", "time", "middle", "log_rate", "log_multiplier", "exponent", "hardening",
)  # fmt: skip
"""See `reduced_courses`."""
AMPLITUDE_COLUMN = COLUMNS.index("amplitude")
OF_STEP = COLUMNS.index("middle")
"""The first of those that are told of the step before a node."""
LOG_RATE = COLUMNS.index("log_rate")

_REST = 1e-9
"""mm; far below what can be measured."""
_DECADES = float(1.0 / np.log(10.0))
_FLOOR = 1e-6
"""MPa, as in the step."""


@njit(cache=True, error_model="numpy")
def observe(
    node: Node, state: Any, toughness: Any, dimple: Dimple, thicker: Any, time: float, values: Any, out: Any
) -> None:
    """Write what is told of the end of a step; toughness : n'/(n' + 2) there, for a dimple that has not crept.

    values : room for the curves, (CURVES,).
    """
    deflection = node.elastic + state[CREEP]
    at = place(deflection, dimple)
    write_curves(LOG_STRESS, LOG_STRESS + 1, at, dimple, thicker, values)
    write_curves(WIDTH, CURVES, at, dimple, thicker, values)
    end = node.pressure + _FLOOR
    stress = exp(values[LOG_STRESS]) * end
    mean = (state[PLACE] + _REST * toughness) / (state[CREEP] + _REST)
    part = (node.elastic + _REST) / (deflection + _REST)
    width, shape = over_exponents(WIDTH, mean, values), over_exponents(SHAPE, mean, values)
    out[0], out[1], out[2] = node.elastic, state[CREEP], deflection
    out[3] = width + part * (values[ELASTIC_WIDTH] - width)
    out[4] = shape + part * (values[ELASTIC_SHAPE] - shape)
    out[5], out[6] = state[STRAINED], stress
    out[7] = node.modulus * state[STRAINED] / stress
    out[8], out[9] = state[FAST] * (1.0 / end), state[SLOW] * (1.0 / end)
    out[10], out[11], out[12], out[13] = node.pressure, node.modulus, node.temperature, time


@njit(cache=True, error_model="numpy")
def observe_step(strain: Any, now: Pace, log_rate: Any, out: Any) -> None:
    """Write what is told of the step itself: strain and ln of the rate in its middle, local exponents."""
    out[14], out[15], out[16] = strain, log_rate * _DECADES, now.log_multiplier
    out[17], out[18] = now.exponent, now.hardening
