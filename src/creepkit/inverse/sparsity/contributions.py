"""Contributions of a law's terms over the stresses and times that tests visit.

    c_i = [ mean_G (f_i / sum_j f_j)^2 ]^(1/2)

with f_i the rate of term i and G the points visited (see visited). A coefficient A_i says nothing of this: its unit
depends on the exponents, and its size on all of them.
"""

from __future__ import annotations

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.objective import ResidualFunction
from creepkit.inverse.sparsity.visited import EvaluationPoints
from creepkit.kernels import lower
from creepkit.language import CreepLaw

DIFFERENCE_STEP = 1e-6
"""Of differences, in conditioned coordinates: the ln of rates is smooth in them."""
LOG_ZERO_RATE = -1e30
"""ln of a rate that is none."""


class TermContributions:
    """Contributions of terms as functions of conditioned coordinates u, for any sum of terms.

    labels : names of the terms, in the order of the last axis of everything.
    """

    def __init__(self, law: CreepLaw, coordinates: Coordinates, points: EvaluationPoints) -> None:
        self.law, self.coordinates, self.points = law, coordinates, points
        self.terms = tuple(law.terms)
        singles = [law.only(label) for label in self.terms]
        self._terms = [([law.names.index(name) for name in single.names], lower(single, "numpy")) for single in singles]

    @classmethod
    def from_objective(cls, objective: ResidualFunction) -> TermContributions:
        """Those of the law of an objective, over its histories."""
        points = EvaluationPoints.from_histories(objective.histories, objective.predictor)
        return cls(objective.law, objective.coordinates, points)

    def log_rates(self, u: Floats) -> Floats:
        """ln of the rate of each term at each point, (candidates, points, terms), of u (candidates, parameters)."""
        points = self.points
        point = (points.stress, points.strain, points.time, points.temperature, points.stress, points.stress / 3.0)
        columns = np.moveaxis(self.coordinates.theta(u), -1, 0)[..., None]
        log_rates = np.empty((len(u), points.stress.size, len(self._terms)))
        for k, (positions, kernel) in enumerate(self._terms):
            initial_states = [state.initial for state in kernel.law.states.values()]
            log_rates[..., k] = kernel.internal_log_rate(*point, *initial_states, *columns[positions])
        return np.asarray(np.maximum(np.nan_to_num(log_rates, nan=LOG_ZERO_RATE), LOG_ZERO_RATE))

    def fractions(self, u: Floats) -> Floats:
        """f_i / sum_j f_j, (candidates, points, terms); from logarithms, so that nothing overflows."""
        log_rates = self.log_rates(u)
        rates = np.exp(log_rates - log_rates.max(axis=-1, keepdims=True))
        return np.asarray(rates / rates.sum(axis=-1, keepdims=True))

    def values(self, u: Floats) -> Floats:
        """c, (candidates, terms), of u (candidates, parameters)."""
        return np.asarray(np.sqrt(np.einsum("p,cpt->ct", self.points.weight, self.fractions(u) ** 2)))

    def jacobian(self, u: Floats) -> Floats:
        """dc/du at one u, (terms, parameters), by central differences in one batch."""
        steps = DIFFERENCE_STEP * np.eye(u.size)
        above, below = np.split(self.values(np.concatenate([u + steps, u - steps])), 2)
        return np.asarray((above - below).T / (2 * DIFFERENCE_STEP))

    def by_term(self, u: Floats) -> dict[str, float]:
        """{term: c} of one u."""
        return dict(zip(self.terms, map(float, self.values(u[None])[0]), strict=True))
