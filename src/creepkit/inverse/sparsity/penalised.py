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
from creepkit.inverse.objective import Objective
from creepkit.inverse.sparsity.contributions import Contributions
from creepkit.inverse.sparsity.penalties import USUAL, Penalty, of_exponents, weights_of_exponents
from creepkit.language import CreepLaw


@dataclass(frozen=True, eq=False)
class Penalised:
    """strength x penalty, as a function of conditioned coordinates; x = (u, e) may be given where u is meant.

    frozen : amounts (contributions, then distances of exponents from off) at which the weights are taken, for least
        squares with fixed weights; None takes them at every point anew.
    """

    contributions: Contributions
    penalty: Penalty
    strength: float
    frozen: Floats | None = None

    @classmethod
    def of(cls, objective: Objective, penalty: Penalty, strength: float | None = None) -> Penalised:
        """The penalty on the law of an objective; strength : for one that says "auto", else the usual."""
        own = penalty.strength if strength is None else strength
        return cls(Contributions.of(objective), penalty, USUAL if isinstance(own, str) else float(own))

    def stronger(self, strength: float) -> Penalised:
        """The same with another strength."""
        return replace(self, strength=float(strength))

    def values(self, u: Floats) -> Floats:
        """(candidates,) what is added to half the chi-square; u : (candidates, parameters or more)."""
        own = u[:, : self._size]
        found = self.penalty.value(self.contributions.values(own))
        if self.penalty.exponents:
            found = found + self.penalty.exponents * of_exponents(self._distances(own))
        return np.asarray(self.strength * found)

    def at(self, u: Floats) -> Penalised:
        """With weights taken at u, and kept."""
        return replace(self, frozen=self._amounts(u))

    def residuals(self, x: Floats) -> Floats:
        """(terms + exponents + 1,); half the sum of their squares touches values() where the weights were taken."""
        amounts = self._amounts(x)
        roots, rest = self._roots(amounts if self.frozen is None else self.frozen)
        return np.append(roots * amounts, rest)

    def jacobian(self, x: Floats) -> Floats:
        """(terms + exponents + 1, parameters or more), weights kept."""
        u = x[: self._size]
        roots, _ = self._roots(self._amounts(x) if self.frozen is None else self.frozen)
        slopes = np.zeros((roots.size + 1, x.size))
        terms = len(self.contributions.labels)
        slopes[:terms, : u.size] = self.contributions.jacobian(u)
        for row, (k, off) in enumerate(self._exponents, start=terms):
            slopes[row, k] = 1.0 if u[k] >= off else -1.0
        slopes[:-1] *= roots[:, None]
        return slopes

    @property
    def _size(self) -> int:
        return len(self.contributions.law.params)

    @property
    def _exponents(self) -> list[tuple[int, float]]:
        return exponents_of(self.contributions.law) if self.penalty.exponents else []

    def _distances(self, u: Floats) -> Floats:
        """How far each exponent is from where it is off, (..., exponents)."""
        own = self._exponents
        places, off = np.array([k for k, _ in own], np.int64), np.array([value for _, value in own])
        return np.asarray(np.abs(u[..., places] - off))

    def _amounts(self, x: Floats) -> Floats:
        """Contributions, then distances of exponents, at one point."""
        u = x[: self._size]
        return np.concatenate([self.contributions.values(u[None])[0], self._distances(u)])

    def _roots(self, amounts: Floats) -> tuple[Floats, float]:
        """Square roots of twice the weights, and the residual that stays when all amounts are zero."""
        c, m = np.split(amounts, [len(self.contributions.labels)])
        weights, value = self.penalty.weights(c), float(self.penalty.value(c))
        if m.size:
            weights = np.concatenate([weights, self.penalty.exponents * weights_of_exponents(m)])
            value += self.penalty.exponents * float(of_exponents(m))
        rest = max(value - float((weights * amounts**2).sum()), 0.0)
        return np.sqrt(2 * self.strength * weights), float(np.sqrt(2 * self.strength * rest))


def exponents_of(law: CreepLaw) -> list[tuple[int, float]]:
    """(position, value where it is off) of the parameters of linear scale that can be off within their bounds."""
    return [
        (k, p.off)
        for k, p in enumerate(law.params.values())
        if p.scale == "linear" and p.off is not None and p.bounds[0] <= p.off <= p.bounds[1]
    ]
