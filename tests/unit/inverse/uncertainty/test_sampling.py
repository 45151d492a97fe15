"""Samples of the posterior against closed forms."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid, trapezoid
from scipy.stats import beta, multivariate_normal, truncnorm
from scipy.stats import t as student

from creepkit.inverse.identify import identify, sampled_where_needed
from creepkit.inverse.noise_model import NoiseModel, OutputNoise
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.uncertainty.importance_sampling import (
    SAMPLES,
    needs_samples,
    posterior_samples,
    sample_posterior,
    shortened_covariance,
    with_samples,
)
from creepkit.inverse.uncertainty.posterior import Posterior, QuadraticResiduals
from creepkit.inverse.uncertainty.quantities import exponent_at, rate_at
from creepkit.laws.norton import NORTON
from creepkit.records import Nuisance
from helpers.log_rate_predictor import LogRates, known_scatter, least_squares, measured
from helpers.steady_rate_predictor import Steady, planted

TRUTH = {"A": float(np.exp(-15.0 - 4.0 * np.log(50.0))), "n": 4.0}
SD = 0.2
A, N = NORTON.params


@pytest.fixture(scope="module")
def tests():
    return measured(NORTON, TRUTH, (30.0, 50.0, 80.0), sd=SD, seed=3)


@pytest.fixture(scope="module")
def fit(tests):
    return known_scatter(NORTON, tests, SD)


@pytest.fixture(scope="module")
def samples(fit):
    return sample_posterior(fit, seed=1)


def test_of_a_linear_problem_they_are_normal(samples, tests):
    """Means and spreads of linear regression, to what some thousand independent draws can tell."""
    best, covariance = least_squares(tests, SD)
    draws = np.stack([np.log(samples.values["A"]), samples.values["n"]])
    sd = np.sqrt(np.diag(covariance))
    assert np.abs(draws.mean(axis=1) - best) == pytest.approx(0.0 * sd, abs=0.15 * sd.max())
    assert np.cov(draws) == pytest.approx(covariance, rel=0.15)
    assert np.corrcoef(draws)[0, 1] == pytest.approx(covariance[0, 1] / sd.prod(), abs=0.005)


def test_intervals_of_rate_and_exponent(samples, tests):
    best, covariance = least_squares(tests, SD)
    way = np.array([1.0, np.log(100.0)])
    middle, half = float(way @ best), 1.96 * float(np.sqrt(way @ covariance @ way))
    rate, low, high = samples.rate([50.0, 100.0], warn=False)
    assert np.log(low[1]) == pytest.approx(middle - half, abs=0.15 * half)
    assert np.log(high[1]) == pytest.approx(middle + half, abs=0.15 * half)
    assert samples.interval(rate_at(100.0)) == pytest.approx((rate[1], low[1], high[1]))
    assert samples.local_exponent(60.0) == pytest.approx(samples.interval("n"), rel=1e-6)
    assert samples.interval(exponent_at(60.0)) == pytest.approx(samples.interval("n"), rel=1e-6)


def test_poorly_known_scatter_widens_them(fit, tests):
    """With 4 degrees of freedom the marginal of n is Student's t, whose 95 % interval is 2.78 standard errors."""
    best, covariance = least_squares(tests, SD)
    found = sample_posterior(replace(fit, freedom=4.0), seed=4)
    half = student.ppf(0.975, 4.0) * np.sqrt(covariance[1, 1])
    assert found.interval("n") == pytest.approx((best[1], best[1] - half, best[1] + half), abs=0.15 * half)


def test_nuisances_are_integrated_out(tests):
    """y = theta . basis + e b with e normal: that is a covariance of C + b b' sd^2 of the residuals."""
    using = LogRates(by=3.0)
    own = (Nuisance("thickness", mean=0.5, sd=0.05),)
    fit = known_scatter(NORTON, tests, SD, using=using, nuisances=own)
    posterior = Posterior.from_identification(fit)
    rows = np.array(
        [(1.0, np.log(h.loading.program().values[0] / fit.reference.stress)) for h in tests for _ in h.times]
    )
    shared = np.kron(np.eye(len(tests)), np.ones((tests[0].times.size, 1))) * 3.0 * 0.05
    inverse = np.linalg.inv(SD**2 * np.eye(len(rows)) + shared @ shared.T)
    curvature = rows.T @ inverse @ rows
    step = np.array([0.03, 0.2])
    points = fit.u + np.array([step, -step, 0.0 * step])
    up, down, middle = posterior.chi_square(*posterior.residuals(points))
    assert up + down - 2 * middle == pytest.approx(2 * step @ curvature @ step, rel=1e-4)
    y = np.concatenate([h.outputs["amplitude"] - h.times / 1e5 for h in tests])
    left = [y - rows @ u for u in points]
    assert up - down == pytest.approx(left[0] @ inverse @ left[0] - left[1] @ inverse @ left[1], rel=1e-4)


# ---- importance sampling ---------------------------------------------------------------------------------------------

# Samples where Laplace's approximation fails: truncated normal distributions, and a grid of the posterior.


SETTINGS = IdentificationSettings(starts=1, sobol_points=8, weights="likelihood", nuisances=(), usual_errors="none")
BOUNDED = NORTON.with_bounds(n=(1.0, 4.0))
"""Norton's law with n of at most 4."""


def sampled(log_density, centre, covariance, seed=0):
    """Samples of ln p (candidates, parameters) from a Gaussian about `centre`."""

    def density(u):
        return np.atleast_1d(log_density(u))

    centre = np.array(centre)
    return posterior_samples(density, centre, shortened_covariance(density, centre, np.array(covariance)), seed)


# ---- closed forms ------------------------------------------------------------------------------------------------

PROBABILITIES = np.array([0.025, 0.25, 0.5, 0.75, 0.975])


@pytest.mark.parametrize("upper", [0.0, -1.0, 2.0])
def test_quantiles_of_a_truncated_normal(upper):
    """N(0, 1) below a bound, beside a parameter that is normal: 3 % of the standard deviation in each quantile."""

    def density(u):
        inside = (u[:, 0] <= upper) & (u[:, 0] > -30)
        return np.where(inside, -0.5 * u[:, 0] ** 2 - 0.5 * (u[:, 1] - 5.0) ** 2 / 0.04, -np.inf)

    samples = sampled(density, [min(upper, 0.0), 5.0], np.diag([1.0, 0.04]))
    assert samples.shape == (SAMPLES, 2)
    assert samples[:, 0].max() <= upper
    truth = truncnorm(-np.inf, upper).ppf(PROBABILITIES)
    np.testing.assert_allclose(
        np.quantile(samples[:, 0], PROBABILITIES), truth, atol=0.12 * truncnorm(-99, upper).std()
    )
    assert samples[:, 1].mean() == pytest.approx(5.0, abs=0.03)
    assert samples[:, 1].std() == pytest.approx(0.2, rel=0.12)


def test_a_covariance_that_is_far_too_narrow_is_made_wider():
    """Laplace's standard deviations are a third of the true ones, and the parameters are correlated by 0.9."""
    truth = multivariate_normal([1.0, -2.0], [[1.0, 0.9], [0.9, 1.0]])
    samples = sampled(truth.logpdf, [1.0, -2.0], np.eye(2) / 9.0)
    np.testing.assert_allclose(samples.mean(axis=0), [1.0, -2.0], atol=0.15)
    np.testing.assert_allclose(np.cov(samples.T), [[1.0, 0.9], [0.9, 1.0]], atol=0.2)


def test_parameters_may_be_of_any_size():
    """Exponents beside an activation energy in J/mol: variances of 1e-7 and 1e8, each with its own normal."""
    sizes = np.array([4e-4, 8e-3, 8e3])
    samples = sampled(lambda u: -0.5 * ((u / sizes) ** 2).sum(axis=1), np.zeros(3), np.diag(sizes**2))
    np.testing.assert_allclose(samples.std(axis=0), sizes, rtol=0.12)


def test_a_parameter_of_which_only_the_bounds_are_known_is_uniform():
    """Its standard deviation is that of the bounds: 1 / sqrt(12)."""

    def density(u):
        return np.where((u[:, 0] >= 0) & (u[:, 0] <= 1), -0.5 * (u[:, 1] / 0.1) ** 2, -np.inf)

    samples = sampled(density, [0.5, 0.0], np.diag([1 / 12, 0.01]))[:, 0]
    np.testing.assert_allclose(np.quantile(samples, PROBABILITIES), beta(1, 1).ppf(PROBABILITIES), atol=0.04)


# ---- identifications ---------------------------------------------------------------------------------------------


def steady_tests(n=4.0, noise=4e-4):
    made = planted(NORTON, {"A": 1e-15, "n": n}, [(s, 1000.0) for s in (60.0, 70.0, 80.0)], seed=3, noise=noise)
    return [h.replace(standard_deviation={"strain": np.full(h.times.size, noise)}) for h in made]


@pytest.fixture(scope="module")
def at_bound():
    """n of 4.1 planted, at most 4 allowed."""
    return sampled_where_needed(identify(BOUNDED, steady_tests(4.1), Steady(), settings=SETTINGS))


def test_a_value_at_its_bound_gets_samples(at_bound):
    assert at_bound.estimates[1].verdict == "at its bound"
    assert needs_samples(at_bound)
    assert at_bound.samples.shape == (SAMPLES, 2)
    assert at_bound.coordinates.theta(at_bound.samples)[:, 1].max() <= 4.0


def test_quantiles_are_those_of_a_grid_of_the_posterior(at_bound):
    """exp(ln p) summed over the middles of 150 x 150 cells within the bounds, marginal in each coordinate."""
    posterior, u = Posterior.from_identification(at_bound), at_bound.u
    seeds = [replace(at_bound, settings=replace(at_bound.settings, seed=seed)) for seed in range(4)]
    samples = np.concatenate([with_samples(one).samples for one in seeds])
    spread = samples.std(axis=0)
    axes = [
        np.linspace(max(c - 6 * s, low), min(c + 6 * s, high), 151)
        for c, s, low, high in zip(u, spread, posterior.lower, posterior.upper, strict=True)
    ]
    axes = [0.5 * (edges[1:] + edges[:-1]) for edges in axes]
    points = np.stack([one.ravel() for one in np.meshgrid(*axes, indexing="ij")], axis=-1)
    density = np.exp(posterior(points)).reshape(150, 150)
    for k in range(2):
        marginal = trapezoid(density, axes[1 - k], axis=1 - k)
        cumulative = cumulative_trapezoid(marginal, axes[k], initial=0.0)
        found = np.interp(np.quantile(samples[:, k], PROBABILITIES), axes[k], cumulative / cumulative[-1])
        assert np.abs(found - PROBABILITIES).max() < 0.04
        assert np.abs(found - PROBABILITIES)[[0, -1]].max() < 0.02


def test_intervals_come_from_the_samples_and_hold_the_value(at_bound):
    value, low, high = at_bound.local_exponent(70.0, 1000.0)
    draws = at_bound.coordinates.theta(at_bound.samples)[:, 1]
    assert low == pytest.approx(np.quantile(draws, 0.025), abs=1e-3)
    assert high == pytest.approx(4.0, abs=1e-3)
    assert low < value <= high
    rate, low, high = at_bound.rate(70.0, 1000.0)
    assert low < rate < high
    laplace = replace(at_bound, samples=None).local_exponent(70.0, 1000.0)
    assert laplace[2] > 4.0


def test_values_inside_their_bounds_need_none():
    fit = sampled_where_needed(identify(NORTON, steady_tests(), Steady(), settings=SETTINGS))
    assert not needs_samples(fit)
    assert fit.samples is None


def test_values_found_under_weights_scatter_as_their_estimator_does():
    """Ordinary least squares of tests whose rates scatter by 0.3: n beyond its bound is a truncated normal.

    Their covariance is (0.3^2 + 0.02^2 / 10) (X'X)^-1; readings alone would say 0.02^2 / 10 (X'X)^-1.
    """
    stresses, scatter, noise = np.geomspace(30.0, 80.0, 10), 0.3, 0.02
    made = measured(NORTON, {**TRUTH, "n": 4.1}, stresses, sd=noise, seed=3)
    off = scatter * np.random.default_rng(4).standard_normal(10)
    made = [h.replace(outputs={"amplitude": h.outputs["amplitude"] + b}) for h, b in zip(made, off, strict=True)]
    settings = replace(SETTINGS, weights="equal")
    fit = identify(BOUNDED, made, LogRates(), settings=settings)
    known = NoiseModel({"amplitude": OutputNoise(noise=noise)}, rate=scatter)
    rows = np.stack([np.ones(10), np.log(stresses)], axis=1)
    means = [(h.outputs["amplitude"] - h.times / 1e5).mean() for h in made]
    best = np.linalg.lstsq(rows, np.array(means), rcond=None)[0][1]
    sd = np.sqrt((scatter**2 + noise**2 / 10) * np.linalg.inv(rows.T @ rows)[1, 1])
    found = sample_posterior(replace(fit, noise_model=known, freedom=1e9), seed=1).values["n"]
    truth = truncnorm((1.0 - best) / sd, (4.0 - best) / sd, best, sd)
    np.testing.assert_allclose(np.quantile(found, PROBABILITIES), truth.ppf(PROBABILITIES), atol=0.12 * truth.std())


@dataclass(frozen=True)
class Shifted(Steady):
    """The same but for a constant factor: it agrees once it is corrected."""

    def predict_batch(self, law, theta, histories, nuisances, sensitivities):
        found = Steady.predict_batch(self, law, theta, histories, nuisances, sensitivities)
        jacobian = None if found.jacobian is None else 1.05 * found.jacobian
        return replace(found, values=1.05 * found.values, jacobian=jacobian)


def test_a_cheaper_predictor_is_corrected_before_samples_are_drawn_through_it(at_bound):
    found = with_samples(replace(at_bound, samples=None), Shifted())
    deviation = (found.samples.mean(axis=0) - at_bound.samples.mean(axis=0)) / at_bound.samples.std(axis=0)
    assert np.abs(deviation).max() < 0.3


# ---- quadratic residuals -----------------------------------------------------------------------------------------


def test_quadratic_functions_come_back_with_their_derivatives():
    """Of 12 points six terms are found, whatever the weights; derivatives are those of differences."""
    rng = np.random.default_rng(0)
    a, b, c = rng.standard_normal((1, 3)), rng.standard_normal((2, 3)), rng.standard_normal((2, 2, 3))

    def residuals(u):
        return (a + u @ b + np.einsum("ni,ijo,nj->no", u, c, u))[:, None, :]

    u = np.array([3.0, -1.0]) + rng.standard_normal((12, 2))
    shape = np.array([[1.0, 0.3], [0.3, 0.5]])
    found = QuadraticResiduals.fitted(u, residuals(u), rng.uniform(0.1, 1.0, 12), np.array([3.0, -1.0]), shape)
    further = np.array([[5.0, 2.0], [1.0, 0.0]])
    values, jacobian = found.candidate_jacobian(further)
    np.testing.assert_allclose(values, residuals(further), rtol=1e-9)
    for k, step in enumerate(1e-5 * np.eye(2)):
        difference = (residuals(further + step) - residuals(further - step)) / 2e-5
        np.testing.assert_allclose(jacobian[..., k], difference, rtol=1e-6, atol=1e-6)
