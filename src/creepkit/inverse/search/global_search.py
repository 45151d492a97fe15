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
from creepkit.report.figures import empty_figure, save_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
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


SMALLEST_DRAWN_COST = 1e-12
"""Costs below it are drawn there: the axis is logarithmic."""


MARKER_LIMIT = 60
"""Above this many iterations they are drawn without marks."""


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
        """The trace of the costs of the candidates of each iteration, an array (candidates,) for each."""
        lowest = np.minimum.accumulate([float(np.min(candidate_costs)) for candidate_costs in costs])
        evaluations = np.cumsum([len(each) for each in costs])
        quartiles = np.array([np.percentile(each, QUARTILES) for each in costs])
        return cls(search, lowest, evaluations, quartiles, tuple(restarts))

    def __len__(self) -> int:
        return len(self.best_cost)

    def plot(self, path: str | Path | None = None) -> Figure:
        """Draw the lowest cost, and how the candidates spread; written to `path` when given."""
        figure = empty_figure(7.0, 4.4)
        axes = figure.subplots()
        self._draw_costs(axes)
        self._draw_evaluations(axes)
        return save_figure(figure, path)

    def _draw_costs(self, axes: Axes) -> None:
        iterations = np.arange(1, len(self) + 1)
        if len(self.quartiles):
            lower, median, upper = np.maximum(self.quartiles, SMALLEST_DRAWN_COST).T
            axes.fill_between(iterations, lower, upper, color="C0", alpha=0.18, lw=0, label="middle half of candidates")
            axes.plot(iterations, median, color="C0", lw=1.0, alpha=0.7, label="their median")
        marker = "o" if len(self) < MARKER_LIMIT else None
        best = np.maximum(self.best_cost, SMALLEST_DRAWN_COST)
        axes.plot(iterations, best, color="C3", lw=2.0, marker=marker, ms=3, label="best so far")
        if self.refined_cost is not None:
            label = f"after least squares, {self.refinement_evaluations} more simulations"
            axes.axhline(max(self.refined_cost, SMALLEST_DRAWN_COST), color="black", lw=1.0, ls="--", label=label)
        for k, start in enumerate(self.restarts):
            axes.axvline(start + 1, color="grey", lw=0.8, ls=":", label="restart" if k == 0 else None)
        axes.set(xlabel="iteration", yscale="log", xlim=(1, max(len(self), 2)))
        axes.set_ylabel("cost (half of chi-square, walls and penalty included)")
        axes.set_title(self.search, fontsize=10)
        axes.grid(alpha=0.25)
        axes.legend(fontsize=8)

    def _draw_evaluations(self, axes: Axes) -> None:
        """Evaluations on a second axis above, at ticks of their own."""
        iterations = np.arange(1, len(self) + 1)
        top_axis = axes.secondary_xaxis("top")
        ticks = np.unique(np.linspace(0, len(self) - 1, min(len(self), 6)).astype(int))
        top_axis.set_xticks(iterations[ticks], [f"{count:,}" for count in self.evaluations[ticks]], fontsize=8)
        top_axis.set_xlabel("candidates evaluated", fontsize=8)
