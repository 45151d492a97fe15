"""Penalties on the contributions of terms, and a penalty as residuals for least squares.

Contributions are fractions that add up to about one, whatever the law is. Therefore only a concave penalty is smallest
where one term has them all. Strength times the penalty is added to half the chi-square: with strength s a change of its
value by one costs as much as a chi-square that is larger by 2 s.

For least squares a penalty is replaced by parabolas w c^2 + const that touch it (iteratively reweighted). With
weights updated at every point, half the sum of squares is the penalty and J'r its gradient; J'J is that of the
parabolas, which lie above a concave penalty: steps are short rather than long.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Literal, TypeAlias

import numpy as np

from creepkit.arrays import Floats
from creepkit.checked_arguments import checked
from creepkit.errors import FitError
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.sparsity.contributions import TermContributions
from creepkit.language import CreepLaw

Strength: TypeAlias = float | Literal["auto"]
"""A number, or chosen along the path from none to all (see term_selection.trace_path)."""


DEFAULT_STRENGTH = 24.0
"""Half the 48 frames of a bulge test of 12 h: what the penalty of square roots was tried with."""


MIN_CONTRIBUTION = 1e-9
"""A contribution below this counts as this in a weight."""


@dataclass(frozen=True)
class PowerSum:
    """sum (a_i + offset)^power of amounts a_i, and the parabolas w a^2 + const that touch it; least : a in a weight."""

    power: float
    offset: float = 0.0
    least: float = MIN_CONTRIBUTION

    def value(self, amounts: Floats) -> Floats:
        """(candidates,) of amounts (candidates, terms)."""
        return np.asarray(((amounts + self.offset) ** self.power).sum(axis=-1))

    def weights(self, amounts: Floats) -> Floats:
        """w, (candidates, terms) at amounts (candidates, terms): a parabola lies above a concave function."""
        a = np.maximum(amounts, self.least)
        return np.asarray(0.5 * self.power * (a + self.offset) ** (self.power - 1.0) / a)


OF_EXPONENTS = PowerSum(0.5, offset=0.02, least=1e-6)
"""Of the distances of exponents from where they are off."""


@checked
@dataclass(frozen=True)
class ContributionPenalty:
    """strength x [ sum over contributions + exponents x sum over exponents that can be off ], see OF_CONTRIBUTIONS.

    exponents : weight of the exponents of linear scale that can be off within their bounds, 0 where they cost nothing.
    """

    strength: Strength = DEFAULT_STRENGTH
    exponents: float = 0.0

    OF_CONTRIBUTIONS: ClassVar[PowerSum]

    def __post_init__(self) -> None:
        if isinstance(self.strength, str):
            if self.strength != "auto":
                raise FitError(f'strength is "{self.strength}"; allowed are numbers and "auto"')
        elif not (np.isfinite(self.strength) and self.strength >= 0):
            raise FitError(f"strength is {self.strength}; it must be a finite number, 0 or above")
        if not (np.isfinite(self.exponents) and self.exponents >= 0):
            raise FitError(f"the weight of exponents is {self.exponents}; it must be a number, 0 or above")


@checked
@dataclass(frozen=True)
class L2(ContributionPenalty):
    """strength x sum c_i^2: the word of the paper, "L2 sparsity", read as the squared norm of contributions.

    It does not select. As the c_i add up to about one, their squares are smallest at *equal* shares: every term is
    kept, and a term that the data leave free is drawn towards the size of the others. It makes the values of a sum
    determinate, no more.
    """

    OF_CONTRIBUTIONS = PowerSum(2.0)


@checked
@dataclass(frozen=True)
class GroupL2(ContributionPenalty):
    """strength x sum c_i: each c_i is itself the L2 norm of a group, the rates of term i at the points visited.

    The group lasso of regression, where it selects. Here the c_i add up to about one, so that it is nearly the same
    for all laws: it prefers terms that act at different times and stresses no more than that they share, and hardly
    ever drops a term.
    """

    OF_CONTRIBUTIONS = PowerSum(1.0)


@checked
@dataclass(frozen=True)
class Sqrt(ContributionPenalty):
    """strength x [ sum (c_i + d)^(1/2) + exponents x sum (|m_j| + 0.02)^(1/2) ], d = 0.003.

    Concave, hence smallest where one term has it all: this one selects. m_j are the exponents of linear scale that can
    be off within their bounds, such as the strain exponent of strain hardening; they weigh a third, so that a simple
    term is preferred to one with memory. d makes the slope at zero finite: a term of no use can still
    grow where the data require it. Being concave it has a minimum at each corner, and needs many starts.
    """

    exponents: float = 1.0 / 3.0

    OF_CONTRIBUTIONS = PowerSum(0.5, offset=0.003)


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
    if not isinstance(penalty, ContributionPenalty | Subsets):
        text = penalty.__name__ if isinstance(penalty, type) else repr(penalty)
        raise FitError(f"penalty is {text}; write L2(), GroupL2(), Sqrt() or Subsets()")


@dataclass(frozen=True, eq=False)
class PenalisedTerms:
    """strength x penalty, as a function of conditioned coordinates; x = (u, e) may be given where u is meant.

    frozen_at : (terms + exponents,) amounts (contributions, then distances of exponents from off) at which the weights
        are taken, for least squares with fixed weights; None takes them at every point anew.
    """

    contributions: TermContributions
    penalty: ContributionPenalty
    strength: float
    frozen_at: Floats | None = None

    @classmethod
    def from_problem(
        cls, problem: LeastSquaresProblem, penalty: ContributionPenalty, strength: float | None = None
    ) -> PenalisedTerms:
        """The penalty on the law of a problem; strength : for one that says "auto", else the usual."""
        given_strength = penalty.strength if strength is None else strength
        return cls(
            TermContributions.from_problem(problem),
            penalty,
            DEFAULT_STRENGTH if isinstance(given_strength, str) else float(given_strength),
        )

    def values(self, u: Floats) -> Floats:
        """(candidates,) what is added to half the chi-square; u : (candidates, parameters or more)."""
        parameters = u[:, : self._parameter_count]
        amounts = np.concatenate([self.contributions.values(parameters), self._distances(parameters)], axis=-1)
        return np.asarray(self.strength * self._penalty(amounts))

    def frozen_weights_at(self, u: Floats) -> PenalisedTerms:
        """With weights taken at u (parameters,), and kept."""
        return replace(self, frozen_at=self._amounts(u))

    def residuals(self, x: Floats) -> Floats:
        """(terms + exponents + 1,); half the sum of their squares touches values() where the weights were taken.

        x : (parameters or more,).
        """
        amounts = self._amounts(x)
        roots, constant = self._root_weights(amounts if self.frozen_at is None else self.frozen_at)
        return np.append(roots * amounts, constant)

    def jacobian(self, x: Floats) -> Floats:
        """(terms + exponents + 1, parameters or more), weights kept; x : (parameters or more,)."""
        u = x[: self._parameter_count]
        root_weights, _ = self._root_weights(self._amounts(x) if self.frozen_at is None else self.frozen_at)
        derivatives = np.zeros((root_weights.size + 1, x.size))
        terms = len(self.contributions.terms)
        derivatives[:terms, : u.size] = self.contributions.jacobian(u)
        for row, (k, off) in enumerate(self._exponents, start=terms):
            derivatives[row, k] = 1.0 if u[k] >= off else -1.0
        derivatives[:-1] *= root_weights[:, None]
        return derivatives

    @property
    def _parameter_count(self) -> int:
        return len(self.contributions.law.params)

    @property
    def _exponents(self) -> list[tuple[int, float]]:
        return switchable_exponents(self.contributions.law) if self.penalty.exponents else []

    def _distances(self, u: Floats) -> Floats:
        """How far each exponent is from where it is off, (..., exponents)."""
        exponents = self._exponents
        positions, off = np.array([k for k, _ in exponents], np.int64), np.array([value for _, value in exponents])
        return np.asarray(np.abs(u[..., positions] - off))

    def _amounts(self, x: Floats) -> Floats:
        """Contributions, then distances of exponents, at one point."""
        u = x[: self._parameter_count]
        return np.concatenate([self.contributions.values(u[None])[0], self._distances(u)])

    def _penalty(self, amounts: Floats) -> Floats:
        """(...,) without the strength; amounts : (..., terms + exponents)."""
        contributions, distances = np.split(amounts, [len(self.contributions.terms)], axis=-1)
        value = self.penalty.OF_CONTRIBUTIONS.value(contributions)
        return value + self.penalty.exponents * OF_EXPONENTS.value(distances)

    def _root_weights(self, amounts: Floats) -> tuple[Floats, float]:
        """Square roots of twice the weights, and the residual that stays when all amounts are zero."""
        contributions, distances = np.split(amounts, [len(self.contributions.terms)])
        of_terms = self.penalty.OF_CONTRIBUTIONS.weights(contributions)
        weights = np.concatenate([of_terms, self.penalty.exponents * OF_EXPONENTS.weights(distances)])
        constant = max(float(self._penalty(amounts) - (weights * amounts**2).sum()), 0.0)
        return np.sqrt(2 * self.strength * weights), float(np.sqrt(2 * self.strength * constant))


def switchable_exponents(law: CreepLaw) -> list[tuple[int, float]]:
    """(position, value where it is off) of the parameters of linear scale that can be off within their bounds."""
    return [
        (k, p.off)
        for k, p in enumerate(law.params.values())
        if p.scale == "linear" and p.off is not None and p.bounds[0] <= p.off <= p.bounds[1]
    ]
