"""Predictions of bulge tests: one finite element run for each candidate and test, side by side on all cores."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from creepkit import kernels
from creepkit.arrays import ArrayLike, Floats
from creepkit.errors import SolveError
from creepkit.fem.record import SolverSettings
from creepkit.fem.simulation import simulate
from creepkit.records import NuisanceValues, History, Prediction, Status
from creepkit.specimens.bulge_course import set_up_test
from creepkit.specimens.bulge_slopes import BulgeSensitivities, output_sensitivities
from creepkit.specimens.observation import OBSERVED

if TYPE_CHECKING:
    from creepkit.kernels.interface import CompiledLaw
    from creepkit.language import CreepLaw
    from creepkit.specimens.bulge import Bulge


@dataclass(frozen=True, eq=False)
class BulgeResponse:
    """One candidate in one test: outputs (times, 3), how it ended, and derivatives if asked for."""

    values: Floats
    status: Status
    end_time: float
    sensitivities: BulgeSensitivities | None


def predict_bulge(
    specimen: Bulge,
    law: CreepLaw,
    values: Mapping[str, ArrayLike],
    histories: Sequence[History],
    jacobian: bool,
    nuisances: NuisanceValues,
) -> Prediction:
    """Predict every candidate in every test; see records.Predictor."""
    for kind in nuisances:
        if kind not in specimen.nuisances:
            raise SolveError(
                f"a bulge specimen does not know the nuisance '{kind}'; it knows {', '.join(specimen.nuisances)}"
            )
    kernel = kernels.lower(law, "numba")
    theta = kernel.to_internal(values)
    candidates = max([len(theta), *(len(v) for v in nuisances.values())])
    theta = np.broadcast_to(theta, (candidates, theta.shape[1]))
    broadcast_nuisances = {kind: np.broadcast_to(v, (candidates, len(histories))) for kind, v in nuisances.items()}
    tasks = list(product(range(candidates), range(len(histories))))

    def run(task: tuple[int, int]) -> BulgeResponse:
        c, k = task
        nuisance_values = {kind: float(value[c, k]) for kind, value in broadcast_nuisances.items()}
        return simulate_and_observe(specimen, kernel, theta[c], histories[k], nuisance_values, jacobian)

    workers = min(specimen.threads or len(os.sched_getaffinity(0)), len(tasks))
    if workers > 1:
        with ThreadPoolExecutor(workers) as pool:
            rows = list(pool.map(run, tasks))
    else:
        rows = [run(task) for task in tasks]
    return _to_prediction(rows, histories, candidates, theta.shape[1], tuple(nuisances) if jacobian else (), jacobian)


def simulate_and_observe(
    specimen: Bulge, kernel: CompiledLaw, theta: Floats, history: History, nuisances: Mapping[str, float], jacobian: bool
) -> BulgeResponse:
    """Simulate one test and observe it at the times of its history."""
    test_setup = set_up_test(specimen, history, nuisances)
    settings = solver_settings(specimen, exact=jacobian)
    simulation = simulate(kernel, theta, test_setup.model, test_setup.load_history, settings=settings, keep_stages=jacobian)
    profiles = simulation.displacements[:, test_setup.model.top, 1]
    sensitivities = None
    if jacobian:
        outputs, sensitivities = output_sensitivities(test_setup, kernel, theta, history, simulation, profiles, tuple(nuisances))
    else:
        outputs = simulation.at(test_setup.observation.observe(test_setup.radii, profiles), history.times)
    return BulgeResponse(outputs, simulation.status, simulation.end_time, sensitivities)


def solver_settings(specimen: Bulge, *, exact: bool = False) -> SolverSettings:
    """The solver's settings; exact : equilibrium so tight that derivatives are those of the scheme."""
    return SolverSettings(
        tolerance=specimen.tolerance,
        newton=1e-7 if exact else 1e-2 * specimen.tolerance,
        deflection_limit=specimen.deflection_limit,
        strain_limit=specimen.strain_limit,
        max_steps=int(specimen.max_steps),
    )


def _to_prediction(
    rows: Sequence[BulgeResponse],
    histories: Sequence[History],
    candidates: int,
    parameters: int,
    kinds: tuple[str, ...],
    jacobian: bool,
) -> Prediction:
    longest = max((h.times.size for h in histories), default=0)
    shape = (candidates, len(histories), longest, len(OBSERVED))
    values = np.full(shape, np.nan)
    law_jacobian = np.full((*shape, parameters), np.nan) if jacobian else None
    nuisance_jacobian = {kind: np.full(shape, np.nan) for kind in kinds}
    for n, response in enumerate(rows):
        c, k = divmod(n, len(histories))
        frames = histories[k].times.size
        values[c, k, :frames] = response.values
        if law_jacobian is not None and response.sensitivities is not None:
            law_jacobian[c, k, :frames] = response.sensitivities.law
            for kind in kinds:
                nuisance_jacobian[kind][c, k, :frames] = response.sensitivities.nuisances[kind]
    return Prediction(
        values=values,
        outputs=OBSERVED,
        lengths=np.array([h.times.size for h in histories], dtype=np.int64),
        status=np.array([int(r.status) for r in rows], dtype=np.int64).reshape(shape[:2]),
        end_times=np.array([r.end_time for r in rows]).reshape(shape[:2]),
        jacobian=law_jacobian,
        times=tuple(h.times for h in histories),
        nuisance_jacobian=nuisance_jacobian,
    )
