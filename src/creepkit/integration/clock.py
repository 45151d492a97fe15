"""Time transformations in which creep strain is nearly a straight line.

Steps are taken in a position s, from 0 to 1 over a segment of the load program:

    s = (y/L)^beta                                  from a virgin state (tau = 0),
    s = ((1 + y/tau)^beta - 1) / ((1 + L/tau)^beta - 1)     after a history (tau > 0),

with y the time since the segment began and L its length. Pure time hardening and strain hardening at constant
stress, before and after steps of stress, and Norton's relaxation are then exactly linear in s. Any clock is a right
one: error control decides the steps, the clock only makes them long.
"""

from __future__ import annotations

from math import exp, expm1, isfinite, log, log1p
from typing import NamedTuple

from numba import njit

SMALLEST_EXPONENT = 0.05
"""Exponents of time are not taken below this: t^m with m = -0.95, where the laws' bounds stop."""

_LARGEST_POWER = 12.0
"""Bound of |beta| ln(1 + L/tau): (1 + y/tau)^beta keeps some ten digits next to 1."""

_LONGEST_TAU = 1e6
"""A shift this much longer than the segment bends nothing within it."""


class TimeTransformation(NamedTuple):
    """start and length of the segment, s; beta, and tau in s (0: from a virgin state)."""

    start: float
    length: float
    beta: float
    tau: float


class TransformedTime(NamedTuple):
    """A time, s, and ln(dt/ds) there."""

    time: float
    log_pace: float


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
def _through(tau: float, beta: float, s: float, reach: float, inner: float, power: float, change: float) -> TransformedTime:
    """The part of a derivative of `moment` that goes through `reach`, which changes by `change`."""
    rise = s * change / (beta * inner)
    return TransformedTime(tau * exp(power) * rise, rise + change / reach - s * change / inner)


@njit(cache=True, error_model="numpy")
def linear_time(start: float, length: float) -> TimeTransformation:
    """Plain time: s proportional to it."""
    return TimeTransformation(start, length, 1.0, length)


@njit(cache=True, error_model="numpy")
def power_law_time(start: float, length: float, beta: float) -> TimeTransformation:
    """The clock of a segment that begins without creep strain; `beta` is the leading exponent of time."""
    return TimeTransformation(start, length, min(max(beta, SMALLEST_EXPONENT), 1.0), 0.0)


@njit(cache=True, error_model="numpy")
def shifted_power_law_time(start: float, length: float, bend: float, bend_rate: float) -> TimeTransformation:
    """The clock of a segment that begins after some creep.

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
