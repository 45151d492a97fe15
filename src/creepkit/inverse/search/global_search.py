"""What a global search takes and gives: its interface, result and trace of costs, and the refinement of its best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.search.local_refinement import IterationCallback, Minimum, Tolerances


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


@dataclass(frozen=True)
class SearchTrace:
    """The costs of a global search, one row for each iteration.

    best_cost : (iterations,) - lowest cost so far; evaluations : (iterations,) candidates evaluated so far.
    refined_cost : lowest cost after local refinement of the best.
    """

    search: str
    best_cost: Floats
    evaluations: Ints
    refined_cost: float | None = None


SAME_BASIN = 0.1
"""Of the width of the bounds: candidates closer than that in every coordinate lead to the same minimum, as a rule."""


FIRST_STEPS, LAST_STEPS = Tolerances(max_steps=3, gain=1e-3), Tolerances(tolerance=1e-4, gain=1e-3)
"""Of every start of least squares, and then of the best of them one after the other."""


CONTINUED, CONFIRMED = 3, 2
"""How many of the best are refined to the end at most, and how many of them that end at the best are enough."""


SAME_POINT, SAME_COST = 0.02, 0.01
"""Of the width of the bounds: starts that come closer than that in every coordinate lead to the same minimum. Of the
cost of a minimum: so do those in its basin whose next step promises a cost as near."""


def refined(
    problem: LeastSquaresProblem, starts: Sequence[Floats], progress: IterationCallback | None = None
) -> list[Minimum]:
    """The ends that starts (parameters,) of least squares lead to, best first; far worse ones after few steps.

    A law with internal variables, whose valleys are long and curved, takes each of the best to its end.
    """
    ends, curved = [], bool(problem.coordinates.state_rates)
    if progress is not None:
        progress("start", 0, len(starts))
    for k, u in enumerate(starts):
        ends.append(problem.minimise(u, tolerances=FIRST_STEPS))
        if progress is not None:
            progress("start", k + 1, len(starts))
    ends.sort(key=lambda end: end.cost)
    for k, end in enumerate(ends[:CONTINUED]):
        ends[k] = _continued(problem, end, ends[:k]) if end.converged or not curved else problem.minimise(end.x)
        best = min(ends, key=lambda one: one.cost)
        if k and not curved and sum(other is best for other in ends[: k + 1]) >= CONFIRMED:
            break
    return sorted(ends, key=lambda end: end.cost)


def _continued(problem: LeastSquaresProblem, end: Minimum, others: Sequence[Minimum]) -> Minimum:
    """The minimum that a search leads to, a few steps at a time; that of another one where it comes to lie there."""
    steps, near = replace(LAST_STEPS, max_steps=FIRST_STEPS.max_steps + 1), list[Minimum]()
    for _ in range(LAST_STEPS.max_steps // FIRST_STEPS.max_steps):
        near, before = [one for one in others if _leads_to(end, one, problem.bounds.width)], end.x
        end = near[0] if near else end if end.converged else problem.minimise(end.x, tolerances=steps)
        if np.array_equal(end.x, before) or near:  # or no step of those that are tried gains anything
            break
    return end


def _leads_to(end: Minimum, other: Minimum, width: Floats) -> bool:
    """Whether a search leads to another minimum: it is there, or in its basin and promised its cost."""
    apart = (np.abs(end.x - other.x) / width).max()
    return bool(
        apart <= SAME_POINT or (apart <= SAME_BASIN and abs(end.promised - other.cost) <= SAME_COST * other.cost)
    )


def refine_candidates(
    problem: LeastSquaresProblem, u: Floats, costs: Floats, max_count: int, trace: SearchTrace
) -> SearchResult:
    """The best different candidates refined by least squares, best first; with max_count=0 the best one as it is.

    u : (candidates, parameters); costs : (candidates,) -.
    """
    selected = _most_different(u, costs, problem.bounds.width, max(max_count, 1))
    problem.check_predicted(u[selected])
    if max_count == 0:
        best = Minimum(u[selected[0]], float(costs[selected[0]]), converged=False)
        return SearchResult((best,), trace)
    minima = sorted((problem.minimise(u[k]) for k in selected), key=lambda minimum: minimum.cost)
    return SearchResult(tuple(minima), replace(trace, refined_cost=minima[0].cost))


def _most_different(u: Floats, costs: Floats, width: Floats, max_count: int) -> list[int]:
    """Positions of the best candidates that differ, at most max_count; width : (parameters,) of the bounds."""
    selected: list[int] = []
    for k in np.argsort(costs, kind="stable"):
        if all((np.abs(u[k] - u[other]) > SAME_BASIN * width).any() for other in selected):
            selected.append(int(k))
        if len(selected) == max_count:
            break
    return selected
