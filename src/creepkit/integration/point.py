"""Adaptive integration of one material point over a load program, with dense output and analytic sensitivities."""

from __future__ import annotations

from math import exp, isfinite, sqrt
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from creepkit.arrays import Floats
from creepkit.integration.clock import Clock, moment, position
from creepkit.integration.pacing import choose_clock, move_clock
from creepkit.integration.segments import Segment, segment_of
from creepkit.integration.stage import SOLVED
from creepkit.integration.step import Drive, Room, advance, dense_change, dense_value, differentiate, error_of
from creepkit.integration.tableau import Tableau

REACHED_END, STRAIN_LIMIT, STATE_LIMIT, DIVERGED, STEP_TOO_SMALL, TOO_MANY_STEPS, SINGULAR = range(7)
"""How an integration ended; all but the first keep the history so far."""

_SAFETY, _LEAST, _MOST = 0.9, 0.1, 8.0
_SMALLEST_STEP = 1e-13
_SENSITIVITY_SLACK = 10.0
_VIRGIN_CAUTION = 10.0
"""From a virgin state strain is a sum of broken powers of s, on which the first step is of order 1 and its error is up
to 2.5 times the estimate; afterwards the estimate exceeds the error some twenty times."""
_SMALLEST_FIRST_STEP = 1e-60


class Settings(NamedTuple):
    """How accurately, and how far, to integrate.

    rtol : local error allowed in a step, relative to strain and to each state.
    smallest : strain below which the error is relative to this instead.
    strain_limit : creep strain at which the point has burst.
    max_steps : cap on steps, accepted and rejected, of one history.
    first, longest : first and longest step, as shares of a segment (in the position of its clock).
    """

    rtol: float = 1e-5
    smallest: float = 1e-7
    strain_limit: float = 1.0
    max_steps: int = 2000
    first: float = 0.02
    longest: float = 0.2


class Ending(NamedTuple):
    """code : how it ended; time : s, where; steps, rejected : how many."""

    code: int
    time: float
    steps: int
    rejected: int


class Kernel(NamedTuple):
    """One candidate's numbers: theta (P,); beta, the leading exponent of time; initial states and limits (S,)."""

    theta: Floats
    beta: float
    initial: Floats
    limits: Floats


@njit(cache=True, error_model="numpy")
def integrate_point(
    update: Any,
    sensitivity: Any,
    kernel: Kernel,
    drive: Drive,
    segments: Floats,
    times: Floats,
    settings: Settings,
    tableau: Tableau,
    work: Room,
    strain: Floats,
    jacobian: Floats,
) -> Ending:
    """Integrate from time zero and fill `strain` (times,) and `jacobian` (times, P) up to the end that is reached.

    segments : (segments, 6); times : (times,) s, non-decreasing, none beyond the last segment.
    jacobian : (times, P), or (0, P) to do without.
    """
    _reset(kernel, work)
    done, steps, rejected = 0, 0, 0
    while done < times.size and times[done] <= 0.0:
        strain[done] = 0.0
        if jacobian.shape[0] > 0:
            jacobian[done, :] = 0.0
        done += 1
    for k in range(segments.shape[0]):
        segment = segment_of(segments[k])
        clock, rate = choose_clock(update, kernel.theta, kernel.beta, drive, segment, work.value, work)
        if jacobian.shape[0] > 0:
            due = times[done] if done < times.size and times[done] < segment.end else segment.end
            move_clock(update, kernel.theta, kernel.beta, drive, segment, clock, due, work)
        slope = rate * exp(moment(clock, 1e-12).log_pace) if rate > 0.0 else 1e-6
        first = min(position(clock, times[done]), 1.0) if done < times.size else 1.0
        s, h, grow = 0.0, min(settings.first, first), True
        while s < 1.0:
            if steps + rejected >= settings.max_steps:
                return Ending(TOO_MANY_STEPS, _time_at(clock, s), steps, rejected)
            h = min(h, settings.longest)
            if s + 1.001 * h > 1.0:
                h = 1.0 - s
            if not (h >= _SMALLEST_STEP * s and h >= _SMALLEST_FIRST_STEP):
                return Ending(_why_small(clock, s, slope, settings), _time_at(clock, s), steps, rejected)
            flag = advance(
                update, kernel.theta, drive, segment, clock, tableau, work, s, h, slope, _newton_tolerance(settings)
            )
            error = np.inf
            if flag == SOLVED:
                ahead = max(1.0, first / (s + h))
                caution = _VIRGIN_CAUTION if s == 0.0 and clock.tau == 0.0 else 1.0
                error = caution * _error(tableau, drive, segment, work, settings, h, ahead)
            if error <= 1.0 and jacobian.shape[0] > 0:
                flag = differentiate(sensitivity, kernel.theta, drive, segment, clock, tableau, work, s, h)
                if flag != SOLVED:
                    return Ending(SINGULAR, _time_at(clock, s), steps, rejected)
                error = max(error, caution * _change_error(tableau, work, settings, h, ahead))
            if not error <= 1.0:
                rejected += 1
                grow = False
                h *= max(_LEAST, _SAFETY * error ** (-1.0 / (tableau.error_order + 1))) if isfinite(error) else _LEAST
                continue
            steps += 1
            code = _limit_reached(kernel, settings, work)
            share = 1.0 if code == REACHED_END else _crossing(kernel, settings, tableau, work, h)
            done = _fill(clock, tableau, work, s, h, share, times, done, strain, jacobian)
            if code != REACHED_END:
                return Ending(code, _time_at(clock, s + share * h), steps, rejected)
            s = 1.0 if h == 1.0 - s else s + h
            _accept(work)
            slope = work.slopes[tableau.c.size - 1, 0]
            growth = _SAFETY * max(error, 1e-12) ** (-1.0 / (tableau.error_order + 1))
            h *= min(_MOST if grow else 1.0, max(_LEAST, growth))
            grow = True
    last = segments[segments.shape[0] - 1, 1] if segments.shape[0] > 0 else 0.0
    return Ending(REACHED_END, last, steps, rejected)


@njit(cache=True, error_model="numpy")
def _reset(kernel: Kernel, work: Room) -> None:
    """Return to a virgin state."""
    for v in range(work.value.size):
        work.value[v] = kernel.initial[v - 1] if v > 0 else 0.0
        for p in range(work.change.shape[1]):
            work.change[v, p] = 0.0


@njit(cache=True, error_model="numpy")
def _accept(work: Room) -> None:
    """Make the end of the step the start of the next."""
    for v in range(work.value.size):
        work.value[v] = work.new_value[v]
        for p in range(work.change.shape[1]):
            work.change[v, p] = work.new_change[v, p]


@njit(cache=True, error_model="numpy")
def _newton_tolerance(settings: Settings) -> float:
    """Newton's last correction; its square, the error left, is a thousandth of the step's tolerance."""
    return min(sqrt(1e-3 * settings.rtol), 1e-3)


@njit(cache=True, error_model="numpy")
def _time_at(clock: Clock, s: float) -> float:
    return moment(clock, s).time if s > 0.0 else clock.start


@njit(cache=True, error_model="numpy")
def _error(
    tableau: Tableau, drive: Drive, segment: Segment, work: Room, settings: Settings, h: float, ahead: float
) -> float:
    """Largest local error of the step over what is allowed; infinite when creep strain falls, which it never does.

    ahead : the first output's position over that of the step's end: until then only the strain there matters.
    """
    if work.new_value[0] < work.value[0]:
        return np.inf
    reach = work.new_value[0] * ahead
    if drive.stiffness > 0.0:
        stress = segment.end_stress - drive.stiffness * work.new_value[0]
        reach = min(reach, abs(stress) / drive.stiffness)
    worst = error_of(tableau, work, h, 0) / (settings.rtol * (reach + settings.smallest))
    for v in range(1, work.value.size):
        reach = max(abs(work.value[v]), abs(work.new_value[v])) + settings.smallest
        worst = max(worst, error_of(tableau, work, h, v) / (settings.rtol * reach))
    return worst if isfinite(worst) else np.inf


@njit(cache=True, error_model="numpy")
def _change_error(tableau: Tableau, work: Room, settings: Settings, h: float, ahead: float) -> float:
    """Largest local error of the sensitivities of strain over what is allowed, in units of the strain itself."""
    worst = 0.0
    for p in range(work.change.shape[1]):
        total = 0.0
        for i in range(tableau.c.size):
            total += tableau.error[i] * work.slope_changes[i, 0, p]
        worst = max(worst, abs(h * total))
    allowed = _SENSITIVITY_SLACK * settings.rtol * (work.new_value[0] * ahead + settings.smallest)
    return worst / allowed if isfinite(worst) else np.inf


@njit(cache=True, error_model="numpy")
def _why_small(clock: Clock, s: float, slope: float, settings: Settings) -> int:
    """A step that must shrink to nothing while the rate would burst the point at once: the rate diverges."""
    return DIVERGED if slope * max(s, 1e-6) > settings.strain_limit else STEP_TOO_SMALL


@njit(cache=True, error_model="numpy")
def _passed(value: float, limit: float, initial: float) -> bool:
    return value >= limit if limit > initial else value <= limit


@njit(cache=True, error_model="numpy")
def _limit_reached(kernel: Kernel, settings: Settings, work: Room) -> int:
    """Which limit the new value has passed, if any."""
    for i in range(kernel.limits.size):
        if isfinite(kernel.limits[i]) and _passed(work.new_value[1 + i], kernel.limits[i], kernel.initial[i]):
            return STATE_LIMIT
    return STRAIN_LIMIT if work.new_value[0] >= settings.strain_limit else REACHED_END


@njit(cache=True, error_model="numpy")
def _crossing(kernel: Kernel, settings: Settings, tableau: Tableau, work: Room, h: float) -> float:
    """Share of the step at which the first limit is passed, by bisection of the dense output."""
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        beyond = dense_value(tableau, work, h, middle, 0) >= settings.strain_limit
        for i in range(kernel.limits.size):
            if isfinite(kernel.limits[i]) and not beyond:
                value = dense_value(tableau, work, h, middle, 1 + i)
                beyond = _passed(value, kernel.limits[i], kernel.initial[i])
        if beyond:
            high = middle
        else:
            low = middle
    return high


@njit(cache=True, error_model="numpy")
def _fill(
    clock: Clock,
    tableau: Tableau,
    work: Room,
    s: float,
    h: float,
    share: float,
    times: Floats,
    done: int,
    strain: Floats,
    jacobian: Floats,
) -> int:
    """Write the outputs that lie within the step, up to its `share`; return how many times are done."""
    while done < times.size:
        x = (position(clock, times[done]) - s) / h
        if x > share * (1.0 + 1e-10):
            break
        x = min(max(x, 0.0), 1.0)
        strain[done] = dense_value(tableau, work, h, x, 0)
        if jacobian.shape[0] > 0:
            dense_change(clock, tableau, work, s, h, x, 0, jacobian[done])
        done += 1
    return done
