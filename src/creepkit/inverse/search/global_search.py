"""What a global search takes and gives: its interface, its result, and the trace of its costs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.search.local_refinement import IterationCallback, Minimum
from creepkit.presentation import present

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class SearchResult:
    """The minima of a search, best first, and its trace."""

    minima: tuple[Minimum, ...]
    trace: SearchTrace | None = None


class GlobalSearch(Protocol):
    """A global search; what identify(search=...) takes."""

    def minima(self, problem: LeastSquaresProblem, progress: IterationCallback | None = None) -> SearchResult:
        """Its minima, best first, of a problem whose unknowns are the conditioned coordinates u alone."""
        ...


QUARTILES = (25.0, 50.0, 75.0)


@dataclass(frozen=True)
class SearchTrace:
    """The costs of a global search, one row for each iteration.

    best_cost : (iterations,) - lowest cost so far; evaluations : (iterations,) candidates evaluated so far.
    quartiles : (iterations, 3) - costs of that iteration's candidates, 25, 50 and 75 %.
    restarts : iterations at which a new run of the search began, but for the first.
    refined_cost : lowest cost after local refinement of the best, which took `refinement_evaluations` simulations.
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
        """The trace of a search; costs : (candidates,) of each iteration."""
        lowest = np.minimum.accumulate([float(np.min(candidate_costs)) for candidate_costs in costs])
        evaluations = np.cumsum([len(each) for each in costs])
        quartiles = np.array([np.percentile(each, QUARTILES) for each in costs])
        return cls(search, lowest, evaluations, quartiles, tuple(restarts))

    def __len__(self) -> int:
        return len(self.best_cost)

    def plot(self, path: str | Path | None = None) -> Figure:
        """Draw the lowest cost, and how the candidates spread; written to `path` when given."""
        return present("reports.search:search_figure", self, path)
