"""Speed of kernels beside the same formulas written by hand for the same target: python kernel_speed.py [rows].

Hand and kernel run alternately on the same points; a figure is the median over the repeats of the ratio of their CPU
times (the issue allows 1.3). `rate` is the rate alone, `all` the rate with its derivatives to the point and to every
parameter. Compiled entries are called for all rows at once, torch runs on one thread. A call of a kernel for arrays
costs some 10 us more than its arithmetic, one for tensors some 50 us, which a few thousand rows make small.
"""

from __future__ import annotations

import ctypes
import math
import statistics
import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import torch
from by_hand import LAWS
from numba import njit

import creepkit
from creepkit.kernels.interface import CompiledLaw
from creepkit.language import CreepLaw

REPEATS, LEAST = 31, 0.01
TARGETS = ("numpy", "torch", "numba")
Run = Callable[[], Any]


def main(rows: int = 20_000) -> None:
    """Print the table."""
    torch.set_num_threads(1)
    print(f"CPU time by kernel / by hand, {rows} points" + " " * 10 + "ns per point and call of the kernel")
    heads = [f"{target} {what}" for target in TARGETS for what in ("rate", "all")]
    print(" " * 18 + "".join(f"{head:>12}" for head in heads) + " |" + "".join(f"{head:>12}" for head in heads))
    for name in LAWS:
        figures = [figure for target in TARGETS for figure in measured(creepkit.law(name), target, rows)]
        ratios = "".join(f"{ratio:12.2f}" for ratio, _ in figures)
        print(f"{name:18}{ratios} |" + "".join(f"{seconds / rows * 1e9:12.1f}" for _, seconds in figures), flush=True)


def measured(law: CreepLaw, target: str, rows: int) -> list[tuple[float, float]]:
    """Return (ratio, seconds a call) for the rate and for the rate with derivatives."""
    points = np.random.default_rng(1).uniform([20.0, 1e-4, 1e2], [200.0, 1e-1, 1e5], (rows, 3))
    values = law.center()
    build = {"numpy": numpy_runs, "torch": torch_runs, "numba": numba_runs}[target]
    return [compared(hand, kernel) for hand, kernel in build(law, points, values)]


def compared(hand: Run, kernel: Run) -> tuple[float, float]:
    """Median ratio of CPU times and median CPU time of the kernel, s a call."""
    loops = calls_for(LEAST, hand)
    pairs = [(spent(hand, loops), spent(kernel, loops)) for _ in range(REPEATS)]
    return statistics.median(b / a for a, b in pairs), statistics.median(b for _, b in pairs)


def calls_for(seconds: float, run: Run) -> int:
    """How many calls take about so long; the first, which may compile, does not count."""
    run()
    return max(1, round(seconds / max(spent(run, 3), 1e-7)))


def spent(run: Run, loops: int) -> float:
    """CPU seconds a call."""
    start = time.process_time()
    for _ in range(loops):
        run()
    return (time.process_time() - start) / loops


# ---- what is compared ----------------------------------------------------------------------------------------------


def numpy_runs(law: CreepLaw, points: Any, values: dict[str, float]) -> list[tuple[Run, Run]]:
    """Arrays of points, numbers as parameters."""
    return array_runs(law, "numpy", np, [column.copy() for column in points.T], values)


def torch_runs(law: CreepLaw, points: Any, values: dict[str, float]) -> list[tuple[Run, Run]]:
    """Tensors of points, tensors without dimensions as parameters."""
    tensors = {name: torch.tensor(value, dtype=torch.float64) for name, value in values.items()}
    return array_runs(law, "torch", torch, [torch.tensor(column.copy()) for column in points.T], tensors)


def array_runs(
    law: CreepLaw, target: Any, module: Any, point: list[Any], values: dict[str, Any]
) -> list[tuple[Run, Run]]:
    """Hand and kernel for arrays or tensors; kernels get logarithms, as they do in a fit."""
    rate, derivatives = LAWS[law.name](module)
    kernel, given = creepkit.lower(law, target), list(values.values())
    theta = [module.log(v) if p.scale == "log" else v for v, p in zip(given, law.params.values(), strict=True)]
    arguments = [*point, 1.0, point[0], point[0] / 3, *theta]
    return [
        (lambda: rate(*point, *given), lambda: kernel.internal_rate(*arguments)),
        (lambda: derivatives(*point, *given), lambda: kernel.internal_derivatives(*arguments)),
    ]


def numba_runs(law: CreepLaw, points: Any, values: dict[str, float]) -> list[tuple[Run, Run]]:
    """Compiled loops over rows."""
    compiled = creepkit.lower(law, "numba")
    x = np.column_stack([points, np.ones(len(points)), points[:, 0], points[:, 0] / 3])
    theta, given = law.to_internal(values)[0], tuple(values.values())
    rate, derivatives = (
        loop_by_hand(f, several) for f, several in zip(LAWS[law.name](math), (False, True), strict=True)
    )
    one, many = np.empty((len(x), 1)), np.empty((len(x), 7 + theta.size))
    return [
        (partial(rate, x, given, one), entry_call(compiled, "rate", x, theta, one)),
        (partial(derivatives, x, given, many), entry_call(compiled, "sensitivity", x, theta, many)),
    ]


def loop_by_hand(function: Callable[..., Any], several: bool) -> Callable[..., Any]:
    """A compiled loop that writes a function's result, or several, row by row."""
    inner = njit(error_model="numpy")(function)

    @njit(error_model="numpy")
    def one(x, theta, out):
        for row in range(x.shape[0]):
            out[row, 0] = inner(x[row, 0], x[row, 1], x[row, 2], *theta)

    @njit(error_model="numpy")
    def many(x, theta, out):
        for row in range(x.shape[0]):
            found = inner(x[row, 0], x[row, 1], x[row, 2], *theta)
            for k in range(len(found)):
                out[row, k] = found[k]

    return many if several else one


def entry_call(compiled: CompiledLaw, entry: str, x: Any, theta: Any, out: Any) -> Run:
    """A call of a compiled entry through its C pointer."""
    double = ctypes.POINTER(ctypes.c_double)
    function = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64, double, double, double)(
        getattr(compiled, entry).address
    )
    pointers = [array.ctypes.data_as(double) for array in (x, theta, out)]
    return lambda: function(len(x), *pointers)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
