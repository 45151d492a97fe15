"""Contributions of a law's terms over the stresses and times that tests visit.

    c_i = [ mean_G (f_i / sum_j f_j)^2 ]^(1/2)

with f_i the rate of term i and G the points visited (see visited). A coefficient A_i says nothing of this: its unit
depends on the exponents, and its size on all of them.
"""

from __future__ import annotations

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.objective import Objective
from creepkit.inverse.sparsity.visited import Visited
from creepkit.kernels import lower
from creepkit.language import CreepLaw

STEP = 1e-6
"""Of differences, in conditioned coordinates: the ln of rates is smooth in them."""
OFF = -1e30
"""ln of a rate that is none."""


class Contributions:
    """Contributions of terms as functions of conditioned coordinates u, for any sum of terms.

    labels : names of the terms, in the order of the last axis of everything.
    """

    def __init__(self, law: CreepLaw, coordinates: Coordinates, visited: Visited) -> None:
        self.law, self.coordinates, self.visited = law, coordinates, visited
        self.labels = tuple(law.terms)
        singles = [law.only(label) for label in self.labels]
        self._terms = [([law.names.index(name) for name in one.names], lower(one, "numpy")) for one in singles]

    @classmethod
    def of(cls, objective: Objective) -> Contributions:
        """Those of the law of an objective, over its histories."""
        visited = Visited.of(objective.histories, objective.using)
        return cls(objective.law, objective.coordinates, visited)

    def log_rates(self, u: Floats) -> Floats:
        """ln of the rate of each term at each point, (candidates, points, terms), of u (candidates, parameters)."""
        v = self.visited
        point = (v.stress, v.strain, v.time, v.temperature, v.stress, v.stress / 3.0)
        columns = np.moveaxis(self.coordinates.theta(u), -1, 0)[..., None]
        found = np.empty((len(u), v.stress.size, len(self._terms)))
        for k, (positions, kernel) in enumerate(self._terms):
            inner = [state.initial for state in kernel.law.states.values()]
            found[..., k] = kernel.internal_log_rate(*point, *inner, *columns[positions])
        return np.asarray(np.maximum(np.nan_to_num(found, nan=OFF), OFF))

    def shares(self, u: Floats) -> Floats:
        """f_i / sum_j f_j, (candidates, points, terms); from logarithms, so that nothing overflows."""
        logs = self.log_rates(u)
        rates = np.exp(logs - logs.max(axis=-1, keepdims=True))
        return np.asarray(rates / rates.sum(axis=-1, keepdims=True))

    def values(self, u: Floats) -> Floats:
        """c, (candidates, terms), of u (candidates, parameters)."""
        return np.asarray(np.sqrt(np.einsum("p,cpt->ct", self.visited.weight, self.shares(u) ** 2)))

    def jacobian(self, u: Floats) -> Floats:
        """dc/du at one u, (terms, parameters), by central differences in one batch."""
        moves = STEP * np.eye(u.size)
        up, down = np.split(self.values(np.concatenate([u + moves, u - moves])), 2)
        return np.asarray((up - down).T / (2 * STEP))

    def named(self, u: Floats) -> dict[str, float]:
        """{term: c} of one u."""
        return dict(zip(self.labels, map(float, self.values(u[None])[0]), strict=True))
