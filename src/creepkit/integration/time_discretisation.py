"""Time discretisation of creep: Runge-Kutta tableaux, segments of a load program, and time transformations.

The tableaux are diagonally implicit and stiffly accurate. Within each segment of the load program steps are taken in a
transformed time in which creep strain is nearly a straight line.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import exp, expm1, isfinite, log, log1p
from typing import NamedTuple

import numpy as np
from numba import njit

from creepkit.arrays import Floats
from creepkit.integration.time_transformation import SMALLEST_EXPONENT, TimeTransformation, TransformedTime
from creepkit.records import Program

__all__ = [
    "SDIRK2",
    "SDIRK4",
    "SMALLEST_EXPONENT",
    "Segment",
    "Tableau",
    "TimeTransformation",
    "TransformedTime",
    "linear_time",
    "merge_programs",
    "position",
    "power_law_time",
    "segment_from_row",
    "shifted_power_law_time",
    "stress_rate",
    "temperature_rate",
    "transformation_derivatives",
    "transformed_time",
]


class Tableau(NamedTuple):
    """A singly diagonally implicit Runge-Kutta method whose last stage is the end of the step.

    a : (stages, stages) lower triangular, constant diagonal gamma; its last row holds the weights.
    c : (stages,) places of the stages in the step.
    error : (stages,) weights less the embedded weights: error = h sum error_i k_i.
    dense : (stages, degree) b_i(x) = sum_q dense_iq x^(q+1), the weights up to the share x of the step.
    order : of the step; error_order : of the embedded solution; dense_order : of the dense output.
    """

    a: Floats
    c: Floats
    error: Floats
    dense: Floats
    order: int
    error_order: int
    dense_order: int

    @property
    def gamma(self) -> float:
        """The constant diagonal."""
        return float(self.a[0, 0])

    @property
    def stages(self) -> int:
        """Number of stages."""
        return int(self.c.size)


def _tableau(
    rows: Sequence[Sequence[float]],
    embedded: Sequence[float],
    dense: Sequence[Sequence[float]],
    orders: tuple[int, int, int],
) -> Tableau:
    a = np.array([list(row) + [0.0] * (len(rows) - len(row)) for row in rows])
    return Tableau(a, a.sum(axis=1), a[-1] - np.array(embedded), np.array(dense), *orders)


_ALEXANDER = 1.0 - np.sqrt(0.5)


SDIRK2 = _tableau(
    rows=[[_ALEXANDER], [1.0 - _ALEXANDER, _ALEXANDER]],
    embedded=[1.0, 0.0],
    dense=[[np.sqrt(2.0), -np.sqrt(0.5)], [1.0 - np.sqrt(2.0), np.sqrt(0.5)]],
    orders=(2, 1, 2),
)
"""Two stages, order 2, L-stable: Alexander (1977), SIAM J. Numer. Anal. 14, 1006.

The embedded solution is the first stage's slope over the whole step; the dense output is the one quadratic that
meets the conditions of order 2 at every place.
"""


SDIRK4 = _tableau(
    rows=[
        [1 / 4],
        [1 / 2, 1 / 4],
        [17 / 50, -1 / 25, 1 / 4],
        [371 / 1360, -137 / 2720, 15 / 544, 1 / 4],
        [25 / 24, -49 / 48, 125 / 16, -85 / 12, 1 / 4],
    ],
    embedded=[59 / 48, -17 / 96, 225 / 32, -85 / 12, 0.0],
    dense=[
        [11 / 3, -463 / 72, 217 / 36, -20 / 9],
        [11 / 2, -385 / 16, 661 / 24, -10.0],
        [-125 / 18, 20125 / 432, -8875 / 216, 250 / 27],
        [0.0, -85 / 4, 85 / 6, 0.0],
        [-11 / 9, 557 / 108, -359 / 54, 80 / 27],
    ],
    orders=(4, 3, 3),
)
"""Five stages, order 4 with embedded order 3, L-stable: Hairer and Wanner, Solving ODEs II, section IV.6, (6.16-6.17).

The dense output is the one quartic that meets the conditions of order 3, and of order 4 for quadrature, everywhere.
"""


class Segment(NamedTuple):
    """start and end, s; driving stress, MPa, and temperature, K, at both."""

    start: float
    end: float
    stress: float
    end_stress: float
    temperature: float
    end_temperature: float


@njit(cache=True, error_model="numpy")
def segment_from_row(row: Floats) -> Segment:
    """A segment from its row of six numbers."""
    return Segment(row[0], row[1], row[2], row[3], row[4], row[5])


@njit(cache=True, error_model="numpy")
def stress_rate(segment: Segment) -> float:
    """Slope of the driving stress, MPa/s."""
    return (segment.end_stress - segment.stress) / (segment.end - segment.start)


@njit(cache=True, error_model="numpy")
def temperature_rate(segment: Segment) -> float:
    """Slope of the temperature, K/s."""
    return (segment.end_temperature - segment.temperature) / (segment.end - segment.start)


def merge_programs(*programs: Program, end: float) -> Floats:
    """Merge programs from 0 to `end` (s) into segments, (segments, 2 + 2 programs); every breakpoint is a boundary.

    Columns: start and end, s, then the values of each program at both.
    """
    marks = np.concatenate([*(program.times for program in programs), [0.0, end]])
    marks = np.unique(marks[marks <= end])
    starts, ends = marks[:-1], marks[1:]
    columns = [starts, ends]
    for program in programs:
        columns += [program.at(starts), _just_before(program, ends)]
    return np.ascontiguousarray(np.stack(columns, axis=1))


def _just_before(program: Program, times: Floats) -> Floats:
    """Values of a program as each time is approached from the left."""
    after = np.searchsorted(program.times, times, side="left")
    before = np.maximum(after - 1, 0)
    after = np.minimum(after, program.times.size - 1)
    width = program.times[after] - program.times[before]
    share = np.divide(times - program.times[before], width, out=np.zeros_like(times), where=width > 0)
    values = program.values
    return np.asarray(values[before] + np.minimum(share, 1.0) * (values[after] - values[before]))


_LARGEST_POWER = 12.0
"""Bound of |beta| ln(1 + L/tau): (1 + y/tau)^beta keeps some ten digits next to 1."""


_LONGEST_TAU = 1e6
"""A shift this much longer than the segment bends nothing within it."""


@njit(cache=True, error_model="numpy")
def transformed_time(clock: TimeTransformation, s: float) -> TransformedTime:
    """Time and pace at position `s` > 0."""
    if clock.tau == 0.0:
        logarithm = log(s) / clock.beta
        elapsed = clock.length * exp(logarithm)
        return TransformedTime(clock.start + elapsed, log(clock.length / clock.beta) + logarithm - log(s))
    reach = expm1(clock.beta * log1p(clock.length / clock.tau))
    grown = log1p(s * reach)
    power = grown / clock.beta
    elapsed = clock.tau * expm1(power)
    return TransformedTime(clock.start + elapsed, log(clock.tau * reach / clock.beta) + power - grown)


@njit(cache=True, error_model="numpy")
def position(clock: TimeTransformation, time: float) -> float:
    """Position of a time in the segment."""
    elapsed = time - clock.start
    if elapsed <= 0.0:
        return 0.0
    if clock.tau == 0.0:
        return float((elapsed / clock.length) ** clock.beta)
    reach = expm1(clock.beta * log1p(clock.length / clock.tau))
    return expm1(clock.beta * log1p(elapsed / clock.tau)) / reach


@njit(cache=True, error_model="numpy")
def transformation_derivatives(clock: TimeTransformation, s: float) -> tuple[TransformedTime, TransformedTime]:
    """Derivatives of `moment` with respect to beta and to tau at a fixed position."""
    beta, tau, length = clock.beta, clock.tau, clock.length
    if tau == 0.0:
        slope = -log(s) / beta**2
        elapsed = length * exp(log(s) / beta)
        return TransformedTime(elapsed * slope, slope - 1.0 / beta), TransformedTime(0.0, 0.0)
    ratio = log1p(length / tau)
    reach = expm1(beta * ratio)
    inner = 1.0 + s * reach
    power = log1p(s * reach) / beta
    by_beta = _through(tau, beta, s, reach, inner, power, ratio * (1.0 + reach))
    fall = -length / (tau * (tau + length))
    by_tau = _through(tau, beta, s, reach, inner, power, beta * (1.0 + reach) * fall)
    shrink = power / beta
    return (
        TransformedTime(by_beta.time - tau * exp(power) * shrink, by_beta.log_pace - shrink - 1.0 / beta),
        TransformedTime(by_tau.time + expm1(power), by_tau.log_pace + 1.0 / tau),
    )


@njit(cache=True, error_model="numpy")
def _through(
    tau: float, beta: float, s: float, reach: float, inner: float, power: float, change: float
) -> TransformedTime:
    """The part of a derivative of `moment` that goes through `reach`, which changes by `change`."""
    rise = s * change / (beta * inner)
    return TransformedTime(tau * exp(power) * rise, rise + change / reach - s * change / inner)


@njit(cache=True, error_model="numpy")
def linear_time(start: float, length: float) -> TimeTransformation:
    """Plain time: s proportional to it."""
    return TimeTransformation(start, length, 1.0, length)


@njit(cache=True, error_model="numpy")
def power_law_time(start: float, length: float, beta: float) -> TimeTransformation:
    """The time transformation of a segment that begins without creep strain; `beta` is the leading exponent of time."""
    return TimeTransformation(start, length, min(max(beta, SMALLEST_EXPONENT), 1.0), 0.0)


@njit(cache=True, error_model="numpy")
def shifted_power_law_time(start: float, length: float, bend: float, bend_rate: float) -> TimeTransformation:
    """The time transformation of a segment that begins after some creep.

    With p'' = r p', a curve (1 + y/tau)^beta has r = (beta - 1)/(tau + y), so r and its rate give beta and tau.
    """
    if not (isfinite(bend) and isfinite(bend_rate)) or bend >= 0.0 or bend_rate <= 0.0:
        return linear_time(start, length)
    tau = -bend / bend_rate
    beta = 1.0 + bend * tau
    if not 1e-30 * length < tau < _LONGEST_TAU * length:
        return linear_time(start, length)
    bound = _LARGEST_POWER / log1p(length / tau)
    beta = min(max(beta, -bound), bound)
    if abs(beta) < 1e-3:
        beta = 1e-3
    return TimeTransformation(start, length, beta, tau)
