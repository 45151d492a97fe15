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
from creepkit.inverse.covariance import cholesky_factors
from creepkit.inverse.objective import ResidualFunction
from creepkit.inverse.problem import LeastSquaresProblem


@dataclass(frozen=True, eq=False)
class Posterior:
    """ln p, but for a constant, of candidates u (candidates, parameters).

    objective : with the unknowns of tests held at their estimates. whitening : (tests, entries, entries), inverses of
    the Cholesky factors of the covariance without the scatter of rates. effect : (tests, entries), at the optimum,
    what one standard deviation of a test's own rate does. floor, ceiling : (parameters,) of the internal parameters.
    taken : (data + unknowns, unknowns) Q. prior : (unknowns,) white residuals of the priors at the estimates.
    freedom : nu; least : the least chi-square.
    """

    problem: LeastSquaresProblem
    objective: ResidualFunction
    whitening: Floats
    rate_effect: Floats
    parameter_lower: Floats
    parameter_upper: Floats
    nuisance_basis: Floats
    prior_residuals: Floats
    degrees_of_freedom: float
    least_chi_square: float

    @classmethod
    def from_problem(cls, problem: LeastSquaresProblem, degrees_of_freedom: float) -> Posterior:
        """That of a reopened identification."""
        objective, residuals, parameter_count = problem.residual_function, problem.residuals, len(problem.residual_function.law.params)
        fixed, nuisances, nuisance_values = objective.with_predictor(objective.predictor, objective.law, objective.coordinates), objective.nuisance_parameters, problem.x[parameter_count:]
        fixed.nuisance_parameters = replace(nuisances, mean=np.array(nuisance_values), fixed=True)
        parameter_bounds = np.array([[p.to_internal(b) for b in p.bounds] for p in objective.law.params.values()])
        whitening = np.asarray(np.linalg.inv(cholesky_factors(residuals, replace(problem.noise_model, rate=0.0))), float)
        rate_effect = residuals.log_rate_sensitivity * problem.noise_model.rate / np.sqrt(residuals.test_weights)[:, None]
        root_precision = np.diag(np.sqrt(nuisances.precision))
        assert residuals.jacobian is not None
        nuisance_jacobian = _whitened(whitening, rate_effect, np.moveaxis(residuals.jacobian[..., parameter_count:], -1, 0))[:, objective.observations.present].T
        nuisance_basis, prior_residuals = np.linalg.qr(np.concatenate([nuisance_jacobian, root_precision]))[0], root_precision @ (nuisance_values - nuisances.mean[: nuisances.size])
        least_chi_square = problem.chi_square(problem.minimise().u)
        return cls(
            problem, fixed, whitening, rate_effect, parameter_bounds[:, 0], parameter_bounds[:, 1], nuisance_basis, prior_residuals, max(degrees_of_freedom, 1.0), least_chi_square
        )  # fmt: skip

    @property
    def lower(self) -> Floats:
        """(parameters,) the lower bounds of u."""
        return self.problem.bounds.lower[: self.parameter_lower.size]

    @property
    def upper(self) -> Floats:
        """(parameters,) the upper bounds of u."""
        return self.problem.bounds.upper[: self.parameter_lower.size]

    def __call__(self, u: Floats) -> Floats:
        """(candidates,) ln p; -inf outside the bounds. All candidates are one prediction."""
        log_density, is_inside = np.full(len(u), -np.inf), self.inside(u)
        if is_inside.any():
            rise = np.maximum(self.chi_square(u[is_inside]) - self.least_chi_square, -0.5 * self.degrees_of_freedom)
            log_density[is_inside] = -0.5 * (self.degrees_of_freedom + u.shape[1]) * np.log1p(rise / self.degrees_of_freedom)
        return np.where(np.isfinite(log_density), log_density, -np.inf)

    def chi_square(self, u: Floats) -> Floats:
        """(candidates,) least sum of squares that any values of the nuisances leave."""
        residuals, rate_effect = self._residuals(u)
        whitened = _whitened(self.whitening, rate_effect, residuals)[:, self.objective.observations.present]
        rows = np.concatenate([whitened, np.broadcast_to(self.prior_residuals, (len(u), self.prior_residuals.size))], axis=1)
        return np.asarray((rows**2).sum(axis=1) - ((rows @ self.nuisance_basis) ** 2).sum(axis=1))

    def _residuals(self, u: Floats) -> tuple[Floats, Floats]:
        """Residuals (candidates, tests, entries), and what a test's own rate does half way to each candidate.

        A factor on all rates moves every coefficient, each of which is a coordinate's own. Where a term has none, and
        for tests compared over their whole life, whose derivatives are dear, it does what it does at the optimum.
        """
        objective, law = self.objective, self.objective.law
        coefficients = list(objective.coordinates.coefficients)
        is_separable = len(coefficients) == len(law.terms) + len(law.states) and not objective.observations.followed_to_rupture.any()
        if not (is_separable and self.problem.noise_model.rate > 0):
            return objective.batch_residuals(u), self.rate_effect
        residuals, jacobian = objective.batch_jacobian(u)
        rate_scatter = self.problem.noise_model.rate / np.sqrt(self.problem.residuals.test_weights)[:, None]
        return residuals, 0.5 * (self.rate_effect + jacobian[..., coefficients].sum(axis=-1) * rate_scatter)

    def inside(self, u: Floats) -> Bools:
        """(candidates,) whether the bounds of u and of the law's parameters, and its constraints, hold."""
        is_inside = np.asarray(((u >= self.lower) & (u <= self.upper)).all(axis=1))
        theta, tolerance = self.problem.residual_function.coordinates.theta(u), 1e-9 * (self.parameter_upper - self.parameter_lower)
        is_inside &= ((theta >= self.parameter_lower - tolerance) & (theta <= self.parameter_upper + tolerance)).all(axis=1)
        if self.problem.residual_function.law.constraints:
            bound_penalties = self.problem.bound_penalties
            is_inside &= np.array([not (bound_penalties.constraint_violations(candidate) > 0).any() for candidate in u])
        return np.asarray(is_inside)


def _whitened(whitening: Floats, rate_effect: Floats, values: Floats) -> Floats:
    """Residuals (..., tests, entries) over their scatter, with a random effect (..., tests, entries) beside.

    With v = W effect the covariance is W^-1 (I + v v') W^-T, and its inverse root (I - b v v') W,
    b = (1 - 1 / sqrt(1 + v'v)) / v'v.
    """
    whitened = np.einsum("tij,...tj->...ti", whitening, values, optimize=True)
    whitened_effect = np.einsum("tij,...tj->...ti", whitening, rate_effect, optimize=True)
    squared_norm = np.maximum((whitened_effect**2).sum(axis=-1, keepdims=True), 1e-300)
    correction = (1.0 - 1.0 / np.sqrt(1.0 + squared_norm)) / squared_norm
    return np.asarray(whitened - correction * whitened_effect * (whitened_effect * whitened).sum(axis=-1, keepdims=True))
