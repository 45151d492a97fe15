"""A law evaluated by each target, in one layout: the author's rates, derivatives and log rate at many samples."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.kernels.calling import call
from creepkit.kernels.interface import POINT_SIZE
from creepkit.kernels.lowering import Kernel, lower
from creepkit.language.law import CreepLaw
from creepkit.testing.sampling import Samples


@dataclass(frozen=True)
class Table:
    """rows : (samples, 1 + S, 1 + 6 + S + P) value and derivatives of the rate and of each state rate.

    logs : (samples,) ln rate.
    """

    rows: Floats
    logs: Floats


def numpy_table(law: CreepLaw, drawn: Samples) -> Table:
    """Evaluate the NumPy kernel."""
    return _stacked(lower(law, "numpy"), drawn.arguments())


def torch_table(law: CreepLaw, drawn: Samples) -> Table:
    """Evaluate the torch kernel."""
    import torch

    return _stacked(lower(law, "torch"), [torch.tensor(column) for column in drawn.arguments()])


def numba_table(law: CreepLaw, drawn: Samples) -> Table:
    """Evaluate the compiled entries."""
    compiled = lower(law, "numba")
    rows, width, count = 1 + compiled.states, POINT_SIZE + compiled.states, len(law.params)
    blocks, logs = [], []
    for point, theta in zip(drawn.points, drawn.theta, strict=True):
        out = call(compiled, "sensitivity", point[None], theta)[0][0]
        to_point = out[rows : rows + rows * width].reshape(rows, width)
        to_theta = out[rows + rows * width :].reshape(rows, count)
        blocks.append(np.hstack([out[:rows, None], to_point, to_theta]))
        logs.append(call(compiled, "update", point[None], theta)[0][0, 0])
    return Table(np.array(blocks), np.array(logs))


def _stacked(kernel: Kernel, arguments: Sequence[Any]) -> Table:
    found = kernel.internal_derivatives(*arguments)
    values = [found.rate, *kernel.internal_rates(*arguments)[1:]]
    slopes = [{**found.point, **found.params}, *found.state_rates.values()]
    rows = [[value, *along.values()] for value, along in zip(values, slopes, strict=True)]
    columns = np.array([[np.asarray(column, float) for column in row] for row in rows])
    return Table(np.moveaxis(columns, -1, 0), np.asarray(kernel.internal_log_rate(*arguments), float))


TABLES: dict[str, Callable[[CreepLaw, Samples], Table]] = {
    "numpy": numpy_table,
    "torch": torch_table,
    "numba": numba_table,
}
"""{target: function that evaluates it}."""
