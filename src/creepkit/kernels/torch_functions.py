"""The functions of printed kernels for torch tensors."""

from __future__ import annotations

import math
from typing import Any

import torch
from torch import asinh, atan, cos, cosh, erf, exp, expm1, log, log1p, sin, sinh, sqrt, square, tanh

__all__ = [
    "asinh", "atan", "both", "choose", "cos", "cosh", "coth", "either", "erf", "exp", "exp_difference", "expm1",
    "floored", "heaviside", "larger", "log", "log1p", "log_cosh", "log_floor", "log_or_off", "log_rise", "log_sinh",
    "log_tanh", "power", "sin", "sinh", "smaller", "sqrt", "square", "tanh",
]  # fmt: skip

both, either = torch.logical_and, torch.logical_or
_LN2 = math.log(2.0)


def _tensor(x: Any, like: Any) -> Any:
    return x if isinstance(x, torch.Tensor) else torch.as_tensor(x, dtype=getattr(like, "dtype", torch.float64))


def log_or_off(x: Any) -> Any:
    """Natural logarithm; minus infinity, with slope 0, at 0, which switches a rate coefficient off."""
    x = _tensor(x, x)
    return torch.where(x == 0, -torch.inf, torch.log(torch.where(x == 0, 1.0, x)))


def power(x: Any, y: Any) -> Any:
    """Return x to the y."""
    return torch.pow(_tensor(x, y), y)


def choose(condition: Any, a: Any, b: Any) -> Any:
    """Return a where the condition holds, else b."""
    return torch.where(condition, _tensor(a, b), _tensor(b, a))


def larger(a: Any, b: Any) -> Any:
    """max(a, b)."""
    return torch.maximum(_tensor(a, b), _tensor(b, a))


def smaller(a: Any, b: Any) -> Any:
    """min(a, b)."""
    return torch.minimum(_tensor(a, b), _tensor(b, a))


def heaviside(x: Any) -> Any:
    """1 where x > 0, else 0."""
    return (x > 0).to(x.dtype)


def floored(x: Any, floor: float) -> Any:
    """max(x, floor), and no less than the smallest normal number of the tensor's type."""
    return torch.clamp(x, min=max(floor, torch.finfo(x.dtype).tiny))


def log_floor(x: Any, floor: float) -> Any:
    """ln max(x, floor)."""
    return torch.log(floored(x, floor))


def log_sinh(x: Any) -> Any:
    """Return ln sinh(x), x > 0."""
    x = torch.clamp(x, min=1e-30)
    return x + torch.log(-0.5 * torch.expm1(-2.0 * x))


def log_cosh(x: Any) -> Any:
    """Return ln cosh(x)."""
    x = torch.abs(x)
    small = torch.log1p(2.0 * torch.square(torch.sinh(0.5 * torch.clamp(x, max=1.0))))
    return torch.where(x < 1.0, small, x + torch.log1p(torch.exp(-2.0 * x)) - _LN2)


def log_rise(x: Any) -> Any:
    """ln(1 - exp(-x)), x > 0."""
    x = torch.clamp(x, min=1e-30)
    near, far = torch.clamp(x, max=_LN2), torch.clamp(x, min=_LN2)
    return torch.where(x > _LN2, torch.log1p(-torch.exp(-far)), torch.log(-torch.expm1(-near)))


def log_tanh(x: Any) -> Any:
    """Return ln tanh(x), x > 0."""
    return log_rise(2.0 * x) - torch.log1p(torch.exp(-2.0 * x))


def coth(x: Any) -> Any:
    """coth(x), x > 0."""
    return 1.0 / torch.tanh(torch.clamp(x, min=1e-30))


def exp_difference(a: Any, b: Any) -> Any:
    """exp(a) - exp(b) without cancellation."""
    difference = a - b
    return -torch.sign(difference) * torch.exp(torch.maximum(a, b)) * torch.expm1(-torch.abs(difference))
