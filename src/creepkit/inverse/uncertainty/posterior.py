"""The posterior of a law's conditioned coordinates u: its density for many candidates at once.

The prior of u is flat within the law's bounds, and chi2 is taken under the covariance that the fit found. With nu
degrees of freedom of that covariance and K parameters

    ln p(u) = -(nu + K) / 2 ln(1 + (chi2(u) - least chi2) / nu),

the multivariate Student's t (Box & Tiao (1973), Bayesian Inference in Statistical Analysis, 2.7); -chi2(u) / 2 for
large nu. Values that are found under weights 1 / W in the place of the inverse covariance are not where that chi2 is
least, and what W says of their spread is wrong. Of them ln p is that of the estimator: chi2_W counts from its least
value beyond any bound, w, as it is linearised, and times (d'G d) / (d'H d), d = u - w, with H its own curvature and
G^-1 the covariance of the estimator (Chandler & Bate (2007), Biometrika 94, 167).

Nuisance parameters of tests are integrated out to first order about their estimates: with r the whitened
residuals at the estimates, J their derivatives to the nuisance parameters, priors below, chi2(u) = |r|^2 - |Q' r|^2,
J = Q R. The effect of a test's own rate is taken half way between the optimum and the candidate.

Over its width residuals are smooth: a response surface, quadratic functions of u fitted to values and derivatives at
some simulated points, gives those of thousands of draws. Source: R. Myers, D. Montgomery and C. Anderson-Cook, Response
Surface Methodology (2016), chapter 6.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from creepkit.arrays import Bools, Floats, Ints
from creepkit.inverse.identification import Identification
from creepkit.inverse.noise_covariance import CovarianceFactor
from creepkit.inverse.perturbations import errors_of_tests, with_expected_scatter
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.search.local_refinement import Tolerances
from creepkit.inverse.uncertainty.laplace_approximation import covariance_of_values
from creepkit.inverse.variance_components import scaled_inverse
from creepkit.inverse.working_noise import WorkingNoiseEstimator

OPTIMUM_TOLERANCES = Tolerances(gain=1e-2)
"""Of the least chi-square, from which ln p is counted: what it is off by shifts all of it, but for Student's t."""


def predicted_errors(fit: Identification, alone: CovarianceFactor) -> Floats:
    """(tests, observations) of the residuals, what the errors of the tests did there: their best linear prediction.

    With C = C0 + S S', C0 that of `alone`, it is S S' C^-1 r = r - C0 C^-1 r: under C0 the rest has the optimum that
    values by likelihood, under the errors that the intervals include, have under C.
    """
    problem, noise = fit.least_squares_problem, fit.noise_model
    linear = problem.linearised(fit.x)
    residuals = linear.with_errors(errors_of_tests(problem, linear, noise)).residuals
    whole = CovarianceFactor.of_residuals(residuals, with_expected_scatter(problem, linear, noise))
    rest = (alone.blocks @ whole.inverse_times(residuals.values)[..., None])[..., 0]
    return np.where(residuals.present, residuals.values - rest, 0.0)


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
        return np.triu_indices(self.centre.size)

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


@dataclass(frozen=True, eq=False)
class EstimatorInformation:
    """What values found under weights are known to, and what these weights alone say of it.

    optimum : (parameters,) u, of the problem made linear, beyond any bound. own, weighted : (parameters, parameters)
    G, the inverse of the estimator's covariance, and H, half the second derivatives of chi-square under the weights.
    """

    optimum: Floats
    own: Floats
    weighted: Floats

    def ratio(self, u: Floats) -> Floats:
        """(candidates,) of the information on u (candidates, parameters) to that which the weights say."""
        distance = u - self.optimum
        own, weighted = (np.einsum("ci,ij,cj->c", distance, one, distance) for one in (self.own, self.weighted))
        return np.asarray(np.divide(own, weighted, out=np.ones(len(u)), where=weighted > 0.0))


@dataclass(frozen=True, eq=False)
class Posterior:
    """ln p, but for a constant, of candidates u.

    problem : with nuisance parameters fixed at their estimates. rate_sd : standard deviation of ln rate between tests.
    covariance_factor : without the scatter of rates. rate_effect : (tests, observations) -, at the optimum, what one
    standard deviation of a test's own rate does. parameter_bounds : (2, parameters) of the internal parameters.
    nuisance_basis : (data + nuisances, nuisances) Q. prior_residuals : (nuisances,) - of the priors, at the estimates.
    degrees_of_freedom : nu. optimum : (parameters,) u, of least_chi_square. errors : (tests, observations) -, what the
    errors of the tests did to the residuals. quadratic : residuals as functions of u, in the place of predictions.
    information : of values that were found under weights; None of those by likelihood.
    """

    problem: LeastSquaresProblem
    rate_sd: float
    covariance_factor: CovarianceFactor
    rate_effect: Floats
    parameter_bounds: Floats
    nuisance_basis: Floats
    prior_residuals: Floats
    degrees_of_freedom: float
    optimum: Floats
    least_chi_square: float
    errors: Floats | float = 0.0
    quadratic: QuadraticResiduals | None = None
    information: EstimatorInformation | None = None

    @classmethod
    def from_identification(cls, fit: Identification) -> Posterior:
        """The posterior of an identification, about its optimum, given what the errors of its tests are there."""
        problem, linear, weighting = fit.least_squares_problem, fit.linear_problem, None
        if fit.settings.weights != "likelihood":
            estimator = WorkingNoiseEstimator(fit.settings, problem.observations)
            weighting = estimator.weighting(estimator.estimate(linear, estimator.initial()))
        expected = with_expected_scatter(problem, linear, fit.noise_model)
        noise_model = weighting or expected
        residuals, nuisances, count = problem.residuals(fit.x), problem.nuisance_parameters, fit.u.size
        e = fit.x[count:]
        factor = CovarianceFactor.of_residuals(residuals, replace(noise_model, rate=0.0))
        rate_effect = residuals.log_rate_sensitivity * noise_model.rate
        root_precision = np.diag(np.sqrt(nuisances.precision))
        nuisance_jacobian = _whitened(factor, rate_effect, np.moveaxis(residuals.jacobian[..., count:], -1, 0))
        nuisance_rows = nuisance_jacobian[:, problem.observations.present].T
        found = cls(
            problem=problem.with_fixed_nuisances(e),
            rate_sd=noise_model.rate,
            covariance_factor=factor,
            rate_effect=rate_effect,
            parameter_bounds=fit.law.internal_bounds,
            nuisance_basis=np.linalg.qr(np.concatenate([nuisance_rows, root_precision]))[0],
            prior_residuals=root_precision @ (e - nuisances.mean[: nuisances.size]),
            degrees_of_freedom=max(fit.freedom, 1.0),
            optimum=fit.u,
            least_chi_square=0.0,
        )
        all_noise, information = CovarianceFactor.of_residuals(residuals, noise_model), None
        if weighting is None and fit.error_covariance is None:
            whole = problem.with_covariance(all_noise)
            x = whole.minimise(fit.x, tolerances=OPTIMUM_TOLERANCES).x
            return replace(found, optimum=x[:count], least_chi_square=whole.chi_square(x))
        if weighting is None:
            found = replace(found, errors=predicted_errors(fit, all_noise))
        least = float(found.chi_square(*found.residuals(fit.u[None]))[0])
        if weighting is not None:
            solution = linear.whole.solve(all_noise)
            step, own = solution.step[:count], covariance_of_values(linear, expected, weighting)
            covariances = [c[:count, :count] for c in (own, solution.covariance)]
            information = EstimatorInformation(fit.u + step, *map(scaled_inverse, covariances))
            least -= float(step @ information.weighted @ step)
        return replace(found, least_chi_square=least, information=information)

    @property
    def lower(self) -> Floats:
        """(parameters,) the lower bounds of u."""
        return self.problem.bounds.lower

    @property
    def upper(self) -> Floats:
        """(parameters,) the upper bounds of u."""
        return self.problem.bounds.upper

    def __call__(self, u: Floats) -> Floats:
        """(candidates,) ln p of u (candidates, parameters), in one prediction; -inf outside the bounds."""
        log_density, is_inside = np.full(len(u), -np.inf), self.inside(u)
        if is_inside.any():
            log_density[is_inside] = self.log_density(u[is_inside], *self.residuals(u[is_inside]))
        return log_density

    def log_density(self, u: Floats, residuals: Floats, rate_effect: Floats) -> Floats:
        """(candidates,) ln p of u (candidates, parameters) within the bounds, but for a constant.

        residuals, rate_effect : (candidates, tests, observations) as residuals() gives them.
        """
        chi_square, count = self.chi_square(residuals, rate_effect), self.problem.parameter_count
        rise = chi_square - self.least_chi_square
        if self.information is not None:
            rise *= self.information.ratio(u)
        rise = np.maximum(rise, -0.5 * self.degrees_of_freedom)
        log_density = -0.5 * (self.degrees_of_freedom + count) * np.log1p(rise / self.degrees_of_freedom)
        return np.where(np.isfinite(log_density), log_density, -np.inf)

    def chi_square(self, residuals: Floats, rate_effect: Floats) -> Floats:
        """(candidates,) least sum of squares that any values of the nuisances leave.

        residuals, rate_effect : (candidates, tests, observations) as residuals() gives them.
        """
        whitened = _whitened(self.covariance_factor, rate_effect, residuals)[:, self.problem.observations.present]
        prior = np.broadcast_to(self.prior_residuals, (len(residuals), self.prior_residuals.size))
        rows = np.concatenate([whitened, prior], axis=1)
        return np.asarray((rows**2).sum(axis=1) - ((rows @ self.nuisance_basis) ** 2).sum(axis=1))

    def residuals(self, u: Floats) -> tuple[Floats, Floats]:
        """Residuals (candidates, tests, observations), and what a test's own rate does half way to each candidate.

        u : (candidates, parameters).

        A factor on all rates moves every coefficient, each of which is a coordinate's own. Where a term has none, and
        for tests compared over their whole life, whose derivatives are expensive, that effect is taken at the optimum.
        """
        if self._rates_are_coefficients:
            return self.residuals_and_jacobian(u)[:2]
        return (self.quadratic or self.problem).candidate_residuals(u) - self.errors, self.rate_effect

    def residuals_and_jacobian(self, u: Floats) -> tuple[Floats, Floats, Floats]:
        """The same, and derivatives (candidates, tests, observations, parameters) to u (candidates, parameters)."""
        residuals, jacobian = (self.quadratic or self.problem).candidate_jacobian(u)
        effect = self.rate_effect
        if self._rates_are_coefficients:
            of_rates = jacobian[..., list(self.problem.coordinates.coefficients)].sum(axis=-1)
            effect = 0.5 * (self.rate_effect + of_rates * self.rate_sd)
        return residuals - self.errors, effect, jacobian

    @property
    def _rates_are_coefficients(self) -> bool:
        """Whether the effect of a test's own rate is taken where a candidate is."""
        followed = self.problem.observations.followed_to_rupture.any()
        return self.problem.coordinates.every_rate_has_coefficient and not followed and self.rate_sd > 0

    def inside(self, u: Floats) -> Bools:
        """(candidates,) whether the bounds of u and of the law's parameters, and its constraints, hold.

        u : (candidates, parameters).
        """
        is_inside = np.asarray(((u >= self.lower) & (u <= self.upper)).all(axis=1))
        lower, upper = self.parameter_bounds
        # Candidates beyond the bounds of u may have no finite values: those within take their place.
        with np.errstate(all="ignore"):
            theta = self.problem.coordinates.theta(np.clip(u, self.lower, self.upper))
        tolerance = 1e-9 * (upper - lower)
        is_inside &= ((theta >= lower - tolerance) & (theta <= upper + tolerance)).all(axis=1)
        if self.problem.law.constraints:
            bound_penalties = self.problem.bound_penalties
            for k in np.flatnonzero(is_inside):
                is_inside[k] = not (bound_penalties.constraint_violations(u[k]) > 0).any()
        return np.asarray(is_inside)


def _whitened_each(factor: CovarianceFactor, values: Floats) -> Floats:
    """L^-1 v of each of (..., tests, observations)."""
    columns = np.moveaxis(values.reshape(-1, *values.shape[-2:]), 0, -1)
    return np.moveaxis(factor.whiten(columns), -1, 0).reshape(values.shape)


def _whitened(factor: CovarianceFactor, rate_effect: Floats, values: Floats) -> Floats:
    """Residuals (..., tests, observations) over their scatter, with a random effect (..., tests, observations) beside.

    With W the whitening of the factor and v = W effect the covariance is W^-1 (I + v v') W^-T, and its inverse root
    (I - b v v') W, b = (1 - 1 / sqrt(1 + v'v)) / v'v.
    """
    whitened, whitened_effect = (_whitened_each(factor, each) for each in (values, rate_effect))
    squared_norm = np.maximum((whitened_effect**2).sum(axis=-1, keepdims=True), 1e-300)
    correction = (1.0 - 1.0 / np.sqrt(1.0 + squared_norm)) / squared_norm
    return np.asarray(
        whitened - correction * whitened_effect * (whitened_effect * whitened).sum(axis=-1, keepdims=True)
    )
