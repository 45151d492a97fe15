"""The sparsity record of an identification: how a sum was reduced to fewer terms."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from scipy.stats import chi2

from creepkit.inverse.goodness_of_fit import OutputErrors
from creepkit.records.presentable import Presentable, function_of_reports


@dataclass(frozen=True)
class FitStatistics:
    """How well a law fits, on the covariance of the whole sum.

    chi_square : of all outputs, priors included; parameters : of the law that were fitted; score : -2 ln of its
    evidence and of its odds before the tests, but for a constant.
    errors : {output: Errors} over all used frames.
    """

    chi_square: float
    parameters: int
    score: float
    errors: Mapping[str, OutputErrors] = field(default_factory=dict)


@dataclass(frozen=True)
class Sparsity(Presentable):
    """How a sum was reduced; the terms are those of `law`, the sum.

    penalty : "l2" or "subsets". kept_terms, dropped_terms : of the sum.
    exponents_off : exponents switched off, without which there is no less evidence.
    contributions, contributions_after_refit : {term: contribution} of the whole sum, and of what was kept.
    full, reduced : statistics of the sum and of the reduced law under one covariance.
    observations : measured values.
    """

    law: str
    penalty: str
    kept_terms: TermNames
    dropped_terms: TermNames
    exponents_off: tuple[str, ...]
    contributions: Mapping[str, float]
    contributions_after_refit: Mapping[str, float]
    full: FitStatistics
    reduced: FitStatistics
    observations: int

    @property
    def chi_square_rise(self) -> float:
        """Of chi-square, from the whole sum to the reduced law."""
        return self.reduced.chi_square - self.full.chi_square

    @property
    def parameters_dropped(self) -> int:
        """Parameters that the reduced law does without."""
        return self.full.parameters - self.reduced.parameters

    @property
    def p_value(self) -> float:
        """Chance of such a rise, or more, if the reduced law is true; 1 where nothing was dropped."""
        return (
            float(chi2.sf(max(self.chi_square_rise, 0.0), self.parameters_dropped))
            if self.parameters_dropped > 0
            else 1.0
        )

    @property
    def score_difference(self) -> float:
        """-2 ln of the evidence for the reduced law over that for the whole sum; below zero where it has more."""
        return self.reduced.score - self.full.score

    @property
    def verdict(self) -> str:
        """What was dropped, and what that cost, in one sentence."""
        return str(function_of_reports("identification.sparsity_verdict")(self))

    shown_by = "identification.sparsity_text"


TermNames = tuple[str, ...]
