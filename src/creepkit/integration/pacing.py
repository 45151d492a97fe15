"""The clock of a segment, from the state in which the segment begins, and how it moves with the parameters."""

from __future__ import annotations

from math import exp, isfinite
from typing import Any

from numba import njit

from creepkit.arrays import Floats
from creepkit.integration.clock import SMALLEST_BETA, Clock, plain, shifted, virgin
from creepkit.integration.segments import Segment, stress_rate, temperature_rate
from creepkit.integration.stage import along_stress, place
from creepkit.integration.step import Drive, Room
from creepkit.kernels.interface import POINT_SIZE, STRAIN, TEMPERATURE, TIME, pointer

_VIRGIN = 1e-25
"""Creep strain below this is none."""

_NUDGE = 1e-6


@njit(cache=True)
def choose_clock(
    update: Any, theta: Floats, beta: float, drive: Drive, segment: Segment, value: Floats, work: Room
) -> tuple[Clock, float]:
    """The clock of a segment that begins with `value` (strain, states), and the rate there (0: not known)."""
    length = segment.end - segment.start
    strain = value[0]
    if strain < _VIRGIN and beta < 1.0:
        return virgin(segment.start, length, beta), 0.0
    row, out, size = work.row, work.out, value.size
    stress = (segment.stress - drive.stiffness * strain) * exp(drive.load * strain)
    if not stress > 0.0:
        return plain(segment.start, length), 0.0
    row[TIME], row[TEMPERATURE] = segment.start, segment.temperature
    row[POINT_SIZE:] = value[1:]
    place(row, drive.axes, stress, strain)
    update(1, pointer(row), pointer(theta), pointer(out))
    rate = exp(min(out[0], 600.0))
    if not isfinite(rate) or rate <= 0.0:
        return plain(segment.start, length), 0.0
    bend, bend_rate = _bends(drive, segment, stress, rate, out[size:], row, out[1:size])
    return shifted(segment.start, length, bend, bend_rate), rate


@njit(cache=True)
def _bends(
    drive: Drive, segment: Segment, stress: float, rate: float, gradient: Floats, row: Floats, state_rates: Floats
) -> tuple[float, float]:
    """r in p'' = r p' and its rate, if ln f kept its logarithmic slopes to time, strain and stress."""
    by_stress = along_stress(gradient, drive.axes)
    strain, time = row[STRAIN], row[TIME]
    aging = gradient[TIME]
    hardening = rate * gradient[STRAIN] if strain > 0.0 else 0.0
    thinning = rate * drive.load * stress * by_stress
    relaxing = -rate * drive.stiffness * by_stress
    driven = by_stress * stress_rate(segment) * exp(drive.load * strain)
    driven += gradient[TEMPERATURE] * temperature_rate(segment)
    for i in range(state_rates.size):
        driven += gradient[POINT_SIZE + i] * state_rates[i]
    bend = aging + hardening + thinning + relaxing + driven
    bend_rate = thinning * bend + relaxing * (bend + drive.stiffness * rate / stress)
    if time > 0.0:
        bend_rate -= aging / time
    if strain > 0.0:
        bend_rate += hardening * (bend - rate / strain)
    return bend, bend_rate


@njit(cache=True)
def move_clock(
    update: Any,
    theta: Floats,
    beta: float,
    beta_slope: Floats,
    drive: Drive,
    segment: Segment,
    clock: Clock,
    work: Room,
) -> None:
    """Write into the room how the clock moves with each parameter, (2, P).

    Any motion gives right sensitivities, since they are exact for a moving clock; this one, by differences, keeps
    them as smooth in s as the strain itself.
    """
    work.clock_change[:] = 0.0
    if clock.tau == 0.0:
        if SMALLEST_BETA < beta < 1.0:
            work.clock_change[0] = beta_slope
        return
    nudged, value = theta.copy(), work.value.copy()
    for p in range(theta.size):
        step = _NUDGE * max(1.0, abs(theta[p])) if isfinite(theta[p]) else 0.0
        if step == 0.0:
            continue
        nudged[p] = theta[p] + step
        for v in range(value.size):
            value[v] = work.value[v] + step * work.change[v, p]
        moved, _ = choose_clock(update, nudged, beta, drive, segment, value, work)
        nudged[p] = theta[p]
        if moved.tau > 0.0 and moved.beta != 1.0 and clock.beta != 1.0:
            work.clock_change[0, p] = (moved.beta - clock.beta) / step
            work.clock_change[1, p] = (moved.tau - clock.tau) / step
