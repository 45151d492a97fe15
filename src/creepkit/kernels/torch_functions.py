"""The torch target: the functions that printed kernels call, and kernels with the derivatives that sympy found.

Autograd does not go through the printed text: no derivative is NaN where a power is floored, none loses its digits
between branches. torch.func (vmap, grad, jacfwd, jacrev, hessian) works.
"""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import torch
from torch import asinh, atan, cos, cosh, erf, exp, expm1, log, log1p, sin, sinh, sqrt, square, tanh  # noqa: F401

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


FUNCTIONS = {name: value for name, value in globals().items() if not name.startswith("_")}
"""What printed text calls."""


TensorFunction = Callable[..., Sequence[Any]]


def broadcast_functions(printed: Mapping[str, TensorFunction], width: int) -> dict[str, TensorFunction]:
    """Return the printed entries with results of one shape and type; the first `width` inputs are the point."""
    rate, log_rate = (printed[name] for name in ("rate", "log_rate"))
    sensitivities, log_sensitivities = (printed[name] for name in ("sensitivity", "log_sensitivity"))
    return {
        "rate": _with_common_type(with_derivatives(rate, sensitivities, width)),
        "log_rate": _with_common_type(with_derivatives(log_rate, log_sensitivities, width)),
        "sensitivity": _with_common_type(lambda *inputs: _broadcast_results(sensitivities(*inputs), inputs)),
    }


def as_array(value: Any) -> Any:
    """A number or tensor, from what a user gives."""
    return value if isinstance(value, (float, torch.Tensor)) else torch.as_tensor(value)


def with_derivatives(values: TensorFunction, derivatives: TensorFunction, width: int) -> TensorFunction:
    """Return values(*tensors) as a function whose derivatives are those that derivatives(*tensors) gives.

    derivatives : gives the results again, then their derivatives to the first `width` inputs, result by result, then
        those to the rest, as `sensitivity` of kernels.interface does.
    """

    def by_input(inputs: Sequence[Any], results: int) -> list[Sequence[Any]]:
        """For each input, the derivatives of every result to it; 0.0 where there is none."""
        results_by_input = derivatives(*inputs)
        rest = len(inputs) - width
        to_point, to_rest = results_by_input[results : results * (1 + width)], results_by_input[results * (1 + width) :]
        return [to_point[k::width] for k in range(width)] + [to_rest[k::rest] for k in range(rest)]

    class WithDerivatives(torch.autograd.Function):
        generate_vmap_rule = True

        @staticmethod
        def forward(*inputs: Any) -> tuple[Any, ...]:
            return tuple(_broadcast_results(values(*inputs), inputs))

        @staticmethod
        def setup_context(ctx: Any, inputs: Any, output: Any) -> None:
            ctx.results = len(output)
            ctx.save_for_backward(*inputs)
            ctx.save_for_forward(*inputs)

        @staticmethod
        def backward(ctx: Any, *gradients: Any) -> tuple[Any, ...]:
            columns = by_input(ctx.saved_tensors, ctx.results)
            selected = zip(ctx.saved_tensors, columns, ctx.needs_input_grad, strict=True)
            return tuple(
                _vector_jacobian_product(gradients, column, x) if needed else None for x, column, needed in selected
            )

        @staticmethod
        def jvp(ctx: Any, *tangents: Any) -> tuple[Any, ...]:
            columns = by_input(ctx.saved_tensors, ctx.results)
            pushed = [_directional_derivative(tangents, [column[k] for column in columns]) for k in range(ctx.results)]
            return tuple(_broadcast_results([0.0 if v is None else v for v in pushed], ctx.saved_tensors))

    entry: TensorFunction = WithDerivatives.apply
    return entry


def _vector_jacobian_product(gradients: Sequence[Any], derivatives: Sequence[Any], like: Any) -> Any:
    """The gradient of one input, in its shape."""
    total = _directional_derivative(gradients, derivatives)
    return None if total is None else total.sum_to_size(like.shape)


def _directional_derivative(directions: Sequence[Any], derivatives: Sequence[Any]) -> Any:
    """Sum of change times slope; None when there is nothing to add."""
    products = [c * s for c, s in zip(directions, derivatives, strict=True) if c is not None and not _is_zero(s)]
    return functools.reduce(operator.add, products) if products else None


def _is_zero(derivative: Any) -> bool:
    return not isinstance(derivative, torch.Tensor) and derivative == 0.0


def _with_common_type(entry: TensorFunction) -> TensorFunction:
    """Make every argument a tensor of the widest type among the tensors given, on their device."""

    def call(*arguments: Any) -> Sequence[Any]:
        tensors = [x for x in arguments if isinstance(x, torch.Tensor)] or [torch.zeros((), dtype=torch.float64)]
        dtype = functools.reduce(torch.promote_types, {x.dtype for x in tensors}, torch.float32)
        like = tensors[0].new_empty((), dtype=dtype)
        return entry(*(_as_type_of(x, like) for x in arguments))

    return call


def _as_type_of(x: Any, like: Any) -> Any:
    if isinstance(x, torch.Tensor) and x.dtype == like.dtype:
        return x
    return torch.as_tensor(x, dtype=like.dtype, device=like.device)


def _broadcast_results(results: Sequence[Any], inputs: Sequence[Any]) -> list[Any]:
    """Give every result the shape of all inputs together, and a memory of its own (zeros are printed as numbers)."""
    shapes = {x.shape for x in inputs} - {torch.Size()}
    shape = shapes.pop() if len(shapes) == 1 else torch.broadcast_shapes(*shapes)  # type: ignore[no-untyped-call]
    constants = {y: inputs[0].new_full((), y).expand(shape) for y in {y for y in results if type(y) is float}}
    given = {id(x) for x in inputs}
    separate = (constants[y] if type(y) is float else y.clone() if id(y) in given else y for y in results)
    return [y if y.shape == shape else y.expand(shape) for y in separate]
