"""The functions of printed kernels for scalars in numba-compiled code."""

from __future__ import annotations

from math import cos, cosh, erf, exp, expm1, log, sin, sinh, sqrt, tanh
from math import atan as atan
from typing import Any

from numba import njit

__all__ = [
    "absolute", "atan", "choose", "cos", "cosh", "coth", "erf", "exp", "exp_difference", "expm1", "floored", "heaviside",
    "larger", "log", "log_floor", "log_sinh", "power", "sin", "sinh", "smaller", "sqrt", "tanh",
]  # fmt: skip

_inlined = njit(cache=True, error_model="numpy", inline="always")


@_inlined
def absolute(x: Any) -> Any:
    """|x|."""
    return abs(x)


@_inlined
def power(x: Any, y: Any) -> Any:
    """Return x to the y."""
    return x**y


@_inlined
def choose(condition: Any, a: Any, b: Any) -> Any:
    """Return a where the condition holds, else b."""
    return a if condition else b


@_inlined
def larger(a: Any, b: Any) -> Any:
    """max(a, b)."""
    return a if a >= b else b


@_inlined
def smaller(a: Any, b: Any) -> Any:
    """min(a, b)."""
    return a if a <= b else b


@_inlined
def heaviside(x: Any) -> Any:
    """1 where x > 0, else 0."""
    return 1.0 if x > 0.0 else 0.0


@_inlined
def floored(x: Any, floor: Any) -> Any:
    """max(x, floor)."""
    return x if x > floor else floor


@_inlined
def log_floor(x: Any, floor: Any) -> Any:
    """ln max(x, floor)."""
    return log(x if x > floor else floor)


@_inlined
def log_sinh(x: Any) -> Any:
    """Return ln sinh(x), x > 0."""
    y = x if x > 1e-30 else 1e-30
    return y + log(-0.5 * expm1(-2.0 * y))


@_inlined
def coth(x: Any) -> Any:
    """coth(x), x > 0."""
    return 1.0 / tanh(x if x > 1e-30 else 1e-30)


@_inlined
def exp_difference(a: Any, b: Any) -> Any:
    """exp(a) - exp(b) without cancellation."""
    if a >= b:
        return exp(a) * -expm1(b - a)
    return exp(b) * expm1(a - b)
