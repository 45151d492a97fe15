"""From the best candidates of a search that knows no slopes to minima: least squares from those that differ."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.errors import FitError
from creepkit.inverse.search.refining import Minimum
from creepkit.inverse.search.subsets import TermMask
from creepkit.inverse.search.trace import SearchTrace

if TYPE_CHECKING:
    from creepkit.inverse.search.landscape import SearchResult, CostFunction
    from creepkit.inverse.search.refining import IterationCallback

SAME_BASIN = 0.1
"""Of the width of the box: candidates closer than that in every coordinate lead to the same minimum, as a rule."""

CONVERGED_DECREASE = 1e-3
"""A fall of the cost, half of chi-square, below which a search has arrived."""


@dataclass(frozen=True)
class SearchCandidates:
    """What a search has seen and holds worth keeping: u (candidates, parameters), cost (candidates,).

    on : (candidates, terms) masks of the terms that `switches` may switch off, or None.
    """

    u: Floats
    cost: Floats
    term_mask: TermMask | None = None
    masks: Bools | None = None

    def fixed_values(self, k: int) -> dict[int, float]:
        """{position: value} of coordinates that rest in candidate k, because their term is off."""
        return {} if self.term_mask is None or self.masks is None else self.term_mask.fixed_values(self.masks[k])

    def terms_off(self, u: Floats) -> tuple[str, ...]:
        """Terms that are off at u."""
        return () if self.term_mask is None else self.term_mask.terms_off(u)

    def most_different(self, width: Floats, max_count: int) -> list[int]:
        """The best that differ, at most so many: a term that is off in one of two makes them differ."""
        selected: list[int] = []
        for k in np.argsort(self.cost, kind="stable"):
            if all((np.abs(self.u[k] - self.u[other]) > SAME_BASIN * width).any() for other in selected):
                selected.append(int(k))
            if len(selected) == max_count:
                break
        return selected


def refine_candidates(
    cost_function: CostFunction, candidates: SearchCandidates, max_count: int, trace: SearchTrace, progress: IterationCallback | None = None
) -> SearchResult:
    """The best different candidates refined, best first; with most=0 the best one as it is."""
    from creepkit.inverse.search.landscape import SearchResult

    selected = candidates.most_different(cost_function.bounds.width, max(max_count, 1))
    if max_count == 0:
        k = selected[0]
        best, cost = candidates.u[k], float(candidates.cost[k])
        return SearchResult((Minimum(best, cost, converged=False, evaluations=0, terms_off=candidates.terms_off(best)),), trace)
    minima = []
    for done, k in enumerate(selected):
        minimum = cost_function.refine(candidates.u[k], fixed=candidates.fixed_values(k))
        minima.append(replace(minimum, terms_off=candidates.terms_off(minimum.u)))
        if progress is not None:
            progress("refinement", done + 1, len(selected))
    evaluations = sum(minimum.evaluations for minimum in minima)
    minima.sort(key=lambda minimum: minimum.cost)
    if candidates.masks is not None:
        minima = _one_per_mask(minima)
    return SearchResult(tuple(minima), replace(trace, refined_cost=min(m.cost for m in minima), refinement_evaluations=evaluations))


def _one_per_mask(minima: list[Minimum]) -> list[Minimum]:
    """One of each subset, for some end as another one; of those that are as good as the best, the simplest first."""
    different = [m for k, m in enumerate(minima) if m.terms_off not in [other.terms_off for other in minima[:k]]]
    best = different[0].cost + CONVERGED_DECREASE
    return sorted(different, key=lambda m: (m.cost > best, -len(m.terms_off) if m.cost <= best else 0, m.cost))


def check_whole_numbers(search: str, values: Mapping[str, float], minimum_values: Mapping[str, int]) -> None:
    """Refuse settings of a search that must be whole numbers of at least so many."""
    for name, value in values.items():
        if value != int(value) or value < minimum_values[name]:
            raise FitError(f"{search}: {name} is {value!r}; it must be a whole number of at least {minimum_values[name]}")
