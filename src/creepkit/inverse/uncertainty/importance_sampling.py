"""Samples of the posterior where Laplace's approximation fails: a value at its bound, or not determined by the tests.

A Gaussian about a value at its bound puts half of its mass where no value may be, and is too narrow or too wide on the
other side. Samples are drawn from a Student's t about it, weighted with the posterior (see uncertainty.posterior) over
their density, and the proposal is moved to the weighted samples in a few rounds: population Monte Carlo (Cappe et al.
(2004), J. Comput. Graph. Stat. 13, 907). The posterior is that of the problem through a cheaper predictor, corrected at
the optimum by what it differs from the predictor there (see inverse.defect_correction), and with residuals that are
quadratic functions of u where these prove right (see uncertainty.posterior).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import softmax
from scipy.stats import chi2, norm, qmc

from creepkit import limits
from creepkit.arrays import ArrayLike, Floats, single_threaded_blas
from creepkit.checked_arguments import checked
from creepkit.errors import FitError
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.defect_correction import with_cheaper_predictor
from creepkit.inverse.identification import Identification
from creepkit.inverse.uncertainty.laplace_approximation import lies_at_bound
from creepkit.inverse.uncertainty.mixture_distribution import INTERVAL_PROBABILITIES
from creepkit.inverse.uncertainty.posterior import Posterior, QuadraticResiduals, quadratic_terms
from creepkit.inverse.uncertainty.quantities import (
    DerivedQuantity,
    Interval,
    PointQuantity,
    RateStatements,
    quantity_of,
)
from creepkit.language import CreepLaw
from creepkit.records import Predictor
from creepkit.records.presentable import Presentable, Tabulated

ROUNDS, MOST_ROUNDS = 4, 12
"""Of proposals: at least, to which those end whose density takes predictions where nobody asked for samples; and where
the samples are still worth too few."""


DRAWS, MOST_DRAWS = 256, 4096
"""In each round, a power of two for the Sobol sequence; and where many of them lie outside the bounds."""


SAMPLES = 400
"""Of equal weight, that are kept."""


PROPOSAL_FREEDOM = 5.0
"""Degrees of freedom of the proposal: tails heavier than those of a posterior of many frames; bounds end both."""


LEAST_EFFECTIVE_SIZE = 40.0
"""Effective number of samples below which they say nothing."""


SAMPLED_WIDTH = 0.8
"""Width of an interval, before bounds cut it, over that of the bounds from which on it is sampled."""


NOT_SAMPLED = (
    "values lie at their bounds or are not determined, and their posterior could not be sampled: intervals of rates "
    "may be too narrow"
)
"""The note on a fit whose posterior is none that can be sampled."""


def needs_samples(fit: Identification) -> bool:
    """Whether some value lies at its bound, or its interval nearly fills the bounds."""
    for one in fit.estimates:
        param = fit.law.table[one.name]
        low, high = (param.to_internal(bound) for bound in param.bounds)
        value, start, end = (param.to_internal(v) for v in (one.value, one.low, one.high))
        half = max(value - start, end - value)  # of the interval as it was: a bound cuts one side at most, or both
        if lies_at_bound(param, one) or 2.0 * half >= SAMPLED_WIDTH * (high - low):
            return True
    return False


def with_samples(fit: Identification, cheaper: Predictor | None = None) -> Identification:
    """The identification with samples of its posterior for intervals of rates and local exponents, where they succeed.

    cheaper : a predictor of the same tests that samples are drawn through, by default the reduced-order model.
    """
    problem = fit.least_squares_problem
    cheaper = cheaper or problem.predictor.reduced_order_model()
    if cheaper is not None:
        problem = with_cheaper_predictor(problem, fit.x, cheaper.for_search())
    posterior = Posterior.from_identification(replace(fit, problem=problem))
    centre, seed, shape = np.array(fit.u), fit.settings.seed, _first_shape(fit, posterior)
    samples = _samples_by_quadratic_residuals(posterior, centre, shape, seed)
    if samples is None:
        samples = posterior_samples(posterior, centre, shape, seed, rounds=ROUNDS)
    if samples is None:
        return replace(fit, notes=(*fit.notes, NOT_SAMPLED))
    return replace(fit, samples=samples)


@dataclass(frozen=True, eq=False)
class PosteriorSamples(RateStatements, Presentable, Tabulated):
    """Draws of a law's values from their posterior.

    u : (draws, parameters) conditioned coordinates of equal weight. ranges : that the tests cover, as of an
    Identification.
    """

    coordinates: Coordinates
    u: Floats
    ranges: Mapping[str, tuple[float, float]]

    @property
    def stated_laws(self) -> tuple[CreepLaw, ...]:
        """The law."""
        return (self.coordinates.law,)

    @property
    def values(self) -> dict[str, Floats]:
        """{parameter: (draws,)} in the author's units."""
        return self.coordinates.law.from_internal(self.coordinates.theta(self.u))

    def interval(self, quantity_or_name: str | DerivedQuantity) -> tuple[float, float, float]:
        """Median and 95 % interval of a parameter, by name, or another quantity: (median, low, high)."""
        quantity = quantity_of(self.coordinates, quantity_or_name)
        quantiles = quantity.to_unit(np.quantile(quantity.function(self.coordinates)(self.u), INTERVAL_PROBABILITIES))
        return float(quantiles[0]), float(quantiles[1]), float(quantiles[2])

    def interval_at(self, quantity: PointQuantity, point: Mapping[str, ArrayLike | None]) -> Interval:
        """Median and 95 % interval of a quantity; point : {name: (...,) or None}."""
        draws = quantity(self.coordinates, **point)(self.u)
        median, low, high = np.quantile(draws, INTERVAL_PROBABILITIES, axis=0)
        return median, low, high

    def __repr__(self) -> str:
        values = ", ".join(f"{name} = {np.median(draws):.4g}" for name, draws in self.values.items())
        return f"<PosteriorSamples of {self.coordinates.law.name}: {len(self.u)} draws, medians {values}>"

    def to_arviz(self) -> Any:
        """An xarray Dataset for arviz, whose plots and summaries take it: one chain, with units of the parameters."""
        from creepkit.reports.dataframes import to_arviz

        return to_arviz(self)

    shown_by = "identification.posterior_text"


@checked
def sample_posterior(
    fit: Identification,
    *,
    draws: Annotated[int, limits.DRAWS_OF_POSTERIOR] = 1000,
    seed: int = 0,
    using: Predictor | None = None,
) -> PosteriorSamples:
    """Draws from the posterior of an identification's values, by population Monte Carlo.

    The errors of the tests that its intervals include are added to each, to first order.

    draws : how many, worth half as many independent ones at least. using : another predictor of the same tests than
        the fit's, such as a surrogate where the fit's is a finite element model.
    """
    fit = fit if using is None else fit.with_histories(fit.histories, using.for_law(fit.law))
    with single_threaded_blas():
        posterior = Posterior.from_identification(fit)
        shape = _first_shape(fit, posterior)
        u = posterior_samples(posterior, posterior.optimum, shape, seed, draws=draws, least=0.5 * draws)
    if u is None:
        raise FitError(f"law '{fit.law.name}': its posterior could not be sampled; give more tests, or fix a parameter")
    if fit.error_covariance is not None:
        sd = np.sqrt(np.diag(fit.covariance))
        scaled = fit.error_covariance / np.outer(sd, sd)
        errors = np.random.default_rng(seed).multivariate_normal(np.zeros(sd.size), scaled, draws, method="eigh")
        u = np.clip(u + sd * errors, posterior.lower, posterior.upper)
    return PosteriorSamples(fit.coordinates, u, fit.ranges)


def _first_shape(fit: Identification, posterior: Posterior) -> Floats:
    """(parameters, parameters) covariance of the first proposal."""
    covariance = fit.by_tests_alone.covariance
    return shortened_covariance(posterior, fit.u, covariance + 1e-12 * np.diag(np.diag(covariance)))


def _samples_by_quadratic_residuals(posterior: Posterior, centre: Floats, shape: Floats, seed: int) -> Floats | None:
    """Samples of the posterior with residuals as quadratic functions of u, where it is what predictions say; else None.

    Fitted to draws about the optimum, and judged at draws of what it says itself, which improve it where it fails; at
    last these draws are weighted by what predictions say of them.
    """
    terms = quadratic_terms(centre.size)
    count = max(LEAST_POINTS, 2 * terms // (1 + centre.size))
    drawn = _drawn(centre, shape, seed, MOST_DRAWS)
    judged, known = drawn[posterior.inside(drawn)][:count], list[tuple[Floats, ...]]()
    samples: Floats = judged
    density: Callable[[Floats], Floats] = posterior
    if len(judged) < count:
        return None
    for k, points in enumerate(JUDGED_POINTS):
        residuals, rate_effect, *slopes = (posterior.residuals if k else posterior.residuals_and_jacobian)(judged)
        exact = posterior.log_density(judged, residuals, rate_effect)
        if k and float(np.std(exact - density(judged))) < LARGEST_ERROR:
            return samples
        usable = np.isfinite(exact) & np.isfinite(residuals).all((1, 2))
        if slopes:
            usable &= np.isfinite(slopes[0]).all((1, 2, 3))
            jacobian = slopes[0][usable]
        known.append(tuple(part[usable] for part in (judged, residuals, exact)))
        u, residuals, log_density = (np.concatenate(parts) for parts in zip(*known, strict=True))
        if len(jacobian) * (1 + centre.size) < 1.5 * terms:
            return None
        weights = np.exp(0.5 * np.maximum(log_density - log_density.max(), LEAST_LOG_WEIGHT))
        surface = QuadraticResiduals.fitted(u, residuals, weights, centre, shape, jacobian)
        density = _corrected(replace(posterior, quadratic=surface, errors=0.0), u, log_density, weights)
        found = posterior_samples(density, centre, shape, seed + k, least=2.0 * SAMPLES)
        if found is None:
            return None
        samples, judged = found, found[:: len(found) // points][:points]
    further, further_effect = posterior.residuals(judged)
    errors = posterior.log_density(judged, further, further_effect) - density(judged)
    return _resampled(judged, errors, LEAST_EFFECTIVE_SIZE, SAMPLES)


def _corrected(quadratic: Posterior, u: Floats, log_density: Floats, weights: Floats) -> Callable[[Floats], Floats]:
    """ln p by quadratic residuals, and a quadratic function of u more where that is wrong at simulated points.

    u : (points, parameters). log_density, weights : (points,) ln p there, and weights. No correction is larger than one
    that was found.
    """
    assert quadratic.quadratic is not None
    centre, root = quadratic.quadratic.centre, quadratic.quadratic.root
    if len(u) < 1.5 * quadratic_terms(u.shape[1]):
        return quadratic
    errors = log_density - quadratic(u)
    surface = QuadraticResiduals.fitted(u, errors[:, None, None], weights, centre, root @ root.T)

    def density(candidates: Floats) -> Floats:
        correction = surface.candidate_residuals(candidates)[:, 0, 0]
        return np.asarray(quadratic(candidates) + np.clip(correction, errors.min(), errors.max()))

    return density


LEAST_POINTS = 6
"""Simulated points, with derivatives, that quadratic residuals are fitted to at least."""


JUDGED_POINTS = (10, 16, 400)
"""Draws at which each of the fits of quadratic residuals is judged, and which improve the next; the last are weighted
by what predictions say."""


LEAST_LOG_WEIGHT = -20.0
"""ln of the posterior over its largest, below which points weigh the same."""


LARGEST_ERROR = 0.2
"""Standard deviation of the error of ln p by quadratic residuals: weights of samples then are right to 20 %."""


def posterior_samples(
    density: Callable[[Floats], Floats],
    centre: Floats,
    shape: Floats,
    seed: int,
    *,
    draws: int = SAMPLES,
    least: float = LEAST_EFFECTIVE_SIZE,
    rounds: int = MOST_ROUNDS,
) -> Floats | None:
    """(draws, parameters) conditioned coordinates of equal weight; None where too few of those tried count.

    density : ln p (candidates,), but for a constant, of u (candidates, parameters).
    centre : (parameters,) of the first proposal. shape : (parameters, parameters) its covariance. least : effective
    number of draws at which it ends. rounds : at most.
    """
    size = centre.size
    smallest = 1e-6 * np.diag(np.diag(shape))
    points, log_density = np.zeros((0, size)), np.zeros(0)
    proposals: list[tuple[Floats, Floats]] = []
    for k in range(rounds):
        proposals.append((centre, shape))
        drawn = _drawn(centre, shape, seed + k)
        points = np.concatenate([points, drawn])
        log_density = np.concatenate([log_density, density(drawn)])
        log_proposal = np.stack([_log_density_of_draws(points, *proposal) for proposal in proposals])
        mixture = np.logaddexp.reduce(log_proposal, axis=0) - np.log(len(proposals))
        log_weight = log_density - mixture
        if not np.isfinite(log_weight).any():
            return None
        weights = softmax(log_weight)
        centre = weights @ points
        deviation = points - centre
        shape = (weights[:, None] * deviation).T @ deviation + smallest
        if k + 1 >= ROUNDS and 1.0 / float((weights**2).sum()) >= least:
            break
    return _resampled(points, log_weight, LEAST_EFFECTIVE_SIZE, draws)


def _resampled(points: Floats, log_weight: Floats, least: float, draws: int) -> Floats | None:
    """(draws, parameters) points of equal weight; None where those of weights (points,) are worth fewer than `least`.

    points : (points, parameters). log_weight : (points,) ln of their weights.
    """
    weights = softmax(log_weight)
    if not 1.0 / float((weights**2).sum()) >= least:
        return None
    positions = (np.arange(draws) + 0.5) / draws
    return np.asarray(points[np.searchsorted(np.cumsum(weights), positions).clip(max=len(points) - 1)])


def shortened_covariance(density: Callable[[Floats], Floats], centre: Floats, covariance: Floats) -> Floats:
    """The covariance (parameters, parameters) with principal axes as short as the posterior falls along them.

    density : ln p (candidates,), but for a constant, of u (candidates, parameters). centre : (parameters,).
    covariance : (parameters, parameters) by Laplace.

    Where tests do not tell parameters apart, as two transients that are alike, the derivatives at the optimum vanish
    along a line that the posterior leaves soon after: Laplace's axis is then longer by orders of magnitude.
    """
    sd = np.sqrt(np.diag(covariance))
    variances, axes = np.linalg.eigh(covariance / np.outer(sd, sd))
    axes = axes * np.sqrt(np.maximum(variances, 1e-12))
    least = float(density(centre[None])[0]) - LARGEST_FALL
    lengths, longer = np.ones(centre.size), np.arange(centre.size)
    for _ in range(AXIS_HALVINGS):
        steps = (lengths[longer] * axes[:, longer]).T
        log_density = density(centre + sd * np.concatenate([steps, -steps])).reshape(2, -1)
        longer = longer[~(log_density >= least).any(axis=0)]
        if not longer.size:
            break
        lengths[longer] *= 0.5
    kept = axes * lengths
    return np.asarray(np.outer(sd, sd) * (kept @ kept.T))


AXIS_HALVINGS = 14
"""Of a principal axis of Laplace's approximation."""


LARGEST_FALL = 2.0
"""Of the logarithm of the posterior along a principal axis: a Gaussian falls by 0.5, Student's t by less than this."""


def _drawn(centre: Floats, shape: Floats, seed: int, draws: int = DRAWS) -> Floats:
    """(draws, parameters) quasi-random draws of a multivariate Student's t."""
    unit = qmc.Sobol(centre.size + 1, seed=seed).random(draws)
    unit = np.clip(unit, 1e-9, 1.0 - 1e-9)
    normal = norm.ppf(unit[:, :-1]) @ np.linalg.cholesky(shape).T
    mixing = chi2.ppf(unit[:, -1:], PROPOSAL_FREEDOM) / PROPOSAL_FREEDOM
    return np.asarray(centre + normal / np.sqrt(mixing))


def _log_density_of_draws(points: Floats, centre: Floats, shape: Floats) -> Floats:
    """(points,) ln of the density of that t, but for a constant; sizes of coordinates may differ by any factor.

    scipy's multivariate_t leaves out coordinates whose variance is 1e-10 of another's: exponents beside an energy.
    """
    root = np.linalg.cholesky(shape)
    distance = (solve_triangular(root, (points - centre).T, lower=True) ** 2).sum(axis=0)
    size_of_tail = 0.5 * (PROPOSAL_FREEDOM + centre.size)
    return np.asarray(-size_of_tail * np.log1p(distance / PROPOSAL_FREEDOM) - np.log(np.diag(root)).sum())
