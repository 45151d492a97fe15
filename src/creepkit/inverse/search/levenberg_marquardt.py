"""Batched Levenberg-Marquardt: least squares from several starts, all of which share each prediction.

Steps are projected on the bounds: a coordinate that stands at its bound and is pushed outwards is left out of the step
(Kanzow, Yamashita & Fukushima (2004), J. Comput. Appl. Math. 172, 375); a step is accepted only if the cost falls.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.inverse.problem import FAILED_COST, PRIOR_STRENGTH, LeastSquaresProblem
from creepkit.inverse.search.local_refinement import IterationCallback, Minimum, robust_loss, robust_weight

MAX_STEPS = 40


TOLERANCE = 1e-5
"""Relative decrease of the cost below which a start has converged, twice in turn."""


CONTINUED = 4
"""Of the best minima, how many are refined further where they have not converged."""


DAMPING_RANGE = (1e-3, 1e8)
"""First damping, relative to the diagonal of J'J over the bounds, and the one at which a start is given up."""


def batched_levenberg_marquardt(
    problem: LeastSquaresProblem,
    starts: Sequence[Floats],
    *,
    max_steps: int = MAX_STEPS,
    progress: IterationCallback | None = None,
    costs: list[Floats] | None = None,
) -> list[Minimum]:
    """The minima that the starts lead to, best first.

    starts : (parameters,) each; costs : receives the costs of all starts, (starts,), after each step.

    The cost of laws with damage has kinks, at which projected steps come to rest: laws with internal variables,
    and tests that are followed to rupture, are refined one by one in a trust region.
    """
    if problem.observations.followed_to_rupture.any() or problem.law.states:
        minima = []
        for k, u in enumerate(starts):
            minima.append(problem.minimise(u))
            if progress is not None:
                progress("start", k + 1, len(starts))
        return sorted(minima, key=lambda minimum: minimum.cost)
    ends = _BatchedLevenbergMarquardt(problem, np.array(starts, float)).run(
        max_steps, progress, [] if costs is None else costs
    )
    return sorted([*_continued(problem, ends[:CONTINUED]), *ends[CONTINUED:]], key=lambda minimum: minimum.cost)


def _continued(problem: LeastSquaresProblem, minima: Sequence[Minimum]) -> list[Minimum]:
    """Minima that have not converged are refined one by one, in a trust region, which follows curved valleys better."""
    finished = []
    for minimum in minima:
        if not minimum.converged:
            continued = problem.minimise(minimum.x)
            minimum = (
                replace(continued, evaluations=continued.evaluations + minimum.evaluations)
                if continued.cost < minimum.cost
                else minimum
            )
        finished.append(minimum)
    return finished


class _BatchedLevenbergMarquardt:
    """The state of all starts: positions, residuals, gradients and Hessians, and damping."""

    def __init__(self, problem: LeastSquaresProblem, starts: Floats) -> None:
        self.problem, self.bounds = problem, problem.bounds
        self.bound_penalties = problem.bound_penalties
        self.u = self.bounds.clip(starts)
        count, size = self.u.shape
        self.cost, self.whitened = np.full(count, np.inf), [np.zeros(0)] * count
        self.gradient, self.hessian = np.zeros((count, size)), np.zeros((count, size, size))
        self.damping, self.stalled_steps = np.full(count, DAMPING_RANGE[0]), np.zeros(count, int)
        self.evaluations = np.zeros(count, int)
        self._evaluate(np.arange(count), self.u)

    def run(self, max_steps: int, progress: IterationCallback | None, costs: list[Floats]) -> list[Minimum]:
        """Step until all have converged."""
        for _ in range(max_steps):
            costs.append(self.cost.copy())
            active = np.flatnonzero((self.stalled_steps < 2) & (self.damping < DAMPING_RANGE[1]))
            if progress is not None:
                progress("start", len(self.u) - active.size, len(self.u))
            if not active.size:
                break
            self._evaluate(active, np.stack([self._trial_point(int(k)) for k in active]))
        minima = [
            Minimum(
                self.u[k],
                float(self.cost[k]),
                bool(self.stalled_steps[k] >= 2),
                int(self.evaluations[k]),
                self.whitened[k],
            )
            for k in range(len(self.u))
        ]
        return sorted(minima, key=lambda minimum: minimum.cost)

    def _trial_point(self, k: int) -> Floats:
        """(parameters,) the next trial point of a start."""
        scale = self.bounds.width
        gradient, hessian = self.gradient[k] * scale, self.hessian[k] * np.outer(scale, scale)
        blocked = ((self.u[k] <= self.bounds.lower) & (gradient > 0)) | (
            (self.u[k] >= self.bounds.upper) & (gradient < 0)
        )
        free = np.flatnonzero(~blocked)
        if not free.size:
            return np.asarray(self.u[k])
        free_hessian = hessian[np.ix_(free, free)]
        free_hessian = free_hessian + self.damping[k] * np.diag(
            np.maximum(np.diag(free_hessian), 1e-12 * np.trace(free_hessian) + 1e-300)
        )
        step = np.zeros(scale.size)
        step[free] = -np.linalg.solve(free_hessian, gradient[free])
        return np.asarray(self.bounds.clip(self.u[k] + np.clip(step, -0.3, 0.3) * scale))

    def _evaluate(self, indices: Ints, points: Floats) -> None:
        """Evaluate points (starts, parameters), and move the starts whose cost decreases."""
        residuals, jacobians = self.problem.candidate_jacobian(points)
        for k, u, residual, jacobian in zip(indices, points, residuals, jacobians, strict=True):
            self.evaluations[k] += 1
            whitened = self.problem.whiten(np.concatenate([residual[..., None], jacobian], axis=-1))
            self._accept_or_reject(int(k), u, whitened[:, 0], whitened[:, 1:])

    def _accept_or_reject(self, k: int, u: Floats, whitened: Floats, jacobian: Floats) -> None:
        prior_weight = PRIOR_STRENGTH / self.bounds.width
        penalty_residuals = np.concatenate([self.bound_penalties.residuals(u), prior_weight * (u - self.bounds.centre)])
        cost = 0.5 * float(robust_loss(whitened**2, self.problem.loss).sum() + (penalty_residuals**2).sum())
        penalty = self.problem.penalty
        cost += 0.0 if penalty is None else float(penalty.values(u[None])[0])
        finite = np.isfinite(cost) and np.isfinite(jacobian).all()
        cost = cost if finite else FAILED_COST
        if not cost < self.cost[k]:
            self.damping[k] *= 8.0
            self.stalled_steps[k] += int(cost <= self.cost[k] * (1.0 + TOLERANCE))
            return
        decrease = (self.cost[k] - cost) / max(cost, 1e-300)
        self.stalled_steps[k] = self.stalled_steps[k] + 1 if decrease < TOLERANCE else 0
        self.damping[k] = max(self.damping[k] * 0.1, 1e-12)
        self.u[k], self.cost[k], self.whitened[k] = u, cost, whitened
        if not finite:
            return  # without a direction it stays where it is
        weight = robust_weight(whitened**2, self.problem.loss)
        penalty_jacobian = np.concatenate([self.bound_penalties.jacobian(u), np.diag(prior_weight)])
        self.gradient[k] = jacobian.T @ (weight * whitened) + penalty_jacobian.T @ penalty_residuals
        self.hessian[k] = (jacobian.T * weight) @ jacobian + penalty_jacobian.T @ penalty_jacobian
        if penalty is not None:
            local_penalty = penalty.frozen_weights_at(u)
            local_jacobian = local_penalty.jacobian(u)
            self.gradient[k] += local_jacobian.T @ local_penalty.residuals(u)
            self.hessian[k] += local_jacobian.T @ local_jacobian
