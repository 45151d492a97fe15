"""Many candidates in many tests through the one-degree-of-freedom march, in one call of compiled code."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from creepkit.arrays import Floats, Ints
from creepkit.specimens.reduced_curves import DimpleCurves
from creepkit.specimens.reduced_march import NUISANCE_DIRECTIONS, ReducedCandidate, FeatureFactors, integrate_candidate, reduced_workspace, sensitivity_workspace
from creepkit.specimens.reduced_observed import TRAJECTORY_COLUMNS


@njit(cache=True, error_model="numpy", nogil=True)
def integrate_candidates(
    update: Any, sensitivity: Any, rate: Any, first: int, last: int, theta: Floats, beta: Floats, beta_slopes: Floats,
    stiffer: Floats, counts: Ints, tests: Floats, curves: Floats, slopes: Floats, redistribution: Floats,
    row: Ints, grid: tuple[float, float], initial: Floats, limits: Floats, ends: tuple[float, float], factors: FeatureFactors,
    tolerance: float, out: Floats, changes: Floats, status: Ints, end_times: Floats,
) -> None:  # fmt: skip
    """March the candidates from `first` to before `last` through all tests; arrays as in `reduced_courses`.

    tests : (candidates or 1, tests, 8, nodes) as in `reduced_problem`.
    """
    exact = changes.shape[0] > 0
    directions = theta.shape[1] + len(NUISANCE_DIRECTIONS) if exact else 0
    count = factors.stress.size * factors.strain.size
    work = reduced_workspace(initial.size, count)
    slopes_work = sensitivity_workspace(initial.size, theta.shape[1], count, directions, len(TRAJECTORY_COLUMNS))
    nothing = np.zeros((0, out.shape[3], directions))
    for c in range(first, last):
        e = c if tests.shape[0] > 1 else 0
        for k in range(counts.size):
            candidate = ReducedCandidate(theta[c], beta[c], beta_slopes[c], stiffer[e, k], initial, limits, ends[0], ends[1])
            r = row[e, k]
            dimple = DimpleCurves(curves[r], slopes[r], redistribution[r], grid[0], grid[1])
            status[c, k], end_times[c, k] = integrate_candidate(
                update, sensitivity, rate, tests[e, k], counts[k], candidate, dimple, factors, tolerance, work,
                slopes_work, out[c, k], changes[c, k] if exact else nothing,
            )  # fmt: skip
