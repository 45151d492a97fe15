"""Local refinement: bounded least squares from one start, a robust loss, and the record of a minimum.

The trust region reflective method of scipy, with analytic Jacobians.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from scipy.optimize import least_squares

from creepkit.arrays import Floats
from creepkit.inverse.bounds import Bounds

IterationCallback = Callable[[str, int, int], None]
"""Reports the progress of a search: (name of the step, how many are done, how many there are)."""


class AdditionalResiduals(Protocol):
    """Residuals beside those of the data: half the sum of their squares is added to the cost."""

    def residuals(self, x: Floats) -> Floats:
        """(additional,) - at x (unknowns,)."""
        ...

    def jacobian(self, x: Floats) -> Floats:
        """(additional, unknowns) their derivatives at x (unknowns,)."""
        ...


@dataclass(frozen=True)
class Minimum:
    """The end of a search.

    x : (unknowns,) where it ended; cost : half the sum of squares there; converged : whether it met its tolerance;
    evaluations : how many points it evaluated.
    whitened_residuals : (data,) -, whitened residuals of the data there, where they were kept.
    """

    x: Floats
    cost: float
    converged: bool
    evaluations: int
    whitened_residuals: Floats | None = field(default=None, repr=False)


@dataclass(frozen=True)
class Tolerances:
    """When a local refinement ends: after so many steps, or at this relative change of the cost."""

    max_steps: int = 30
    tolerance: float = 1e-5


def bounded_least_squares(
    system: Callable[[Floats], tuple[Floats, Floats]],
    start: Floats,
    bounds: Bounds,
    scale: Floats,
    tolerances: Tolerances,
    *,
    fixed: Mapping[int, float],
    robust: bool,
) -> Minimum:
    """Bounded least squares by the trust region reflective method of scipy.

    system : x (unknowns,) to residuals (rows,) and their derivatives (rows, unknowns).
    start : (unknowns,) within the bounds; scale : (unknowns,) the scale of a step in each unknown.
    fixed : {position: value} of unknowns that keep their values.
    """
    free = np.setdiff1d(np.arange(start.size), list(fixed))
    cache: dict[bytes, tuple[Floats, Floats]] = {}

    def at(free_values: Floats) -> Floats:
        x = start.copy()
        x[free] = free_values
        return x

    def evaluate(free_values: Floats) -> tuple[Floats, Floats]:
        key = free_values.tobytes()
        if key not in cache:
            cache.clear()
            values, jacobian = system(at(free_values))
            cache[key] = values, jacobian[:, free]
        return cache[key]

    result = least_squares(
        lambda part: evaluate(part)[0],
        start[free],
        jac=lambda part: evaluate(part)[1],
        bounds=(bounds.lower[free], bounds.upper[free]),
        x_scale=scale[free],
        loss="soft_l1" if robust else "linear",
        max_nfev=tolerances.max_steps,
        ftol=tolerances.tolerance,
        xtol=10 * tolerances.tolerance,
        gtol=tolerances.tolerance,
    )
    return Minimum(at(np.asarray(result.x)), float(result.cost), bool(result.status > 0), int(result.nfev), result.fun)


def robust_loss(squared: Floats) -> Floats:
    """(...,) - the loss "soft_l1" of scipy; squared : (...,) squares of whitened residuals."""
    return np.asarray(2.0 * (np.sqrt(1.0 + squared) - 1.0))
