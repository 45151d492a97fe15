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
    DimpleCurves,
    interpolate_exponents,
    grid_position,
    write_curves,
)
from creepkit.specimens.reduced_dual import exp
from creepkit.specimens.reduced_step import CREEP_DEFLECTION, FAST, EXPONENT_STATE, SLOW, STRAIN_STATE, StepData, StepExponents

TRAJECTORY_COLUMNS = (
    "elastic", "creep", "amplitude", "width", "shape", "strain", "stress", "age", "fast", "slow", "pressure", "modulus",
    "temperature", "time", "middle", "log_rate", "log_multiplier", "exponent", "hardening",
)  # fmt: skip
"""See `reduced_courses`."""
AMPLITUDE_COLUMN = TRAJECTORY_COLUMNS.index("amplitude")
FIRST_STEP_COLUMN = TRAJECTORY_COLUMNS.index("middle")
"""The first of those that are told of the step before a node."""
LOG_RATE_COLUMN = TRAJECTORY_COLUMNS.index("log_rate")

_REST_DEFLECTION = 1e-9
"""mm; far below what can be measured."""
_DECADES = float(1.0 / np.log(10.0))
_PRESSURE_FLOOR = 1e-6
"""MPa, as in the step."""


@njit(cache=True, error_model="numpy")
def write_node_outputs(
    node: StepData, state: Any, toughness: Any, dimple: DimpleCurves, thicker: Any, time: float, values: Any, out: Any
) -> None:
    """Write what is told of the end of a step; toughness : n'/(n' + 2) there, for a dimple that has not crept.

    values : room for the curves, (CURVES,).
    """
    deflection = node.elastic + state[CREEP_DEFLECTION]
    at = grid_position(deflection, dimple)
    write_curves(LOG_STRESS, LOG_STRESS + 1, at, dimple, thicker, values)
    write_curves(WIDTH, CURVES, at, dimple, thicker, values)
    end = node.pressure + _PRESSURE_FLOOR
    stress = exp(values[LOG_STRESS]) * end
    mean = (state[EXPONENT_STATE] + _REST_DEFLECTION * toughness) / (state[CREEP_DEFLECTION] + _REST_DEFLECTION)
    part = (node.elastic + _REST_DEFLECTION) / (deflection + _REST_DEFLECTION)
    width, shape = interpolate_exponents(WIDTH, mean, values), interpolate_exponents(SHAPE, mean, values)
    out[0], out[1], out[2] = node.elastic, state[CREEP_DEFLECTION], deflection
    out[3] = width + part * (values[ELASTIC_WIDTH] - width)
    out[4] = shape + part * (values[ELASTIC_SHAPE] - shape)
    out[5], out[6] = state[STRAIN_STATE], stress
    out[7] = node.modulus * state[STRAIN_STATE] / stress
    out[8], out[9] = state[FAST] * (1.0 / end), state[SLOW] * (1.0 / end)
    out[10], out[11], out[12], out[13] = node.pressure, node.modulus, node.temperature, time


@njit(cache=True, error_model="numpy")
def write_step_outputs(strain: Any, now: StepExponents, log_rate: Any, out: Any) -> None:
    """Write what is told of the step itself: strain and ln of the rate in its middle, local exponents."""
    out[14], out[15], out[16] = strain, log_rate * _DECADES, now.log_multiplier
    out[17], out[18] = now.exponent, now.hardening
