"""Bootstrap of term selection: how often each term is kept when the tests are resampled.

Tests are drawn with replacement, as many as there are; where there is one only, its frames are, in blocks. A test (or
frame) drawn k times has its whitened residuals counted k times: the bootstrap of weighted likelihood.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import beta

from creepkit import limits
from creepkit.arrays import Floats
from creepkit.checked_arguments import checked
from creepkit.errors import FitError
from creepkit.inverse.observation_vector import ObservationVector
from creepkit.inverse.search.local_refinement import IterationCallback
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.sparsity.penalties import ContributionPenalty, PenalisedTerms, Subsets
from creepkit.inverse.sparsity.reduced_laws import ReducedLaws, TermProblem, terms_above
from creepkit.inverse.sparsity.result import TermNames
from creepkit.inverse.sparsity.term_selection import PredictorOrMapping, choose_terms, identify_full, penalised_fit
from creepkit.language import CreepLaw
from creepkit.presentation import Presentable
from creepkit.records import History

BLOCK_FRAMES = 6
"""Frames of a block: an eighth of a bulge test of 48."""


ZERO_WEIGHT = 1e-12
"""Weight of observations that were not drawn."""


@dataclass(frozen=True)
class SelectionFrequencies(Presentable, text="reports.search:selection_frequencies_text"):
    """How often each term, and each set of terms, was kept.

    unit : "tests" or "blocks of frames"; resamples : number of draws; term_counts : {term: times kept};
    set_counts : {terms: times that they, and no others, were kept}, the most frequent first.
    """

    unit: str
    resamples: int
    term_counts: Mapping[str, int]
    set_counts: Mapping[TermNames, int]

    def interval(self, term: str) -> tuple[float, float]:
        """95 % interval of the frequency of a term, of Clopper and Pearson."""
        return binomial_interval(self.term_counts[term], self.resamples)


def binomial_interval(count: int, trials: int, significance: float = 0.05) -> tuple[float, float]:
    """Exact interval of a frequency (Clopper & Pearson (1934), Biometrika 26, 404)."""
    low = float(beta.ppf(significance / 2, count, trials - count + 1)) if count > 0 else 0.0
    high = float(beta.ppf(1 - significance / 2, count + 1, trials - count)) if count < trials else 1.0
    return low, high


def selection_frequencies(
    reductions: ReducedLaws,
    penalty: ContributionPenalty | Subsets,
    strength: float | None,
    optimum: Floats,
    *,
    resamples: int = 20,
    seed: int = 0,
    progress: IterationCallback | None = None,
) -> SelectionFrequencies:
    """Term selection for each resample, from the optima on all data, with the strength of all data.

    optimum : (unknowns,) x of the penalised fit on all data.
    """
    limits.check_number("resamples", resamples, limits.RESAMPLES, FitError)
    problem, selections = reductions.problem, []
    for k, weights in enumerate(
        bootstrap_weights(problem.problem.observations, resamples, np.random.default_rng(seed))
    ):
        selections.append(_terms_kept(reductions, with_weights(problem, weights), penalty, strength, optimum))
        if progress is not None:
            progress("draw", k + 1, resamples)
    sets = {terms: selections.count(terms) for terms in sorted(set(selections), key=selections.count, reverse=True)}
    counts = {label: sum(label in terms for terms in selections) for label in reductions.terms}
    return SelectionFrequencies(
        "tests" if len(problem.problem.histories) > 1 else "blocks of frames", resamples, counts, sets
    )


def with_weights(problem: TermProblem, weights: Floats) -> TermProblem:
    """The problem with squares of whitened residuals counted weights (tests, observations) times."""
    covariance_factor = problem.problem.covariance_factor.with_counts(np.maximum(weights, ZERO_WEIGHT))
    return replace(problem, problem=problem.problem.with_covariance(covariance_factor))


def bootstrap_weights(observations: ObservationVector, resamples: int, rng: np.random.Generator) -> Iterator[Floats]:
    """(tests, observations) how often each was drawn: whole tests, or blocks of frames of the only one."""
    tests, columns = observations.present.shape
    frame = observations.frame_index
    for _ in range(resamples):
        if tests > 1:
            yield np.repeat(rng.multinomial(tests, np.full(tests, 1.0 / tests))[:, None], columns, axis=1).astype(float)
        else:
            yield _block_counts(int(frame.max()) + 1, rng)[frame]


def _block_counts(frames: int, rng: np.random.Generator) -> Floats:
    """(frames,) how often each frame was drawn, in blocks that wrap around the end."""
    length = min(BLOCK_FRAMES, max(frames // 2, 1))
    counts = np.zeros(frames)
    for start in rng.integers(frames, size=-(-frames // length)):
        counts[(start + np.arange(length)) % frames] += 1.0
    return counts


def _terms_kept(
    reductions: ReducedLaws,
    problem: TermProblem,
    penalty: ContributionPenalty | Subsets,
    strength: float | None,
    optimum: Floats,
) -> TermNames:
    if isinstance(penalty, Subsets):
        return ReducedLaws(problem, reductions).lowest_bic(penalty.EXHAUSTIVE_LIMIT).kept_terms
    penalised_terms = PenalisedTerms.from_problem(problem.problem, penalty, strength)
    single_term_optima: Sequence[Floats] = [
        problem.embedded(single.law, single.x) for single in reductions.single_terms()
    ]
    x = penalised_fit(problem, penalised_terms, [optimum, reductions.full().x, *single_term_optima]).x
    return terms_above(problem.contributions_at(x))


@checked
def bootstrap_terms(
    law: CreepLaw,
    histories: Sequence[History],
    using: PredictorOrMapping,
    penalty: ContributionPenalty | Subsets,
    *,
    resamples: int = 20,
    seed: int = 0,
    settings: IdentificationSettings | None = None,
    progress: IterationCallback | None = None,
) -> SelectionFrequencies:
    """How often each term is kept when the tests (or the frames of the only one) are drawn again."""
    _, reductions = identify_full(law, histories, using, None, settings, progress)
    choice = choose_terms(reductions, penalty, None, progress)
    return selection_frequencies(
        reductions, penalty, choice.strength, choice.x, resamples=resamples, seed=seed, progress=progress
    )
