"""The functions of printed kernels for torch tensors: differentiable, with no NaN gradient at zero strain or time."""

from __future__ import annotations

from typing import Any

import torch

__all__ = [
    "absolute", "atan", "choose", "cos", "cosh", "coth", "erf", "exp", "exp_difference", "expm1", "floored", "heaviside",
    "larger", "log", "log_floor", "log_sinh", "power", "sin", "sinh", "smaller", "sqrt", "tanh",
]  # fmt: skip


def _on_tensor(function: Any) -> Any:
    def call(x: Any) -> Any:
        return function(_tensor(x))

    return call


def _tensor(x: Any, like: Any = None) -> Any:
    if isinstance(x, torch.Tensor):
        return x
    return torch.as_tensor(x, dtype=like.dtype if isinstance(like, torch.Tensor) else torch.float64)


absolute, atan, cos, cosh, erf = map(_on_tensor, (torch.abs, torch.atan, torch.cos, torch.cosh, torch.erf))
exp, expm1, log, sin, sinh = map(_on_tensor, (torch.exp, torch.expm1, torch.log, torch.sin, torch.sinh))
sqrt, tanh = map(_on_tensor, (torch.sqrt, torch.tanh))
power = torch.pow


def choose(condition: Any, a: Any, b: Any) -> Any:
    """Return a where the condition holds, else b."""
    return torch.where(condition, a, b)


def larger(a: Any, b: Any) -> Any:
    """max(a, b), with the slope of one of them at a tie."""
    a, b = _tensor(a, b), _tensor(b, a)
    return torch.where(a >= b, a, b)


def smaller(a: Any, b: Any) -> Any:
    """min(a, b), with the slope of one of them at a tie."""
    a, b = _tensor(a, b), _tensor(b, a)
    return torch.where(a <= b, a, b)


def heaviside(x: Any) -> Any:
    """1 where x > 0, else 0."""
    x = _tensor(x)
    return (x > 0).to(x.dtype)


def floored(x: Any, floor: float) -> Any:
    """max(x, floor) with slope 1 on both sides: the gradient at zero is the one-sided gradient at the floor."""
    x = _tensor(x)
    return torch.where(x < floor, x - x.detach() + floor, x)


def log_floor(x: Any, floor: float) -> Any:
    """ln max(x, floor)."""
    return torch.log(floored(x, floor))


def log_sinh(x: Any) -> Any:
    """Return ln sinh(x), x > 0."""
    x = floored(x, 1e-30)
    return x + torch.log(-0.5 * torch.expm1(-2.0 * x))


def coth(x: Any) -> Any:
    """coth(x), x > 0."""
    return 1.0 / torch.tanh(floored(x, 1e-30))


def exp_difference(a: Any, b: Any) -> Any:
    """exp(a) - exp(b) without cancellation, differentiable where a = b."""
    a, b = _tensor(a, b), _tensor(b, a)
    ordered = a >= b
    high, low = torch.where(ordered, a, b), torch.where(ordered, b, a)
    difference = torch.exp(high) * -torch.expm1(low - high)
    return torch.where(ordered, difference, -difference)
