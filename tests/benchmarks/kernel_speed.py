"""CPU time of kernels derived from a law, over that of the same formulas written by hand for the same target.

    python tests/benchmarks/kernel_speed.py [rows] [--laws norton ...] [--write]

Kernel and hand-written code run alternately on the same points (20,000 rows by default); each ratio is the median over
31 repeats of the ratio of their CPU times, and the time is that of the kernel. "Rate" is the creep rate alone,
"derivatives" the rate with its derivatives to stress, strain, time and every parameter. Compiled functions (ours by
LLVM, those by hand by numba) are called for all rows at once, torch runs on one thread.

The second table calls compiled entries as the solvers do, for one point and for eight.
"""

from __future__ import annotations

import ctypes
import math
import statistics
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import torch
from hand_written_laws import LAWS
from measured import Page, arguments
from numba import njit

import creepkit as ck
from creepkit.kernels.interface import CompiledLaw
from creepkit.language import CreepLaw

REPEATS = 31
SHORTEST = 0.01
"""s of CPU that one measurement takes at least."""
TARGETS = ("numpy", "torch", "compiled")
Run = Callable[[], Any]


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("rows", nargs="?", type=int, default=20_000, help="points that a call is made for")
    parser.add_argument("--laws", nargs="*", default=["norton", "hyperbolic-sine", "combined"], choices=list(LAWS))
    options = parser.parse_args()
    torch.set_num_threads(1)
    page = Page("kernel_speed" if options.rows == 20_000 else f"kernel_speed_{options.rows}", __doc__)
    page.paragraph(f"{options.rows} points a call.")
    page.table(
        "law",
        "target",
        "rate: kernel over hand",
        "derivatives: kernel over hand",
        "rate: ns a point",
        "derivatives: ns a point",
    )
    for name in options.laws:
        for target in TARGETS:
            (rate, rate_seconds), (all_, all_seconds) = compare_with_hand(ck.law(name), target, options.rows)
            times = (f"{1e9 * seconds / options.rows:.1f}" for seconds in (rate_seconds, all_seconds))
            page.row(name, target, f"{rate:.2f}", f"{all_:.2f}", *times)
    page.table(
        "law", *(f"{entry}, ns a point: {n}" for entry in ("update", "sensitivity") for n in ("1", "8", "1 over 8"))
    )
    for name in options.laws:
        cells: list[str] = []
        for entry in ("update", "sensitivity"):
            one, eight = (nanoseconds_a_point(ck.law(name), entry, rows) for rows in (1, 8))
            cells += [f"{one:.1f}", f"{eight:.2f}", f"{one / eight:.1f}"]
        page.row(name, *cells)
    if options.write:
        page.write()


def compare_with_hand(law: CreepLaw, target: str, rows: int) -> list[tuple[float, float]]:
    """Return (ratio, seconds a call) for the rate and for the rate with derivatives."""
    points = np.random.default_rng(1).uniform([20.0, 1e-4, 1e2], [200.0, 1e-1, 1e5], (rows, 3))
    values = law.center()
    build = {"numpy": numpy_runs, "torch": torch_runs, "compiled": numba_runs}[target]
    return [ratio_of_times(hand, kernel) for hand, kernel in build(law, points, values)]


def ratio_of_times(hand: Run, kernel: Run) -> tuple[float, float]:
    """Median ratio of CPU times and median CPU time of the kernel, s a call."""
    loops = calls_for(SHORTEST, hand)
    pairs = [(cpu_seconds(hand, loops), cpu_seconds(kernel, loops)) for _ in range(REPEATS)]
    return statistics.median(b / a for a, b in pairs), statistics.median(b for _, b in pairs)


def calls_for(seconds: float, run: Run) -> int:
    """How many calls take about so many seconds; the first, which may compile, does not count."""
    run()
    return max(1, round(seconds / max(cpu_seconds(run, 3), 1e-7)))


def cpu_seconds(run: Run, loops: int) -> float:
    """CPU seconds a call."""
    start = time.process_time()
    for _ in range(loops):
        run()
    return (time.process_time() - start) / loops


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
    """Hand-written code and kernel for arrays or tensors; kernels take logarithms, as they do in a fit."""
    rate, derivatives = LAWS[law.name](module)
    kernel, given = ck.lower(law, target), list(values.values())
    theta = [module.log(v) if p.scale == "log" else v for v, p in zip(given, law.params.values(), strict=True)]
    arguments = [*point, 1.0, point[0], point[0] / 3, *theta]
    return [
        (lambda: rate(*point, *given), lambda: kernel.internal_rates(*arguments)),
        (lambda: derivatives(*point, *given), lambda: kernel.internal_derivatives(*arguments)),
    ]


def numba_runs(law: CreepLaw, points: Any, values: dict[str, float]) -> list[tuple[Run, Run]]:
    """Compiled loops over rows."""
    compiled, x = ck.lower(law, "compiled"), all_variables(points)
    theta, given = law.to_internal(values)[0], tuple(values.values())
    rate, derivatives = (
        loop_by_hand(f, several) for f, several in zip(LAWS[law.name](math), (False, True), strict=True)
    )
    one, many, by_column = np.empty((len(x), 1)), np.empty((len(x), 7 + theta.size)), np.ascontiguousarray(x.T)
    return [
        (partial(rate, x, given, one), entry_call(compiled, "rate", by_column, theta, one)),
        (partial(derivatives, x, given, many), entry_call(compiled, "sensitivity", by_column, theta, many)),
    ]


def all_variables(points: Any) -> Any:
    """Points (points, 6) from stress, strain and time, (points, 3)."""
    return np.column_stack([points, np.ones(len(points)), points[:, 0], points[:, 0] / 3])


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
            results = inner(x[row, 0], x[row, 1], x[row, 2], *theta)
            for k in range(len(results)):
                out[row, k] = results[k]

    return many if several else one


def entry_call(compiled: CompiledLaw, entry: str, x: Any, theta: Any, out: Any) -> Run:
    """A call of a compiled entry through its C pointer; x (6, points)."""
    double = ctypes.POINTER(ctypes.c_double)
    function = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64, double, double, double)(
        getattr(compiled, entry).address
    )
    pointers = [array.ctypes.data_as(double) for array in (x, theta, out)]
    return lambda: function(x.shape[1], *pointers)


BLOCKS, CALLS = 64, 20_000
"""Different groups of points, and calls that one measurement takes."""


def nanoseconds_a_point(law: CreepLaw, entry: str, rows: int) -> float:
    """CPU time of an entry that compiled code calls for so many points at once."""
    compiled, theta = ck.lower(law, "compiled"), law.to_internal(law.center())[0]
    points = np.random.default_rng(1).uniform([20.0, 1e-4, 1e2], [200.0, 1e-1, 1e5], (BLOCKS * rows, 3))
    x = np.ascontiguousarray(all_variables(points).reshape(BLOCKS, rows, 6).transpose(0, 2, 1))
    out = np.empty((7 + theta.size) * rows)
    run = repeated_calls(getattr(compiled, entry).address, rows, x, theta, out)
    return 1e9 * min(cpu_seconds(run, 1) for _ in range(REPEATS)) / (CALLS * rows)


def repeated_calls(entry: int, rows: int, x: Any, theta: Any, out: Any) -> Run:
    """A compiled loop that calls the entry at an address for one group of points after another, x (groups, 6, rows)."""
    function = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64, *3 * [ctypes.c_void_p])(entry)

    @njit
    def loop(x, theta, out):
        flags = 0
        for call in range(CALLS):
            flags |= function(rows, x[call % BLOCKS].ctypes, theta.ctypes, out.ctypes)
        return flags

    return partial(loop, x, theta, out)


if __name__ == "__main__":
    main()
