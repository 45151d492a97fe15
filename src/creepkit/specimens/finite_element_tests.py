"""What tests simulated by finite elements share: modulus over time, moving steps in time, simulations in threads."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from creepkit.arrays import Floats, usable_cores
from creepkit.errors import SolveError
from creepkit.fem.simulation import Simulation, SurfaceSensitivities
from creepkit.records import Program

if TYPE_CHECKING:
    from creepkit.language import Elastic


_TIME_SHIFT = 1e-3
"""s, by which steps are moved to difference an interpolation between steps that move."""


PROGRAM_STEPS = {"temperature step": 1.0, "temperature drift": 1.0, "load step": 1e-3}
"""K, K and relative, of central differences of programs; without error where a program is linear in them."""


def modulus_program(elastic: Elastic, temperature: Program, factor: float, where: str) -> Program:
    """Young's modulus over time, MPa, a straight line where the temperature is one."""
    moduli = {float(T): float(elastic.at(float(T)).E) for T in np.unique(temperature.values)}
    values = np.array([factor * moduli[float(T)] for T in temperature.values])
    if not (values > 0).all():
        raise SolveError(f"{where}: the modulus is {values.min():g} MPa; it must be above zero")
    return Program(temperature.times, values)


def step_time_derivative(
    simulation: Simulation, change: SurfaceSensitivities, directions: Floats, k: int, outputs: Floats, times: Floats
) -> Floats | float:
    """What the motion of the steps in time does to the interpolation between them, (times, outputs).

    directions : (D, segments, 10) of the load history, of which number k counts. outputs : (steps, outputs) in their
    units. times : (times,) s.
    """
    if not change.times[:, k].any() and not directions[k, :, 0].any():
        return 0.0
    starts = directions[k, : simulation.timeline.starts.size, 0]
    ends = (
        simulation.timeline.moved(s * _TIME_SHIFT * change.times[:, k], s * _TIME_SHIFT * starts) for s in (1.0, -1.0)
    )
    up, down = (line.interpolate(outputs, times) for line in ends)
    return np.asarray((up - down) / (2.0 * _TIME_SHIFT))


Task = TypeVar("Task")
Row = TypeVar("Row")


def in_threads(run: Callable[[Task], Row], tasks: Sequence[Task], threads: int | None) -> list[Row]:
    """The results of tasks in their order; threads : that run them, None for one on each core."""
    workers = min(threads or usable_cores(), len(tasks))
    if workers <= 1:
        return [run(task) for task in tasks]
    pool = ThreadPoolExecutor(workers)
    try:
        return list(pool.map(run, tasks))
    finally:
        pool.shutdown(cancel_futures=True)  # an interrupt waits for the simulations that run, not for the others
