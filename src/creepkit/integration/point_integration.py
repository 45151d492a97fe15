"""Adaptive integration of one material point over a load program, with dense output and sensitivities."""

from __future__ import annotations

from math import exp, inf, nan
from typing import Any, NamedTuple

from numba import njit

from creepkit.arrays import Floats
from creepkit.integration.event_location import (
    DIVERGED,
    REACHED_END,
    STATE_LIMIT,
    STEP_TOO_SMALL,
    TERMINATION_MARGIN,
    TOO_MANY_STEPS,
    LevelEvents,
    TerminationLimits,
    approaching_limit,
    first_limit_passed,
    limit_crossing,
    limit_reached,
    locate_levels,
    log_time_sensitivity,
)
from creepkit.integration.runge_kutta_step import (
    StepWorkspace,
    StressControl,
    advance,
    dense_sensitivity,
    dense_value,
    differentiate,
)
from creepkit.integration.stage_problem import SOLVED
from creepkit.integration.step_control import (
    INITIAL_ERROR_FACTOR,
    AcceptedStep,
    IntegrationSettings,
    bounded_step,
    choose_time_transformation,
    differentiate_time_transformation,
    newton_tolerance,
    predictive_step_factor,
    sensitivity_error,
    step_factor,
    strain_error,
)
from creepkit.integration.time_discretisation import (
    Segment,
    Tableau,
    TimeTransformation,
    position,
    segment_from_row,
    transformed_time,
)

_SMALLEST_STEP = 1e-13


_SMALLEST_FIRST_STEP = 1e-60


_NEGLIGIBLE = 0.01
"""Share of the tolerance within which a time need not be known better."""


class CandidateParameters(NamedTuple):
    """One candidate's numbers: theta (P,); beta, the leading exponent of time; its limits."""

    theta: Floats
    beta: float
    limits: TerminationLimits


class IntegrationProgress(NamedTuple):
    """done, reached : output times filled, levels reached; steps, rejected : how many; code, time : its end, s."""

    done: int
    reached: int
    steps: int
    rejected: int
    code: int
    time: float


@njit(cache=True, error_model="numpy")
def integrate_point(
    update: Any,
    sensitivity: Any,
    kernel: CandidateParameters,
    drive: StressControl,
    segments: Floats,
    times: Floats,
    settings: IntegrationSettings,
    tableau: Tableau,
    work: StepWorkspace,
    strain: Floats,
    jacobian: Floats,
    arrivals: LevelEvents,
) -> IntegrationProgress:
    """Integrate from time zero; fill strain, jacobian and the times of the levels, up to the end reached.

    strain : (times,), NaN after the end.
    segments : (segments, 6); times : (times,) s, non-decreasing, none beyond the last segment.
    jacobian : (times, P), or (0, P) to do without.
    """
    progress = IntegrationProgress(_start(kernel, times, work, strain, jacobian), 0, 0, 0, REACHED_END, 0.0)
    for k in range(segments.shape[0]):
        segment = segment_from_row(segments[k])
        progress = _integrate_segment(
            update,
            sensitivity,
            kernel,
            drive,
            segment,
            times,
            settings,
            tableau,
            work,
            strain,
            jacobian,
            arrivals,
            progress,
        )
        if progress.code != REACHED_END:
            break
    return progress


@njit(cache=True, error_model="numpy")
def _start(kernel: CandidateParameters, times: Floats, work: StepWorkspace, strain: Floats, jacobian: Floats) -> int:
    """Return to a virgin state; fill the outputs at time zero and return their number."""
    for v in range(work.value.size):
        work.value[v] = kernel.limits.initial[v - 1] if v > 0 else 0.0
        for p in range(work.change.shape[1]):
            work.change[v, p] = 0.0
    done = 0
    while done < times.size and times[done] <= 0.0:
        strain[done] = 0.0
        for p in range(jacobian.shape[1] if jacobian.shape[0] > 0 else 0):
            jacobian[done, p] = 0.0
        done += 1
    return done


@njit(cache=True, error_model="numpy")
def _integrate_segment(
    update: Any,
    sensitivity: Any,
    kernel: CandidateParameters,
    drive: StressControl,
    segment: Segment,
    times: Floats,
    settings: IntegrationSettings,
    tableau: Tableau,
    work: StepWorkspace,
    strain: Floats,
    jacobian: Floats,
    arrivals: LevelEvents,
    progress: IntegrationProgress,
) -> IntegrationProgress:
    """Integrate over one segment in its transformed time s, from 0 to 1."""
    done, reached, steps, rejected = progress.done, progress.reached, progress.steps, progress.rejected
    clock, rate = choose_time_transformation(update, kernel.theta, kernel.beta, drive, segment, work.value, work)
    if jacobian.shape[0] > 0:
        due = min(times[done], segment.end) if done < times.size else segment.end
        differentiate_time_transformation(update, kernel.theta, kernel.beta, drive, segment, clock, due, work)
    first = min(position(clock, times[done]), 1.0) if done < times.size else 1.0
    slope = rate * exp(transformed_time(clock, 1e-12).log_pace) if rate > 0.0 else nan
    s, h, growing = 0.0, min(settings.first, first), True
    before = AcceptedStep(0.0, 1.0)
    near, steep = -1, slope
    while s < 1.0:
        h = bounded_step(s, h, settings.longest)
        if steps + rejected >= settings.max_steps:
            return IntegrationProgress(done, reached, steps, rejected, TOO_MANY_STEPS, _time_at(clock, s))
        if not (h >= _SMALLEST_STEP * s and h >= _SMALLEST_FIRST_STEP):
            code = STATE_LIMIT if near > 0 else _why_small(s, slope, settings)
            if code != STEP_TOO_SMALL and jacobian.shape[0] > 0:
                _steep_end(clock, work, s, max(near, 0), steep, arrivals)
            return IntegrationProgress(done, reached, steps, rejected, code, _time_at(clock, s))
        error = _attempt(
            update, sensitivity, kernel, drive, segment, clock, settings, tableau, work, s, h, slope, first, jacobian
        )
        if not error <= 1.0:
            h, growing = h * step_factor(tableau, error, False), False
            rejected += 1
            continue
        steps += 1
        code = limit_reached(kernel.limits, work)
        share = 1.0 if code == REACHED_END else limit_crossing(kernel.limits, tableau, work, h)
        ended = first_limit_passed(kernel.limits, tableau, work, h, share) if code != REACHED_END else -1
        if code == REACHED_END:
            now = transformed_time(clock, s + h)
            pace = exp(now.log_pace) / now.time if now.time > 0.0 else inf
            ended = approaching_limit(kernel.limits, work, pace, _NEGLIGIBLE * settings.rtol)
            code = REACHED_END if ended < 0 else STATE_LIMIT if ended > 0 else DIVERGED
            near = approaching_limit(kernel.limits, work, pace, TERMINATION_MARGIN)
            steep = work.slopes[tableau.c.size - 1, max(near, 0)]
        done = _fill(clock, tableau, work, s, h, share, times, done, strain, jacobian)
        reached = locate_levels(clock, tableau, work, s, h, share, arrivals, reached)
        if code != REACHED_END:
            if jacobian.shape[0] > 0:
                log_time_sensitivity(clock, tableau, work, s, h, share, ended, arrivals.end_change)
            return IntegrationProgress(done, reached, steps, rejected, code, _time_at(clock, s + share * h))
        _accept(work)
        slope = work.slopes[tableau.c.size - 1, 0]
        s = 1.0 if h == 1.0 - s else s + h
        longer = step_factor(tableau, error, growing)
        if not growing:
            longer *= predictive_step_factor(tableau, before, h, error)
        before = AcceptedStep(h, error)
        h, growing = h * longer, True
    return IntegrationProgress(done, reached, steps, rejected, REACHED_END, segment.end)


@njit(cache=True, error_model="numpy")
def _attempt(
    update: Any,
    sensitivity: Any,
    kernel: CandidateParameters,
    drive: StressControl,
    segment: Segment,
    clock: TimeTransformation,
    settings: IntegrationSettings,
    tableau: Tableau,
    work: StepWorkspace,
    s: float,
    h: float,
    slope: float,
    first: float,
    jacobian: Floats,
) -> float:
    """Try a step; return its error over what is allowed, infinite when a stage has no solution."""
    guess = 1e-6 if not slope > 0.0 else slope
    tolerance = newton_tolerance(settings)
    if advance(update, kernel.theta, drive, segment, clock, tableau, work, s, h, guess, tolerance) != SOLVED:
        return inf
    ahead = max(1.0, first / (s + h))
    caution = INITIAL_ERROR_FACTOR if s == 0.0 and clock.tau == 0.0 else 1.0
    error = caution * strain_error(tableau, drive, segment, work, settings, h, ahead, slope)
    if error <= 1.0 and jacobian.shape[0] > 0:
        if differentiate(sensitivity, kernel.theta, drive, segment, clock, tableau, work, s, h) != SOLVED:
            return inf
        error = max(error, caution * sensitivity_error(tableau, work, settings, h, ahead))
    return float(error)


@njit(cache=True, error_model="numpy")
def _accept(work: StepWorkspace) -> None:
    """Make the end of the step the start of the next."""
    for v in range(work.value.size):
        work.value[v] = work.new_value[v]
        for p in range(work.change.shape[1]):
            work.change[v, p] = work.new_change[v, p]


@njit(cache=True, error_model="numpy")
def _time_at(clock: TimeTransformation, s: float) -> float:
    return transformed_time(clock, s).time if s > 0.0 else clock.start


@njit(cache=True, error_model="numpy")
def _why_small(s: float, slope: float, settings: IntegrationSettings) -> int:
    """A step that shrinks to nothing while the rate would burst the point at once: the rate diverges."""
    return DIVERGED if slope * max(s, 1e-6) > settings.strain_limit else STEP_TOO_SMALL


@njit(cache=True, error_model="numpy")
def _steep_end(
    clock: TimeTransformation, work: StepWorkspace, s: float, v: int, slope: float, arrivals: LevelEvents
) -> None:
    """The derivative of the end where unknown `v` is vertical over time: a rate that diverges, a limit just ahead."""
    now = transformed_time(clock, s)
    pace = slope * now.time / exp(now.log_pace)
    for p in range(arrivals.end_change.size):
        arrivals.end_change[p] = -work.change[v, p] / pace


@njit(cache=True, error_model="numpy")
def _fill(
    clock: TimeTransformation,
    tableau: Tableau,
    work: StepWorkspace,
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
            dense_sensitivity(clock, tableau, work, s, h, x, 0, jacobian[done])
        done += 1
    return done
