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

Entry = Callable[..., Sequence[Any]]


def bound(printed: Mapping[str, Entry], width: int) -> dict[str, Entry]:
    """Return the printed entries with results of one shape and type; the first `width` inputs are the point."""
    rate, log_rate = (printed[name] for name in ("rate", "log_rate"))
    slopes, log_slopes = (printed[name] for name in ("sensitivity", "log_sensitivity"))
    return {
        "rate": _on_tensors(differentiable(rate, slopes, width)),
        "log_rate": _on_tensors(differentiable(log_rate, log_slopes, width)),
        "sensitivity": _on_tensors(lambda *inputs: _whole(slopes(*inputs), inputs)),
    }


def number(value: Any) -> Any:
    """A number or tensor, from what a user gives."""
    return value if isinstance(value, (float, torch.Tensor)) else torch.as_tensor(value)


def differentiable(values: Entry, slopes: Entry, width: int) -> Entry:
    """Return values(*tensors) as a function whose derivatives are those that slopes(*tensors) gives.

    slopes : gives the results again, then their derivatives to the first `width` inputs, result by result, then those
        to the rest, as `sensitivity` of kernels.interface does.
    """

    def by_input(inputs: Sequence[Any], results: int) -> list[Sequence[Any]]:
        """For each input, the derivatives of every result to it; 0.0 where there is none."""
        found = slopes(*inputs)
        rest = len(inputs) - width
        to_point, to_rest = found[results : results * (1 + width)], found[results * (1 + width) :]
        return [to_point[k::width] for k in range(width)] + [to_rest[k::rest] for k in range(rest)]

    class WithSlopes(torch.autograd.Function):
        generate_vmap_rule = True

        @staticmethod
        def forward(*inputs: Any) -> tuple[Any, ...]:
            return tuple(_whole(values(*inputs), inputs))

        @staticmethod
        def setup_context(ctx: Any, inputs: Any, output: Any) -> None:
            ctx.results = len(output)
            ctx.save_for_backward(*inputs)
            ctx.save_for_forward(*inputs)

        @staticmethod
        def backward(ctx: Any, *gradients: Any) -> tuple[Any, ...]:
            columns = by_input(ctx.saved_tensors, ctx.results)
            wanted = zip(ctx.saved_tensors, columns, ctx.needs_input_grad, strict=True)
            return tuple(_pulled(gradients, column, x) if needed else None for x, column, needed in wanted)

        @staticmethod
        def jvp(ctx: Any, *tangents: Any) -> tuple[Any, ...]:
            columns = by_input(ctx.saved_tensors, ctx.results)
            pushed = [_dot(tangents, [column[k] for column in columns]) for k in range(ctx.results)]
            return tuple(_whole([0.0 if v is None else v for v in pushed], ctx.saved_tensors))

    entry: Entry = WithSlopes.apply
    return entry


def _pulled(gradients: Sequence[Any], slopes: Sequence[Any], like: Any) -> Any:
    """The gradient of one input, in its shape."""
    total = _dot(gradients, slopes)
    return None if total is None else total.sum_to_size(like.shape)


def _dot(changes: Sequence[Any], slopes: Sequence[Any]) -> Any:
    """Sum of change times slope; None when there is nothing to add."""
    products = [c * s for c, s in zip(changes, slopes, strict=True) if c is not None and not _is_zero(s)]
    return functools.reduce(operator.add, products) if products else None


def _is_zero(slope: Any) -> bool:
    return not isinstance(slope, torch.Tensor) and slope == 0.0


def _on_tensors(entry: Entry) -> Entry:
    """Make every argument a tensor of the widest type among the tensors given, on their device."""

    def call(*arguments: Any) -> Sequence[Any]:
        tensors = [x for x in arguments if isinstance(x, torch.Tensor)] or [torch.zeros((), dtype=torch.float64)]
        dtype = functools.reduce(torch.promote_types, {x.dtype for x in tensors}, torch.float32)
        like = tensors[0].new_empty((), dtype=dtype)
        return entry(*(_alike(x, like) for x in arguments))

    return call


def _alike(x: Any, like: Any) -> Any:
    if isinstance(x, torch.Tensor) and x.dtype == like.dtype:
        return x
    return torch.as_tensor(x, dtype=like.dtype, device=like.device)


def _whole(results: Sequence[Any], inputs: Sequence[Any]) -> list[Any]:
    """Give every result the shape of all inputs together, and a memory of its own (zeros are printed as numbers)."""
    shapes = {x.shape for x in inputs} - {torch.Size()}
    shape = shapes.pop() if len(shapes) == 1 else torch.broadcast_shapes(*shapes)  # type: ignore[no-untyped-call]
    numbers = {y: inputs[0].new_full((), y).expand(shape) for y in {y for y in results if type(y) is float}}
    given = {id(x) for x in inputs}
    own = (numbers[y] if type(y) is float else y.clone() if id(y) in given else y for y in results)
    return [y if y.shape == shape else y.expand(shape) for y in own]
