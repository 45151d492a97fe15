"""The posterior of a law's conditioned coordinates u, for many candidates at once.

The prior of u is flat within the law's bounds, and chi2 is taken under the covariance that the fit found. How well that
is known, the fit's degrees of freedom say: with nu of them and K parameters

    ln p(u) = -(nu + K) / 2 ln(1 + (chi2(u) - least chi2) / nu),

the multivariate Student's t (Box & Tiao (1973), Bayesian Inference in Statistical Analysis, 2.7), whose marginals have
the intervals of Laplace's approximation where the problem is linear; -chi2(u) / 2 for large nu.

The explicit nuisances of tests (thickness and so on), where there are any, are integrated out to first order about
their estimates: with r the white residuals at the estimates, J their derivatives to the nuisances, priors below,

    chi2(u) = |r|^2 - |Q' r|^2,   J = Q R,

which is the least that any values of the nuisances leave. What a test's own rate does, where rates scatter, is taken
half way between the optimum and the candidate, which makes it right to second order (see intervals.profile).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.inverse.covariance import whitener
from creepkit.inverse.objective import Objective
from creepkit.inverse.problem import Opened


@dataclass(frozen=True, eq=False)
class Posterior:
    """ln p, but for a constant, of candidates u (candidates, parameters).

    objective : with the unknowns of tests held at their estimates. whitening : (tests, entries, entries), inverses of
    the Cholesky factors of the covariance without the scatter of rates. effect : (tests, entries), at the optimum,
    what one standard deviation of a test's own rate does. floor, ceiling : (parameters,) of the internal parameters.
    taken : (data + unknowns, unknowns) Q. prior : (unknowns,) white residuals of the priors at the estimates.
    freedom : nu; least : the least chi-square.
    """

    problem: Opened
    objective: Objective
    whitening: Floats
    effect: Floats
    floor: Floats
    ceiling: Floats
    taken: Floats
    prior: Floats
    freedom: float
    least: float

    @classmethod
    def of(cls, problem: Opened, freedom: float) -> Posterior:
        """That of a reopened identification."""
        o, r, size = problem.objective, problem.residuals, len(problem.objective.law.params)
        held, unknowns, e = o.asking(o.using, o.law, o.coordinates), o.unknowns, problem.x[size:]
        held.unknowns = replace(unknowns, mean=np.array(e), held=True)
        ends = np.array([[p.to_internal(b) for b in p.bounds] for p in o.law.params.values()])
        whitening = np.asarray(np.linalg.inv(whitener(r, replace(problem.scatter, rate=0.0))), float)
        effect = r.rate_effect * problem.scatter.rate / np.sqrt(r.trust)[:, None]
        pull = np.diag(np.sqrt(unknowns.precision))
        assert r.jacobian is not None
        own = _whitened(whitening, effect, np.moveaxis(r.jacobian[..., size:], -1, 0))[:, o.entries.present].T
        taken, prior = np.linalg.qr(np.concatenate([own, pull]))[0], pull @ (e - unknowns.mean[: unknowns.size])
        least = problem.chi2(problem.minimise().u)
        return cls(
            problem, held, whitening, effect, ends[:, 0], ends[:, 1], taken, prior, max(freedom, 1.0), least
        )  # fmt: skip

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
        misfit, effect = self._misfits(u)
        white = _whitened(self.whitening, effect, misfit)[:, self.objective.entries.present]
        rows = np.concatenate([white, np.broadcast_to(self.prior, (len(u), self.prior.size))], axis=1)
        return np.asarray((rows**2).sum(axis=1) - ((rows @ self.taken) ** 2).sum(axis=1))

    def _misfits(self, u: Floats) -> tuple[Floats, Floats]:
        """Residuals (candidates, tests, entries), and what a test's own rate does half way to each candidate.

        A factor on all rates moves every coefficient, each of which is a coordinate's own. Where a term has none, and
        for tests compared over their whole life, whose derivatives are dear, it does what it does at the optimum.
        """
        o, law = self.objective, self.objective.law
        own = list(o.coordinates.coefficients)
        apart = len(own) == len(law.terms) + len(law.states) and not o.entries.whole.any()
        if not (apart and self.problem.scatter.rate > 0):
            return o.screen(u), self.effect
        misfit, slopes = o.side_by_side(u)
        size = self.problem.scatter.rate / np.sqrt(self.problem.residuals.trust)[:, None]
        return misfit, 0.5 * (self.effect + slopes[..., own].sum(axis=-1) * size)

    def inside(self, u: Floats) -> Bools:
        """(candidates,) whether the bounds of u and of the law's parameters, and its constraints, hold."""
        good = np.asarray(((u >= self.low) & (u <= self.high)).all(axis=1))
        theta, room = self.problem.objective.coordinates.theta(u), 1e-9 * (self.ceiling - self.floor)
        good &= ((theta >= self.floor - room) & (theta <= self.ceiling + room)).all(axis=1)
        if self.problem.objective.law.constraints:
            fences = self.problem.fences
            good &= np.array([not (fences.violations(one) > 0).any() for one in u])
        return np.asarray(good)


def _whitened(whitening: Floats, effect: Floats, values: Floats) -> Floats:
    """Residuals (..., tests, entries) over their scatter, with a random effect (..., tests, entries) beside.

    With v = W effect the covariance is W^-1 (I + v v') W^-T, and its inverse root (I - b v v') W,
    b = (1 - 1 / sqrt(1 + v'v)) / v'v.
    """
    white = np.einsum("tij,...tj->...ti", whitening, values, optimize=True)
    v = np.einsum("tij,...tj->...ti", whitening, effect, optimize=True)
    size = np.maximum((v**2).sum(axis=-1, keepdims=True), 1e-300)
    share = (1.0 - 1.0 / np.sqrt(1.0 + size)) / size
    return np.asarray(white - share * v * (v * white).sum(axis=-1, keepdims=True))
