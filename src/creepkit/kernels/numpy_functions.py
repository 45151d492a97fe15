"""The NumPy target: the functions that printed kernels call, and kernels as functions of arrays."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy import cos, cosh, exp, expm1, log, log1p, sin, sinh, sqrt, square, tanh  # noqa: F401

asinh, atan, choose, power = np.arcsinh, np.arctan, np.where, np.power


both, either, larger, smaller = np.logical_and, np.logical_or, np.maximum, np.minimum


_LN2 = float(np.log(2.0))


def log_or_off(x: Any) -> Any:
    """Natural logarithm; minus infinity at 0, which switches a rate coefficient off."""
    with np.errstate(divide="ignore"):
        return np.log(x)


def erf(x: Any) -> Any:
    """Error function."""
    from scipy.special import erf as error_function

    return error_function(x)


def heaviside(x: Any) -> Any:
    """1 where x > 0, else 0."""
    return np.where(np.asarray(x) > 0, 1.0, 0.0)


def floored(x: Any, floor: float) -> Any:
    """max(x, floor), and no less than the smallest normal number of single precision where x has it."""
    if floor < 1e-37 and getattr(x, "dtype", None) == np.float32:
        floor = 1e-37
    return np.maximum(x, floor)


def log_floor(x: Any, floor: float) -> Any:
    """ln max(x, floor)."""
    return np.log(floored(x, floor))


def log_sinh(x: Any) -> Any:
    """Return ln sinh(x), x > 0."""
    x = np.maximum(x, 1e-30)
    y = np.expm1(-2.0 * x)
    y *= -0.5
    y = np.log(y)
    y += x
    return y


def log_cosh(x: Any) -> Any:
    """Return ln cosh(x)."""
    x = np.absolute(x)
    small = np.log1p(2.0 * np.sinh(0.5 * np.minimum(x, 1.0)) ** 2)
    return np.where(x < 1.0, small, x + np.log1p(np.exp(-2.0 * x)) - _LN2)


def log_rise(x: Any) -> Any:
    """ln(1 - exp(-x)), x > 0."""
    x = np.maximum(x, 1e-30)
    return np.where(x > _LN2, np.log1p(-np.exp(-np.maximum(x, _LN2))), np.log(-np.expm1(-np.minimum(x, _LN2))))


def log_tanh(x: Any) -> Any:
    """Return ln tanh(x), x > 0."""
    return log_rise(2.0 * x) - np.log1p(np.exp(-2.0 * x))


def coth(x: Any) -> Any:
    """coth(x), x > 0."""
    return 1.0 / np.tanh(np.maximum(x, 1e-30))


def exp_difference(a: Any, b: Any) -> Any:
    """exp(a) - exp(b) without cancellation."""
    high, size = np.maximum(a, b), np.minimum(a, b)
    size -= high
    size = np.expm1(size)
    size *= np.exp(high)
    return np.copysign(size, np.subtract(a, b))


FUNCTIONS = {name: value for name, value in globals().items() if not name.startswith("_")}
"""What printed text calls."""


def broadcast_functions(printed: Mapping[str, Callable[..., Any]], width: int) -> dict[str, Callable[..., list[Any]]]:
    """Return the printed entries with results that have the shape of all arguments together."""
    return {name: _broadcast_results(entry) for name, entry in printed.items()}


def as_array(value: Any) -> Any:
    """A number or array, from what a user gives."""
    return value if isinstance(value, float) else np.asarray(value)


def _broadcast_results(entry: Callable[..., Any]) -> Callable[..., list[Any]]:
    def call(*arguments: Any) -> list[Any]:
        with np.errstate(over="ignore", under="ignore", divide="ignore"):
            results = entry(*arguments)
        shapes = {getattr(x, "shape", ()) for x in arguments} - {()}
        shape = shapes.pop() if len(shapes) == 1 else np.broadcast_shapes(*shapes)
        numbers = {y: np.broadcast_to(y, shape) for y in {y for y in results if type(y) is float}}
        return [numbers[y] if type(y) is float else _broadcast(y, shape) for y in results]

    return call


def _broadcast(y: Any, shape: tuple[int, ...]) -> Any:
    return y if getattr(y, "shape", ()) == shape else np.broadcast_to(y, shape)
