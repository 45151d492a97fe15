"""Local refinement: bounded least squares from one start, robust losses, and the records of a minimum and of a penalty.

Gauss-Newton steps with exact Jacobians, within a box that is the bounds and a trust region (Nocedal and Wright (2006),
Numerical Optimization, 10.3). Only what a simulation gives is made linear; penalties of bounds, with their corners, are
taken as they are, so that a value at its bound costs no more simulations than another.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from scipy.optimize import least_squares, lsq_linear

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
        gives, to whose squares the loss is applied, and those without, such as penalties, which no step linearises.
    start : (unknowns,) within the bounds; scale : (unknowns,) the scale of a step in each unknown.
    fixed : {position: value} of unknowns that keep their values.
    """
    free = np.setdiff1d(np.arange(start.size), list(fixed))
    radius, evaluations, x = FIRST_RADIUS, 1, start.copy()
    residuals, jacobian = data(x)
    data_cost, other_cost = _cost(residuals, loss), _cost(others(x)[0])
    while True:
        root_weight = np.sqrt(robust_weight(residuals**2, loss))
        basis, triangle = np.linalg.qr(root_weight[:, None] * jacobian[:, free])
        projected = basis.T @ (root_weight * residuals)
        reach = radius * scale[free]
        box = np.stack([np.maximum((bounds.lower - x)[free], -reach), np.minimum((bounds.upper - x)[free], reach)])
        trial = x.copy()
        step = _bounded_step(projected, triangle, others, x, free, box)
        trial[free] += step
        trial = bounds.clip(trial)
        expected = _cost(projected) - _cost(projected + triangle @ step) + other_cost - _cost(others(trial)[0])
        converged = expected <= tolerances.tolerance * (data_cost + other_cost) or radius < LEAST_RADIUS
        if converged or evaluations >= tolerances.max_steps:
            return Minimum(x, data_cost + other_cost, bool(converged), evaluations, residuals)
        trial_residuals, trial_jacobian = data(trial)
        evaluations += 1
        finite = np.isfinite(trial_residuals).all() and np.isfinite(trial_jacobian).all()
        costs = (_cost(trial_residuals, loss) if finite else np.inf), _cost(others(trial)[0])
        gain, length = data_cost + other_cost - sum(costs), float(np.abs(step / scale[free]).max())
        if gain < 0.25 * expected:
            radius = 0.25 * length
        elif gain > 0.75 * expected and length > 0.99 * radius:
            radius *= 2.0
        if gain > 0.0:
            x, residuals, jacobian, (data_cost, other_cost) = trial, trial_residuals, trial_jacobian, costs


System = Callable[[Floats], tuple[Floats, Floats]]
"""x (unknowns,) to residuals (rows,) and their derivatives (rows, unknowns)."""


FIRST_RADIUS, LEAST_RADIUS = 3.0, 1e-7
"""Of the trust region, in scales of a step: at first, and where no shorter step is tried."""


LINEAR_ENOUGH = 0.1
"""Error of what a step gains, over that gain, up to which residuals without simulation are taken as linear."""


def _cost(residuals: Floats, loss: str = "linear") -> float:
    return 0.5 * float(robust_loss(residuals**2, loss).sum())


def _bounded_step(projected: Floats, triangle: Floats, others: System, x: Floats, free: Ints, box: Floats) -> Floats:
    """(free,) the step s of least |projected + triangle s|^2 + |others(x + s)|^2 within a box (2, free).

    First with `others` linear, by active sets; where they are not, by a search that costs no simulation.
    """

    def at(step: Floats) -> tuple[Floats, Floats]:
        moved = x.copy()
        moved[free] += step
        values, slopes = others(moved)
        return np.concatenate([projected + triangle @ step, values]), np.concatenate([triangle, slopes[:, free]])

    values, slopes = at(np.zeros(free.size))
    size = np.maximum(np.linalg.norm(slopes, axis=0), 1e-300)
    low, high = box[0], np.maximum(box[1], box[0] + 1e-12 * np.maximum(1.0, np.abs(box[0])))
    step = np.linalg.lstsq(slopes / size, -values, rcond=None)[0] / size
    if not ((step >= low) & (step <= high)).all():
        step = lsq_linear(slopes / size, -values, bounds=(low * size, high * size), method="bvls").x / size
    step = np.clip(step, low, high)
    linear, exact = values + slopes @ step, at(step)[0]
    if abs(_cost(exact) - _cost(linear)) <= LINEAR_ENOUGH * max(_cost(values) - _cost(linear), 0.0):
        return np.asarray(step)
    start = step if _cost(exact) < _cost(values) else np.zeros(free.size)
    found = least_squares(lambda s: at(s)[0], start, lambda s: at(s)[1], bounds=(low, high), x_scale=1.0 / size)
    return np.asarray(found.x)


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
