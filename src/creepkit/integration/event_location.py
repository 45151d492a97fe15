"""Event location and termination: limits of strain and states, times at given strains, and their derivatives.

A time t at which an unknown v takes a given value depends on the parameters as
dt/dtheta = -(dv/dtheta at fixed t) / (dv/dt).
"""

from __future__ import annotations

from math import exp, isfinite
from typing import NamedTuple

from numba import njit

from creepkit.arrays import Floats
from creepkit.integration.runge_kutta_step import StepWorkspace, dense_sensitivity, dense_slope, dense_value
from creepkit.integration.time_discretisation import Tableau, TimeTransformation, transformed_time

REACHED_END, STRAIN_LIMIT, STATE_LIMIT, DIVERGED, STEP_TOO_SMALL, TOO_MANY_STEPS = range(6)
"""Codes of an ending; whatever it is, the history so far is kept."""


TERMINATION_MARGIN = 1e-7
"""Fraction of the time passed, within which a limit ahead ends a simulation whose steps have shrunk to nothing."""


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


_BISECTIONS = 50


class LevelEvents(NamedTuple):
    """Creep strains to arrive at, and what becomes of them; P parameters.

    levels : (levels,) increasing. times, slopes : (levels,) s, and dp/d(ln t) there; untouched where never reached.
    changes : (levels, P) d(ln t), or (0, P) to do without.
    end_change : (P,) d(ln t) of the end, where a limit was reached or the rate diverged; else untouched.
    """

    levels: Floats
    times: Floats
    slopes: Floats
    changes: Floats
    end_change: Floats


@njit(cache=True, error_model="numpy")
def locate_levels(
    clock: TimeTransformation,
    tableau: Tableau,
    work: StepWorkspace,
    s: float,
    h: float,
    share: float,
    arrivals: LevelEvents,
    reached: int,
) -> int:
    """Write the times of the levels reached within the step, up to its `share`; return how many levels are reached."""
    end = dense_value(tableau, work, h, share, 0)
    while reached < arrivals.levels.size and arrivals.levels[reached] <= end:
        level, low, high = arrivals.levels[reached], 0.0, share
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            if dense_value(tableau, work, h, middle, 0) < level:
                low = middle
            else:
                high = middle
        arrivals.times[reached] = transformed_time(clock, s + high * h).time
        arrivals.slopes[reached] = log_time_rate(clock, tableau, work, s, h, high, 0)
        if arrivals.changes.shape[0] > 0:
            log_time_sensitivity(clock, tableau, work, s, h, high, 0, arrivals.changes[reached])
        reached += 1
    return reached


@njit(cache=True, error_model="numpy")
def log_time_rate(
    clock: TimeTransformation, tableau: Tableau, work: StepWorkspace, s: float, h: float, x: float, v: int
) -> float:
    """dv/d(ln t) at the share `x` of the step."""
    slope = 0.0
    for i in range(tableau.c.size):
        slope += dense_slope(tableau, i, x) * work.slopes[i, v]
    now = transformed_time(clock, s + x * h)
    return float(slope * now.time / exp(now.log_pace))


@njit(cache=True, error_model="numpy")
def log_time_sensitivity(
    clock: TimeTransformation,
    tableau: Tableau,
    work: StepWorkspace,
    s: float,
    h: float,
    x: float,
    v: int,
    change: Floats,
) -> None:
    """Derivatives (P,), into `change`, of the ln of the time at which unknown `v` has the value it has at `x`."""
    dense_sensitivity(clock, tableau, work, s, h, x, v, change)
    pace = log_time_rate(clock, tableau, work, s, h, x, v)
    for p in range(change.size):
        change[p] = -change[p] / pace
