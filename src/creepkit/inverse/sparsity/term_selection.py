"""Term selection: a sum is fitted with a penalty, terms are dropped, the rest is refitted and compared with the sum.

Misfit and penalty together have several minima, so that the penalised fit has many starts.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.composite_predictor import through_for_law
from creepkit.inverse.identification import Identification
from creepkit.inverse.identify import identify
from creepkit.inverse.initial_search import StartingEstimate
from creepkit.inverse.search.global_search import GlobalSearch, SearchTrace
from creepkit.inverse.search.local_refinement import IterationCallback, Minimum
from creepkit.inverse.search.multistart import distinct
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.sparsity.penalties import L2, PenalisedTerms, Subsets, check_penalty
from creepkit.inverse.sparsity.reduced_laws import ReducedLaw, ReducedLaws, TermProblem, terms_above
from creepkit.inverse.sparsity.result import FitStatistics, Sparsity, TermNames
from creepkit.language import CreepLaw
from creepkit.records import History, Predictor

CONTINUED_STARTS, COMPLETED_STARTS = 5, 2
"""Starts that are refined for some steps, and how many of them to the end."""


PRELIMINARY_STEPS = 12
"""Steps of the first refinement."""


def penalised_starts(reductions: ReducedLaws) -> list[Floats]:
    """(unknowns,) each: the optimum without penalty, the same with each term leading, and each term's own optimum."""
    problem = reductions.problem
    single_term_optima = [problem.embedded(single.law, single.x) for single in reductions.single_terms()]
    return [problem.start, *problem.fraction_permutations(), *single_term_optima]


def penalised_fit(problem: TermProblem, penalty: PenalisedTerms, starts: Sequence[Floats]) -> Minimum:
    """The lowest minimum of chi-square and penalty, from starts (unknowns,): first some steps, then to the end."""
    costs = [problem.cost(x, penalty) for x in starts]
    order = sorted(range(len(starts)), key=lambda k: costs[k])[:CONTINUED_STARTS]
    preliminary = sorted((problem.minimise(starts[k], penalty, PRELIMINARY_STEPS) for k in order), key=lambda m: m.cost)
    completed = [m if m.converged else problem.minimise(m.x, penalty) for m in preliminary[:COMPLETED_STARTS]]
    return min(completed, key=lambda m: m.cost)


@dataclass(frozen=True, eq=False)
class TermChoice:
    """The terms that a penalty keeps.

    contributions : of all terms under the penalty; x : (unknowns,) there.
    strength : None of a choice among subsets; trace : of the global search, if there was one.
    """

    kept_terms: TermNames
    contributions: Mapping[str, float]
    x: Floats
    strength: float | None = None
    trace: SearchTrace | None = None


def choose_terms(
    reductions: ReducedLaws,
    penalty: L2 | Subsets,
    search: GlobalSearch | None = None,
    progress: IterationCallback | None = None,
) -> TermChoice:
    """The terms that a penalty keeps.

    search : a global search of the penalised cost besides the usual starts; not for subsets.
    """
    problem = reductions.problem
    if isinstance(penalty, Subsets):
        lowest = reductions.lowest_bic(penalty.EXHAUSTIVE_LIMIT)
        x = problem.embedded(lowest.law, lowest.x)
        return TermChoice(lowest.kept_terms, problem.contributions_at(x), x)
    penalised_terms = PenalisedTerms.from_problem(problem.problem, penalty)
    starts, trace = penalised_starts(reductions), None
    if search is not None:
        searched = problem.search_problem(penalised_terms)
        result = search.minima(searched, progress)
        starts += [problem.with_nuisances(minimum.x) for minimum in distinct(result.minima, searched.bounds)]
        trace = result.trace
    x = penalised_fit(problem, penalised_terms, starts).x
    contributions = problem.contributions_at(x)
    return TermChoice(terms_above(contributions), contributions, x, penalised_terms.strength, trace=trace)


PredictorOrMapping = Predictor | Mapping[str, Predictor]


def identify_sparse(
    law: CreepLaw,
    histories: Sequence[History],
    using: PredictorOrMapping,
    *,
    penalty: L2 | Subsets,
    search: GlobalSearch | None = None,
    through: Predictor | None = None,
    settings: IdentificationSettings | None = None,
    progress: IterationCallback | None = None,
) -> Identification:
    """Identify the law of those terms of a sum that the histories need; what was dropped is recorded in `sparsity`.

    The whole sum is identified without penalty first: it gives the covariance on which everything is compared. Then
    misfit and penalty together are minimised from its optimum, from each term's own, and where `search` finds minima;
    terms that contribute less than 5 % are dropped; what is left is identified without penalty.

    through : a surrogate by which terms are chosen; values and intervals are those of `using`.
    """
    check_penalty(penalty)
    full, reductions = identify_full(law, histories, using, through, settings, progress)
    return identify_reduced(penalty, full, reductions, search, progress)


def identify_reduced(
    penalty: L2 | Subsets,
    full: Identification,
    reductions: ReducedLaws,
    search: GlobalSearch | None = None,
    progress: IterationCallback | None = None,
) -> Identification:
    """The same from the whole sum, identified before."""
    choice = choose_terms(reductions, penalty, search, progress)
    reduced = confirmed_law(reductions, choice)
    parameter_count = len(reduced.law.params)
    initial_nuisances = [
        replace(nuisance, value=float(nuisance_value))
        for nuisance, nuisance_value in zip(full.nuisances, reduced.x[parameter_count:], strict=True)
    ]
    assert full.predictor is not None
    start = StartingEstimate(reduced.x[:parameter_count], initial_nuisances, full.reference)
    fit = identify(reduced.law, full.histories, full.predictor, settings=full.settings, start=start, progress=progress)
    record = _sparsity_record(full, fit, reductions, reduced, choice, penalty)
    return replace(fit, search_trace=choice.trace or full.search_trace, sparsity=record)


def identify_full(
    law: CreepLaw,
    histories: Sequence[History],
    using: PredictorOrMapping,
    through: Predictor | None,
    settings: IdentificationSettings | None,
    progress: IterationCallback | None,
) -> tuple[Identification, ReducedLaws]:
    """The whole sum identified without penalty, and its terms ready to be dropped."""
    if len(law.terms) < 2:
        raise FitError(
            f"law '{law.name}' has one term, '{next(iter(law.terms))}', and a penalty chooses among terms: "
            "identify it without penalty, or a sum of laws with it"
        )
    full = identify(law, histories, using, settings=settings, through=through, progress=progress)
    return full, ReducedLaws(TermProblem.from_identification(full, through_for_law(through, law)))


def confirmed_law(reductions: ReducedLaws, choice: TermChoice) -> ReducedLaw:
    """The reduced law, to which dropped terms come back, the largest first, until its BIC is not above the sum's."""
    kept_terms = list(choice.kept_terms)
    while True:
        reduced = reductions.with_terms(kept_terms)
        if reduced.bic <= reductions.full(reduced).bic or len(kept_terms) == len(reductions.terms):
            return reduced
        dropped = [label for label in reductions.terms if label not in kept_terms]
        kept_terms.append(max(dropped, key=lambda label: choice.contributions[label]))


def _sparsity_record(
    full_fit: Identification,
    fit: Identification,
    reductions: ReducedLaws,
    reduced: ReducedLaw,
    choice: TermChoice,
    penalty: L2 | Subsets,
) -> Sparsity:
    problem, full = reductions.problem, reductions.full(reduced)
    return Sparsity(
        law=problem.law.name,
        penalty=type(penalty).__name__,
        strength=choice.strength,
        kept_terms=reduced.kept_terms,
        dropped_terms=tuple(label for label in reductions.terms if label not in reduced.kept_terms),
        exponents_off=reduced.exponents_off,
        proposed_terms=choice.kept_terms,
        contributions_without_penalty=problem.contributions_at(full.x),
        contributions_with_penalty=choice.contributions,
        contributions_after_refit=reduced.problem.contributions_at(reduced.x),
        full=FitStatistics(full.chi_square, full.parameter_count, full.bic, full_fit.errors),
        reduced=FitStatistics(reduced.chi_square, reduced.parameter_count, reduced.bic, fit.errors),
        observations=problem.problem.observations.count,
    )
