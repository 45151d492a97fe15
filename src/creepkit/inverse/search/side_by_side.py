"""Levenberg-Marquardt from several starts at once: one prediction serves all of them.

A predictor asked for ten candidates takes hardly longer than for one. Steps are projected on the box: a coordinate
that stands at its bound and is pushed outwards is left out of the step (Kanzow, Yamashita & Fukushima (2004), J.
Comput. Appl. Math. 172, 375); a step is taken only if the cost falls.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.inverse.fences import Fences
from creepkit.inverse.search.landscape import WORST, Landscape, rho, rho_slope
from creepkit.inverse.search.refining import ANCHOR, Minimum, Progress

STEPS = 40
TOLERANCE = 1e-5
"""Relative fall of the cost below which a start has arrived, twice in turn."""
BY_ITSELF = 4
"""Of the best ends, how many go on where they have not arrived."""
DAMPING = (1e-3, 1e8)
"""First damping, relative to the diagonal of J'J over the box, and the one at which a start has nowhere to go."""


def refined_side_by_side(
    landscape: Landscape, starts: Sequence[Floats], *, steps: int = STEPS, progress: Progress | None = None,
    costs: list[Floats] | None = None,
) -> list[Minimum]:  # fmt: skip
    """The minima that the starts lead to, best first; costs : is given the costs of all starts after each step.

    Damage that runs away makes a cost with kinks, at which projected steps come to rest: laws with internal variables,
    and tests that are followed to rupture, are refined one by one in a trust region.
    """
    if landscape.objective.entries.whole.any() or landscape.objective.law.states:
        found = []
        for k, u in enumerate(starts):
            found.append(landscape.refine(u, steps=30))
            if progress is not None:
                progress("start", k + 1, len(starts))
        return sorted(found, key=lambda minimum: minimum.cost)
    ends = _Marquardt(landscape, np.array(starts, float)).run(steps, progress, [] if costs is None else costs)
    return sorted([*_finished(landscape, ends[:BY_ITSELF]), *ends[BY_ITSELF:]], key=lambda minimum: minimum.cost)


def _finished(landscape: Landscape, ends: Sequence[Minimum]) -> list[Minimum]:
    """Minima that have not arrived go on by themselves, in a trust region that follows bent valleys better."""
    found = []
    for end in ends:
        if not end.converged:
            on = landscape.refine(end.u)
            end = replace(on, evaluations=on.evaluations + end.evaluations) if on.cost < end.cost else end
        found.append(end)
    return found


class _Marquardt:
    """The state of all starts: where they are, their residuals and Jacobians, and how damped they step."""

    def __init__(self, landscape: Landscape, starts: Floats) -> None:
        self.landscape, self.box = landscape, landscape.box
        self.fences = Fences(landscape.objective)
        self.u = self.box.clip(starts)
        count, size = self.u.shape
        self.cost, self.white = np.full(count, np.inf), [np.zeros(0)] * count
        self.slope, self.curve = np.zeros((count, size)), np.zeros((count, size, size))
        self.damping, self.idle = np.full(count, DAMPING[0]), np.zeros(count, int)
        self.asked = np.zeros(count, int)
        self._take(np.arange(count), self.u)

    def run(self, steps: int, progress: Progress | None, costs: list[Floats]) -> list[Minimum]:
        """Step until all have arrived."""
        for _ in range(steps):
            costs.append(self.cost.copy())
            going = np.flatnonzero((self.idle < 2) & (self.damping < DAMPING[1]))
            if progress is not None:
                progress("start", len(self.u) - going.size, len(self.u))
            if not going.size:
                break
            self._take(going, np.stack([self._step(int(k)) for k in going]))
        ends = [
            Minimum(self.u[k], float(self.cost[k]), bool(self.idle[k] >= 2), int(self.asked[k]), self.white[k])
            for k in range(len(self.u))
        ]
        return sorted(ends, key=lambda minimum: minimum.cost)

    def _step(self, k: int) -> Floats:
        """Where a start tries to go next."""
        scale = self.box.width
        slope, curve = self.slope[k] * scale, self.curve[k] * np.outer(scale, scale)
        stuck = ((self.u[k] <= self.box.low) & (slope > 0)) | ((self.u[k] >= self.box.high) & (slope < 0))
        free = np.flatnonzero(~stuck)
        if not free.size:
            return np.asarray(self.u[k])
        inner = curve[np.ix_(free, free)]
        inner = inner + self.damping[k] * np.diag(np.maximum(np.diag(inner), 1e-12 * np.trace(inner) + 1e-300))
        move = np.zeros(scale.size)
        move[free] = -np.linalg.solve(inner, slope[free])
        return np.asarray(self.box.clip(self.u[k] + np.clip(move, -0.3, 0.3) * scale))

    def _take(self, which: Ints, points: Floats) -> None:
        """Look at points, and move there the starts whose cost falls."""
        residuals, jacobians = self.landscape.objective.side_by_side(points)
        data = self.landscape.objective.entries.present
        factor = self.landscape.factor
        for k, u, values, jacobian in zip(which, points, residuals, jacobians, strict=True):
            self.asked[k] += 1
            both = np.concatenate([values[..., None], jacobian], axis=-1)
            white = np.linalg.solve(factor, both)[data]
            self._judge(int(k), u, white[:, 0], white[:, 1:])

    def _judge(self, k: int, u: Floats, white: Floats, jacobian: Floats) -> None:
        hold = ANCHOR / self.box.width
        walls = np.concatenate([self.fences.values(u), hold * (u - self.box.middle)])
        cost = 0.5 * float(rho(white**2, self.landscape.loss).sum() + (walls**2).sum())
        penalty = self.landscape.penalty
        cost += 0.0 if penalty is None else float(penalty.values(u[None])[0])
        known = np.isfinite(cost) and np.isfinite(jacobian).all()
        cost = cost if known else WORST
        if not cost < self.cost[k]:
            self.damping[k] *= 8.0
            self.idle[k] += int(cost <= self.cost[k] * (1.0 + TOLERANCE))
            return
        fall = (self.cost[k] - cost) / max(cost, 1e-300)
        self.idle[k] = self.idle[k] + 1 if fall < TOLERANCE else 0
        self.damping[k] = max(self.damping[k] * 0.1, 1e-12)
        self.u[k], self.cost[k], self.white[k] = u, cost, white
        if not known:
            return  # without a direction it stays where it is
        weight = rho_slope(white**2, self.landscape.loss)
        slopes = np.concatenate([self.fences.jacobian(u), np.diag(hold)])
        self.slope[k] = jacobian.T @ (weight * white) + slopes.T @ walls
        self.curve[k] = (jacobian.T * weight) @ jacobian + slopes.T @ slopes
        if penalty is not None:
            near = penalty.at(u)
            drawn = near.jacobian(u)
            self.slope[k] += drawn.T @ near.residuals(u)
            self.curve[k] += drawn.T @ drawn
