"""Scatter: the likelihood is the textbook one, and planted sizes are found again."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from creepkit.inverse.covariance import (
    Scatter,
    covariance,
    effective_size,
    estimated,
    expected_effects,
    log_likelihood,
)
from creepkit.inverse.objective import Residuals
from creepkit.records import Nuisance

BOTH = (Nuisance("offset"), Nuisance("rate"))


def made(tests, frames, seed, scatter):
    """Residuals drawn from the very covariance, on strains that grow in time."""
    rng = np.random.default_rng(seed)
    times = np.tile(np.geomspace(10, 1e5, frames), (tests, 1))
    strain = 1e-4 + 2e-2 * times / times.max()
    slopes = 1 / strain
    shape = Residuals(np.zeros_like(slopes), slopes, np.ones_like(slopes, bool), None, 0.7 * np.ones_like(slopes))
    factor = np.linalg.cholesky(covariance(shape, np.log(times), scatter))
    values = (factor @ rng.normal(size=(tests, frames, 1)))[..., 0]
    return Residuals(values, slopes, shape.present, None, shape.rate_effect), np.log(times)


def test_likelihood_is_that_of_a_multivariate_normal():
    scatter = Scatter(noise=1e-5, offset=2e-5, rate=0.3, drift=0.05, reach=1.5)
    residuals, log_times = made(3, 12, 0, scatter)
    c = covariance(residuals, log_times, scatter)
    truth = sum(multivariate_normal(np.zeros(12), c[k]).logpdf(residuals.values[k]) for k in range(3))
    assert log_likelihood(residuals, log_times, scatter) == pytest.approx(truth, rel=1e-10)


def test_absent_frames_do_not_count():
    scatter = Scatter(noise=1e-5, offset=2e-5, rate=0.3, drift=0.05, reach=1.5)
    whole, log_times = made(2, 12, 1, scatter)
    present = whole.present.copy()
    present[1, 7:] = False
    part = Residuals(np.where(present, whole.values, 0), np.where(present, whole.slopes, 0), present, None,
                     np.where(present, whole.rate_effect, 0))  # fmt: skip
    c = covariance(whole, log_times, scatter)
    truth = multivariate_normal(np.zeros(12), c[0]).logpdf(whole.values[0])
    truth += multivariate_normal(np.zeros(7), c[1][:7, :7]).logpdf(whole.values[1, :7])
    assert log_likelihood(part, log_times, scatter) == pytest.approx(truth, rel=1e-10)


def test_planted_scatter_is_found():
    """150 tests: the standard error of a standard deviation from 150 draws is 6 %, so 25 % is four of them."""
    truth = Scatter(noise=2e-5, offset=1e-4, rate=0.4, drift=0.1, reach=1.5)
    residuals, log_times = made(150, 30, 2, truth)
    found = estimated(residuals, log_times, Scatter(2e-5, 0, 3e-5, 0.5, 0.2, 2.0), BOTH)
    assert found.offset == pytest.approx(truth.offset, rel=0.25)
    assert found.rate == pytest.approx(truth.rate, rel=0.25)
    assert found.drift == pytest.approx(truth.drift, rel=0.25)
    assert found.reach == pytest.approx(truth.reach, rel=0.5)


def test_a_given_prior_stays():
    residuals, log_times = made(20, 20, 3, Scatter(2e-5, 0, 1e-4, 0.4, 0.1, 1.5))
    found = estimated(
        residuals, log_times, Scatter(2e-5, 0, 7e-5, 0.5, 0.1, 1.5), (Nuisance("offset", sd=7e-5), Nuisance("rate"))
    )
    assert found.offset == 7e-5


def test_effective_size_counts_a_test_once_when_its_residuals_move_together():
    residuals, log_times = made(6, 40, 4, Scatter(1e-6, 0.0, 0.0, 1.0, 0.0, 1.0))
    assert effective_size(residuals, log_times, Scatter(1e-6, 0.0, 0.0, 1.0, 0.0, 1.0)) == pytest.approx(6, rel=0.01)
    assert effective_size(residuals, log_times, Scatter(1e-1, 0.0, 0.0, 0.0, 0.0, 1.0)) == pytest.approx(240, rel=0.01)


def test_expected_effects_find_the_offset_and_rate_of_each_test():
    """With tiny noise the best linear prediction is the truth; the sign is that of measured minus predicted."""
    times = np.tile(np.geomspace(10, 1e5, 40), (2, 1))
    strain = 1e-4 + 2e-2 * times / times.max()
    slopes, effect = 1 / strain, np.ones_like(strain)
    offset, log_factor = np.array([3e-5, -2e-5]), np.array([0.2, -0.1])
    residual = -(slopes * offset[:, None] + effect * log_factor[:, None])
    shape = Residuals(residual, slopes, np.ones_like(slopes, bool), None, effect)
    found = expected_effects(shape, np.log(times), Scatter(1e-8, 0.0, 1e-3, 2.0, 0.0, 1.0))
    np.testing.assert_allclose(found[0], offset, rtol=1e-2)
    np.testing.assert_allclose(found[1], log_factor, rtol=1e-2)
