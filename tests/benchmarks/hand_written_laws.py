"""The laws that ship, written by hand: the rate, and the rate with every derivative, as one would for one target.

Each factory takes a module with exp, log, sinh, tanh (numpy, torch or math) and returns functions of stress, strain,
time and the author's parameters. Derivatives to parameters of log scale are those to their logarithm, as in kernels.
"""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType
from typing import Any

Pair = tuple[Callable[..., Any], Callable[..., Any]]


def norton(m: ModuleType) -> Pair:
    """A s^n."""
    log = m.log

    def rate(s, e, t, A, n):
        return A * s**n

    def derivatives(s, e, t, A, n):
        f = A * s**n
        return f, n * f / s, f, f * log(s)

    return rate, derivatives


def strain_hardening(m: ModuleType) -> Pair:
    """A s^n e^k."""
    log = m.log

    def rate(s, e, t, A, n, k):
        return A * s**n * e**k

    def derivatives(s, e, t, A, n, k):
        f = A * s**n * e**k
        return f, n * f / s, k * f / e, f, f * log(s), f * log(e)

    return rate, derivatives


def time_hardening(m: ModuleType) -> Pair:
    """A s^n t^k."""
    log = m.log

    def rate(s, e, t, A, n, k):
        return A * s**n * t**k

    def derivatives(s, e, t, A, n, k):
        f = A * s**n * t**k
        return f, n * f / s, k * f / t, f, f * log(s), f * log(t)

    return rate, derivatives


def hyperbolic_sine(m: ModuleType) -> Pair:
    """A sinh(s/B)^n."""
    log, sinh, tanh = m.log, m.sinh, m.tanh

    def rate(s, e, t, A, n, B):
        return A * sinh(s / B) ** n

    def derivatives(s, e, t, A, n, B):
        x = s / B
        sine = sinh(x)
        f = A * sine**n
        slope = n * f / tanh(x)
        return f, slope / B, f, f * log(sine), -x * slope

    return rate, derivatives


def drifting_exponent(m: ModuleType) -> Pair:
    """A s^n(t) e^k, n(t) = n_inf + (C + n_0 - n_inf) exp(-t/d) - C exp(-t/r)."""
    log, exp = m.log, m.exp

    def rate(s, e, t, A, n_0, n_inf, C, d, r, k):
        n = n_inf + (C + n_0 - n_inf) * exp(-t / d) - C * exp(-t / r)
        return A * s**n * e**k

    def derivatives(s, e, t, A, n_0, n_inf, C, d, r, k):
        fast, slow = exp(-t / d), exp(-t / r)
        span = C + n_0 - n_inf
        n = n_inf + span * fast - C * slow
        f = A * s**n * e**k
        g = f * log(s)
        by_time = g * (C * slow / r - span * fast / d)
        by_d, by_r = g * span * fast * t / d**2, -g * C * slow * t / r**2
        return f, n * f / s, k * f / e, by_time, f, g * fast, g * (1 - fast), g * (fast - slow), by_d, by_r, f * log(e)

    return rate, derivatives


def combined(m: ModuleType) -> Pair:
    """A_1 sinh(s/B)^n_1 + A_2 s^n_2 e^m_1 + A_3 s^n_3 t^m_2."""
    log, sinh, tanh = m.log, m.sinh, m.tanh

    def rate(s, e, t, A_1, n_1, B, A_2, n_2, m_1, A_3, n_3, m_2):
        return A_1 * sinh(s / B) ** n_1 + A_2 * s**n_2 * e**m_1 + A_3 * s**n_3 * t**m_2

    def derivatives(s, e, t, A_1, n_1, B, A_2, n_2, m_1, A_3, n_3, m_2):
        x = s / B
        sine = sinh(x)
        f = A_1 * sine**n_1
        g = A_2 * s**n_2 * e**m_1
        h = A_3 * s**n_3 * t**m_2
        slope, log_s = n_1 * f / tanh(x), log(s)
        by_stress = slope / B + (n_2 * g + n_3 * h) / s
        to_point = f + g + h, by_stress, m_1 * g / e, m_2 * h / t
        return *to_point, f, f * log(sine), -x * slope, g, g * log_s, g * log(e), h, h * log_s, h * log(t)

    return rate, derivatives


LAWS: dict[str, Callable[[ModuleType], Pair]] = {
    "norton": norton,
    "strain-hardening": strain_hardening,
    "time-hardening": time_hardening,
    "hyperbolic-sine": hyperbolic_sine,
    "drifting-exponent": drifting_exponent,
    "combined": combined,
}
"""{name in the registry: factory}."""
