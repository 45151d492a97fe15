"""The restricted likelihood against textbooks: unbiased variances, Student's intervals, generalised least squares."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import multivariate_normal, norm, t

from creepkit.inverse.goodness_of_fit import relative_squared_error
from creepkit.inverse.noise_covariance import CovarianceFactor
from creepkit.inverse.noise_model import NoiseModel, OutputNoise, Residuals
from creepkit.inverse.perturbations import covariances_of_values_with_errors
from creepkit.inverse.residuals import life_sensitivity, orthogonal_distance
from creepkit.inverse.variance_components import (
    LinearisedProblem,
    estimate_variance_components,
    restricted_log_likelihood,
)


def linear_model(values, design, clock=None, outputs=1):
    """A linear model y = X b with b flat, looked at from b = 0."""
    tests, entries, size = design.shape
    clock = np.broadcast_to(np.linspace(0.0, 5.0, entries), (tests, entries)) if clock is None else clock
    output = np.tile(np.arange(outputs).repeat(entries // outputs), (tests, 1))
    ones = np.ones((tests, entries))
    residuals = Residuals(values, ones, ones > 0, clock, design, 0 * ones, output, ones)
    room = np.array([[-np.inf], [np.inf]]) * np.ones(size)
    return LinearisedProblem(residuals, np.full(size, 1e-12), np.zeros(size), np.ones(size, bool), room)


def white(sd, names=("strain",), **more):
    return NoiseModel({name: OutputNoise(sd, **more) for name in names})


def polynomial(entries, degree, tests=1):
    x = np.linspace(-1.0, 1.0, entries)
    return np.tile(np.stack([x**k for k in range(degree + 1)], axis=-1), (tests, 1, 1))


def test_white_noise_is_the_sum_of_squares_over_the_degrees_of_freedom():
    """Patterson & Thompson: the restricted estimate of one variance is RSS / (n - p)."""
    rng, design = np.random.default_rng(0), polynomial(30, 3)
    values = 0.2 * rng.normal(size=(1, 30))
    found = estimate_variance_components(
        *_model(values, design), white(0.15), (), fixed=(), linearised=linear_model(values, design)
    )
    left = values[0] - design[0] @ np.linalg.lstsq(design[0], values[0], rcond=None)[0]
    assert found["strain"].noise ** 2 == pytest.approx((left**2).sum() / 26, rel=1e-4)


def _model(values, design):
    return (linear_model(values, design).residuals,)


def test_intervals_of_white_noise_are_students():
    """With one estimated variance the freedom is n - p, whatever a predictor states of its error; (X'X)^-1 s^2."""
    rng, design = np.random.default_rng(1), polynomial(25, 2)
    linear = linear_model(0.3 * rng.normal(size=(1, 25)), design)
    for noise in (white(0.3), white(0.3, drift=0.002)):
        covariance, *errors = covariances_of_values_with_errors(linear, noise, (), None)
        expected = (t.ppf(0.975, 22) / norm.ppf(0.975) * 0.3) ** 2 * np.linalg.inv(design[0].T @ design[0])
        assert covariance == pytest.approx(expected, rel=5e-3)
        assert not np.any(errors)


def test_a_prior_counts_where_its_unknown_stands_at_its_bound():
    linear = linear_model(np.zeros((1, 10)), polynomial(10, 0))
    held = replace(linear, precision=np.array([4.0]), prior_residual=np.array([1.5]), free=np.zeros(1, bool))
    assert held.solve(CovarianceFactor.of_residuals(held.residuals, white(0.5))).chi_square == pytest.approx(
        9.0, rel=1e-12
    )


def test_the_likelihood_is_that_of_contrasts_that_know_nothing_of_the_values():
    """Harville (1974): -2 ln of the density of any n - p independent contrasts, up to a constant of X alone."""
    rng, design = np.random.default_rng(2), polynomial(12, 2)
    values = rng.normal(size=(1, 12))
    contrasts = np.linalg.qr(design[0], mode="complete")[0][:, 3:]
    scatters = [
        white(s, drift=d, correlation_length=r) for s, d, r in ((0.5, 0.3, 1.0), (1.0, 0.8, 0.4), (0.2, 0.1, 2.0))
    ]
    mine, textbook = [], []
    for scatter in scatters:
        linear = linear_model(values, design)
        c = CovarianceFactor.of_residuals(linear.residuals, scatter).blocks[0]
        mine.append(restricted_log_likelihood(linear, scatter))
        textbook.append(multivariate_normal(np.zeros(9), contrasts.T @ c @ contrasts).logpdf(contrasts.T @ values[0]))
    assert np.diff(mine) == pytest.approx(np.diff(textbook), rel=1e-6)


def test_the_optimum_is_generalised_least_squares():
    rng, design = np.random.default_rng(3), polynomial(20, 1, tests=2)
    values, scatter = rng.normal(size=(2, 20)), white(0.1, drift=1.0, correlation_length=0.7)
    linear = linear_model(values, design)
    inverses = np.linalg.inv(CovarianceFactor.of_residuals(linear.residuals, scatter).blocks)
    A = sum(x.T @ c @ x for x, c in zip(design, inverses, strict=True))
    b = sum(x.T @ c @ y for x, c, y in zip(design, inverses, values, strict=True))
    assert linear.solve(CovarianceFactor.of_residuals(linear.residuals, scatter)).step == pytest.approx(
        -np.linalg.solve(A, b), rel=1e-9
    )


def test_a_discrepancy_is_not_taken_for_less_than_it_is():
    """AR(1) of .9, a fifth of the test long, under a cubic: plain maximum likelihood finds too little of it.

    60 series of 48 frames; the mean of ln of the estimated variance of the process, to three standard errors.
    """
    rng, design = np.random.default_rng(5), polynomial(48, 3)
    clock = np.linspace(5.0 / 48, 5.0, 48)[None]
    lags = np.abs(np.arange(48)[:, None] - np.arange(48)[None])
    factor = np.linalg.cholesky(0.9**lags)
    restricted, plain = [], []
    for _ in range(60):
        values = (factor @ rng.normal(size=48))[None]
        linear = linear_model(values, design, clock)
        unit = replace(linear.residuals, discrepancy_unit=np.ones((1, 48)))
        linear = replace(linear, residuals=unit)
        start = replace(white(0.1), discrepancy=0.7)
        restricted.append(estimate_variance_components(unit, start, (), linearised=linear).discrepancy)
        left = values - (design[0] @ np.linalg.lstsq(design[0], values[0], rcond=None)[0])[None]
        plain.append(estimate_variance_components(replace(unit, values=left), start, ()).discrepancy)
    assert np.median(plain) < 0.75
    assert np.median(restricted) == pytest.approx(1.0, abs=0.25)


# ---- scatter of lives ------------------------------------------------------------------------------------------------

# Scatter of rupture lives: the closed form of its effect on a residual, against a curve that is moved in life.


@pytest.mark.parametrize("share", [0.05, 0.5, 0.8, 0.95, 0.99])
def test_a_longer_life_moves_the_residual_of_a_frame_as_stated(share):
    """Kachanov and Rabotnov's curve e = tr l [1 - (1 - t / tr)^(1/l)], its life longer by 1e-5 at the same rate."""
    growth, step = 5.0, 1e-5

    def strain(t, life):
        return life * growth * (1.0 - (1.0 - t / life) ** (1.0 / growth))

    def log_time(e, life):
        return np.log(life * (1.0 - (1.0 - e / (life * growth)) ** growth))

    e = strain(share, 1.0)
    slope = share * (1.0 - share) ** (1.0 / growth - 1.0) / e

    def moved(strain_error, time_error):
        found = orthogonal_distance(np.array(strain_error), np.array(time_error), np.array(slope))
        return float(found.values) / step

    by_life = -moved(np.log(strain(share, np.exp(step)) / e), np.log(share) - log_time(e, np.exp(step)))
    by_rate = moved(slope * step, step)
    residuals = SimpleNamespace(log_rate_sensitivity=np.full((1, 1), by_rate))
    assert life_sensitivity(residuals)[0, 0] == pytest.approx(abs(by_life), rel=2e-3, abs=1e-3)


# ---- goodness of fit -------------------------------------------------------------------------------------------------

# Relative squared error in its three readings, by hand; errors that were not predicted stay unknown.


MEASURED = [np.array([1.0, 3.0]), np.array([5.0, 7.0])]
PREDICTED = [np.array([1.0, 4.0]), np.array([5.0, 5.0])]


def test_three_means():
    """Squares 1 + 4; about 4 they are 9 + 1 + 1 + 9, about 2 and 6 four times 1, about 3 and 5 four times 4."""
    assert relative_squared_error(MEASURED, PREDICTED) == pytest.approx(5 / 20)
    assert relative_squared_error(MEASURED, PREDICTED, about="test") == pytest.approx(5 / 4)
    assert relative_squared_error(MEASURED, PREDICTED, about="frame") == pytest.approx(5 / 16)
