"""Which terms a penalty keeps: the penalised fit of the whole sum from many starts, and what is dropped after it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from creepkit.arrays import Floats
from creepkit.inverse.search.landscape import Search
from creepkit.inverse.search.multistart import distinct
from creepkit.inverse.search.refining import Progress
from creepkit.inverse.search.trace import Trace
from creepkit.inverse.sparsity.fitting import penalised_fit, usual_starts
from creepkit.inverse.sparsity.path import Path, path_of
from creepkit.inverse.sparsity.penalised import Penalised
from creepkit.inverse.sparsity.penalties import Penalty, Subsets
from creepkit.inverse.sparsity.reduction import Reductions, Terms, kept_of


@dataclass(frozen=True, eq=False)
class Choice:
    """What a penalty left over.

    shares : contributions of all terms under the penalty; strength, path : None of a choice among subsets; trace : of
        the global search, if there was one.
    """

    kept: Terms
    shares: Mapping[str, float]
    x: Floats
    strength: float | None = None
    path: Path | None = None
    trace: Trace | None = None


def chosen(
    reductions: Reductions, penalty: Penalty | Subsets, search: Search | None = None, progress: Progress | None = None
) -> Choice:
    """The terms that a penalty keeps.

    search : where the penalised landscape is searched besides the usual starts; not for subsets, nor along a path.
    """
    stage = reductions.stage
    if isinstance(penalty, Subsets):
        best = reductions.lowest(penalty.EVERY)
        x = stage.placed(best.law, best.x)
        return Choice(best.kept, stage.shares(x), x)
    if penalty.strength == "auto":
        path = path_of(reductions, penalty, progress=progress)
        return Choice(
            path.kept[path.chosen], path.named(), path.x[path.chosen], float(path.strengths[path.chosen]), path
        )
    penalised = Penalised.of(stage.objective, penalty)
    starts, trace = usual_starts(reductions), None
    if search is not None:
        landscape = stage.landscape(penalised)
        found = search.minima(landscape, progress)
        starts += [stage.held(m.u) for m in distinct(found.minima, landscape.box)]
        trace = found.trace
    x = penalised_fit(stage, penalised, starts).u
    shares = stage.shares(x)
    return Choice(kept_of(shares), shares, x, penalised.strength, trace=trace)
