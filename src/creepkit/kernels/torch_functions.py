"""The functions of printed kernels for torch tensors: differentiable, with no NaN gradient at zero strain or time.

A branch that is not taken must still be finite, because its gradient is multiplied by zero, not dropped.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import Any

import torch

__all__ = [
    "asinh", "atan", "both", "choose", "cos", "cosh", "coth", "either", "erf", "exp", "exp_difference", "expm1",
    "floored", "heaviside", "larger", "log", "log1p", "log_cosh", "log_floor", "log_or_off", "log_rise", "log_sinh",
    "log_tanh", "power", "sin", "sinh", "smaller", "sqrt", "square", "tanh",
]  # fmt: skip

_LN2 = math.log(2.0)


def _on_tensor(function: Any) -> Any:
    def call(x: Any) -> Any:
        return function(_tensor(x))

    return call


def _tensor(x: Any, like: Any = None) -> Any:
    if isinstance(x, torch.Tensor):
        return x
    return torch.as_tensor(x, dtype=like.dtype if isinstance(like, torch.Tensor) else torch.float64)


asinh, atan, cos, cosh, erf = map(_on_tensor, (torch.asinh, torch.atan, torch.cos, torch.cosh, torch.erf))
exp, log, log1p, sin = map(_on_tensor, (torch.exp, torch.log, torch.log1p, torch.sin))
sinh, sqrt, square = map(_on_tensor, (torch.sinh, torch.sqrt, torch.square))


class _Floored(torch.autograd.Function):
    """max(x, floor) whose gradient does not feel the floor."""

    generate_vmap_rule = True

    @staticmethod
    def forward(x: Any, floor: float) -> Any:
        return torch.clamp(x, min=max(floor, torch.finfo(x.dtype).tiny))

    @staticmethod
    def setup_context(ctx: Any, inputs: Any, output: Any) -> None:
        pass

    @staticmethod
    def backward(ctx: Any, gradient: Any) -> Any:
        return gradient, None

    @staticmethod
    def jvp(ctx: Any, tangent: Any, _: Any) -> Any:
        return tangent.clone()


class _Expm1(torch.autograd.Function):
    """exp(x) - 1 whose gradient is exp(x); torch's own is the result plus 1, which has no digits left at x = -30."""

    generate_vmap_rule = True

    @staticmethod
    def forward(x: Any) -> Any:
        return torch.expm1(x)

    @staticmethod
    def setup_context(ctx: Any, inputs: Any, output: Any) -> None:
        ctx.save_for_backward(*inputs)
        ctx.save_for_forward(*inputs)

    @staticmethod
    def backward(ctx: Any, gradient: Any) -> Any:
        return gradient * torch.exp(ctx.saved_tensors[0])

    @staticmethod
    def jvp(ctx: Any, tangent: Any) -> Any:
        return tangent * torch.exp(ctx.saved_tensors[0])


class _ExpDifference(torch.autograd.Function):
    """exp(a) - exp(b); its parts by |a - b| and its sign would have no slope where a = b."""

    generate_vmap_rule = True

    @staticmethod
    def forward(a: Any, b: Any) -> Any:
        size = torch.exp(torch.maximum(a, b)) * torch.expm1(-torch.abs(a - b))
        return torch.copysign(size, a - b)

    @staticmethod
    def setup_context(ctx: Any, inputs: Any, output: Any) -> None:
        ctx.save_for_backward(*inputs)
        ctx.save_for_forward(*inputs)

    @staticmethod
    def backward(ctx: Any, gradient: Any) -> Any:
        a, b = ctx.saved_tensors
        return gradient * torch.exp(a), -gradient * torch.exp(b)

    @staticmethod
    def jvp(ctx: Any, along_a: Any, along_b: Any) -> Any:
        a, b = ctx.saved_tensors
        return along_a * torch.exp(a) - along_b * torch.exp(b)


def alike(outputs: Sequence[Any], inputs: Sequence[Any]) -> list[Any]:
    """Give every output the shape of all inputs together, and the floating type of the tensors among them."""
    tensors = [x for x in inputs if isinstance(x, torch.Tensor)]
    shape = torch.broadcast_shapes(*(t.shape for t in tensors))
    dtype = functools.reduce(torch.promote_types, {t.dtype for t in tensors}) if tensors else torch.float64
    return [_shaped(y, shape, dtype) for y in outputs]


def _shaped(y: Any, shape: torch.Size, dtype: torch.dtype) -> Any:
    if not isinstance(y, torch.Tensor):
        return torch.full((), y, dtype=dtype).expand(shape)
    y = y if y.dtype == dtype else y.to(dtype)
    return y if y.shape == shape else y.expand(shape)


def power(x: Any, y: Any) -> Any:
    """Return x to the y."""
    return torch.pow(_tensor(x, y), y)


def choose(condition: Any, a: Any, b: Any) -> Any:
    """Return a where the condition holds, else b."""
    a, b = _tensor(a, b), _tensor(b, a)
    return torch.where(torch.as_tensor(condition), a, b)


def both(a: Any, b: Any) -> Any:
    """Where both conditions hold."""
    return torch.logical_and(torch.as_tensor(a), torch.as_tensor(b))


def either(a: Any, b: Any) -> Any:
    """Where one of the conditions holds."""
    return torch.logical_or(torch.as_tensor(a), torch.as_tensor(b))


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


def log_or_off(x: Any) -> Any:
    """Natural logarithm; minus infinity, with slope 0, at 0, which switches a rate coefficient off."""
    x = _tensor(x)
    return torch.where(x == 0, -torch.inf, torch.log(torch.where(x == 0, 1.0, x)))


def floored(x: Any, floor: float) -> Any:
    """max(x, floor) with slope 1 on both sides: the gradient at zero is the one-sided gradient at the floor."""
    return _Floored.apply(_tensor(x), floor)


def expm1(x: Any) -> Any:
    """exp(x) - 1."""
    return _Expm1.apply(_tensor(x))


def log_floor(x: Any, floor: float) -> Any:
    """ln max(x, floor)."""
    return torch.log(floored(x, floor))


def log_sinh(x: Any) -> Any:
    """Return ln sinh(x), x > 0."""
    x = floored(x, 1e-30)
    return x + torch.log(expm1(-2.0 * x) * -0.5)


def log_cosh(x: Any) -> Any:
    """Return ln cosh(x)."""
    x, _ = _size_and_sign(x)
    return x + torch.log1p(torch.exp(-2.0 * x)) - _LN2


def log_rise(x: Any) -> Any:
    """ln(1 - exp(-x)), x > 0."""
    x = floored(x, 1e-30)
    late = x > _LN2
    near, far = torch.where(late, _LN2, x), torch.where(late, x, _LN2)
    return torch.where(late, torch.log1p(-torch.exp(-far)), torch.log(-torch.expm1(-near)))


def log_tanh(x: Any) -> Any:
    """Return ln tanh(x), x > 0."""
    return log_rise(2.0 * x) - torch.log1p(torch.exp(-2.0 * x))


def tanh(x: Any) -> Any:
    """tanh(x), with a gradient that keeps its digits where tanh(x) is nearly 1."""
    x, sign = _size_and_sign(x)
    return sign * -expm1(-2.0 * x) / (1.0 + torch.exp(-2.0 * x))


def coth(x: Any) -> Any:
    """coth(x), x > 0."""
    return 1.0 / tanh(floored(x, 1e-30))


def exp_difference(a: Any, b: Any) -> Any:
    """exp(a) - exp(b) without cancellation, differentiable where a = b."""
    return _ExpDifference.apply(_tensor(a, b), _tensor(b, a))


def _size_and_sign(x: Any) -> tuple[Any, Any]:
    """|x|, with slope 1 at 0, and the sign of x."""
    x = _tensor(x)
    sign = torch.where(x < 0, -1.0, 1.0).to(x.dtype)
    return x * sign, sign
