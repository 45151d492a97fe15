"""sparse: a sum of terms fitted with a penalty, terms dropped, the rest refitted and confirmed against the sum."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from creepkit.errors import FitError
from creepkit.inverse.identification import Identification
from creepkit.inverse.identify import identify
from creepkit.inverse.search.landscape import GlobalSearch
from creepkit.inverse.search.refining import IterationCallback
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.sparsity.choosing import TermChoice, choose_terms
from creepkit.inverse.sparsity.path import PATH_STRENGTHS, PenaltyPath, trace_path
from creepkit.inverse.sparsity.penalties import ContributionPenalty, Subsets, check_penalty
from creepkit.inverse.sparsity.record import FitStatistics, Sparsity
from creepkit.inverse.sparsity.reduction import ReducedLaw, ReducedLaws
from creepkit.inverse.sparsity.resampling import SelectionFrequencies, selection_frequencies
from creepkit.inverse.sparsity.stage import TermProblem
from creepkit.language import CreepLaw
from creepkit.records import History, Predictor

PredictorOrMapping = Predictor | Mapping[str, Predictor]


def identify_sparse(
    law: CreepLaw, histories: Sequence[History], using: PredictorOrMapping, *, penalty: ContributionPenalty | Subsets,
    search: GlobalSearch | None = None, through: Predictor | None = None, settings: IdentificationSettings | None = None,
    progress: IterationCallback | None = None,
) -> Identification:  # fmt: skip
    """Identify the law of those terms of a sum that the histories need; what was dropped stands in `sparsity`.

    The whole sum is identified without penalty first: it gives the covariance on which everything is compared. Then
    misfit and penalty together are minimised from its optimum, from each term's own, and where `search` finds minima;
    terms that contribute less than 5 % are dropped; what is left is identified without penalty.

    through : a surrogate by which terms are chosen; values and intervals are those of `using`.
    """
    check_penalty(penalty)
    full, reductions = identify_full(law, histories, using, through, settings, progress)
    return identify_reduced(penalty, full, reductions, search, progress)


def identify_reduced(
    penalty: ContributionPenalty | Subsets, full: Identification, reductions: ReducedLaws, search: GlobalSearch | None = None,
    progress: IterationCallback | None = None,
) -> Identification:  # fmt: skip
    """The same from the whole sum, identified and opened before."""
    choice = choose_terms(reductions, penalty, search, progress)
    reduced = confirmed_law(reductions, choice)
    parameter_count = len(reduced.law.params)
    initial_nuisances = [replace(nuisance, value=float(nuisance_value)) for nuisance, nuisance_value in zip(full.nuisances, reduced.x[parameter_count:], strict=True)]
    assert full.predictor is not None
    fit = identify(
        reduced.law, full.histories, full.predictor, settings=full.settings, start=reduced.x[:parameter_count], known_nuisances=initial_nuisances,
        reference=full.reference, progress=progress,
    )  # fmt: skip
    record = _sparsity_record(full, fit, reductions, reduced, choice, penalty)
    return replace(fit, search_trace=choice.trace or full.search_trace, sparsity=record)


def penalty_path(
    law: CreepLaw, histories: Sequence[History], using: PredictorOrMapping, penalty: ContributionPenalty, *,
    strengths: Sequence[float] = PATH_STRENGTHS, settings: IdentificationSettings | None = None, progress: IterationCallback | None = None,
) -> PenaltyPath:  # fmt: skip
    """The path of a penalty over its strength, from none to all, with the automatic choice."""
    _, reductions = identify_full(law, histories, using, None, settings, progress)
    return trace_path(reductions, penalty, strengths, progress)


def bootstrap_terms(
    law: CreepLaw, histories: Sequence[History], using: PredictorOrMapping, penalty: ContributionPenalty | Subsets, *, resamples: int = 20,
    seed: int = 0, settings: IdentificationSettings | None = None, progress: IterationCallback | None = None,
) -> SelectionFrequencies:  # fmt: skip
    """How often each term is kept when the tests (or the frames of the only one) are drawn again."""
    _, reductions = identify_full(law, histories, using, None, settings, progress)
    choice = choose_terms(reductions, penalty, None, progress)
    return selection_frequencies(reductions, penalty, choice.strength, choice.x, resamples=resamples, seed=seed, progress=progress)


def identify_full(
    law: CreepLaw, histories: Sequence[History], using: PredictorOrMapping, through: Predictor | None, settings: IdentificationSettings | None,
    progress: IterationCallback | None,
) -> tuple[Identification, ReducedLaws]:  # fmt: skip
    """The whole sum identified without penalty, and its terms ready to be dropped."""
    if len(law.terms) < 2:
        raise FitError(
            f"law '{law.name}' has one term, '{next(iter(law.terms))}', and a penalty chooses among terms: "
            "identify it without penalty, or a sum of laws with it"
        )
    full = identify(law, histories, using, settings=settings, through=through, progress=progress)
    return full, ReducedLaws(TermProblem.from_identification(full, through))


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
    full_fit: Identification, fit: Identification, reductions: ReducedLaws, reduced: ReducedLaw, choice: TermChoice,
    penalty: ContributionPenalty | Subsets,
) -> Sparsity:  # fmt: skip
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
        observations=problem.observation_count,
        path=choice.path,
    )
