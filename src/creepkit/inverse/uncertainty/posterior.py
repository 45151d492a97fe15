"""The posterior of a law's conditioned coordinates u: its density for many candidates at once, and samples by MCMC.

The prior of u is flat within the law's bounds, and chi2 is taken under the covariance that the fit found. With nu
degrees of freedom of that covariance and K parameters

    ln p(u) = -(nu + K) / 2 ln(1 + (chi2(u) - least chi2) / nu),

the multivariate Student's t (Box & Tiao (1973), Bayesian Inference in Statistical Analysis, 2.7); -chi2(u) / 2 for
large nu. Nuisance parameters of tests are integrated out to first order about their estimates: with r the whitened
residuals at the estimates, J their derivatives to the nuisance parameters, priors below, chi2(u) = |r|^2 - |Q' r|^2,
J = Q R. The effect of a test's own rate is taken half way between the optimum and the candidate (see
uncertainty.profile_likelihood).

Samples are drawn by emcee with moves of differential evolution (ter Braak (2006), Stat. Comput. 16, 239), a fifth of
them its snooker update (ter Braak & Vrugt (2008), Stat. Comput. 18, 435).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit import limits
from creepkit.arrays import ArrayLike, Bools, Floats, single_threaded_blas
from creepkit.checked_arguments import checked
from creepkit.errors import FitError
from creepkit.inverse.composite_predictor import predictor_for_law
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.identification import Identification
from creepkit.inverse.noise_covariance import CovarianceFactor
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.search.local_refinement import IterationCallback, Tolerances
from creepkit.inverse.uncertainty.mixture_distribution import INTERVAL_PROBABILITIES
from creepkit.inverse.uncertainty.quadratic_residuals import QuadraticResiduals
from creepkit.inverse.uncertainty.quantities import DerivedQuantity, local_exponent, log_rate, quantity_of
from creepkit.presentation import Presentable, present
from creepkit.records import Predictor

if TYPE_CHECKING:
    from matplotlib.figure import Figure


TESTS_ALONE = "by the tests alone: their temperatures, loads and dimensions are taken as exactly known"
"""What is said of intervals that do not include the errors which tests usually have."""


REFIT_TOLERANCES = Tolerances(max_steps=25, tolerance=1e-7)
"""Of minima about an optimum that is known."""


@dataclass(frozen=True, eq=False)
class Posterior:
    """ln p, but for a constant, of candidates u.

    problem : with nuisance parameters fixed at their estimates. rate_sd : standard deviation of ln rate between tests.
    test_weights : (tests,) -. covariance_factor : without the scatter of rates. rate_effect : (tests, observations) -,
    at the optimum, what one standard deviation of a test's own rate does. parameter_bounds : (2, parameters) of the
    internal parameters.
    nuisance_basis : (data + nuisances, nuisances) Q. prior_residuals : (nuisances,) - of the priors, at the estimates.
    degrees_of_freedom : nu; least_chi_square : at the optimum.
    quadratic : residuals as functions of u, in the place of predictions.
    """

    problem: LeastSquaresProblem
    rate_sd: float
    test_weights: Floats
    covariance_factor: CovarianceFactor
    rate_effect: Floats
    parameter_bounds: Floats
    nuisance_basis: Floats
    prior_residuals: Floats
    degrees_of_freedom: float
    least_chi_square: float
    quadratic: QuadraticResiduals | None = None

    @classmethod
    def from_identification(cls, fit: Identification) -> Posterior:
        """The posterior of an identification, about its optimum."""
        problem, noise_model = fit.least_squares_problem, fit.noise_model
        residuals, nuisances, count = fit.residuals_of(problem), problem.nuisance_parameters, fit.u.size
        assert residuals.jacobian is not None
        e = fit.x[count:]
        factor = CovarianceFactor.of_residuals(residuals, replace(noise_model, rate=0.0))
        rate_effect = residuals.log_rate_sensitivity * noise_model.rate / np.sqrt(residuals.test_weights)[:, None]
        root_precision = np.diag(np.sqrt(nuisances.precision))
        nuisance_jacobian = _whitened(factor, rate_effect, np.moveaxis(residuals.jacobian[..., count:], -1, 0))
        nuisance_rows = nuisance_jacobian[:, problem.observations.present].T
        whole = problem.with_covariance(CovarianceFactor.of_residuals(residuals, noise_model))
        return cls(
            problem=problem.with_fixed_nuisances(e),
            rate_sd=noise_model.rate,
            test_weights=residuals.test_weights,
            covariance_factor=factor,
            rate_effect=rate_effect,
            parameter_bounds=fit.law.internal_bounds,
            nuisance_basis=np.linalg.qr(np.concatenate([nuisance_rows, root_precision]))[0],
            prior_residuals=root_precision @ (e - nuisances.mean[: nuisances.size]),
            degrees_of_freedom=max(fit.freedom, 1.0),
            least_chi_square=whole.chi_square(whole.minimise(fit.x, tolerances=REFIT_TOLERANCES).x),
        )

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
            log_density[is_inside] = self.log_density(*self.residuals(u[is_inside]))
        return log_density

    def log_density(self, residuals: Floats, rate_effect: Floats) -> Floats:
        """(candidates,) ln p of candidates within the bounds, but for a constant.

        residuals, rate_effect : (candidates, tests, observations) as residuals() gives them.
        """
        chi_square, count = self.chi_square(residuals, rate_effect), self.problem.parameter_count
        rise = np.maximum(chi_square - self.least_chi_square, -0.5 * self.degrees_of_freedom)
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
        problem, law = self.problem, self.problem.law
        predicted = self.quadratic or problem
        coefficients = list(problem.coordinates.coefficients)
        is_separable = (
            len(coefficients) == len(law.terms) + len(law.states) and not problem.observations.followed_to_rupture.any()
        )
        if not (is_separable and self.rate_sd > 0):
            return predicted.candidate_residuals(u), self.rate_effect
        residuals, jacobian = predicted.candidate_jacobian(u)
        rate_scatter = self.rate_sd / np.sqrt(self.test_weights)[:, None]
        return residuals, 0.5 * (self.rate_effect + jacobian[..., coefficients].sum(axis=-1) * rate_scatter)

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


CONVERGED_LENGTH = 50.0
"""Steps over autocorrelation time that emcee's authors require before its estimate is reliable."""


MAX_START_DRAWS = 50
"""Draws of a walker's start that may fall outside the bounds."""


@dataclass(frozen=True, eq=False)
class PosteriorSamples(Presentable, text="reports.uncertainty:posterior_text"):
    """Draws of a law's values from their posterior.

    chain : (steps, walkers, parameters) conditioned coordinates u, all of them; log_probability : (steps, walkers).
    burn_in : steps left out at the beginning. acceptance_fraction : mean share of accepted moves.
    autocorrelation_time : (parameters,) steps.
    """

    coordinates: Coordinates
    chain: Floats
    log_probability: Floats
    burn_in: int
    acceptance_fraction: float
    autocorrelation_time: Floats
    notes: tuple[str, ...] = ()

    @property
    def u(self) -> Floats:
        """(draws, parameters) after the burn-in."""
        return self.chain[self.burn_in :].reshape(-1, self.chain.shape[-1])

    @property
    def values(self) -> dict[str, Floats]:
        """{parameter: (draws,)} in the author's units."""
        return self.coordinates.law.from_internal(self.coordinates.theta(self.u))

    @property
    def converged(self) -> bool:
        """Whether the chain is long against its autocorrelation time."""
        return bool(len(self.chain) > CONVERGED_LENGTH * self.autocorrelation_time.max())

    @property
    def effective_sample_size(self) -> float:
        """Number of independent draws that are worth as much."""
        return float(len(self.u) / self.autocorrelation_time.max())

    def interval(self, quantity_or_name: str | DerivedQuantity) -> tuple[float, float, float]:
        """Median and 95 % interval of a parameter, by name, or another quantity: (median, low, high)."""
        quantity = quantity_of(self.coordinates, quantity_or_name)
        quantiles = quantity.to_unit(np.quantile(quantity.function(self.coordinates)(self.u), INTERVAL_PROBABILITIES))
        return float(quantiles[0]), float(quantiles[1]), float(quantiles[2])

    @checked
    def rate(
        self,
        stress: ArrayLike,
        temperature: ArrayLike | None = None,
        *,
        strain: ArrayLike | None = None,
        time: ArrayLike | None = None,
    ) -> tuple[Floats, Floats, Floats]:
        """Median creep rate, 1/s, with its 95 % interval: (rate, low, high), each of the broadcast shape.

        stress, temperature, strain, time : numbers or arrays that broadcast, in MPa, K, - and s.
        """
        draws = log_rate(self.coordinates, stress, temperature, strain, time)(self.u)
        median, low, high = np.exp(np.quantile(draws, INTERVAL_PROBABILITIES, axis=0))
        return median, low, high

    @checked
    def local_exponent(
        self,
        stress: ArrayLike,
        temperature: ArrayLike | None = None,
        *,
        strain: ArrayLike | None = None,
        time: ArrayLike | None = None,
    ) -> tuple[Floats, Floats, Floats]:
        """Median local stress exponent with its 95 % interval: (exponent, low, high).

        stress, temperature, strain, time : as in `rate`, numbers or arrays that broadcast; the results have that shape.
        """
        draws = local_exponent(self.coordinates, stress, temperature, strain, time)(self.u)
        median, low, high = np.quantile(draws, INTERVAL_PROBABILITIES, axis=0)
        return median, low, high

    def plot(self, path: str | Path | None = None) -> Figure:
        """Every pair of parameters, and each alone; written to `path` when given."""
        return present("reports.uncertainty:pairs_figure", self, path)


def sample_posterior(
    fit: Identification,
    *,
    walkers: int = 32,
    steps: int = 1000,
    seed: int = 0,
    using: Predictor | None = None,
    progress: IterationCallback | None = None,
) -> PosteriorSamples:
    """Sample the posterior of an identification's values; needs emcee.

    walkers : an even number of at least twice the parameters. using : another predictor of the same tests than the
        fit's, such as a surrogate where the fit's is a finite element model.
    """
    limits.check_number("walkers", walkers, limits.WALKERS, FitError)
    limits.check_number("steps", steps, limits.WALKER_STEPS, FitError)
    emcee, size = _import_emcee(), fit.u.size
    if walkers % 2 or walkers < 2 * size + 2 or steps < 10:
        raise FitError(
            f"{walkers} walkers and {steps} steps were asked for; a law of {size} parameters needs an even number of "
            f"at least {2 * size + 2} walkers, and at least 10 steps"
        )
    sampled = fit if using is None else fit.with_histories(fit.histories, predictor_for_law(using, fit.law))
    posterior = Posterior.from_identification(sampled)
    rng = np.random.default_rng(seed)
    moves = [(emcee.moves.DEMove(), 0.8), (emcee.moves.DESnookerMove(), 0.2)]
    sampler = emcee.EnsembleSampler(walkers, size, posterior, vectorize=True, moves=moves)
    start = emcee.State(
        _initial_walkers(fit, posterior, walkers, rng), random_state=np.random.RandomState(seed).get_state()
    )
    with single_threaded_blas():
        for k, _ in enumerate(sampler.sample(start, iterations=steps)):
            if progress is not None:
                progress("step", k + 1, steps)
    return _posterior_samples(fit, sampler.get_chain(), sampler.get_log_prob(), sampler.acceptance_fraction, emcee)


def _import_emcee() -> Any:
    try:
        import emcee
    except ImportError:
        raise FitError("sampling needs emcee, which is not installed: pip install 'creepkit[mcmc]'") from None
    return emcee


def _initial_walkers(fit: Identification, posterior: Posterior, walkers: int, rng: np.random.Generator) -> Floats:
    """(walkers, parameters) from Laplace's approximation, drawn again where a bound cuts it, ever closer to the fit."""
    covariance = fit.by_tests_alone.covariance
    root = np.linalg.cholesky(covariance + 1e-14 * np.diag(np.diag(covariance)))
    centre = np.clip(fit.u, posterior.lower, posterior.upper)
    starts = np.empty((walkers, fit.u.size))
    missing = np.ones(walkers, bool)
    for k in range(MAX_START_DRAWS):
        starts[missing] = centre + 0.9**k * rng.normal(size=(int(missing.sum()), fit.u.size)) @ root.T
        starts = np.where(missing[:, None], _reflected(starts, posterior), starts)
        missing &= ~np.isfinite(posterior(starts))
        if not missing.any():
            return starts
    raise FitError(
        f"law '{fit.law.name}': no walker can start, the values lie at the edge of the law's bounds; widen the bounds"
    )


def _reflected(u: Floats, posterior: Posterior) -> Floats:
    """Points beyond a bound thrown back by as much: values at their bound leave half a normal distribution."""
    u = np.where(u < posterior.lower, 2 * posterior.lower - u, u)
    return np.where(u > posterior.upper, 2 * posterior.upper - u, u)


def _posterior_samples(
    fit: Identification, chain: Floats, log_probability: Floats, accepted: Floats, emcee: Any
) -> PosteriorSamples:
    steps = len(chain)
    autocorrelation_time = np.array(
        [float(emcee.autocorr.integrated_time(chain[:, :, k], tol=0)[0]) for k in range(fit.u.size)]
    )
    autocorrelation_time = np.where(np.isfinite(autocorrelation_time), np.maximum(autocorrelation_time, 1.0), steps)
    burn_in = int(min(np.ceil(5 * autocorrelation_time.max()), steps // 2))
    notes = [] if fit.error_covariance is None else [TESTS_ALONE]
    if steps <= CONVERGED_LENGTH * autocorrelation_time.max():
        notes.append(
            f"not converged: the chain is {steps / autocorrelation_time.max():.0f} autocorrelation times long, "
            f"{CONVERGED_LENGTH:.0f} are needed; "
            f"ask for {int(np.ceil(CONVERGED_LENGTH * autocorrelation_time.max() / 100.0)) * 100 + 100} steps or more"
        )
    acceptance_fraction = float(np.mean(accepted))
    if not 0.05 < acceptance_fraction < 0.8:
        notes.append(f"a share of {acceptance_fraction:.2f} of the moves was accepted, where 0.2 to 0.5 is usual")
    return PosteriorSamples(
        fit.coordinates, chain, log_probability, burn_in, acceptance_fraction, autocorrelation_time, tuple(notes)
    )
