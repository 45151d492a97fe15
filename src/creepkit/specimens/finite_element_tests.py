"""What tests simulated by finite elements share: modulus over time, moving steps in time, simulations in threads."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from creepkit.arrays import Floats, usable_cores
from creepkit.errors import SolveError
from creepkit.fem.finite_element_model import FiniteElementModel
from creepkit.fem.simulation import Simulation, SurfaceSensitivities
from creepkit.fem.solver import SolverSettings
from creepkit.integration.time_discretisation import SDIRK2_TEXT
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


def finite_element_text(model: FiniteElementModel, settings: SolverSettings) -> str:
    """Elements, kinematics, material, integration in time and its end, in sentences for a paper."""
    return (
        f"Finite elements of a body of revolution: {len(model.elements)} quadrilaterals of eight nodes with 2 x 2 "
        f"integration points, {len(model.nodes)} nodes. Strains are finite (logarithmic, Hencky elasticity), and creep "
        "flows along the elastic deviator at the rate that the law gives for the von Mises stress. Time is integrated "
        f"by {SDIRK2_TEXT}, in steps whose estimated error of displacements is at most {settings.tolerance:g} of their "
        f"largest plus {settings.least:g} mm. A test ends at a creep strain of {settings.strain_limit:g} in a point or "
        f"an observed displacement of {settings.deflection_limit:g} mm."
    )


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
