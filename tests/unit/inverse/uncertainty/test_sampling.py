"""Samples of the posterior against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm
from scipy.stats import t as student

from creepkit.inverse.identify import identify
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.uncertainty.importance_sampling import sample_posterior
from creepkit.inverse.uncertainty.posterior import Posterior
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


def test_rates_that_scatter_between_tests_count_once_a_test():
    """ln rate of 12 tests on ln stress is a regression: the slope's standard error is sd / sqrt(sum of squares).

    A quarter of the half width holds what draws scatter by, and what rates do beyond second order.
    """
    stresses = np.geomspace(30.0, 80.0, 12)
    tests = planted(NORTON, {"A": 1e-16, "n": 5.2}, [(s, 1000.0) for s in stresses], seed=5, rate=0.2, noise=1e-5)
    fit = identify(NORTON, tests, Steady(), settings=IdentificationSettings(starts=3, sobol_points=16, frames=12))
    x = np.log(stresses)
    y = np.array([np.log(h.outputs["strain"][-1] / h.times[-1]) for h in tests])
    slope, level = np.polyfit(x, y, 1)
    sd = np.sqrt(((y - level - slope * x) ** 2).sum() / 10)
    half = student.ppf(0.975, 10) * sd / np.sqrt(((x - x.mean()) ** 2).sum())
    assert sample_posterior(fit, seed=1).interval("n") == pytest.approx(
        (slope, slope - half, slope + half), abs=0.25 * half
    )


def test_a_bound_cuts_the_posterior(tests):
    """Far more than n = 3 allows: against its bound the density is an exponential tail, all of it below."""
    short = NORTON.with_bounds(n=(1.0, 3.0))
    found = sample_posterior(known_scatter(short, tests, SD), seed=2)
    best, covariance = least_squares(tests, SD)
    middle, sd = best[1], float(np.sqrt(covariance[1, 1]))
    expected = middle + sd * norm.ppf(norm.cdf((3.0 - middle) / sd) * np.array([0.5, 0.025]))
    n = found.interval("n")
    assert n[0] == pytest.approx(expected[0], abs=0.1 * (3.0 - expected[0]))
    assert n[1] == pytest.approx(expected[1], abs=0.15 * (3.0 - expected[1]))
    assert found.values["n"].max() <= 3.0


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


def test_a_seed_repeats_the_draws(fit):
    first, again = (sample_posterior(fit, seed=5) for _ in range(2))
    assert np.array_equal(first.u, again.u)
    assert not np.array_equal(first.u, sample_posterior(fit, seed=6).u)
