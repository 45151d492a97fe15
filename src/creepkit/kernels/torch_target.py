"""Printed entries as functions of torch tensors, with the gradients that sympy derived.

Autograd does not go through the printed text. So no gradient is NaN where a power is floored, none loses its digits
between branches, and the floor at zero strain is not felt. torch.func (vmap, grad, jacfwd, jacrev, hessian) works.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import torch

from creepkit.kernels import torch_functions

FUNCTIONS = {name: getattr(torch_functions, name) for name in torch_functions.__all__}
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
    """Return values(*tensors) as a function whose derivatives are those that slopes(*tensors) gives.

    slopes : gives the results again, then their derivatives to the first `width` inputs, result by result, then those
        to the rest, as `sensitivity` of kernels.interface does.
    """

    def by_input(inputs: Sequence[Any], results: int) -> list[Sequence[Any]]:
        """For each input, the derivatives of every result to it; 0.0 where there is none."""
        found = derivatives(*inputs)
        rest = len(inputs) - width
        to_point, to_rest = found[results : results * (1 + width)], found[results * (1 + width) :]
        return [to_point[k::width] for k in range(width)] + [to_rest[k::rest] for k in range(rest)]

    class WithSlopes(torch.autograd.Function):
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
            wanted = zip(ctx.saved_tensors, columns, ctx.needs_input_grad, strict=True)
            return tuple(_vector_jacobian_product(gradients, column, x) if needed else None for x, column, needed in wanted)

        @staticmethod
        def jvp(ctx: Any, *tangents: Any) -> tuple[Any, ...]:
            columns = by_input(ctx.saved_tensors, ctx.results)
            pushed = [_directional_derivative(tangents, [column[k] for column in columns]) for k in range(ctx.results)]
            return tuple(_broadcast_results([0.0 if v is None else v for v in pushed], ctx.saved_tensors))

    entry: TensorFunction = WithSlopes.apply
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
