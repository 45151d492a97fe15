"""What further test would separate two laws: the chi-square by which one must be expected to fail if the other is true.

Let law a be true at its fitted values, without noise. Law b is refitted to what a predicts of the tests that were made
and of one more; the chi-square that then remains, under the covariance of a's fit, is what b is expected to be worse
by. With g the white difference of the predictions on all these tests, priors of unknowns below, and J its derivatives
to b's unknowns, a Gauss-Newton step leaves min |g + J d|^2; the most promising tests are refitted in full. Predictions
are those of the cheap stand-in where the predictor has one: differences between laws are what matters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from creepkit.errors import FitError
from creepkit.inverse.identification import Identification
from creepkit.inverse.intervals.mixture import WeightedLaws
from creepkit.inverse.selection.contest import ModelDiscrimination
from creepkit.inverse.selection.designs import CandidateTest
from creepkit.inverse.selection.designs import candidate_tests as variations
from creepkit.inverse.selection.equivalence import DISTINGUISHABLE_CHI_SQUARE
from creepkit.inverse.selection.ranking import CREDIBLE_WEIGHT
from creepkit.inverse.threads import single_threaded_blas
from creepkit.records import History

FULL_REFITS = 3
"""Designs that are refitted in full."""


@dataclass(frozen=True)
class DiscriminatingExperiment:
    """One further test: what it is, and the chi-square by which the wrong law is expected to be worse with it."""

    description: str
    history: History
    chi_square: float


@dataclass(frozen=True)
class DiscriminationDesign:
    """Further tests, the most telling first, if law `true` holds and law `other` is fitted.

    now : expected chi-square by the tests that were made. left_out : designs that burst at once.
    """

    reference_law: str
    alternative_law: str
    current_chi_square: float
    experiments: tuple[DiscriminatingExperiment, ...]
    excluded: tuple[str, ...] = ()

    @property
    def sentence(self) -> str:
        """The most telling test, or that none is."""
        premise = f"if {self.reference_law} holds, {self.alternative_law} is worse by an expected chi-square of {self.current_chi_square:.2g} in these tests"
        if not self.experiments or self.experiments[0].chi_square < DISTINGUISHABLE_CHI_SQUARE:
            return f"{premise}; none of the {len(self.experiments)} further tests considered brings it above {DISTINGUISHABLE_CHI_SQUARE:.2g}"
        best = self.experiments[0]
        return f"{premise}; one more test, {best.description}, would bring it to {best.chi_square:.2g}"

    def __str__(self) -> str:
        rows = [f"  {t.chi_square:9.3g}  {t.description}" for t in self.experiments]
        return "\n".join([self.sentence, *rows, *(f"      burst  {name}" for name in self.excluded)])


def discriminating_experiments(
    reference: Identification, alternative: Identification, candidates_or_histories: Sequence[CandidateTest | History] | None = None
) -> DiscriminationDesign:
    """Further tests by how well they would separate law b from law a, if a is true.

    designs : planned tests (histories need no outputs); by default variations of the tests that were made.
    """
    if reference.predictor is None or not reference.histories:
        raise FitError("this identification was loaded from a file: attach its histories and specimen with fit.on()")
    if reference.provenance.get("data") != alternative.provenance.get("data"):
        raise FitError(
            "the two identifications were made from different histories, frames or nuisances; make them alike"
        )
    candidates = _candidates_given(reference, candidates_or_histories)
    with single_threaded_blas():
        discrimination = ModelDiscrimination.from_identifications(reference, alternative, candidates)
        current_chi_square = discrimination.refitted_chi_square([])
        experiments = _expected_chi_squares(discrimination, current_chi_square)
    excluded = tuple(d.description for d in candidates if d not in discrimination.candidates)
    return DiscriminationDesign(reference.law.name, alternative.law.name, current_chi_square, experiments, excluded)


def further_tests(ranking: WeightedLaws) -> tuple[DiscriminationDesign, ...]:
    """What would separate the best law of a ranking, if it is true, from each other one of more than 5 % of weight."""
    best, *others = ranking.laws
    return tuple(discriminating_experiments(best.fit, other.fit) for other in others if other.weight > CREDIBLE_WEIGHT)


def _candidates_given(fit: Identification, candidates_or_histories: Sequence[CandidateTest | History] | None) -> tuple[CandidateTest, ...]:
    """The designs given, named so that they are no test that was made; else variations of those."""
    if candidates_or_histories is None:
        return variations(fit.histories, float(fit.local_exponent(fit.reference.stress)[0]), fit.predictor)
    candidates = (candidate if isinstance(candidate, CandidateTest) else CandidateTest(candidate.name, candidate) for candidate in candidates_or_histories)
    return tuple(CandidateTest(d.description, replace(d.history, name=f"plan: {d.description}")) for d in candidates)


def _expected_chi_squares(discrimination: ModelDiscrimination, current_chi_square: float) -> tuple[DiscriminatingExperiment, ...]:
    """Every plan with its chi-square, by one step or, of the most promising, in full; never below that of now."""
    chi_squares = [discrimination.linearised_chi_square([k]) for k in range(len(discrimination.candidates))]
    for k in np.argsort(chi_squares)[::-1][:FULL_REFITS]:
        chi_squares[k] = discrimination.refitted_chi_square([int(k)])
    experiments = [
        DiscriminatingExperiment(candidate.description, candidate.history, max(value, current_chi_square)) for candidate, value in zip(discrimination.candidates, chi_squares, strict=True)
    ]
    return tuple(sorted(experiments, key=lambda test: -test.chi_square))
