"""The clock of a segment, from the state in which the segment begins, and how it moves with the parameters."""

from __future__ import annotations

from math import exp, isfinite, log
from typing import Any

from numba import njit

from creepkit.arrays import Floats
from creepkit.integration.clock import SMALLEST_EXPONENT, TimeTransformation, linear_time, shifted_power_law_time, power_law_time
from creepkit.integration.problem import stress_derivative, write_point
from creepkit.integration.segments import Segment, stress_rate, temperature_rate
from creepkit.integration.step import StressControl, StepWorkspace
from creepkit.kernels.interface import POINT_SIZE, STRAIN, TEMPERATURE, TIME, data_pointer

_ZERO_STRAIN = 1e-25
"""Creep strain below this is none."""

_NUDGE = 1e-6


@njit(cache=True, error_model="numpy")
def choose_time_transformation(
    update: Any, theta: Floats, beta: float, drive: StressControl, segment: Segment, value: Floats, work: StepWorkspace
) -> tuple[TimeTransformation, float]:
    """The clock of a segment that begins with `value` (strain, states), and the rate there (0: not known)."""
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
    update: Any, theta: Floats, beta: float, drive: StressControl, segment: Segment, clock: TimeTransformation, first: float, work: StepWorkspace
) -> None:
    """Write into the room how the clock moves with each parameter, (2, P); `first` is the first output time, s.

    Any motion gives right sensitivities, since they are exact for a moving clock. This one, by differences, keeps
    them as smooth in s as the strain itself: it follows the exponent that prevails when the first output is due.
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
