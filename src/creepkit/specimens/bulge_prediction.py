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
from creepkit.fem.record import Settings
from creepkit.fem.simulation import simulate
from creepkit.records import Effects, History, Prediction, Status
from creepkit.specimens.bulge_course import setup
from creepkit.specimens.bulge_slopes import Slopes, slopes_of
from creepkit.specimens.observation import OBSERVED

if TYPE_CHECKING:
    from creepkit.kernels.interface import CompiledLaw
    from creepkit.language import CreepLaw
    from creepkit.specimens.bulge import Bulge


@dataclass(frozen=True, eq=False)
class Row:
    """One candidate in one test: outputs (times, 3), how it ended, and derivatives if asked for."""

    values: Floats
    status: Status
    end_time: float
    slopes: Slopes | None


def predict(
    specimen: Bulge,
    law: CreepLaw,
    values: Mapping[str, ArrayLike],
    histories: Sequence[History],
    jacobian: bool,
    effects: Effects,
) -> Prediction:
    """Predict every candidate in every test; see records.Predictor."""
    for kind in effects:
        if kind not in specimen.effects:
            raise SolveError(
                f"a bulge specimen does not know the nuisance '{kind}'; it knows {', '.join(specimen.effects)}"
            )
    kernel = kernels.lower(law, "numba")
    theta = kernel.internal(values)
    candidates = max([len(theta), *(len(v) for v in effects.values())])
    theta = np.broadcast_to(theta, (candidates, theta.shape[1]))
    assumed = {kind: np.broadcast_to(v, (candidates, len(histories))) for kind, v in effects.items()}
    tasks = list(product(range(candidates), range(len(histories))))

    def run(task: tuple[int, int]) -> Row:
        c, k = task
        own = {kind: float(value[c, k]) for kind, value in assumed.items()}
        return row(specimen, kernel, theta[c], histories[k], own, jacobian)

    workers = min(specimen.threads or len(os.sched_getaffinity(0)), len(tasks))
    if workers > 1:
        with ThreadPoolExecutor(workers) as pool:
            rows = list(pool.map(run, tasks))
    else:
        rows = [run(task) for task in tasks]
    return _gathered(rows, histories, candidates, theta.shape[1], tuple(effects) if jacobian else (), jacobian)


def row(
    specimen: Bulge, kernel: CompiledLaw, theta: Floats, history: History, effects: Mapping[str, float], jacobian: bool
) -> Row:
    """Simulate one test and observe it at the times of its history."""
    made = setup(specimen, history, effects)
    settings = settings_of(specimen, exact=jacobian)
    found = simulate(kernel, theta, made.body, made.course, settings=settings, keep_stages=jacobian)
    profiles = found.displacements[:, made.body.top, 1]
    slopes = None
    if jacobian:
        seen, slopes = slopes_of(made, kernel, theta, history, found, profiles, tuple(effects))
    else:
        seen = found.at(made.observation.observe(made.radii, profiles), history.times)
    return Row(seen, found.status, found.end_time, slopes)


def settings_of(specimen: Bulge, *, exact: bool = False) -> Settings:
    """The solver's settings; exact : equilibrium so tight that derivatives are those of the scheme."""
    return Settings(
        tolerance=specimen.tolerance,
        newton=1e-7 if exact else 1e-2 * specimen.tolerance,
        deflection_limit=specimen.deflection_limit,
        strain_limit=specimen.strain_limit,
        max_steps=int(specimen.max_steps),
    )


def _gathered(
    rows: Sequence[Row],
    histories: Sequence[History],
    candidates: int,
    parameters: int,
    kinds: tuple[str, ...],
    jacobian: bool,
) -> Prediction:
    longest = max((h.times.size for h in histories), default=0)
    shape = (candidates, len(histories), longest, len(OBSERVED))
    values = np.full(shape, np.nan)
    changes = np.full((*shape, parameters), np.nan) if jacobian else None
    by_kind = {kind: np.full(shape, np.nan) for kind in kinds}
    for n, found in enumerate(rows):
        c, k = divmod(n, len(histories))
        frames = histories[k].times.size
        values[c, k, :frames] = found.values
        if changes is not None and found.slopes is not None:
            changes[c, k, :frames] = found.slopes.law
            for kind in kinds:
                by_kind[kind][c, k, :frames] = found.slopes.effects[kind]
    return Prediction(
        values=values,
        outputs=OBSERVED,
        lengths=np.array([h.times.size for h in histories], dtype=np.int64),
        status=np.array([int(r.status) for r in rows], dtype=np.int64).reshape(shape[:2]),
        end_times=np.array([r.end_time for r in rows]).reshape(shape[:2]),
        jacobian=changes,
        times=tuple(h.times for h in histories),
        effect_jacobian=by_kind,
    )
