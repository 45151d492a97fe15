"""Least squares from several starts at once, all of which share each prediction, by paths of Gauss-Newton steps.

A start that meets the path of a better one ends where that does (see search.local_refinement for the steps).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.problem import FAILED_COST, LeastSquaresProblem
from creepkit.inverse.search.local_refinement import IterationCallback, LeastSquaresPath, Minimum

MAX_STEPS = 40


TOLERANCE = 1e-5
"""Relative decrease of the cost that a step must promise; else a start has converged."""


MET = 0.02
"""Distance over the width of the bounds, in every coordinate, from which on the worse of two starts goes as the other.
"""


CONTINUED = 4
"""Of the best minima, how many are refined further where they have not converged."""


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
    ends = _BatchedPaths(problem, np.array(starts, float)).run(max_steps, progress, [] if costs is None else costs)
    return sorted([*_continued(problem, ends[:CONTINUED]), *ends[CONTINUED:]], key=lambda minimum: minimum.cost)


def _continued(problem: LeastSquaresProblem, minima: Sequence[Minimum]) -> list[Minimum]:
    """Minima that have not converged are refined one by one, in a trust region, which follows curved valleys better."""
    finished: list[Minimum] = []
    continued: dict[bytes, Minimum] = {}
    for minimum in minima:
        if not minimum.converged:
            key = minimum.x.tobytes()  # several starts may have gone one way
            continued[key] = continued[key] if key in continued else problem.minimise(minimum.x)
            lower = continued[key]
            evaluations = lower.evaluations + minimum.evaluations
            minimum = replace(lower, evaluations=evaluations) if lower.cost < minimum.cost else minimum
        finished.append(minimum)
    return finished


class _BatchedPaths:
    """The paths of all starts, whose trial points share each prediction."""

    def __init__(self, problem: LeastSquaresProblem, starts: Floats) -> None:
        self.problem, scale = problem, 0.1 * problem.bounds.width
        self.paths = [
            LeastSquaresPath(start, problem.other_system, problem.bounds, scale, loss=problem.loss)
            for start in problem.bounds.clip(starts)
        ]
        self.follows = list(range(len(self.paths)))
        self._evaluate({k: path.x for k, path in enumerate(self.paths)})

    def run(self, max_steps: int, progress: IterationCallback | None, costs: list[Floats]) -> list[Minimum]:
        """Step until all have converged."""
        active = [k for k, path in enumerate(self.paths) if np.isfinite(path.cost)]
        for _ in range(max_steps):
            costs.append(np.array([min(path.cost, FAILED_COST) for path in self.paths]))
            if progress is not None:
                progress("start", len(self.paths) - len(active), len(self.paths))
            trials = {k: self.paths[k].trial(TOLERANCE) for k in active if not self._has_met_another(k)}
            going = {k: trial for k, trial in trials.items() if trial is not None}
            active = list(going)
            if not active:
                break
            self._evaluate(going)
        ends = [self.paths[self._end_of(k)].minimum() for k in range(len(self.paths))]
        minima = [
            replace(end, evaluations=path.evaluations)
            if np.isfinite(end.cost)
            else replace(end, cost=FAILED_COST, whitened_residuals=None)
            for end, path in zip(ends, self.paths, strict=True)
        ]
        return sorted(minima, key=lambda minimum: minimum.cost)

    def _has_met_another(self, k: int) -> bool:
        """Whether a start has met the path of a better one, which it follows from there."""
        own, width = self.paths[k], MET * self.problem.bounds.width
        better = [
            j
            for j, other in enumerate(self.paths)
            if other.cost < own.cost and (np.abs(other.x - own.x) <= width).all()
        ]
        if better:
            self.follows[k] = min(better, key=lambda j: self.paths[j].cost)
        return bool(better)

    def _end_of(self, k: int) -> int:
        """The start whose path a start followed to its end."""
        while self.follows[k] != k:
            k = self.follows[k]
        return k

    def _evaluate(self, points: Mapping[int, Floats]) -> None:
        """Evaluate points (parameters,), {position of the start: point}, in one prediction."""
        residuals, jacobians = self.problem.candidate_jacobian(np.stack([*points.values()]))
        for (k, u), residual, jacobian in zip(points.items(), residuals, jacobians, strict=True):
            whitened = self.problem.whiten(np.concatenate([residual[..., None], jacobian], axis=-1))
            self.paths[k].evaluated(u, whitened[:, 0], whitened[:, 1:])
