"""A law evaluated by each target, in one layout: the author's rates, derivatives and log rate at many samples."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.kernels.calling import call_entry
from creepkit.kernels.interface import POINT_SIZE
from creepkit.kernels.lowering import ArrayKernel, lower
from creepkit.language.law import CreepLaw
from creepkit.testing.sampling import LawSamples


@dataclass(frozen=True)
class KernelTable:
    """rows : (samples, 1 + S, 1 + 6 + S + P) value and derivatives of the rate and of each state rate.

    logs : (samples,) ln rate.
    """

    rows: Floats
    log_rates: Floats


def evaluate_numpy(law: CreepLaw, samples: LawSamples) -> KernelTable:
    """Evaluate the NumPy kernel."""
    return _kernel_table(lower(law, "numpy"), samples.arguments())


def evaluate_torch(law: CreepLaw, samples: LawSamples) -> KernelTable:
    """Evaluate the torch kernel."""
    import torch

    return _kernel_table(lower(law, "torch"), [torch.tensor(column) for column in samples.arguments()])


def evaluate_numba(law: CreepLaw, samples: LawSamples) -> KernelTable:
    """Evaluate the compiled entries."""
    compiled = lower(law, "numba")
    rows, width, count = 1 + compiled.states, POINT_SIZE + compiled.states, len(law.params)
    blocks, log_rates = [], []
    for point, theta in zip(samples.points, samples.theta, strict=True):
        out = call_entry(compiled, "sensitivity", point[None], theta)[0][0]
        to_point = out[rows : rows + rows * width].reshape(rows, width)
        to_theta = out[rows + rows * width :].reshape(rows, count)
        blocks.append(np.hstack([out[:rows, None], to_point, to_theta]))
        log_rates.append(call_entry(compiled, "update", point[None], theta)[0][0, 0])
    return KernelTable(np.array(blocks), np.array(log_rates))


def _kernel_table(kernel: ArrayKernel, arguments: Sequence[Any]) -> KernelTable:
    result = kernel.internal_derivatives(*arguments)
    values = [result.rate, *kernel.internal_rates(*arguments)[1:]]
    derivatives = [{**result.point, **result.params}, *result.state_rates.values()]
    rows = [[value, *derivatives_of_row.values()] for value, derivatives_of_row in zip(values, derivatives, strict=True)]
    columns = np.array([[np.asarray(column, float) for column in row] for row in rows])
    return KernelTable(np.moveaxis(columns, -1, 0), np.asarray(kernel.internal_log_rate(*arguments), float))


KERNEL_EVALUATORS: dict[str, Callable[[CreepLaw, LawSamples], KernelTable]] = {
    "numpy": evaluate_numpy,
    "torch": evaluate_torch,
    "numba": evaluate_numba,
}
"""{target: function that evaluates it}."""
