"""Sensitivities of a march: exact derivatives of the discrete scheme at frozen places of its steps.

A march that kept its stages is replayed. At each stage R(u; history, inputs) = 0 is differentiated: the exact
(unsymmetric) tangent is factorised once, and every column, a law parameter, a direction of the load program or a
number of the geometry, is one more right-hand side. With K du = -dR at fixed u known, each point's creep and states
follow by the response of its local equations. Steps keep their places s in a segment; where a column moves the ends of
segments, as a jump time does, the times of the steps move with them and their own derivatives are returned.
"""

from __future__ import annotations

from math import exp
from typing import Any

from numba import njit

from creepkit.arrays import Floats
from creepkit.fem.band import eliminate_rows, solve_rows
from creepkit.fem.body import FiniteElementModel
from creepkit.fem.columns import BY_MOMENT, SensitivityWorkspace, SensitivityDirections, set_input_derivatives
from creepkit.fem.material import EQUIVALENT_STRAIN, PointWorkspace, StageConditions
from creepkit.fem.record import START, StepRecord
from creepkit.fem.slope_changes import rate_sensitivities
from creepkit.fem.stage_changes import assemble_sensitivities, clear_rows, pressure_sensitivities
from creepkit.fem.steps import segment_transformation, stage_at
from creepkit.integration.clock import transformed_time
from creepkit.integration.tableau import Tableau

DONE, SINGULAR = range(2)
"""Flags: done; a tangent was singular."""


@njit(cache=True, error_model="numpy", nogil=True)
def differentiate_program(
    sensitivity: Any,
    theta: Floats,
    beta: float,
    poisson: float,
    body: FiniteElementModel,
    segments: Floats,
    columns: SensitivityDirections,
    tableau: Tableau,
    initial: Floats,
    record: StepRecord,
    count: int,
    point: PointWorkspace,
    room: SensitivityWorkspace,
    surface: Floats,
    times: Floats,
) -> int:
    """Fill `surface` (records, top, C), changes of u_z of the observed nodes, and `times` (records, D), s.

    record : of a march that kept its stages; count : its rows. The first row is the body at rest; a row whose step has
    no length is a sudden change of load, with one stage.
    """
    _start_sensitivities(room, initial)
    for row in range(1, count):
        n = record.segments[row]
        segment, s, h = segments[n], record.places[row, 0], record.places[row, 1]
        sudden = h == 0.0
        for i in range(1 if sudden else tableau.c.size):
            at, time, weight = s + tableau.c[i] * h, segment[START], 0.0
            if not sudden:
                now = transformed_time(segment_transformation(segment, beta), at)
                time, weight = now.time, tableau.a[i, i] * h * exp(now.log_pace)
            stage = stage_at(segment, poisson, time, weight)
            set_input_derivatives(segments, columns.directions, n, beta, at, sudden, room.inputs)
            if not _stage_sensitivities(sensitivity, theta, stage, body, columns, tableau, record, row, i, h, point, room):
                return SINGULAR
        for d in range(times.shape[1]):
            times[row, d] = room.inputs[BY_MOMENT, d]
        if not sudden:
            _advance_sensitivities(record, row, tableau, h, room)
        for k in range(body.top.size):
            equation = body.equations[2 * body.top[k] + 1]
            for c in range(surface.shape[2]):
                surface[row, k, c] = room.right[equation, c] if equation >= 0 else 0.0
    return DONE


@njit(cache=True, error_model="numpy")
def _start_sensitivities(room: SensitivityWorkspace, initial: Floats) -> None:
    for k in range(room.value.shape[0]):
        for v in range(room.value.shape[1]):
            room.value[k, v] = initial[v - EQUIVALENT_STRAIN - 1] if v > EQUIVALENT_STRAIN else 0.0
            for c in range(room.change.shape[2]):
                room.change[k, v, c] = 0.0


@njit(cache=True, error_model="numpy")
def _advance_sensitivities(record: StepRecord, row: int, tableau: Tableau, h: float, room: SensitivityWorkspace) -> None:
    """Move history and its changes to the end of the step."""
    last = tableau.c.size - 1
    value, change, rates = room.value, room.change, room.rates
    for k in range(value.shape[0]):
        for v in range(value.shape[1]):
            for i in range(tableau.c.size):
                factor = h * tableau.a[last, i]
                value[k, v] += factor * record.slopes[row, i, k, v]
                for c in range(change.shape[2]):
                    change[k, v, c] += factor * rates[i, k, v, c]


@njit(cache=True, error_model="numpy", inline="always")
def _stage_sensitivities(
    sensitivity: Any,
    theta: Floats,
    stage: StageConditions,
    body: FiniteElementModel,
    columns: SensitivityDirections,
    tableau: Tableau,
    record: StepRecord,
    row: int,
    i: int,
    h: float,
    point: PointWorkspace,
    room: SensitivityWorkspace,
) -> bool:
    """Changes of the displacements (left in room.right) and of the slopes of stage `i`; False when singular."""
    share, displacement = tableau.a[i, i] * h, record.stages[row, i]
    clear_rows(room.rows)
    clear_rows(room.right)
    assemble_sensitivities(
        sensitivity, theta, stage, body, columns, tableau, record.slopes, row, i, h, share, point, room, displacement
    )
    pressure_sensitivities(body, stage.pressure, columns, theta.size, displacement, room)
    size, width = body.size, body.width
    if not eliminate_rows(room.rows, size, width):
        return False
    solve_rows(room.rows, size, width, room.right)
    if h > 0.0:
        rate_sensitivities(
            body, stage, columns, theta.size, record.slopes, row, i, h, share, tableau, room, displacement
        )
    return True
