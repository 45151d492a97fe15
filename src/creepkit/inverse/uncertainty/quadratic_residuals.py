"""Residuals as quadratic functions of the coordinates within a posterior: a response surface.

Over the width of a posterior the residuals r(u) of a creep test are smooth; each is fitted by least squares to values
and derivatives at some simulated points, weighted by the posterior, so that thousands of draws need no simulation.

Source: R. Myers, D. Montgomery and C. Anderson-Cook, Response Surface Methodology (2016), chapter 6.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Floats, Ints


@dataclass(frozen=True, eq=False)
class QuadraticResiduals:
    """r(u) of (tests, observations), in v = root^-1 (u - centre).

    centre : (parameters,). root : (parameters, parameters) lower triangular. coefficients : (terms, tests,
    observations) of 1, of v, and of the products of two of its elements.
    """

    centre: Floats
    root: Floats
    coefficients: Floats

    @classmethod
    def fitted(
        cls,
        u: Floats,
        residuals: Floats,
        weights: Floats,
        centre: Floats,
        shape: Floats,
        jacobian: Floats | None = None,
    ) -> QuadraticResiduals:
        """Through points u (points, parameters); residuals : (points, tests, observations); weights : (points,).

        centre : (parameters,) mean of the points, about which the functions are written. shape : (parameters,
        parameters) their covariance. jacobian : (first points, tests, observations, parameters) derivatives to u, of as
        many points as they are known of.
        """
        result = cls(centre, np.asarray(np.linalg.cholesky(shape)), np.zeros(0))
        terms, root_weights = result._terms(u), np.sqrt(weights)
        rows, right = [root_weights[:, None] * terms], [root_weights[:, None] * residuals.reshape(len(u), -1)]
        if jacobian is not None:
            known, size = len(jacobian), centre.size
            own = root_weights[:known, None, None]
            slopes = own * np.moveaxis(result._slopes(u[:known]), -1, 1)
            derivatives = own * np.moveaxis((jacobian @ result.root).reshape(known, -1, size), -1, 1)
            rows.append(slopes.reshape(known * size, -1))
            right.append(derivatives.reshape(known * size, -1))
        coefficients = np.linalg.lstsq(np.concatenate(rows), np.concatenate(right), rcond=1e-10)[0]
        return cls(centre, result.root, np.asarray(coefficients.reshape(-1, *residuals.shape[1:])))

    def candidate_residuals(self, u: Floats) -> Floats:
        """(candidates, tests, observations) - of u (candidates, parameters)."""
        return np.asarray(np.tensordot(self._terms(u), self.coefficients, axes=1))

    def candidate_jacobian(self, u: Floats) -> tuple[Floats, Floats]:
        """The same of u (candidates, parameters), and derivatives (candidates, tests, observations, parameters)."""
        jacobian = np.tensordot(self._slopes(u) @ np.linalg.inv(self.root), self.coefficients, axes=(1, 0))
        return self.candidate_residuals(u), np.asarray(np.moveaxis(jacobian, 1, -1))

    @property
    def _pairs(self) -> tuple[Ints, Ints]:
        first, second = np.triu_indices(self.centre.size)
        return np.asarray(first, np.int64), np.asarray(second, np.int64)

    def _standardised(self, u: Floats) -> Floats:
        return np.asarray(np.linalg.solve(self.root, (u - self.centre).T).T)

    def _slopes(self, u: Floats) -> Floats:
        """(points, terms, parameters) derivatives of the terms to v."""
        v, size = self._standardised(u), u.shape[1]
        first, second = self._pairs
        slopes = np.zeros((len(u), quadratic_terms(size), size))
        slopes[:, 1 + np.arange(size), np.arange(size)] = 1.0
        pairs = 1 + size + np.arange(len(first))
        slopes[:, pairs, first] += v[:, second]
        slopes[:, pairs, second] += v[:, first]
        return slopes

    def _terms(self, u: Floats) -> Floats:
        """(points, terms) 1, v, and products of two."""
        v = self._standardised(u)
        first, second = self._pairs
        return np.concatenate([np.ones((len(u), 1)), v, v[:, first] * v[:, second]], axis=1)


def quadratic_terms(parameters: int) -> int:
    """How many coefficients a quadratic function has."""
    return (parameters + 1) * (parameters + 2) // 2
