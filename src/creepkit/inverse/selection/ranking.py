"""Ranking of identified laws with weights: a set of laws, "decisive" only above 0.95.

Identifications by likelihood are compared under a common covariance (see selection.discrimination): chi-square + K ln n
(BIC), or + 2K + 2K(K+1)/(n-K-1) (AICc), with n the independent frames and nuisance parameters integrated out. For
others -2 ln L is multiplied by independent frames over frames, as is done for correlated residuals; that is a rule, not
a theorem. Weights are exp(-excess / 2) over their sum.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.identification import Identification
from creepkit.inverse.information_criteria import (
    CREDIBLE_WEIGHT,
    DECISIVE_WEIGHT,
    aicc_penalty,
    bic_penalty,
    criterion_weights,
)
from creepkit.inverse.selection.discrimination import under_common_covariance
from creepkit.presentation import Presentable, present

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from creepkit.inverse.selection.discrimination import EquivalentLaws
    from creepkit.inverse.uncertainty.model_averaging import ModelAverage


CRITERIA = ("bic", "aicc", "hold-out")


Criterion = Literal["bic", "aicc", "hold-out"]


@dataclass(frozen=True)
class RankedLaw:
    """One law in a ranking: criterion less the best, its weight, and its chi-square under the covariance
    of the best (NaN for identifications that were not made by likelihood).
    """

    fit: Identification
    excess: float
    weight: float
    chi_square: float = float("nan")


@dataclass(frozen=True)
class Ranking(Presentable):
    """Identified laws, best first.

    criterion : by which; independent_frames : their number; failed : {law: why it could not be identified}.
    """

    laws: tuple[RankedLaw, ...]
    criterion: Criterion = "bic"
    independent_frames: float = float("nan")
    failed: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))

    @property
    def best(self) -> Identification:
        """The law of lowest criterion."""
        return self.laws[0].fit

    @property
    def decisive(self) -> bool:
        """Whether one law has more than 95 % of the weight."""
        return self.laws[0].weight > DECISIVE_WEIGHT

    @property
    def credible(self) -> tuple[RankedLaw, ...]:
        """The laws that the tests cannot rule out: weight above 5 %."""
        return tuple(r for r in self.laws if r.weight > CREDIBLE_WEIGHT)

    @property
    def verdict(self) -> str:
        """One sentence: which law, or which laws these tests cannot tell apart."""
        names = [r.fit.law.name for r in self.credible]
        if self.decisive:
            return f"decisive: {names[0]}" if len(self.laws) > 1 else f"only {names[0]} was fitted"
        return f"not decisive: these tests cannot tell apart {' and '.join(names)}"

    @property
    def model_average(self) -> ModelAverage:
        """All laws together, each with its weight: rate(), local_exponent(), with intervals that hold both doubts."""
        from creepkit.inverse.uncertainty.model_averaging import ModelAverage

        return ModelAverage.from_ranking(self)

    def equivalents(self) -> tuple[EquivalentLaws, ...]:
        """Pairs of laws that these tests cannot separate, be they good or bad."""
        from creepkit.inverse.selection.discrimination import equivalent_laws

        return equivalent_laws(self)

    def further_tests(self) -> tuple[Any, ...]:
        """A DiscriminationDesign for each remaining law: tests that would tell it from the best (some seconds)."""
        return present(self, "further_tests")

    def plot(self, path: str | Path | None = None) -> Figure:
        """Misfits and weights of the laws, and the curves of the credible ones; written to `path` when given."""
        return present(self, "plot", path)


def rank(
    fits: Sequence[Identification], criterion: Criterion = "bic", failed: Mapping[str, str] | None = None
) -> Ranking:
    """Rank identifications made from the same histories; criterion : "bic" or "aicc"."""
    if not fits:
        raise FitError("there are no identifications to rank")
    if criterion not in ("bic", "aicc"):
        raise FitError(f"rank(by={criterion!r}) is not known: identifications are ranked by 'bic' or 'aicc'")
    if len({fit.provenance.get("data") for fit in fits}) > 1:
        raise FitError(
            "the identifications were made from different histories, frames, losses or nuisances and cannot be ranked; "
            "make them alike"
        )
    chi_square = np.full(len(fits), np.nan)
    if all(fit.linearised is not None for fit in fits):
        common_fits = under_common_covariance(fits)
        independent_frames, chi_square = common_fits.independent_frames, common_fits.chi_square
        score = chi_square + common_fits.log_determinant
    else:
        independent_frames = max(fits, key=lambda fit: fit.log_likelihood).effective_frames
        score = np.array([_effective_deviance(fit, independent_frames) for fit in fits])
    penalty = bic_penalty if criterion == "bic" else aicc_penalty
    score = score + [penalty(determined_parameter_count(fit), independent_frames) for fit in fits]
    return ranking_from_scores(
        fits, score, criterion, independent_frames=independent_frames, chi_square=chi_square, failed=failed
    )


def ranking_from_scores(
    fits: Sequence[Identification],
    scores: Floats,
    criterion: Criterion,
    *,
    independent_frames: float,
    chi_square: Floats | None = None,
    failed: Mapping[str, str] | None = None,
) -> Ranking:
    """The ranking of identifications.

    scores : (laws,) -2 ln of their evidence. chi_square : (laws,) of their residuals.
    """
    excess, weight = criterion_weights(scores)
    chi_squares = np.full(len(fits), np.nan) if chi_square is None else chi_square
    order = np.argsort(excess, kind="stable")
    laws = tuple(RankedLaw(fits[k], float(excess[k]), float(weight[k]), float(chi_squares[k])) for k in order)
    return Ranking(laws, criterion, float(independent_frames), MappingProxyType(dict(failed or {})))


def _effective_deviance(fit: Identification, independent_frames: float) -> float:
    """-2 ln L, in which frames that move together count as one."""
    frames = sum(m.frames for m in fit.tests)
    return -2.0 * fit.log_likelihood * min(independent_frames / max(frames, 1), 1.0)


def determined_parameter_count(fit: Identification) -> int:
    """How many parameters the data determine: the others have the variance of their bounds, uncorrelated."""
    variances = np.diag(fit.covariance)
    is_uncorrelated = (fit.covariance != 0).sum(axis=1) == 1
    return int(
        (
            ~(is_uncorrelated & np.isclose(variances, np.ptp(fit.law.internal_bounds, axis=0) ** 2 / 12.0, rtol=1e-6))
        ).sum()
    )
