"""What a march is differentiated to, and how the inputs of a stage change with each direction of the load program."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from creepkit.arrays import Floats
from creepkit.fem.body import FiniteElementModel
from creepkit.fem.record import (
    END,
    END_MODULUS,
    END_PRESSURE,
    FINAL_TEMPERATURE,
    MODULUS,
    PRESSURE,
    START,
    START_TEMPERATURE,
)
from creepkit.fem.steps import segment_transformation
from creepkit.integration.clock import transformed_time

LANES = 16
"""Right-hand sides are kept in multiples of this, the numbers that a processor takes at a time twice over."""

_NUDGE = 1e-4
"""Share of a segment's length by which its ends are moved to difference its clock."""

BY_PRESSURE, BY_MOMENT, BY_LOAD_TEMPERATURE, BY_STIFFNESS, BY_WEIGHT = range(5)
"""Rows of ChangeRoom.inputs: change of pressure, of time, of temperature, of ln E, and of ln weight."""


class SensitivityDirections(NamedTuple):
    """What is differentiated to, C = P + D + G columns: P law parameters, then these.

    directions : (D, segments, 10) change of the load program.
    gradients, hoops : (G, elements, 4, 2, 2) and (G, elements, 4), see fem.shape.GeometryChange.
    velocities : (G, 2 nodes) mm.
    """

    directions: Floats
    gradients: Floats
    hoops: Floats
    velocities: Floats


class SensitivityWorkspace(NamedTuple):
    """Working arrays; V = 4 + S, R = 1 + S.

    value : (points, V); change : (points, V, C); rates : (stages, points, V, C) changes of the slopes;
    base : (points, V, C); own : (points, R, C) change of D and of the states at fixed strain; follow : (points, R, 4).
    rows : (size, 2 width + 1) tangent; right : (size, C or a little more). element : (4, 8, 8); products : (10, 8);
    local : (2, 8) displacements; force : (2, 8, 3), (2, 8); element_right : (16, C); moved : (16, C).
    inputs : (5, D) change of pressure, time, temperature, ln E and ln weight. side, sides, ends : of a pressed side.
    history : (V,) of a stage; by_strain : (4, 5).
    """

    value: Floats
    change: Floats
    rates: Floats
    base: Floats
    own: Floats
    follow: Floats
    rows: Floats
    right: Floats
    element: Floats
    products: Floats
    local: Floats
    force: Floats
    element_right: Floats
    moved: Floats
    inputs: Floats
    side: Floats
    sides: Floats
    ends: Floats
    history: Floats
    by_strain: Floats
    stress_change: Floats
    gradient_change: Floats


def sensitivity_workspace(body: FiniteElementModel, states: int, stages: int, columns: int, directions: int) -> SensitivityWorkspace:
    """Allocate the working arrays."""
    points, size = 4 * len(body.elements), 4 + states
    return SensitivityWorkspace(
        value=np.zeros((points, size)),
        change=np.zeros((points, size, columns)),
        rates=np.zeros((stages, points, size, columns)),
        base=np.zeros((points, size, columns)),
        own=np.zeros((points, 1 + states, columns)),
        follow=np.zeros((points, 1 + states, 4)),
        rows=np.zeros((body.size, 2 * body.width + 1)),
        right=np.zeros((body.size, (columns + LANES - 1) // LANES * LANES)),
        element=np.zeros((4, 8, 8)),
        products=np.zeros((10, 8)),
        local=np.zeros((2, 8)),
        force=np.zeros((16, 3)),
        element_right=np.zeros((16, columns)),
        moved=np.zeros((16, columns)),
        inputs=np.zeros((5, directions)),
        side=np.zeros((2, 3)),
        sides=np.zeros((4, 3, 3)),
        ends=np.zeros((2, 3)),
        history=np.zeros(size),
        by_strain=np.zeros((4, 5)),
        stress_change=np.zeros((3, columns)),
        gradient_change=np.zeros((5, columns)),
    )


@njit(cache=True, error_model="numpy")
def set_input_derivatives(
    segments: Floats, directions: Floats, n: int, beta: float, s: float, at_start: bool, inputs: Floats
) -> None:
    """Change of pressure, time, temperature, ln E and ln weight with each direction, at place `s` of segment `n`."""
    segment = segments[n]
    length = segment[END] - segment[START]
    now = transformed_time(segment_transformation(segment, beta), s) if not at_start else transformed_time(segment_transformation(segment, 1.0), 1e-300)
    share = 0.0 if at_start else (now.time - segment[START]) / length
    modulus = segment[MODULUS] + share * (segment[END_MODULUS] - segment[MODULUS])
    for d in range(directions.shape[0]):
        change = directions[d, n]
        longer = change[END] - change[START]
        later, slower = change[START], 0.0
        if not at_start and (change[START] != 0.0 or longer != 0.0):
            step = _NUDGE * length
            up = transformed_time(segment_transformation(segment + step * change, beta), s)
            down = transformed_time(segment_transformation(segment - step * change, beta), s)
            later, slower = (up.time - down.time) / (2.0 * step), (up.log_pace - down.log_pace) / (2.0 * step)
        along = 0.0 if at_start else (later - change[START] - share * longer) / length
        inputs[BY_PRESSURE, d] = (
            change[PRESSURE] + share * (change[END_PRESSURE] - change[PRESSURE])
            + along * (segment[END_PRESSURE] - segment[PRESSURE])
        )  # fmt: skip
        inputs[BY_LOAD_TEMPERATURE, d] = (
            change[START_TEMPERATURE] + share * (change[FINAL_TEMPERATURE] - change[START_TEMPERATURE])
            + along * (segment[FINAL_TEMPERATURE] - segment[START_TEMPERATURE])
        )  # fmt: skip
        stiffer = change[MODULUS] + share * (change[END_MODULUS] - change[MODULUS])
        inputs[BY_STIFFNESS, d] = (stiffer + along * (segment[END_MODULUS] - segment[MODULUS])) / modulus
        inputs[BY_MOMENT, d] = later
        inputs[BY_WEIGHT, d] = slower
