"""Ranking of identified laws by BIC, with weights: a set of laws, "decisive" only above 0.95.

All laws are judged by the same number of independent frames: what the residuals of the best-fitting one say. The
criterion weighs -2 ln L by independent frames over frames, as one does for correlated residuals; it is a rule, not a
theorem.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from creepkit.errors import FitError
from creepkit.inverse.identification import Identification, information_criterion

DECISIVE = 0.95
CREDIBLE = 0.05


@dataclass(frozen=True)
class Ranked:
    """One law in a ranking: BIC less the best, and its share of belief."""

    fit: Identification
    excess: float
    weight: float


@dataclass(frozen=True)
class Ranking:
    """Identified laws, best first."""

    laws: tuple[Ranked, ...]

    @property
    def best(self) -> Identification:
        """The law of lowest BIC."""
        return self.laws[0].fit

    @property
    def remaining(self) -> tuple[Ranked, ...]:
        """The laws that the tests cannot rule out: weight above 5 %."""
        return tuple(r for r in self.laws if r.weight > CREDIBLE)

    @property
    def verdict(self) -> str:
        """One sentence: which law, or which laws these tests cannot tell apart."""
        names = [r.fit.law.name for r in self.remaining]
        if self.laws[0].weight > DECISIVE:
            return f"decisive: {names[0]}" if len(self.laws) > 1 else f"only {names[0]} was fitted"
        return f"not decisive: these tests cannot tell apart {' and '.join(names)}"


def rank(fits: Sequence[Identification]) -> Ranking:
    """Rank identifications made from the same histories."""
    if not fits:
        raise FitError("there are no identifications to rank")
    if len({fit.provenance.get("data") for fit in fits}) > 1:
        raise FitError(
            "the identifications were made from different histories, frames, losses or nuisances and cannot be ranked; "
            "make them alike"
        )
    size = max(fits, key=lambda fit: fit.log_likelihood).size
    score = np.array([information_criterion(fit, size) for fit in fits])
    excess = score - score.min()
    weight = np.exp(-0.5 * excess)
    weight /= weight.sum()
    order = np.argsort(excess)
    return Ranking(tuple(Ranked(fits[k], float(excess[k]), float(weight[k])) for k in order))
