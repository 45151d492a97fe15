"""The functions of printed kernels for NumPy arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy import cos, cosh, exp, expm1, log, sin, sinh, sqrt, tanh

__all__ = [
    "absolute", "atan", "choose", "cos", "cosh", "coth", "erf", "exp", "exp_difference", "expm1", "floored", "heaviside",
    "larger", "log", "log_floor", "log_sinh", "power", "sin", "sinh", "smaller", "sqrt", "tanh",
]  # fmt: skip

absolute, atan, choose, larger, power, smaller = np.absolute, np.arctan, np.where, np.maximum, np.power, np.minimum


def erf(x: Any) -> Any:
    """Error function."""
    from scipy.special import erf as error_function

    return error_function(x)


def heaviside(x: Any) -> Any:
    """1 where x > 0, else 0."""
    return np.where(np.asarray(x) > 0, 1.0, 0.0)


def floored(x: Any, floor: float) -> Any:
    """max(x, floor)."""
    return np.maximum(x, floor)


def log_floor(x: Any, floor: float) -> Any:
    """ln max(x, floor)."""
    return np.log(np.maximum(x, floor))


def log_sinh(x: Any) -> Any:
    """Return ln sinh(x), x > 0."""
    x = np.maximum(x, 1e-30)
    return x + np.log(-0.5 * np.expm1(-2.0 * x))


def coth(x: Any) -> Any:
    """coth(x), x > 0."""
    return 1.0 / np.tanh(np.maximum(x, 1e-30))


def exp_difference(a: Any, b: Any) -> Any:
    """exp(a) - exp(b) without cancellation."""
    high = np.maximum(a, b)
    return np.copysign(np.exp(high) * -np.expm1(np.minimum(a, b) - high), np.subtract(a, b))
