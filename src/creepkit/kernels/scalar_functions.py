"""The functions of printed kernels for Python numbers: what exported modules take along."""

from __future__ import annotations

from math import asinh, atan, cos, cosh, erf, exp, expm1, log, log1p, sin, sinh, sqrt, tanh  # noqa: F401
from typing import Any

_LN2 = log(2.0)


def power(x: Any, y: Any) -> Any:
    """Return x to the y."""
    return x**y


def square(x: Any) -> Any:
    """Return x times x."""
    return x * x


def choose(condition: Any, a: Any, b: Any) -> Any:
    """Return a where the condition holds, else b."""
    return a if condition else b


def both(a: Any, b: Any) -> Any:
    """Whether both conditions hold."""
    return a and b


def either(a: Any, b: Any) -> Any:
    """Whether one of the conditions holds."""
    return a or b


def larger(a: Any, b: Any) -> Any:
    """max(a, b); NaN when either is."""
    return a if a >= b or a != a else b


def smaller(a: Any, b: Any) -> Any:
    """min(a, b); NaN when either is."""
    return a if a <= b or a != a else b


def heaviside(x: Any) -> Any:
    """1 where x > 0, else 0."""
    return 1.0 if x > 0.0 else 0.0


def floored(x: Any, floor: Any) -> Any:
    """max(x, floor); NaN when x is."""
    return floor if x < floor else x


def log_floor(x: Any, floor: Any) -> Any:
    """ln max(x, floor)."""
    return log(floor if x < floor else x)


def log_sinh(x: Any) -> Any:
    """Return ln sinh(x), x > 0."""
    y = 1e-30 if x < 1e-30 else x
    return y + log(-0.5 * expm1(-2.0 * y))


def log_cosh(x: Any) -> Any:
    """Return ln cosh(x)."""
    y = abs(x)
    return log1p(2.0 * sinh(0.5 * y) ** 2) if y < 1.0 else y + log1p(exp(-2.0 * y)) - _LN2


def log_rise(x: Any) -> Any:
    """ln(1 - exp(-x)), x > 0."""
    y = 1e-30 if x < 1e-30 else x
    return log1p(-exp(-y)) if y > _LN2 else log(-expm1(-y))


def log_tanh(x: Any) -> Any:
    """Return ln tanh(x), x > 0."""
    y = 1e-30 if x < 1e-30 else x
    tail = exp(-2.0 * y)
    return (log1p(-tail) if 2.0 * y > _LN2 else log(-expm1(-2.0 * y))) - log1p(tail)


def coth(x: Any) -> Any:
    """coth(x), x > 0."""
    return 1.0 / tanh(1e-30 if x < 1e-30 else x)


def exp_difference(a: Any, b: Any) -> Any:
    """exp(a) - exp(b) without cancellation."""
    if a >= b:
        return exp(a) * -expm1(b - a)
    return exp(b) * expm1(a - b)
