"""The penalised fit of a whole sum, from many starts: a concave penalty has a minimum at each corner."""

from __future__ import annotations

from collections.abc import Sequence

from creepkit.arrays import Floats
from creepkit.inverse.search.refining import Minimum
from creepkit.inverse.sparsity.penalised import Penalised
from creepkit.inverse.sparsity.reduction import Reductions
from creepkit.inverse.sparsity.stage import Stage

SKETCHED, POLISHED = 5, 2
"""Starts that are followed for some steps, and how many of them to the end."""
SKETCH = 12
"""Steps of least squares to see where a start leads."""


def usual_starts(reductions: Reductions) -> list[Floats]:
    """The optimum without penalty, the same with each term leading, and each term's own optimum."""
    stage = reductions.stage
    corners = [stage.placed(one.law, one.x) for one in reductions.singles()]
    return [stage.start, *stage.rotated(stage.start), *corners]


def penalised_fit(stage: Stage, penalised: Penalised, starts: Sequence[Floats]) -> Minimum:
    """The lowest minimum of misfit and penalty: the best starts are followed some steps, the best ends polished."""
    costs = [stage.misfit(x) + float(penalised.values(x[None])[0]) for x in starts]
    order = sorted(range(len(starts)), key=lambda k: costs[k])[:SKETCHED]
    sketched = sorted((stage.minimise(starts[k], penalised, SKETCH) for k in order), key=lambda m: m.cost)
    ends = [m if m.converged else stage.minimise(m.u, penalised) for m in sketched[:POLISHED]]
    return min(ends, key=lambda m: m.cost)
