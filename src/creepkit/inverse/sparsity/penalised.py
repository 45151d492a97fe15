"""A penalty on the terms of one law over one set of tests: values, and residuals for least squares.

Least squares sees a penalty through parabolas w c^2 + const that touch it (iteratively reweighted least squares). With
weights taken anew at every point, half the sum of squares *is* the penalty and J'r its gradient, so that one run of
least squares minimises it; J'J is that of the parabolas, which for a concave penalty lie above it: steps are short
rather than long.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.objective import ResidualFunction
from creepkit.inverse.sparsity.contributions import TermContributions
from creepkit.inverse.sparsity.penalties import DEFAULT_STRENGTH, ContributionPenalty, exponent_penalty, exponent_weights
from creepkit.language import CreepLaw


@dataclass(frozen=True, eq=False)
class PenalisedTerms:
    """strength x penalty, as a function of conditioned coordinates; x = (u, e) may be given where u is meant.

    frozen : amounts (contributions, then distances of exponents from off) at which the weights are taken, for least
        squares with fixed weights; None takes them at every point anew.
    """

    contributions: TermContributions
    penalty: ContributionPenalty
    strength: float
    frozen_at: Floats | None = None

    @classmethod
    def from_objective(cls, objective: ResidualFunction, penalty: ContributionPenalty, strength: float | None = None) -> PenalisedTerms:
        """The penalty on the law of an objective; strength : for one that says "auto", else the usual."""
        given_strength = penalty.strength if strength is None else strength
        return cls(TermContributions.from_objective(objective), penalty, DEFAULT_STRENGTH if isinstance(given_strength, str) else float(given_strength))

    def with_strength(self, strength: float) -> PenalisedTerms:
        """The same with another strength."""
        return replace(self, strength=float(strength))

    def values(self, u: Floats) -> Floats:
        """(candidates,) what is added to half the chi-square; u : (candidates, parameters or more)."""
        parameters = u[:, : self._parameter_count]
        penalties = self.penalty.value(self.contributions.values(parameters))
        if self.penalty.exponents:
            penalties = penalties + self.penalty.exponents * exponent_penalty(self._distances(parameters))
        return np.asarray(self.strength * penalties)

    def frozen_weights_at(self, u: Floats) -> PenalisedTerms:
        """With weights taken at u, and kept."""
        return replace(self, frozen_at=self._amounts(u))

    def residuals(self, x: Floats) -> Floats:
        """(terms + exponents + 1,); half the sum of their squares touches values() where the weights were taken."""
        amounts = self._amounts(x)
        roots, constant = self._root_weights(amounts if self.frozen_at is None else self.frozen_at)
        return np.append(roots * amounts, constant)

    def jacobian(self, x: Floats) -> Floats:
        """(terms + exponents + 1, parameters or more), weights kept."""
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

    def _root_weights(self, amounts: Floats) -> tuple[Floats, float]:
        """Square roots of twice the weights, and the residual that stays when all amounts are zero."""
        contributions, distances = np.split(amounts, [len(self.contributions.terms)])
        weights, value = self.penalty.weights(contributions), float(self.penalty.value(contributions))
        if distances.size:
            weights = np.concatenate([weights, self.penalty.exponents * exponent_weights(distances)])
            value += self.penalty.exponents * float(exponent_penalty(distances))
        constant = max(value - float((weights * amounts**2).sum()), 0.0)
        return np.sqrt(2 * self.strength * weights), float(np.sqrt(2 * self.strength * constant))


def switchable_exponents(law: CreepLaw) -> list[tuple[int, float]]:
    """(position, value where it is off) of the parameters of linear scale that can be off within their bounds."""
    return [
        (k, p.off)
        for k, p in enumerate(law.params.values())
        if p.scale == "linear" and p.off is not None and p.bounds[0] <= p.off <= p.bounds[1]
    ]
