"""Local refinement: bounded least squares from one start, a robust loss, and the record of a minimum.

The trust region reflective method of scipy, with analytic Jacobians.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from scipy.optimize import least_squares

from creepkit.arrays import Floats
from creepkit.inverse.bounds import Bounds
from creepkit.inverse.variance_components import BOUND_TOLERANCE

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
    evaluations : how many points it evaluated. promised : cost at the end of a further step of Gauss and Newton.
    whitened_residuals : (data,) -, whitened residuals of the data there, where they were kept.
    """

    x: Floats
    cost: float
    converged: bool
    promised: float = np.inf
    whitened_residuals: Floats | None = field(default=None, repr=False)


@dataclass(frozen=True)
class Tolerances:
    """When a local refinement ends.

    After so many steps, at this relative change of the cost, or where a step of Gauss and Newton promises less than the
    relative gain, which is judged before the step is simulated.
    """

    max_steps: int = 30
    tolerance: float = 1e-5
    gain: float = 0.0


class _PromisesNothing(Exception):
    """Ends a refinement at a point from which a step would gain too little."""


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
    lower, upper, cache = bounds.lower[free], bounds.upper[free], dict[bytes, tuple[Minimum, Floats]]()

    def evaluate(free_values: Floats) -> tuple[Minimum, Floats]:
        """The point as an end, and the derivatives there."""
        key = free_values.tobytes()
        if key not in cache:
            cache.clear()
            x = start.copy()
            x[free] = free_values
            values, jacobian = system(x)
            weights = 1.0 / np.sqrt(1.0 + values**2) if robust else np.ones_like(values)
            cost = 0.5 * float((robust_loss(values**2) if robust else values**2).sum())
            gain = _promised_gain(values, jacobian[:, free], weights, lower - free_values, upper - free_values)
            ends = gain <= tolerances.gain * cost
            cache[key] = Minimum(x, cost, ends, cost - gain, values), jacobian[:, free]
        return cache[key]

    def jacobian(free_values: Floats) -> Floats:
        end, derivatives = evaluate(free_values)
        if end.converged:
            raise _PromisesNothing
        return derivatives

    try:
        result = least_squares(
            lambda part: np.asarray(evaluate(part)[0].whitened_residuals),
            start[free],
            jac=jacobian,
            bounds=(lower, upper),
            x_scale=scale[free],
            loss="soft_l1" if robust else "linear",
            max_nfev=tolerances.max_steps,
            ftol=tolerances.tolerance,
            xtol=10 * tolerances.tolerance,
            gtol=tolerances.tolerance,
        )
    except _PromisesNothing:
        return next(iter(cache.values()))[0]
    return replace(evaluate(result.x)[0], converged=result.status > 0)


def _promised_gain(values: Floats, jacobian: Floats, weights: Floats, below: Floats, above: Floats) -> float:
    """How much lower than here the cost is by its linear model at the end of a step of Gauss and Newton.

    values : (rows,), jacobian : (rows, unknowns) there. weights : (rows,) derivative of the loss to squares.
    below, above : (unknowns,) steps to the bounds; an unknown that a bound holds takes no part.
    """
    gradient, tolerance = jacobian.T @ (weights * values), BOUND_TOLERANCE * (above - below)
    moves = ~((below > -tolerance) & (gradient > 0.0) | (above < tolerance) & (gradient < 0.0))
    normal_matrix = (jacobian[:, moves] * weights[:, None]).T @ jacobian[:, moves]
    size = np.sqrt(np.maximum(np.diag(normal_matrix), 1e-300))
    if not (np.isfinite(normal_matrix).all() and np.isfinite(gradient).all()):
        return np.inf
    scaled = gradient[moves] / size
    return 0.5 * float(scaled @ np.linalg.lstsq(normal_matrix / np.outer(size, size), scaled, rcond=1e-12)[0])


def robust_loss(squared: Floats) -> Floats:
    """(...,) - the loss "soft_l1" of scipy; squared : (...,) squares of whitened residuals."""
    return np.asarray(2.0 * (np.sqrt(1.0 + squared) - 1.0))
