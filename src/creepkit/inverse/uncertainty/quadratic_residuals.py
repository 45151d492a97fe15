"""Residuals as quadratic functions of the coordinates within a posterior: a response surface.

Over the width of a posterior the residuals r(u) of a creep test are smooth; each is fitted by least squares at some
tens of simulated points, weighted by the posterior, so that thousands of draws need no simulation. With two parameters
or three, ln p is so found to 0.02 in the mean of six planted dimples.

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
    def fitted(cls, u: Floats, residuals: Floats, weights: Floats, centre: Floats, shape: Floats) -> QuadraticResiduals:
        """Through points u (points, parameters); residuals : (points, tests, observations); weights : (points,).

        centre : (parameters,) mean of the points, about which the functions are written. shape : (parameters,
        parameters) their covariance.
        """
        result = cls(centre, np.asarray(np.linalg.cholesky(shape)), np.zeros(0))
        terms, root_weights = result._terms(u), np.sqrt(weights)[:, None]
        right = residuals.reshape(len(u), -1)
        coefficients = np.linalg.lstsq(root_weights * terms, root_weights * right, rcond=1e-10)[0]
        return cls(centre, result.root, np.asarray(coefficients.reshape(-1, *residuals.shape[1:])))

    def candidate_residuals(self, u: Floats) -> Floats:
        """(candidates, tests, observations) - of u (candidates, parameters)."""
        return np.asarray(np.tensordot(self._terms(u), self.coefficients, axes=1))

    def candidate_jacobian(self, u: Floats) -> tuple[Floats, Floats]:
        """The same of u (candidates, parameters), and derivatives (candidates, tests, observations, parameters)."""
        v, inverse = self._standardised(u), np.linalg.inv(self.root)
        first, second = self._pairs
        slopes = np.zeros((len(u), len(self.coefficients), u.shape[1]))  # of the terms, to v
        slopes[:, 1 + np.arange(u.shape[1]), np.arange(u.shape[1])] = 1.0
        pairs = 1 + u.shape[1] + np.arange(len(first))
        slopes[:, pairs, first] += v[:, second]
        slopes[:, pairs, second] += v[:, first]
        jacobian = np.tensordot(slopes @ inverse, self.coefficients, axes=(1, 0))
        return self.candidate_residuals(u), np.asarray(np.moveaxis(jacobian, 1, -1))

    @property
    def _pairs(self) -> tuple[Ints, Ints]:
        first, second = np.triu_indices(self.centre.size)
        return np.asarray(first, np.int64), np.asarray(second, np.int64)

    def _standardised(self, u: Floats) -> Floats:
        return np.asarray(np.linalg.solve(self.root, (u - self.centre).T).T)

    def _terms(self, u: Floats) -> Floats:
        """(points, terms) 1, v, and products of two."""
        v = self._standardised(u)
        first, second = self._pairs
        return np.concatenate([np.ones((len(u), 1)), v, v[:, first] * v[:, second]], axis=1)


def quadratic_terms(parameters: int) -> int:
    """How many coefficients a quadratic function has."""
    return (parameters + 1) * (parameters + 2) // 2
