"""Ranking of identified laws, with weights: a set of laws, "decisive" only above 0.95.

Identifications by likelihood are judged under one covariance (see selection.judging): chi-square + K ln n (BIC), or
+ 2K + 2K(K+1)/(n-K-1) (AICc), with n the independent frames and unknowns of tests integrated out. For others, whose
values and scatter come from different rules, -2 ln L is weighed by independent frames over frames, as one does for
correlated residuals; that is a rule, not a theorem. Weights are exp(-excess / 2) over their sum.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Literal

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.identification import Identification
from creepkit.inverse.selection.judging import judged

if TYPE_CHECKING:
    from creepkit.inverse.intervals.mixture import Mixture
    from creepkit.inverse.selection.equivalence import Equivalence
    from creepkit.inverse.selection.separation import Separation

DECISIVE = 0.95
CREDIBLE = 0.05
CRITERIA = ("bic", "aicc", "hold-out")
Criterion = Literal["bic", "aicc", "hold-out"]


@dataclass(frozen=True)
class Ranked:
    """One law in a ranking: criterion less the best, its share of belief, and its chi-square under the covariance
    of the best (NaN for identifications that were not made by likelihood).
    """

    fit: Identification
    excess: float
    weight: float
    chi_square: float = float("nan")


@dataclass(frozen=True)
class Ranking:
    """Identified laws, best first.

    by : the criterion; size : independent frames; failed : {law: why it could not be identified}.
    """

    laws: tuple[Ranked, ...]
    by: Criterion = "bic"
    size: float = float("nan")
    failed: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))

    @property
    def best(self) -> Identification:
        """The law of lowest criterion."""
        return self.laws[0].fit

    @property
    def decisive(self) -> bool:
        """Whether one law has more than 95 % of the weight."""
        return self.laws[0].weight > DECISIVE

    @property
    def remaining(self) -> tuple[Ranked, ...]:
        """The laws that the tests cannot rule out: weight above 5 %."""
        return tuple(r for r in self.laws if r.weight > CREDIBLE)

    @property
    def verdict(self) -> str:
        """One sentence: which law, or which laws these tests cannot tell apart."""
        names = [r.fit.law.name for r in self.remaining]
        if self.decisive:
            return f"decisive: {names[0]}" if len(self.laws) > 1 else f"only {names[0]} was fitted"
        return f"not decisive: these tests cannot tell apart {' and '.join(names)}"

    @property
    def mixture(self) -> Mixture:
        """All laws together, each with its weight: rate(), local_exponent(), with intervals that hold both doubts."""
        from creepkit.inverse.intervals.mixture import Mixture

        return Mixture.of(self)

    def equivalents(self) -> tuple[Equivalence, ...]:
        """Pairs of laws that these tests cannot separate, be they good or bad."""
        from creepkit.inverse.selection.equivalence import equivalents

        return equivalents(self)

    def further_tests(self) -> tuple[Separation, ...]:
        """What tests would tell the remaining laws apart, and by how much (some seconds of simulations)."""
        from creepkit.inverse.selection.separation import further_tests

        return further_tests(self)

    def __str__(self) -> str:
        from creepkit.inverse.selection.printing import text_of

        return text_of(self)


def rank(fits: Sequence[Identification], by: Criterion = "bic", failed: Mapping[str, str] | None = None) -> Ranking:
    """Rank identifications made from the same histories; by : "bic" or "aicc"."""
    if not fits:
        raise FitError("there are no identifications to rank")
    if by not in ("bic", "aicc"):
        raise FitError(f"rank(by={by!r}) is not known: identifications are ranked by 'bic' or 'aicc'")
    if len({fit.provenance.get("data") for fit in fits}) > 1:
        raise FitError(
            "the identifications were made from different histories, frames, losses or nuisances and cannot be ranked; "
            "make them alike"
        )
    chi_square = np.full(len(fits), np.nan)
    if all(fit.linear is not None for fit in fits):
        common = judged(fits)
        size, chi_square = common.size, common.chi_square
        score = chi_square + common.occam
    else:
        size = max(fits, key=lambda fit: fit.log_likelihood).size
        score = np.array([_deviance(fit, size) for fit in fits])
    score = score + [_price(parameters_touched(fit), size, by) for fit in fits]
    return ranked(fits, score, by, size=size, chi_square=chi_square, failed=failed)


def ranked(
    fits: Sequence[Identification], score: Floats, by: Criterion, *, size: float, chi_square: Floats | None = None,
    failed: Mapping[str, str] | None = None,
) -> Ranking:  # fmt: skip
    """The ranking of identifications with these scores, -2 ln of their evidence."""
    excess = score - score.min()
    weight = np.exp(-0.5 * excess)
    weight /= weight.sum()
    squares = np.full(len(fits), np.nan) if chi_square is None else chi_square
    order = np.argsort(excess, kind="stable")
    laws = tuple(Ranked(fits[k], float(excess[k]), float(weight[k]), float(squares[k])) for k in order)
    return Ranking(laws, by, float(size), MappingProxyType(dict(failed or {})))


def _deviance(fit: Identification, size: float) -> float:
    """-2 ln L, in which frames that move together count as one."""
    frames = sum(m.frames for m in fit.misfits)
    return -2.0 * fit.log_likelihood * min(size / max(frames, 1), 1.0)


def parameters_touched(fit: Identification) -> int:
    """How many parameters the data touch: the others have the variance of their bounds, by themselves."""
    ends = [[p.to_internal(b) for b in p.bounds] for p in fit.law.params.values()]
    own = np.diag(fit.covariance)
    by_itself = (fit.covariance != 0).sum(axis=1) == 1
    return int((~(by_itself & np.isclose(own, np.ptp(ends, axis=1) ** 2 / 12.0, rtol=1e-6))).sum())


def _price(count: int, size: float, by: Criterion) -> float:
    """What a criterion takes for `count` parameters."""
    if by == "bic":
        return count * float(np.log(size))
    return 2.0 * count + 2.0 * count * (count + 1) / max(size - count - 1.0, 1.0)
