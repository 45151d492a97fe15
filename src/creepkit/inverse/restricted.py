"""The likelihood of scatter with the values of a law integrated out (restricted maximum likelihood).

Residuals are linear about where they were taken, r + J d, with a Gaussian prior of precision P on the unknowns. Then

    -2 ln L = ln|C| + ln|A| - ln|P| + min over d of [ (r + J d)' C^-1 (r + J d) + (o + d)' P (o + d) ]

with A = J' C^-1 J + P and o the distance from the prior means. ln|P| is a constant unless spreads of unknowns of tests
are estimated too; a prior without end leaves its own out. The second term makes up for what the values took out of the
residuals: with autocorrelated noise over one test plain maximum likelihood finds much too little of it (Patterson &
Thompson (1971), Biometrika 58, 545; Pinheiro & Bates (2000), Mixed-Effects Models in S and S-PLUS, 2.2.5).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.inverse.covariance import covariance
from creepkit.inverse.residuals import Residuals
from creepkit.inverse.scatter import NoiseModel

BOUND_TOLERANCE = 1e-6
"""Of the width of the bounds: nearer than this an unknown stays where it is."""


@dataclass(frozen=True, eq=False)
class LinearisedProblem:
    """A problem made linear where its residuals were taken.

    residuals : with their Jacobian to all unknowns; precision, distance : (unknowns,) of the priors, and from their
        means; free : which unknowns may move (those at their bounds may not); room : (2, unknowns) how far, down, up.
    """

    residuals: Residuals
    precision: Floats
    prior_residual: Floats
    free: Bools
    step_bounds: Floats

    @property
    def jacobian(self) -> Floats:
        """(tests, entries, free unknowns)."""
        assert self.residuals.jacobian is not None
        return self.residuals.jacobian[..., self.free]

    def solve(self, inverses: Floats) -> LinearSolution:
        """The optimum under covariances of given inverses, (tests, entries, entries)."""
        J, p = self.jacobian, self.precision[self.free]
        weighted_jacobian = inverses @ J
        normal_matrix = np.einsum("tep,teq->pq", J, weighted_jacobian) + np.diag(p)
        covariance = scaled_inverse(normal_matrix)
        prior_residual = self.prior_residual.copy()
        step = -covariance @ (np.einsum("tep,te->p", weighted_jacobian, self.residuals.values) + p * prior_residual[self.free])
        prior_residual[self.free] += step
        residuals = self.residuals.values + J @ step
        weighted_residuals = (inverses @ residuals[..., None])[..., 0]
        chi2 = float((residuals * weighted_residuals).sum() + (self.precision * prior_residual**2).sum())
        return LinearSolution(step, residuals, weighted_residuals, weighted_jacobian, covariance, chi2, -float(np.linalg.slogdet(covariance)[1]))


@dataclass(frozen=True, eq=False)
class LinearSolution:
    """The optimum of a linear problem: step, residuals r, C^-1 r, C^-1 J, A^-1, chi-square with priors, and ln|A|."""

    step: Floats
    residuals: Floats
    weighted_residuals: Floats
    weighted_jacobian: Floats
    covariance: Floats
    chi_square: float
    log_det: float


def inverse_covariances(residuals: Residuals, noise_model: NoiseModel) -> tuple[Floats, float]:
    """C^-1 of every test, (tests, entries, entries), and ln|C| over all of them.

    Outputs that share nothing are inverted one by one.
    """
    c = covariance(residuals, noise_model)
    if noise_model.rate > 0 or residuals.random_effect_sensitivities is not None:
        return np.asarray(np.linalg.inv(c)), float(np.linalg.slogdet(c)[1].sum())
    out, log_det = np.zeros_like(c), 0.0
    for test, (present, output) in enumerate(zip(residuals.present, residuals.output_index, strict=True)):
        out[test][np.diag_indices_from(out[test])] = 1.0
        for position in np.unique(output[present]):
            indices = np.flatnonzero(present & (output == position))
            block = np.ix_(indices, indices)
            inverse_factor = np.linalg.inv(np.linalg.cholesky(c[test][block]))
            out[test][block] = inverse_factor.T @ inverse_factor
            log_det -= 2.0 * float(np.log(np.diag(inverse_factor)).sum())
    return out, log_det


def restricted_log_likelihood(linearised: LinearisedProblem, noise_model: NoiseModel) -> float:
    """ln L but for a constant; ln|A| over all unknowns, so that it does not jump where one meets its bound."""
    inverses, log_det = inverse_covariances(linearised.residuals, noise_model)
    unconstrained = replace(linearised, free=np.ones_like(linearised.free)).solve(inverses)
    priors = float(np.log(linearised.precision[linearised.precision > 0]).sum())
    return -0.5 * (log_det + unconstrained.log_det - priors + linearised.solve(inverses).chi_square)


def scaled_inverse(matrix: Floats) -> Floats:
    """Inverse of a positive matrix whose rows differ by orders of magnitude."""
    scale = np.sqrt(np.diag(matrix))
    return np.asarray(np.linalg.inv(matrix / np.outer(scale, scale)) / np.outer(scale, scale))
