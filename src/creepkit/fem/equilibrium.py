"""Equilibrium of a stage by Newton's method: full steps, and cheap ones with the tangent of the step before."""

from __future__ import annotations

from math import isfinite
from typing import Any, NamedTuple

from numba import njit

from creepkit.arrays import Floats
from creepkit.fem.band import factorize, solve_factorized
from creepkit.fem.body import FiniteElementModel
from creepkit.fem.element import BALANCED, RATE_UNDEFINED, ForceWorkspace, PointStates, assemble
from creepkit.fem.material import PointWorkspace, StageConditions

CONVERGED, NO_STRESS, UNSTABLE, TOO_FAR, TOO_MANY, UNDEFINED = range(6)
"""Flags: found; a point had no solution; the tangent is not positive definite; corrections grow; too many of them; the
law gave no finite rate."""

_ITERATIONS = 16
_LOOSE = 0.03
"""Tolerance of the points' own equations in the first pass, from which the displacements move anyway."""
_KEEP = 0.3
"""The tangent is kept while each correction is at most this share of the one before."""


class EquilibriumResult(NamedTuple):
    """Flag, and how many passes with and without a new tangent it took."""

    flag: int
    full: int
    light: int


@njit(cache=True, error_model="numpy", inline="always")
def solve_equilibrium(
    update: Any,
    theta: Floats,
    body: FiniteElementModel,
    stage: StageConditions,
    displacement: Floats,
    points: PointStates,
    room: PointWorkspace,
    forces: ForceWorkspace,
    tolerance: float,
    longest: float,
    tight: float,
) -> EquilibriumResult:
    """Bring `displacement` (2 nodes,) to equilibrium; corrections below `tolerance`, mm, end the search.

    longest : mm, corrections are cut to this. tight : tolerance of the points' own equations once near.
    """
    before, size, factor, full, light = 0.0, 0.0, 1.0, 0, 0
    for iteration in range(_ITERATIONS):
        stiff = iteration == 0 or factor < 1.0 or (iteration > 1 and size > _KEEP * before)
        local = max(tight, _LOOSE) if iteration == 0 else tight
        flag = assemble(update, theta, body, stage, displacement, points, room, forces, stiff, local)
        if flag != BALANCED:
            return EquilibriumResult(UNDEFINED if flag == RATE_UNDEFINED and iteration < 2 else NO_STRESS, full, light)
        if stiff:
            full += 1
            if not factorize(forces.band, body.size, body.width, forces.block):
                return EquilibriumResult(UNSTABLE, full, light)
        else:
            light += 1
        solve_factorized(forces.band, body.size, body.width, forces.residual)
        before, size = size, _largest(forces.residual, body.size)
        if not isfinite(size) or (iteration > 6 and size > before):
            return EquilibriumResult(TOO_FAR, full, light)
        factor = min(1.0, longest / size) if size > 0.0 else 1.0
        for k in range(displacement.size):
            equation = body.equations[k]
            if equation >= 0:
                displacement[k] -= factor * forces.residual[equation]
        if size <= tolerance:
            return EquilibriumResult(CONVERGED, full, light)
    return EquilibriumResult(TOO_MANY, full, light)


@njit(cache=True, error_model="numpy")
def _largest(values: Floats, size: int) -> float:
    worst = 0.0
    for k in range(size):
        if not isfinite(values[k]):
            return float(values[k])
        worst = max(worst, abs(values[k]))
    return worst
