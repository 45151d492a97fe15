"""Printed entries as functions of NumPy arrays."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from creepkit.kernels import numpy_functions

FUNCTIONS = {name: getattr(numpy_functions, name) for name in numpy_functions.__all__}
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
        shapes = {np.shape(x) for x in arguments} - {()}
        shape = shapes.pop() if len(shapes) == 1 else np.broadcast_shapes(*shapes)
        numbers = {y: np.broadcast_to(y, shape) for y in {y for y in results if type(y) is float}}
        return [numbers[y] if type(y) is float else _broadcast(y, shape) for y in results]

    return call


def _broadcast(y: Any, shape: tuple[int, ...]) -> Any:
    return y if np.shape(y) == shape else np.broadcast_to(y, shape)
