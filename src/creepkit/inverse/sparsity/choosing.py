"""Which terms a penalty keeps: the penalised fit of the whole sum from many starts, and what is dropped after it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from creepkit.arrays import Floats
from creepkit.inverse.search.landscape import GlobalSearch
from creepkit.inverse.search.multistart import distinct
from creepkit.inverse.search.refining import IterationCallback
from creepkit.inverse.search.trace import SearchTrace
from creepkit.inverse.sparsity.fitting import penalised_fit, penalised_starts
from creepkit.inverse.sparsity.path import PenaltyPath, trace_path
from creepkit.inverse.sparsity.penalised import PenalisedTerms
from creepkit.inverse.sparsity.penalties import ContributionPenalty, Subsets
from creepkit.inverse.sparsity.reduction import ReducedLaws, TermNames, terms_above


@dataclass(frozen=True, eq=False)
class TermChoice:
    """What a penalty left over.

    shares : contributions of all terms under the penalty; strength, path : None of a choice among subsets; trace : of
        the global search, if there was one.
    """

    kept_terms: TermNames
    contributions: Mapping[str, float]
    x: Floats
    strength: float | None = None
    path: PenaltyPath | None = None
    trace: SearchTrace | None = None


def choose_terms(
    reductions: ReducedLaws, penalty: ContributionPenalty | Subsets, search: GlobalSearch | None = None, progress: IterationCallback | None = None
) -> TermChoice:
    """The terms that a penalty keeps.

    search : where the penalised landscape is searched besides the usual starts; not for subsets, nor along a path.
    """
    problem = reductions.problem
    if isinstance(penalty, Subsets):
        lowest = reductions.lowest_bic(penalty.EXHAUSTIVE_LIMIT)
        x = problem.embedded(lowest.law, lowest.x)
        return TermChoice(lowest.kept_terms, problem.contributions_at(x), x)
    if penalty.strength == "auto":
        path = trace_path(reductions, penalty, progress=progress)
        return TermChoice(
            path.kept_terms[path.chosen], path.contributions_by_term(), path.x[path.chosen], float(path.strengths[path.chosen]), path
        )
    penalised_terms = PenalisedTerms.from_objective(problem.objective, penalty)
    starts, trace = penalised_starts(reductions), None
    if search is not None:
        cost_function = problem.cost_function(penalised_terms)
        result = search.minima(cost_function, progress)
        starts += [problem.with_nuisances(minimum.u) for minimum in distinct(result.minima, cost_function.bounds)]
        trace = result.trace
    x = penalised_fit(problem, penalised_terms, starts).u
    contributions = problem.contributions_at(x)
    return TermChoice(terms_above(contributions), contributions, x, penalised_terms.strength, trace=trace)
