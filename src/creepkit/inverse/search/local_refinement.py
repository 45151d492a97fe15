"""Local refinement: bounded least squares from one start, robust losses, and the records of a minimum and of a penalty.

Gauss-Newton steps with exact Jacobians, within a box that is the bounds and a trust region (Nocedal and Wright (2006),
Numerical Optimization, 10.3). Only what a simulation gives is made linear; penalties of bounds, with their corners, are
taken as they are, so that a value at its bound costs no more simulations than another.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from scipy.optimize import lsq_linear

from creepkit.arrays import Floats, Ints
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


class Penalty(AdditionalResiduals, Protocol):
    """A penalty that is added to the cost, and its representation as residuals for least squares."""

    def values(self, u: Floats) -> Floats:
        """(candidates,) - what is added to the cost; u : (candidates, parameters)."""
        ...

    def frozen_weights_at(self, u: Floats) -> AdditionalResiduals:
        """The residuals with weights taken at u (parameters,), and kept."""
        ...


@dataclass(frozen=True)
class Minimum:
    """The end of a search.

    x : (unknowns,) where it ended; cost : half the sum of squares there; converged : whether it met its tolerance;
    evaluations : how many points it evaluated.
    whitened_residuals : (data,) -, whitened residuals of the data there, where they were kept.
    terms_off : terms of a sum that the search switched off.
    """

    x: Floats
    cost: float
    converged: bool
    evaluations: int
    whitened_residuals: Floats | None = field(default=None, repr=False)
    terms_off: tuple[str, ...] = ()


@dataclass(frozen=True)
class Tolerances:
    """When a local refinement ends: after so many steps, or at this relative change of the cost."""

    max_steps: int = 30
    tolerance: float = 1e-5


System = Callable[[Floats], tuple[Floats, Floats]]
"""x (unknowns,) to residuals (rows,) and their derivatives (rows, unknowns)."""


FIRST_RADIUS, LEAST_RADIUS = 3.0, 1e-7
"""Of the trust region, in scales of a step: at first, and where no shorter step is tried."""


LINEARISATIONS, LINEAR_ENOUGH = 8, 1e-3
"""How often residuals without simulation are made linear for one step, and the error of its gain that ends that."""


class LeastSquaresPath:
    """Bounded least squares from one start by Gauss-Newton steps in a trust region; see bounded_least_squares()."""

    def __init__(
        self,
        start: Floats,
        others: System,
        bounds: Bounds,
        scale: Floats,
        fixed: Sequence[int] = (),
        loss: str = "linear",
    ) -> None:
        """others : residuals without simulation, such as penalties, which no step makes linear for good."""
        self.x, self.others, self.bounds, self.scale, self.loss = start.copy(), others, bounds, scale, loss
        self.free = np.setdiff1d(np.arange(start.size), fixed)
        self.radius, self.evaluations, self.converged = FIRST_RADIUS, 0, False
        self.data_cost = self.other_cost = np.inf
        self.residuals, self.jacobian = np.zeros(0), np.zeros((0, start.size))
        self.expected = self.length = 0.0

    @property
    def cost(self) -> float:
        """Half the sum of squares, with the loss of the data."""
        return self.data_cost + self.other_cost

    def minimum(self) -> Minimum:
        """Where it is."""
        return Minimum(self.x, self.cost, self.converged, self.evaluations, self.residuals)

    def trial(self, tolerance: float) -> Floats | None:
        """(unknowns,) the next point to evaluate; None where a step would gain less than this share of the cost."""
        free, root_weight = self.free, np.sqrt(robust_weight(self.residuals**2, self.loss))
        basis, triangle = np.linalg.qr(root_weight[:, None] * self.jacobian[:, free])
        projected = basis.T @ (root_weight * self.residuals)
        reach, x = self.radius * self.scale[free], self.x
        low, high = (limit[free] - x[free] for limit in (self.bounds.lower, self.bounds.upper))
        step = _bounded_step(
            projected, triangle, self.others, x, free, (np.maximum(low, -reach), np.minimum(high, reach))
        )
        trial = x.copy()
        trial[free] += step
        trial = self.bounds.clip(trial)
        gain = _cost(projected) - _cost(projected + triangle @ step)
        self.expected = gain + self.other_cost - _cost(self.others(trial)[0])
        self.length = float(np.abs(step / self.scale[free]).max(initial=0.0))
        self.converged = bool(self.expected <= tolerance * self.cost or self.radius < LEAST_RADIUS)
        return None if self.converged else trial

    def evaluated(self, trial: Floats, residuals: Floats, jacobian: Floats) -> None:
        """Go to a trial point whose cost is lower, and change the trust region by how well the gain was foreseen."""
        self.evaluations += 1
        finite = np.isfinite(residuals).all() and np.isfinite(jacobian).all()
        data_cost = _cost(residuals, self.loss) if finite else np.inf
        other_cost = _cost(self.others(trial)[0])
        gain = self.cost - data_cost - other_cost if finite else -np.inf
        if np.isfinite(self.cost):
            if gain < 0.25 * self.expected:
                self.radius = 0.25 * self.length
            elif gain > 0.75 * self.expected and self.length > 0.99 * self.radius:
                self.radius *= 2.0
        if gain > 0.0:
            self.x, self.residuals, self.jacobian = trial, residuals, jacobian
            self.data_cost, self.other_cost = data_cost, other_cost


def bounded_least_squares(
    data: System,
    others: System,
    start: Floats,
    bounds: Bounds,
    scale: Floats,
    tolerances: Tolerances,
    *,
    fixed: Mapping[int, float],
    loss: str,
) -> Minimum:
    """Bounded least squares by Gauss-Newton steps within a trust region; it ends where a step would gain nothing more.

    data, others : x (unknowns,) to residuals (rows,) and their derivatives (rows, unknowns): those that a simulation
        gives, to which the loss is applied, and those without, such as penalties.
    start : (unknowns,) within the bounds; scale : (unknowns,) the scale of a step in each unknown.
    fixed : {position: value} of unknowns that keep their values.
    """
    path = LeastSquaresPath(start, others, bounds, scale, list(fixed), loss)
    path.evaluated(start, *data(start))
    while (trial := path.trial(tolerances.tolerance)) is not None and path.evaluations < tolerances.max_steps:
        path.evaluated(trial, *data(trial))
    return path.minimum()


def _cost(residuals: Floats, loss: str = "linear") -> float:
    return 0.5 * float(robust_loss(residuals**2, loss).sum())


def _bounded_step(
    projected: Floats, triangle: Floats, others: System, x: Floats, free: Ints, box: tuple[Floats, Floats]
) -> Floats:
    """(free,) the step s of least |projected + triangle s|^2 + |others(x + s)|^2 within a box: (free,) low and high.

    With `others` made linear in turn where the last step ended, by active sets; that costs no simulation.
    """
    low, high = box
    high = np.maximum(high, low + 1e-12 * np.maximum(1.0, np.abs(low)))

    def at(step: Floats) -> tuple[Floats, Floats]:
        moved = x.copy()
        moved[free] += step
        values, slopes = others(moved)
        return np.concatenate([projected + triangle @ step, values]), np.concatenate([triangle, slopes[:, free]])

    step = best = np.zeros(free.size)
    values, slopes = at(step)
    least = start_cost = _cost(values)
    for _ in range(LINEARISATIONS):
        size = np.maximum(np.linalg.norm(slopes, axis=0), 1e-300)
        right = slopes @ step - values
        step = np.linalg.lstsq(slopes / size, right, rcond=None)[0] / size
        if not ((step >= low) & (step <= high)).all():
            step = lsq_linear(slopes / size, right, bounds=(low * size, high * size), method="bvls").x / size
        step = np.clip(step, low, high)
        foreseen = _cost(slopes @ step - right)
        values, slopes = at(step)
        cost = _cost(values)
        best, least = (step, cost) if cost < least else (best, least)
        if abs(cost - foreseen) <= LINEAR_ENOUGH * max(start_cost - foreseen, 0.0):
            break
    return np.asarray(best)


def robust_loss(squared: Floats, loss: str) -> Floats:
    """(...,) - the losses of scipy; squared : (...,) squares of whitened residuals."""
    if loss == "linear":
        return squared
    if loss == "soft_l1":
        return np.asarray(2.0 * (np.sqrt(1.0 + squared) - 1.0))
    if loss == "huber":
        return np.where(squared <= 1.0, squared, 2.0 * np.sqrt(np.maximum(squared, 1.0)) - 1.0)
    return np.asarray(np.log1p(squared) if loss == "cauchy" else np.arctan(squared))


def robust_weight(squared: Floats, loss: str) -> Floats:
    """(...,) - their derivatives at squared (...,): the weights of iteratively reweighted least squares."""
    if loss == "linear":
        return np.ones_like(squared)
    if loss == "soft_l1":
        return np.asarray(1.0 / np.sqrt(1.0 + squared))
    if loss == "huber":
        return np.where(squared <= 1.0, 1.0, 1.0 / np.sqrt(np.maximum(squared, 1.0)))
    return np.asarray(1.0 / (1.0 + squared) if loss == "cauchy" else 1.0 / (1.0 + squared**2))
