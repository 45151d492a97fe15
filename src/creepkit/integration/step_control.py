"""Step control: error tolerances, step lengths, and the choice of the time transformation of a segment."""

from __future__ import annotations

from math import exp, inf, isfinite, isnan, log, sqrt
from typing import Any, NamedTuple

from numba import njit

from creepkit.arrays import Floats
from creepkit.integration.runge_kutta_step import StepWorkspace, StressControl, dense_value, local_error
from creepkit.integration.stage_problem import stress_derivative, write_point
from creepkit.integration.time_discretisation import (
    SMALLEST_EXPONENT,
    Segment,
    Tableau,
    TimeTransformation,
    linear_time,
    power_law_time,
    shifted_power_law_time,
    stress_rate,
    temperature_rate,
)
from creepkit.kernels.interface import POINT_SIZE, STRAIN, TEMPERATURE, TIME, data_pointer

_SAFETY, _LEAST, _MOST = 0.9, 0.1, 8.0


_SENSITIVITY_SLACK = 10.0
"""Sensitivities are of the order of ten strains: d(strain)/d(exponent) = strain ln(stress)."""


INITIAL_ERROR_FACTOR = 10.0
"""From a virgin state strain is a sum of broken powers of s, on which the first step is of order 1 and its error is up
to 2.5 times the estimate; afterwards the estimate exceeds the error some twenty times."""


class IntegrationSettings(NamedTuple):
    """How accurately, and how far, to integrate.

    rtol : local error allowed in a step, relative to strain and to each state.
    smallest : strain below which the error is relative to this instead.
    strain_limit : creep strain at which the point has burst.
    max_steps : cap on steps, accepted and rejected, of one history.
    first, longest : first and longest step, as shares of a segment (in its transformed time).
    """

    rtol: float = 1e-5
    smallest: float = 1e-7
    strain_limit: float = 1.0
    max_steps: int = 2000
    first: float = 0.02
    longest: float = 0.2


@njit(cache=True, error_model="numpy")
def newton_tolerance(settings: IntegrationSettings) -> float:
    """Newton's last correction; its square, the error left, is a thousandth of the step's tolerance."""
    return min(sqrt(1e-3 * settings.rtol), 1e-3)


@njit(cache=True, error_model="numpy")
def strain_error(
    tableau: Tableau,
    drive: StressControl,
    segment: Segment,
    work: StepWorkspace,
    settings: IntegrationSettings,
    h: float,
    ahead: float,
    slope: float,
) -> float:
    """Largest local error of the step and of its dense output over what is allowed.

    Infinite when creep strain falls, which it never does. Under prescribed strain the stress counts as well.
    ahead : the first output's position over that of the step's end: until then only the strain there matters.
    slope : dp/ds at the start of the step, NaN when not known; with it, Hermite's cubic checks the dense output.
    """
    if work.new_value[0] < work.value[0]:
        return inf
    reach = work.new_value[0] * ahead
    if drive.stiffness > 0.0:
        stress = segment.end_stress - drive.stiffness * work.new_value[0]
        reach = min(reach, abs(stress) / drive.stiffness)
    worst = local_error(tableau, work, h, 0)
    if not isnan(slope):
        hermite = work.value[0] + work.new_value[0] + 0.25 * h * (slope - work.slopes[tableau.c.size - 1, 0])
        worst = max(worst, abs(dense_value(tableau, work, h, 0.5, 0) - 0.5 * hermite))
    worst /= settings.rtol * (reach + settings.smallest)
    for v in range(1, work.value.size):
        reach = max(abs(work.value[v]), abs(work.new_value[v])) + settings.smallest
        worst = max(worst, local_error(tableau, work, h, v) / (settings.rtol * reach))
    return worst if isfinite(worst) else inf


@njit(cache=True, error_model="numpy")
def sensitivity_error(
    tableau: Tableau, work: StepWorkspace, settings: IntegrationSettings, h: float, ahead: float
) -> float:
    """Largest local error of the sensitivities of strain over what is allowed: of ten strains, or of themselves.

    Before a rupture they grow without end, for there strain is vertical over time.
    """
    worst, reach = 0.0, _SENSITIVITY_SLACK * (work.new_value[0] * ahead + settings.smallest)
    for p in range(work.change.shape[1]):
        total = 0.0
        for i in range(tableau.c.size):
            total += tableau.error[i] * work.slope_changes[i, 0, p]
        worst = max(worst, abs(h * total) / (settings.rtol * max(reach, abs(work.new_change[0, p]))))
    return worst if isfinite(worst) else inf


@njit(cache=True, error_model="numpy")
def step_factor(tableau: Tableau, error: float, growing: bool) -> float:
    """Factor on the step after an error; a step that follows a rejection does not grow."""
    if not isfinite(error):
        return _LEAST
    factor = _SAFETY * max(error, 1e-12) ** (-1.0 / (tableau.error_order + 1))
    return float(min(max(factor, _LEAST), _MOST if growing else 1.0))


class AcceptedStep(NamedTuple):
    """The last accepted step: its length (0: none yet), and its error over what was allowed."""

    length: float
    error: float


@njit(cache=True, error_model="numpy")
def predictive_step_factor(tableau: Tableau, before: AcceptedStep, h: float, error: float) -> float:
    """Factor, at most one, on the step after one that had to be tried again.

    On the way to a singularity every step must be shorter than the last. That goes on: predictive control, Gustafsson
    (1994), ACM Trans. Math. Softw. 20, 496.
    """
    if not before.length > 0.0:
        return 1.0
    ratio = (max(before.error, 1e-12) / max(error, 1e-12)) ** (1.0 / (tableau.error_order + 1))
    return float(min(max(ratio * h / before.length, _LEAST), 1.0))


@njit(cache=True, error_model="numpy")
def bounded_step(s: float, h: float, longest: float) -> float:
    """The step, not too long, and ending at 1 rather than just before it."""
    h = min(h, longest)
    return 1.0 - s if s + 1.001 * h > 1.0 else h


_ZERO_STRAIN = 1e-25
"""Creep strain below this is none."""


_NUDGE = 1e-6


@njit(cache=True, error_model="numpy")
def choose_time_transformation(
    update: Any, theta: Floats, beta: float, drive: StressControl, segment: Segment, value: Floats, work: StepWorkspace
) -> tuple[TimeTransformation, float]:
    """The time transformation of a segment, and the rate at its start (0: not known).

    value : (1 + S,) strain and states there.
    """
    length = segment.end - segment.start
    strain = value[0]
    if strain < _ZERO_STRAIN and beta < 1.0:
        return power_law_time(segment.start, length, beta), 0.0
    row, out, size = work.row, work.out, value.size
    stress = (segment.stress - drive.stiffness * strain) * exp(drive.load * strain)
    if not stress > 0.0:
        return linear_time(segment.start, length), 0.0
    row[TIME], row[TEMPERATURE] = segment.start, segment.temperature
    for v in range(1, size):
        row[POINT_SIZE + v - 1] = value[v]
    write_point(row, drive.axes, stress, strain)
    update(1, data_pointer(row), data_pointer(theta), data_pointer(out))
    rate = exp(min(out[0], 600.0))
    if not isfinite(rate) or rate <= 0.0:
        return linear_time(segment.start, length), 0.0
    bend, bend_rate = _bends(drive, segment, stress, rate, row, out, size)
    return shifted_power_law_time(segment.start, length, bend, bend_rate), rate


@njit(cache=True, error_model="numpy")
def _bends(
    drive: StressControl, segment: Segment, stress: float, rate: float, row: Floats, out: Floats, size: int
) -> tuple[float, float]:
    """r in p'' = r p' and its rate, if ln f kept its logarithmic slopes to time, strain and stress."""
    by_stress = stress_derivative(out, size, drive.axes)
    strain, time = row[STRAIN], row[TIME]
    aging = out[size + TIME]
    hardening = rate * out[size + STRAIN] if strain > 0.0 else 0.0
    thinning = rate * drive.load * stress * by_stress
    relaxing = -rate * drive.stiffness * by_stress
    driven = by_stress * stress_rate(segment) * exp(drive.load * strain)
    driven += out[size + TEMPERATURE] * temperature_rate(segment)
    for v in range(1, size):
        driven += out[size + POINT_SIZE + v - 1] * out[v]
    bend = aging + hardening + thinning + relaxing + driven
    bend_rate = thinning * bend + relaxing * (bend + drive.stiffness * rate / stress)
    if time > 0.0:
        bend_rate -= aging / time
    if strain > 0.0:
        bend_rate += hardening * (bend - rate / strain)
    return bend, bend_rate


@njit(cache=True, error_model="numpy")
def local_exponent(
    update: Any, theta: Floats, beta: float, drive: StressControl, segment: Segment, time: float, work: StepWorkspace
) -> float:
    """Exponent of time of the curve p ~ t^b that a virgin state follows about `time`, s."""
    row, out = work.row, work.out
    elapsed = time - segment.start
    row[TIME] = time
    row[TEMPERATURE] = segment.temperature + temperature_rate(segment) * elapsed
    for v in range(1, work.value.size):
        row[POINT_SIZE + v - 1] = work.value[v]
    stress = segment.stress + stress_rate(segment) * elapsed
    log_strain, exponent = -7.0, beta
    for _ in range(30):
        write_point(row, drive.axes, stress, exp(log_strain))
        update(1, data_pointer(row), data_pointer(theta), data_pointer(out))
        softening = 1.0 - out[work.value.size + STRAIN] * row[STRAIN]
        exponent = (1.0 + elapsed * out[work.value.size + TIME]) / softening
        step = (log(elapsed / beta) + out[0] - log_strain) / softening
        if not isfinite(step) or abs(step) < 1e-10:
            break
        log_strain = min(max(log_strain + step, -65.0), 0.0)
    return exponent


@njit(cache=True, error_model="numpy")
def differentiate_time_transformation(
    update: Any,
    theta: Floats,
    beta: float,
    drive: StressControl,
    segment: Segment,
    clock: TimeTransformation,
    first: float,
    work: StepWorkspace,
) -> None:
    """Write into the workspace how the time transformation moves with each parameter, (2, P).

    first : s, the first output time. Any motion gives right sensitivities, since they are exact for a moving time
    transformation. This one, by differences, keeps them as smooth in s as the strain itself: it follows the exponent
    that prevails when the first output is due.
    """
    for p in range(theta.size):
        work.clock_change[0, p] = work.clock_change[1, p] = 0.0
    from_virgin = clock.tau == 0.0
    if from_virgin and not SMALLEST_EXPONENT < beta < 1.0:
        return
    here = local_exponent(update, theta, beta, drive, segment, first, work) if from_virgin else 0.0
    nudged, value = theta.copy(), work.value.copy()
    for p in range(theta.size):
        step = _NUDGE * max(1.0, abs(theta[p])) if isfinite(theta[p]) else 0.0
        if step == 0.0:
            continue
        nudged[p] = theta[p] + step
        if from_virgin:
            there = local_exponent(update, nudged, beta, drive, segment, first, work)
            change = (there - here) / step
            work.clock_change[0, p] = change if isfinite(change) else 0.0
        else:
            for v in range(value.size):
                value[v] = work.value[v] + step * work.change[v, p]
            moved, _ = choose_time_transformation(update, nudged, beta, drive, segment, value, work)
            if moved.tau > 0.0 and moved.beta != 1.0 and clock.beta != 1.0:
                work.clock_change[0, p] = (moved.beta - clock.beta) / step
                work.clock_change[1, p] = (moved.tau - clock.tau) / step
        nudged[p] = theta[p]
