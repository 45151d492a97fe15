"""How an integration may end: the limits of strain and states, and where in a step they are reached."""

from __future__ import annotations

from math import isfinite
from typing import NamedTuple

from numba import njit

from creepkit.arrays import Floats
from creepkit.integration.dense import dense_value
from creepkit.integration.step import StepWorkspace
from creepkit.integration.tableau import Tableau

REACHED_END, STRAIN_LIMIT, STATE_LIMIT, DIVERGED, STEP_TOO_SMALL, TOO_MANY_STEPS = range(6)
"""Codes of an ending; whatever it is, the history so far is kept."""


TERMINATION_MARGIN = 1e-7
"""Share of the time passed, within which a limit ahead is the end of a march whose steps have shrunk to nothing."""


class TerminationLimits(NamedTuple):
    """Creep strain at which the point has burst; initial states and the values at which it has failed, (S,)."""

    strain: float
    initial: Floats
    states: Floats


@njit(cache=True, error_model="numpy")
def _passed(limits: TerminationLimits, i: int, value: float) -> bool:
    """Whether state `i` has passed its limit, coming from its initial value."""
    if not isfinite(limits.states[i]):
        return False
    return bool(value >= limits.states[i] if limits.states[i] > limits.initial[i] else value <= limits.states[i])


@njit(cache=True, error_model="numpy")
def first_limit_passed(limits: TerminationLimits, tableau: Tableau, work: StepWorkspace, h: float, x: float) -> int:
    """Which unknown is at its limit at the share `x` of the step: 0 is strain, then the states."""
    for i in range(limits.states.size):
        if _passed(limits, i, dense_value(tableau, work, h, x, 1 + i)):
            return 1 + i
    return 0


@njit(cache=True, error_model="numpy")
def limit_reached(limits: TerminationLimits, work: StepWorkspace) -> int:
    """STATE_LIMIT or STRAIN_LIMIT when the new value has passed one, else REACHED_END."""
    for i in range(limits.states.size):
        if _passed(limits, i, work.new_value[1 + i]):
            return STATE_LIMIT
    return STRAIN_LIMIT if work.new_value[0] >= limits.strain else REACHED_END


@njit(cache=True, error_model="numpy")
def approaching_limit(limits: TerminationLimits, work: StepWorkspace, pace: float, margin: float) -> int:
    """Which unknown, growing ever faster, will pass its limit within the share `margin` of the time; -1 is none.

    pace : d(ln t)/ds at the step's end. Where a rate diverges at the limit, the last millionth of a life takes as many
    steps as the rest of it.
    """
    last = work.slopes.shape[0] - 1
    for v in range(limits.states.size + 1):
        limit = limits.states[v - 1] if v > 0 else limits.strain
        slope = work.slopes[last, v]
        gap = limit - work.new_value[v]
        faster = slope * gap > 0.0 and abs(slope) > abs(work.slopes[0, v])
        if isfinite(limit) and faster and abs(gap) * pace < margin * abs(slope):
            return v
    return -1


@njit(cache=True, error_model="numpy")
def limit_crossing(limits: TerminationLimits, tableau: Tableau, work: StepWorkspace, h: float) -> float:
    """Share of the step at which the first limit is passed, by bisection of the dense output."""
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        beyond = dense_value(tableau, work, h, middle, 0) >= limits.strain
        for i in range(limits.states.size):
            beyond = beyond or _passed(limits, i, dense_value(tableau, work, h, middle, 1 + i))
        if beyond:
            high = middle
        else:
            low = middle
    return high
