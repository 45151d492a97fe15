"""The posterior of a law's conditioned coordinates u, for many candidates at once.

The prior of u is flat within the law's bounds, and chi2 is taken under the covariance that the fit found. How well that
is known, the fit's degrees of freedom say: with nu of them and K parameters

    ln p(u) = -(nu + K) / 2 ln(1 + (chi2(u) - least chi2) / nu),

the multivariate Student's t (Box & Tiao (1973), Bayesian Inference in Statistical Analysis, 2.7), whose marginals have
the intervals of Laplace's approximation where the problem is linear; -chi2(u) / 2 for large nu.

The explicit nuisances of tests (thickness and so on), where there are any, are integrated out to first order about
their estimates: with r the white residuals at the estimates, J their derivatives to the nuisances with the priors below,

    chi2(u) = |r|^2 - |Q' r|^2,   J = Q R,

which is the least that any values of the nuisances leave.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.inverse.problem import Opened


@dataclass(frozen=True, eq=False)
class Posterior:
    """ln p, but for a constant, of candidates u (candidates, parameters).

    whitening : (tests, entries, entries), the inverses of the Cholesky factors. floor, ceiling : (parameters,) of the
    internal parameters. taken : (data + unknowns, unknowns) Q. prior : (unknowns,) white residuals of the priors at
    the estimates. freedom : nu; least : the least chi-square.
    """

    problem: Opened
    whitening: Floats
    floor: Floats
    ceiling: Floats
    taken: Floats
    prior: Floats
    freedom: float
    least: float

    @classmethod
    def of(cls, problem: Opened, freedom: float) -> Posterior:
        """That of a reopened identification."""
        o, size = problem.objective, len(problem.objective.law.params)
        ends = np.array([[p.to_internal(b) for b in p.bounds] for p in o.law.params.values()])
        jacobian, pull = problem.residuals.jacobian, np.diag(np.sqrt(o.unknowns.precision))
        assert jacobian is not None
        whitening = np.asarray(np.linalg.inv(problem.factor), float)
        own = (whitening @ jacobian[..., size:])[o.entries.present]
        taken = np.linalg.qr(np.concatenate([own, pull]))[0]
        prior = pull @ (problem.x[size:] - o.unknowns.mean[: o.unknowns.size])
        least = problem.chi2(problem.minimise().u)
        return cls(problem, whitening, ends[:, 0], ends[:, 1], taken, prior, max(freedom, 1.0), least)

    @property
    def low(self) -> Floats:
        """(parameters,) the lower bounds of u."""
        return self.problem.box.low[: self.floor.size]

    @property
    def high(self) -> Floats:
        """(parameters,) the upper bounds of u."""
        return self.problem.box.high[: self.floor.size]

    def __call__(self, u: Floats) -> Floats:
        """(candidates,) ln p; -inf outside the bounds. All candidates are one prediction."""
        out, inside = np.full(len(u), -np.inf), self.inside(u)
        if inside.any():
            rise = np.maximum(self.chi2(u[inside]) - self.least, -0.5 * self.freedom)
            out[inside] = -0.5 * (self.freedom + u.shape[1]) * np.log1p(rise / self.freedom)
        return np.where(np.isfinite(out), out, -np.inf)

    def chi2(self, u: Floats) -> Floats:
        """(candidates,) least sum of squares that any values of the nuisances leave."""
        o = self.problem.objective
        misfit = o.screen(u, self.problem.x[u.shape[1] :])
        white = np.einsum("tij,ctj->cti", self.whitening, misfit, optimize=True)[:, o.entries.present]
        rows = np.concatenate([white, np.broadcast_to(self.prior, (len(u), self.prior.size))], axis=1)
        return np.asarray((rows**2).sum(axis=1) - ((rows @ self.taken) ** 2).sum(axis=1))

    def inside(self, u: Floats) -> Bools:
        """(candidates,) whether the bounds of u and of the law's parameters, and its constraints, hold."""
        good = np.asarray(((u >= self.low) & (u <= self.high)).all(axis=1))
        theta, room = self.problem.objective.coordinates.theta(u), 1e-9 * (self.ceiling - self.floor)
        good &= ((theta >= self.floor - room) & (theta <= self.ceiling + room)).all(axis=1)
        if self.problem.objective.law.constraints:
            fences = self.problem.fences
            good &= np.array([not (fences.violations(one) > 0).any() for one in u])
        return np.asarray(good)
