"""Bounded least squares from one start, with analytic Jacobian."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from scipy.optimize import least_squares

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.fences import Fences
from creepkit.inverse.objective import Objective
from creepkit.inverse.search.box import Box

ANCHOR = 1e-4
"""How hard each unknown is drawn to the middle of its bounds, in standard deviations of data per width of the bounds.

Far too weak to bias a value. Without it one unknown that moves nothing, as the share of the largest principal stress
in tension, leaves the Jacobian short of its rank, and scipy's steps are then always as long as the trust region.
"""

Progress = Callable[[str, int, int], None]


class Extra(Protocol):
    """Residuals beside those of the data: half the sum of their squares is added to the cost."""

    def residuals(self, x: Floats) -> Floats:
        """(extra,) at x (unknowns,)."""
        ...

    def jacobian(self, x: Floats) -> Floats:
        """(extra, unknowns)."""
        ...


@dataclass(frozen=True)
class Minimum:
    """Where a search ended: coordinates, cost (half the sum of squares), and whether it converged.

    white : (entries of data,) residuals there over their scatter, where they were kept.
    off : terms of a sum that the search switched off.
    """

    u: Floats
    cost: float
    converged: bool
    evaluations: int
    white: Floats | None = field(default=None, repr=False)
    off: tuple[str, ...] = ()


def refine(
    objective: Objective, box: Box, factor: Floats, start: Floats, *, loss: str = "linear",
    steps: int = 80, tolerance: float = 1e-10, extra: Extra | None = None, held: Mapping[int, float] | None = None,
) -> Minimum:  # fmt: skip
    """Bounded least squares (scipy's trust region reflective).

    factor : (tests, entries, entries) Cholesky factors of the covariance, which stay as they are during the search.
    extra : further residuals; held : {position: value} of unknowns that stay where they are.
    """
    fences, hold, middle = Fences(objective), ANCHOR / box.width, box.middle
    memory: dict[bytes, tuple[Floats, Floats]] = {}
    whole = np.array(start, float)
    whole[list(held or {})] = list((held or {}).values())
    free = np.setdiff1d(np.arange(whole.size), list(held or {}))

    def at(part: Floats) -> Floats:
        x = whole.copy()
        x[free] = part
        return x

    def evaluate(part: Floats) -> tuple[Floats, Floats]:
        key = part.tobytes()
        if key not in memory:
            memory.clear()
            x = at(part)
            residuals = objective.at(x)
            assert residuals.jacobian is not None
            both = np.concatenate([residuals.values[..., None], residuals.jacobian], axis=-1)
            white = np.linalg.solve(factor, both)[objective.entries.present]
            values = [white[:, 0], fences.values(x), hold * (x - middle)]
            slopes = [white[:, 1:], fences.jacobian(x), np.diag(hold)]
            if extra is not None:
                values.append(extra.residuals(x))
                slopes.append(extra.jacobian(x))
            memory[key] = np.concatenate(values), np.concatenate(slopes)[:, free]
        return memory[key]

    begun = np.clip(whole, box.low + 1e-9 * box.width, box.high - 1e-9 * box.width)[free]
    if not all(np.isfinite(part).all() for part in evaluate(begun)):
        raise FitError(
            f"law '{objective.law.name}': its prediction is no number where a refinement begins; narrow the bounds of "
            "its parameters, or give more starts"
        )
    scale, own = 0.1 * box.width, objective.unknowns.size
    if own:
        scale[-own:] = np.minimum(objective.unknowns.sd, box.width[-own:])
    result = least_squares(
        lambda part: evaluate(part)[0],
        begun,
        jac=lambda part: evaluate(part)[1],
        bounds=(box.low[free], box.high[free]),
        x_scale=scale[free],
        loss=loss,
        max_nfev=steps,
        ftol=tolerance,
        xtol=10 * tolerance,
        gtol=tolerance,
    )
    data = int(objective.entries.present.sum())
    return Minimum(
        at(np.asarray(result.x)), float(result.cost), bool(result.status > 0), int(result.nfev), result.fun[:data]
    )
