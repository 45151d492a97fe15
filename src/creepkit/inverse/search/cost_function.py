"""The cost function that a global search minimises, the interface of a search, and its convergence history."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.inverse.bound_penalties import BoundPenalties
from creepkit.inverse.residuals import ResidualFunction
from creepkit.inverse.search.local_refinement import Bounds, IterationCallback, Minimum, bounded_least_squares
from creepkit.inverse.settings import IdentificationSettings
from creepkit.presentation import present

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from creepkit.inverse.sparsity.penalties import PenalisedTerms


FAILED_COST = 1e12
"""Cost of a candidate that cannot be predicted at all."""


@dataclass(frozen=True)
class CostFunction:
    """The cost of conditioned coordinates u, with the unknowns of tests at their means.

    objective : residuals of the predictor that is searched; factor : (tests, entries, entries) Cholesky factors of
    the covariance by which they are weighed, broad and fixed; loss : of white residuals, scipy's names.
    """

    objective: ResidualFunction
    bounds: Bounds
    covariance_factor: Floats
    settings: IdentificationSettings
    penalty: PenalisedTerms | None = None
    loss: str = "linear"

    def cost(self, u: Floats) -> Floats:
        """(candidates,) half the sum of squared white residuals, walls and penalty; u : (candidates, parameters).

        All candidates and histories are one prediction. Finite, whatever happens to a candidate.
        """
        inside = self.bounds.clip(u)
        whitened = self.whitened(self.objective.batch_residuals(inside))
        total = 0.5 * robust_loss(whitened**2, self.loss).sum(axis=1)
        total += 0.5 * (self._bound_penalties.residuals(inside) ** 2).sum(axis=1)
        if self.penalty is not None:
            total += self.penalty.values(inside)
        return np.where(np.isfinite(total), total, FAILED_COST)

    @cached_property
    def _bound_penalties(self) -> BoundPenalties:
        return BoundPenalties(self.objective)

    def whitened(self, residuals: Floats) -> Floats:
        """(candidates, data) white residuals of residuals (candidates, tests, entries)."""
        whitened = np.linalg.solve(self.covariance_factor, np.moveaxis(residuals, 0, -1))
        return np.asarray(whitened[self.objective.observations.present].T)

    def refine(
        self, u: Floats, max_steps: int = 30, tolerance: float = 1e-5, fixed: Mapping[int, float] | None = None
    ) -> Minimum:
        """Bounded least squares from u; held : {position: value} of coordinates that stay where they are."""
        return bounded_least_squares(
            self.objective, self.bounds, self.covariance_factor, u, loss=self.loss, max_steps=max_steps, tolerance=tolerance,
            additional=self.penalty, fixed=fixed,
        )  # fmt: skip


def robust_loss(squared: Floats, loss: str) -> Floats:
    """scipy's losses of squared residuals z."""
    if loss == "linear":
        return squared
    if loss == "soft_l1":
        return np.asarray(2.0 * (np.sqrt(1.0 + squared) - 1.0))
    if loss == "huber":
        return np.where(squared <= 1.0, squared, 2.0 * np.sqrt(np.maximum(squared, 1.0)) - 1.0)
    return np.asarray(np.log1p(squared) if loss == "cauchy" else np.arctan(squared))


def robust_weight(squared: Floats, loss: str) -> Floats:
    """Their derivatives: the weights of iteratively reweighted least squares."""
    if loss == "linear":
        return np.ones_like(squared)
    if loss == "soft_l1":
        return np.asarray(1.0 / np.sqrt(1.0 + squared))
    if loss == "huber":
        return np.where(squared <= 1.0, 1.0, 1.0 / np.sqrt(np.maximum(squared, 1.0)))
    return np.asarray(1.0 / (1.0 + squared) if loss == "cauchy" else 1.0 / (1.0 + squared**2))


@dataclass(frozen=True)
class SearchResult:
    """What a search found: minima, best first, and how it got there."""

    minima: tuple[Minimum, ...]
    trace: SearchTrace | None = None


class GlobalSearch(Protocol):
    """A global search; what identify(search=...) takes."""

    def minima(self, cost_function: CostFunction, progress: IterationCallback | None = None) -> SearchResult:
        """The minima that it found, best first."""
        ...


QUARTILES = (25.0, 50.0, 75.0)


@dataclass(frozen=True)
class SearchTrace:
    """One row for each iteration.

    best : (iterations,) lowest cost so far; evaluations : (iterations,) candidates evaluated so far.
    quartiles : (iterations, 3) of the costs of that iteration's candidates, 25, 50 and 75 %; NaN where there are none.
    restarts : iterations at which a new run of the search began, but for the first.
    polished : lowest cost after the best were refined by least squares, and `refinements`, the simulations that took.
    """

    search: str
    best_cost: Floats
    evaluations: Ints
    quartiles: Floats = field(default_factory=lambda: np.empty((0, 3)))
    restarts: tuple[int, ...] = ()
    refined_cost: float | None = None
    refinement_evaluations: int = 0

    @classmethod
    def from_costs(cls, search: str, costs: Sequence[Floats], restarts: Sequence[int] = ()) -> SearchTrace:
        """From the costs of the candidates of each iteration, one array each."""
        lowest = np.minimum.accumulate([float(np.min(candidate_costs)) for candidate_costs in costs])
        evaluations = np.cumsum([len(each) for each in costs])
        quartiles = np.array([np.percentile(each, QUARTILES) for each in costs])
        return cls(search, lowest, evaluations, quartiles, tuple(restarts))

    def __len__(self) -> int:
        return len(self.best_cost)

    def plot(self, path: str | Path | None = None) -> Figure:
        """Draw the lowest cost, and how the candidates spread; written to `path` when given."""
        return present(self, "plot", path)
