"""From the best candidates of a search that knows no slopes to minima: least squares from those that differ."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.errors import FitError
from creepkit.inverse.search.refining import Minimum
from creepkit.inverse.search.subsets import Switches
from creepkit.inverse.search.trace import Trace

if TYPE_CHECKING:
    from creepkit.inverse.search.landscape import Found, Landscape
    from creepkit.inverse.search.refining import Progress

NEAR = 0.1
"""Of the width of the box: candidates closer than that in every coordinate lead to the same minimum, as a rule."""

SETTLED = 1e-3
"""A fall of the cost, half of chi-square, below which a search has arrived."""


@dataclass(frozen=True)
class Candidates:
    """What a search has seen and holds worth keeping: u (candidates, parameters), cost (candidates,).

    on : (candidates, terms) masks of the terms that `switches` may switch off, or None.
    """

    u: Floats
    cost: Floats
    switches: Switches | None = None
    on: Bools | None = None

    def held(self, k: int) -> dict[int, float]:
        """{position: value} of coordinates that rest in candidate k, because their term is off."""
        return {} if self.switches is None or self.on is None else self.switches.held(self.on[k])

    def off(self, u: Floats) -> tuple[str, ...]:
        """Terms that are off at u."""
        return () if self.switches is None else self.switches.names_off(u)

    def different(self, width: Floats, most: int) -> list[int]:
        """The best that differ, at most so many: a term that is off in one of two makes them differ."""
        kept: list[int] = []
        for k in np.argsort(self.cost, kind="stable"):
            if all((np.abs(self.u[k] - self.u[other]) > NEAR * width).any() for other in kept):
                kept.append(int(k))
            if len(kept) == most:
                break
        return kept


def polished(
    landscape: Landscape, seen: Candidates, most: int, trace: Trace, progress: Progress | None = None
) -> Found:
    """The best different candidates refined, best first; with most=0 the best one as it is."""
    from creepkit.inverse.search.landscape import Found

    chosen = seen.different(landscape.box.width, max(most, 1))
    if most == 0:
        k = chosen[0]
        best, cost = seen.u[k], float(seen.cost[k])
        return Found((Minimum(best, cost, converged=False, evaluations=0, off=seen.off(best)),), trace)
    minima = []
    for done, k in enumerate(chosen):
        minimum = landscape.refine(seen.u[k], held=seen.held(k))
        minima.append(replace(minimum, off=seen.off(minimum.u)))
        if progress is not None:
            progress("refinement", done + 1, len(chosen))
    spent = sum(minimum.evaluations for minimum in minima)
    minima.sort(key=lambda minimum: minimum.cost)
    if seen.on is not None:
        minima = _of_subsets(minima)
    return Found(tuple(minima), replace(trace, polished=min(m.cost for m in minima), refinements=spent))


def _of_subsets(minima: list[Minimum]) -> list[Minimum]:
    """One of each subset, for some end as another one; of those that are as good as the best, the simplest first."""
    different = [m for k, m in enumerate(minima) if m.off not in [other.off for other in minima[:k]]]
    best = different[0].cost + SETTLED
    return sorted(different, key=lambda m: (m.cost > best, -len(m.off) if m.cost <= best else 0, m.cost))


def check_counts(search: str, values: Mapping[str, float], least: Mapping[str, int]) -> None:
    """Refuse settings of a search that must be whole numbers of at least so many."""
    for name, value in values.items():
        if value != int(value) or value < least[name]:
            raise FitError(f"{search}: {name} is {value!r}; it must be a whole number of at least {least[name]}")
