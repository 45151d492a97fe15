"""The penalised fit of a whole sum, from many starts: a concave penalty has a minimum at each corner."""

from __future__ import annotations

from collections.abc import Sequence

from creepkit.arrays import Floats
from creepkit.inverse.search.refining import Minimum
from creepkit.inverse.sparsity.penalised import PenalisedTerms
from creepkit.inverse.sparsity.reduction import ReducedLaws
from creepkit.inverse.sparsity.stage import TermProblem

CONTINUED_STARTS, COMPLETED_STARTS = 5, 2
"""Starts that are followed for some steps, and how many of them to the end."""
PRELIMINARY_STEPS = 12
"""Steps of least squares to see where a start leads."""


def penalised_starts(reductions: ReducedLaws) -> list[Floats]:
    """The optimum without penalty, the same with each term leading, and each term's own optimum."""
    problem = reductions.problem
    single_term_optima = [problem.embedded(single.law, single.x) for single in reductions.single_terms()]
    return [problem.start, *problem.fraction_permutations(problem.start), *single_term_optima]


def penalised_fit(problem: TermProblem, penalty: PenalisedTerms, starts: Sequence[Floats]) -> Minimum:
    """The lowest minimum of misfit and penalty: the best starts are followed some steps, the best ends polished."""
    costs = [problem.half_chi_square(x) + float(penalty.values(x[None])[0]) for x in starts]
    order = sorted(range(len(starts)), key=lambda k: costs[k])[:CONTINUED_STARTS]
    preliminary = sorted((problem.minimise(starts[k], penalty, PRELIMINARY_STEPS) for k in order), key=lambda m: m.cost)
    completed = [m if m.converged else problem.minimise(m.u, penalty) for m in preliminary[:COMPLETED_STARTS]]
    return min(completed, key=lambda m: m.cost)
