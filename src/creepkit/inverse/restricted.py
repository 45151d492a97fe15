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
from creepkit.inverse.scatter import Scatter

AT_BOUND = 1e-6
"""Of the width of the bounds: nearer than this an unknown stays where it is."""


@dataclass(frozen=True, eq=False)
class Linear:
    """A problem made linear where its residuals were taken.

    residuals : with their Jacobian to all unknowns; precision, distance : (unknowns,) of the priors, and from their
        means; free : which unknowns may move (those at their bounds may not); room : (2, unknowns) how far, down, up.
    """

    residuals: Residuals
    precision: Floats
    distance: Floats
    free: Bools
    room: Floats

    @property
    def jacobian(self) -> Floats:
        """(tests, entries, free unknowns)."""
        assert self.residuals.jacobian is not None
        return self.residuals.jacobian[..., self.free]

    def solved(self, inverses: Floats) -> Solved:
        """The optimum under covariances of given inverses, (tests, entries, entries)."""
        J, p = self.jacobian, self.precision[self.free]
        pulled = inverses @ J
        A = np.einsum("tep,teq->pq", J, pulled) + np.diag(p)
        M = inverse(A)
        from_means = self.distance.copy()
        move = -M @ (np.einsum("tep,te->p", pulled, self.residuals.values) + p * from_means[self.free])
        from_means[self.free] += move
        left = self.residuals.values + J @ move
        white = (inverses @ left[..., None])[..., 0]
        chi2 = float((left * white).sum() + (self.precision * from_means**2).sum())
        return Solved(move, left, white, pulled, M, chi2, -float(np.linalg.slogdet(M)[1]))


@dataclass(frozen=True, eq=False)
class Solved:
    """The optimum of a linear problem: step, residuals r, C^-1 r, C^-1 J, A^-1, chi-square with priors, and ln|A|."""

    move: Floats
    left: Floats
    white: Floats
    pulled: Floats
    variance: Floats
    chi_square: float
    log_det: float


def inverses_of(residuals: Residuals, scatter: Scatter) -> tuple[Floats, float]:
    """C^-1 of every test, (tests, entries, entries), and ln|C| over all of them.

    Outputs that share nothing are inverted one by one.
    """
    c = covariance(residuals, scatter)
    if scatter.rate > 0 or residuals.known is not None:
        return np.asarray(np.linalg.inv(c)), float(np.linalg.slogdet(c)[1].sum())
    out, log_det = np.zeros_like(c), 0.0
    for test, (present, output) in enumerate(zip(residuals.present, residuals.output, strict=True)):
        out[test][np.diag_indices_from(out[test])] = 1.0
        for position in np.unique(output[present]):
            own = np.flatnonzero(present & (output == position))
            block = np.ix_(own, own)
            half = np.linalg.inv(np.linalg.cholesky(c[test][block]))
            out[test][block] = half.T @ half
            log_det -= 2.0 * float(np.log(np.diag(half)).sum())
    return out, log_det


def restricted_log_likelihood(linear: Linear, scatter: Scatter) -> float:
    """ln L but for a constant; ln|A| over all unknowns, so that it does not jump where one meets its bound."""
    inverses, log_det = inverses_of(linear.residuals, scatter)
    whole = replace(linear, free=np.ones_like(linear.free)).solved(inverses)
    priors = float(np.log(linear.precision[linear.precision > 0]).sum())
    return -0.5 * (log_det + whole.log_det - priors + linear.solved(inverses).chi_square)


def inverse(matrix: Floats) -> Floats:
    """Inverse of a positive matrix whose rows differ by orders of magnitude."""
    scale = np.sqrt(np.diag(matrix))
    return np.asarray(np.linalg.inv(matrix / np.outer(scale, scale)) / np.outer(scale, scale))
