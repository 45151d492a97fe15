"""How the terms of a sum are reduced: the paper's penalty on their contributions, or a choice among sets of terms.

Strength times the penalty is added to half the chi-square: with strength s a change of its value by one costs as much
as a chi-square that is larger by 2 s.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from creepkit.arrays import Floats
from creepkit.checked_arguments import checked
from creepkit.errors import FitError
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.sparsity.contributions import TermContributions
from creepkit.language import CreepLaw


@checked
@dataclass(frozen=True)
class L2:
    """strength x sum c_i^2: the word of the paper, "L2 sparsity", read as the squared norm of contributions.

    It does not select. As the c_i add up to about one, their squares are smallest at *equal* shares: every term is
    kept, and a term that the data leave free is drawn towards the size of the others. It makes the values of a sum
    determinate, no more. strength : by default half the 48 frames of a bulge test of 12 h.
    """

    strength: float = 24.0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.strength) and self.strength >= 0):
            raise FitError(f"strength is {self.strength}; it must be a finite number, 0 or above")


@checked
@dataclass(frozen=True)
class Subsets:
    """{0} or its bounds for every coefficient, as Table 1 has it: each set of terms is fitted, the lowest BIC kept.

    No penalty on a sum but a choice among laws: exact up to EVERY terms, forward selection beyond. It shrinks nothing
    and has no strength to choose; each set costs a fit.
    """

    EXHAUSTIVE_LIMIT: ClassVar[int] = 4


def check_penalty(penalty: object) -> None:
    """A penalty is a record, such as L2(), and not its class or name."""
    if not isinstance(penalty, L2 | Subsets):
        text = penalty.__name__ if isinstance(penalty, type) else repr(penalty)
        raise FitError(f"penalty is {text}; write L2() or Subsets()")


@dataclass(frozen=True, eq=False)
class PenalisedTerms:
    """strength x sum c_i^2, as a function of conditioned coordinates; x = (u, e) may be given where u is meant."""

    contributions: TermContributions
    strength: float

    @classmethod
    def from_problem(cls, problem: LeastSquaresProblem, penalty: L2) -> PenalisedTerms:
        """The penalty on the law of a problem."""
        return cls(TermContributions.from_problem(problem), penalty.strength)

    def values(self, u: Floats) -> Floats:
        """(candidates,) what is added to half the chi-square; u : (candidates, parameters or more)."""
        return np.asarray(self.strength * (self.contributions.values(u[:, : self._count]) ** 2).sum(axis=-1))

    def residuals(self, x: Floats) -> Floats:
        """(terms,); half the sum of their squares is the penalty. x : (parameters or more,)."""
        return np.asarray(np.sqrt(2 * self.strength) * self.contributions.values(x[None, : self._count])[0])

    def jacobian(self, x: Floats) -> Floats:
        """(terms, parameters or more) derivatives at x (parameters or more,)."""
        of_parameters = np.sqrt(2 * self.strength) * self.contributions.jacobian(x[: self._count])
        return np.pad(of_parameters, ((0, 0), (0, x.size - self._count)))

    @property
    def _count(self) -> int:
        return len(self.contributions.law.params)


def switchable_exponents(law: CreepLaw) -> list[tuple[int, float]]:
    """(position, value where it is off) of the parameters of linear scale that can be off within their bounds."""
    return [
        (k, p.off)
        for k, p in enumerate(law.params.values())
        if p.scale == "linear" and p.off is not None and p.bounds[0] <= p.off <= p.bounds[1]
    ]
