"""When a point arrives somewhere: at given creep strains, and at its end; with the derivatives of these times.

A time t at which an unknown v takes a given value moves with the parameters as the implicit function theorem says,
dt/dtheta = -(dv/dtheta at fixed t) / (dv/dt).
"""

from __future__ import annotations

from math import exp
from typing import NamedTuple

from numba import njit

from creepkit.arrays import Floats
from creepkit.integration.clock import TimeTransformation, transformed_time
from creepkit.integration.dense import dense_sensitivity, dense_slope, dense_value
from creepkit.integration.step import StepWorkspace
from creepkit.integration.tableau import Tableau

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
    clock: TimeTransformation, tableau: Tableau, work: StepWorkspace, s: float, h: float, share: float, arrivals: LevelEvents, reached: int
) -> int:
    """Write the arrivals within the step, up to its `share`; return how many levels are reached."""
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
def log_time_rate(clock: TimeTransformation, tableau: Tableau, work: StepWorkspace, s: float, h: float, x: float, v: int) -> float:
    """dv/d(ln t) at the share `x` of the step."""
    slope = 0.0
    for i in range(tableau.c.size):
        slope += dense_slope(tableau, i, x) * work.slopes[i, v]
    now = transformed_time(clock, s + x * h)
    return float(slope * now.time / exp(now.log_pace))


@njit(cache=True, error_model="numpy")
def log_time_sensitivity(
    clock: TimeTransformation, tableau: Tableau, work: StepWorkspace, s: float, h: float, x: float, v: int, change: Floats
) -> None:
    """Derivatives (P,), into `change`, of the ln of the time at which unknown `v` has the value it has at `x`."""
    dense_sensitivity(clock, tableau, work, s, h, x, v, change)
    pace = log_time_rate(clock, tableau, work, s, h, x, v)
    for p in range(change.size):
        change[p] = -change[p] / pace
