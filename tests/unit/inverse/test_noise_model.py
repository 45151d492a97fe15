"""Scatter: the likelihood is the textbook one, and planted sizes are found again."""

from dataclasses import replace

import numpy as np
import pytest

from creepkit.inverse.noise_covariance import effective_sample_size, predicted_random_effects
from creepkit.inverse.noise_model import NoiseModel, OutputNoise, Residuals, autocorrelated_components, covariance
from creepkit.inverse.variance_components import estimate_variance_components
from creepkit.records import Nuisance

BOTH = (Nuisance("offset"), Nuisance("rate"))


def sizes(noise, misfit=0.0, offset=0.0, rate=0.0, drift=0.0, correlation_length=1.0):
    """Scatter of strains alone."""
    return NoiseModel({"strain": OutputNoise(noise, misfit, offset, drift, correlation_length)}, rate)


def residuals_of(values, slopes, present, times, effect, output=None):
    """Residuals of tests that are all trusted alike."""
    output = np.zeros(values.shape, np.int64) if output is None else output
    loudness, trust = np.ones(values.shape), np.ones(len(values))
    return Residuals(values, slopes, present, np.log(times), None, effect, output, loudness, trust)


def made(tests, frames, seed, scatter):
    """Residuals drawn from the very covariance, on strains that grow in time."""
    rng = np.random.default_rng(seed)
    times = np.tile(np.geomspace(10, 1e5, frames), (tests, 1))
    strain = 1e-4 + 2e-2 * times / times.max()
    slopes = 1 / strain
    effect = 0.7 * np.ones_like(slopes)
    shape = residuals_of(np.zeros_like(slopes), slopes, np.ones_like(slopes, bool), times, effect)
    factor = np.linalg.cholesky(covariance(shape, scatter))
    return replace(shape, values=(factor @ rng.normal(size=(tests, frames, 1)))[..., 0])


def test_planted_scatter_is_found():
    """150 tests: the standard error of a standard deviation from 150 draws is 6 %, so 25 % is four of them."""
    truth = sizes(noise=2e-5, offset=1e-4, rate=0.4, drift=0.1, correlation_length=0.45)
    residuals = made(150, 30, 2, truth)
    found = estimate_variance_components(residuals, sizes(2e-5, 0, 3e-5, 0.5, 0.2, 0.2), BOTH)
    assert found["strain"].offset == pytest.approx(truth["strain"].offset, rel=0.25)
    assert found.rate == pytest.approx(truth.rate, rel=0.25)
    assert found["strain"].drift == pytest.approx(truth["strain"].drift, rel=0.25)
    assert found["strain"].correlation_length == pytest.approx(truth["strain"].correlation_length, rel=0.5)


def test_a_given_prior_stays():
    residuals = made(20, 20, 3, sizes(2e-5, 0, 1e-4, 0.4, 0.1, 1.5))
    found = estimate_variance_components(
        residuals, sizes(2e-5, 0, 7e-5, 0.5, 0.1, 1.5), (Nuisance("offset", sd=7e-5), Nuisance("rate"))
    )
    assert found["strain"].offset == 7e-5


def test_effective_size_counts_a_test_once_when_its_residuals_move_together():
    residuals = made(6, 40, 4, sizes(1e-6, 0.0, 0.0, 1.0, 0.0, 1.0))
    assert effective_sample_size(residuals, sizes(1e-6, 0.0, 0.0, 1.0, 0.0, 1.0)) == pytest.approx(6, rel=0.01)
    assert effective_sample_size(residuals, sizes(1e-1, 0.0, 0.0, 0.0, 0.0, 1.0)) == pytest.approx(240, rel=0.01)


def test_expected_effects_find_the_offset_and_rate_of_each_test():
    """With tiny noise the best linear prediction is the truth; the sign is that of measured minus predicted."""
    times = np.tile(np.geomspace(10, 1e5, 40), (2, 1))
    strain = 1e-4 + 2e-2 * times / times.max()
    slopes, effect = 1 / strain, np.ones_like(strain)
    offset, log_factor = np.array([3e-5, -2e-5]), np.array([0.2, -0.1])
    residual = -(slopes * offset[:, None] + effect * log_factor[:, None])
    shape = residuals_of(residual, slopes, np.ones_like(slopes, bool), times, effect)
    found = predicted_random_effects(shape, sizes(1e-8, 0.0, 1e-3, 2.0, 0.0, 1.0))
    np.testing.assert_allclose(found[0][:, 0], offset, rtol=1e-2)
    np.testing.assert_allclose(found[1], log_factor, rtol=1e-2)


# ---- several outputs -----------------------------------------------------------------------------------------------


def two_outputs():
    """Two tests of two outputs end to end, five frames each; only the rate joins them."""
    rng = np.random.default_rng(5)
    times = np.tile(np.geomspace(10, 1e4, 5), (2, 2))
    output = np.repeat([[0, 1]], 5, axis=1).repeat(2, axis=0)
    slopes, effect = 1 + rng.uniform(size=(2, 10)), rng.normal(size=(2, 10))
    scatter = NoiseModel(
        {"amplitude": OutputNoise(0.1, 0.2, 0.3, 0.4, 1.0), "width": OutputNoise(0.2, 0.1, 0.5, 0.3, 2.0)}, 0.6
    )
    return residuals_of(rng.normal(size=(2, 10)), slopes, np.ones((2, 10), bool), times, effect, output), scatter


def test_a_test_of_little_trust_scatters_more():
    residuals, scatter = two_outputs()
    plain, doubted = (
        covariance(residuals, scatter),
        covariance(residuals.with_test_weights(np.array([1.0, 0.25])), scatter),
    )
    np.testing.assert_allclose(doubted[0], plain[0])
    np.testing.assert_allclose(doubted[1], 4 * plain[1])


# ---- model discrepancy ---------------------------------------------------------------------------------------------


def with_discrepancy(seed=6):
    """The residuals of two outputs, their units of discrepancy, and a noise model with a discrepancy."""
    residuals, scatter = two_outputs()
    unit = 0.5 + np.random.default_rng(seed).uniform(size=residuals.values.shape)
    return replace(residuals, discrepancy_unit=unit), replace(scatter, discrepancy=1.3, discrepancy_length=0.8)


@pytest.mark.parametrize("restricted", [False, True])
def test_slopes_of_the_likelihood_are_its_differences(restricted):
    """Plain and restricted; the noise of the first output is stated, a sixth below, which gives it a prior."""
    from creepkit.inverse.variance_components import LinearisedProblem, _Likelihood

    residuals, scatter = with_discrepancy()
    scatter, linear = scatter.with_output("amplitude", stated=0.085), None
    if restricted:
        design = np.random.default_rng(7).normal(size=(2, 10, 3))
        residuals = replace(residuals, jacobian=design)
        bounds = np.array([[-np.inf], [np.inf]]) * np.ones(3)
        linear = LinearisedProblem(residuals, np.full(3, 0.1), np.array([0.2, 0.0, -0.1]), np.ones(3, bool), bounds)
    free = [("amplitude", "noise"), ("", "discrepancy"), ("", "discrepancy_length"), ("", "rate")]
    free += [("width", name) for name in ("noise", "offset", "drift", "correlation_length")]
    likelihood = _Likelihood(residuals.with_test_weights(np.array([1.0, 0.3])), scatter, free, linear)
    x = np.log([0.1, 1.3, 0.8, 0.6, 0.2, 0.5, 0.3, 2.0])
    slope = likelihood.cost(x)[1]
    for k in range(x.size):
        step = 1e-5 * np.eye(x.size)[k]
        difference = (likelihood.cost(x + step)[0] - likelihood.cost(x - step)[0]) / 2e-5
        assert slope[k] == pytest.approx(difference, rel=1e-5, abs=1e-7)


def test_a_planted_discrepancy_of_two_outputs_is_found():
    """300 series: 4 % of a standard deviation in one standard error; the outputs' noises differ by a factor of 20."""
    rng, frames = np.random.default_rng(8), 24
    clock = np.tile(np.linspace(0.2, 5.0, frames), (150, 2))
    output = np.tile(np.repeat([0, 1], frames), (150, 1))
    noise = np.where(output == 0, 0.02, 0.4)
    ones = np.ones_like(clock)
    shape = Residuals(0 * ones, ones, ones > 0, clock, None, 0 * ones, output, ones, np.ones(150),
                      discrepancy_unit=noise)  # fmt: skip
    parts = {"amplitude": OutputNoise(0.02), "width": OutputNoise(0.4)}
    truth = NoiseModel(parts, discrepancy=2.0, discrepancy_length=1.2)
    drawn = np.linalg.cholesky(covariance(shape, truth)) @ rng.normal(size=(*clock.shape, 1))
    start = replace(truth, discrepancy=0.5, discrepancy_length=0.5)
    found = estimate_variance_components(replace(shape, values=drawn[..., 0]), start, (), fixed=())
    assert found.discrepancy == pytest.approx(2.0, rel=0.12)
    assert found.discrepancy_length == pytest.approx(1.2, rel=0.3)
    assert [found[name].noise for name in parts] == pytest.approx([0.02, 0.4], rel=0.1)


@pytest.mark.parametrize(("actual", "stated"), [(0.3, 0.2), (0.1, 0.2), (0.21, 0.2)])
def test_stated_noise_is_a_lower_bound_with_a_prior(actual, stated):
    """White noise s of n frames: the least of n ln s + RSS / 2 s^2 + (ln(s / stated) / 0.2)^2 / 2 over s >= stated."""
    values = actual * np.random.default_rng(9).normal(size=(1, 25))
    ones = np.ones_like(values)
    residuals = residuals_of(values, ones, ones > 0, np.linspace(1.0, 2.0, 25)[None], 0 * ones)
    start = NoiseModel({"strain": OutputNoise(stated, stated=stated)})
    found = estimate_variance_components(residuals, start, (), fixed=())["strain"].noise
    s = stated * np.exp(np.linspace(0.0, 2.0, 200001))
    cost = 25 * np.log(s) + 0.5 * (values**2).sum() / s**2 + 0.5 * (np.log(s / stated) / 0.2) ** 2
    assert found == pytest.approx(s[np.argmin(cost)], rel=1e-3)
    assert found >= stated * (1 - 1e-9)


def test_noise_that_nobody_stated_may_be_smaller_than_its_estimate():
    """The root mean square of the residuals, whatever the third differences said."""
    values = 0.1 * np.random.default_rng(10).normal(size=(1, 400))
    ones = np.ones_like(values)
    residuals = residuals_of(values, ones, ones > 0, np.linspace(1.0, 2.0, 400)[None], 0 * ones)
    found = estimate_variance_components(residuals, sizes(0.2), (), fixed=())["strain"].noise
    assert found == pytest.approx(np.sqrt((values**2).mean()), rel=1e-3)


def test_autocorrelated_parts_are_counted():
    scatter = NoiseModel({"amplitude": OutputNoise(0.1, drift=0.2), "width": OutputNoise(0.1, drift=1e-4)})
    assert autocorrelated_components(scatter) == 2
    assert autocorrelated_components(replace(scatter, discrepancy=1.0)) == 4
    assert autocorrelated_components(replace(scatter, discrepancy=0.01)) == 2
