"""Bands of draws whose distribution is known."""

import numpy as np
import pytest
from scipy.stats import norm

from creepkit.forecasts.bands import band_of_draws
from creepkit.inverse.output_transforms import LinearTransform

IDENTITY = LinearTransform(1.0, 10.0)
RNG = np.random.default_rng(0)


def band(values, noise=0.0, grows=True, level=0.95):
    noise = np.broadcast_to(noise, values.shape[1:]).astype(float)
    times = 1.0 + np.arange(values.shape[1])
    return band_of_draws(values, times, noise, IDENTITY, level, np.random.default_rng(1), grows=grows)


def test_parallel_curves_have_one_band():
    curves = RNG.standard_normal((20000, 1)) + np.linspace(0.0, 5.0, 7)
    result = band(curves)
    np.testing.assert_allclose(result.high - result.median, 1.96, atol=0.06)
    np.testing.assert_allclose(result.highest, result.high, atol=0.06)


def test_independent_times_need_the_quantile_of_the_largest():
    times = 20
    result = band(np.zeros((20000, times)) + 1e-6 * RNG.standard_normal((20000, 1)), noise=1.0)
    # Sidak (1967): all of m independent normal variables lie within this with probability 0.95.
    sidak = norm.ppf(0.5 + 0.5 * 0.95 ** (1.0 / times))
    np.testing.assert_allclose(result.highest, sidak, rtol=0.03)
    np.testing.assert_allclose(result.high, 1.96, rtol=0.01)


def test_new_curves_lie_inside_as_often_as_stated():
    def walks(count):
        return np.cumsum(RNG.standard_normal((count, 30)), axis=1)

    result = band(walks(4000), level=0.9)
    new = walks(4000)
    inside = ((new >= result.lowest) & (new <= result.highest)).all(axis=1).mean()
    assert inside == pytest.approx(0.9, abs=0.02)
    assert ((new >= result.low) & (new <= result.high)).mean() == pytest.approx(0.9, abs=0.02)


def test_where_many_have_ruptured_there_is_no_upper_end():
    curves = np.tile(np.linspace(0.0, 1.0, 5), (1000, 1)) + 0.01 * RNG.standard_normal((1000, 1))
    curves[:100, 3:] = np.nan
    result = band(curves)
    assert np.isfinite(result.high[:3]).all()
    assert np.isinf(result.high[3:]).all()
    assert np.isfinite(result.low).all()


def test_new_curves_lie_inside_while_they_last():
    times = np.linspace(0.1, 1.6, 25)

    def ruptured(count):
        clock = times / np.exp(0.2 * RNG.standard_normal((count, 1)))
        return np.where(clock < 1.0, -np.log(np.maximum(1.0 - clock, 1e-12)), np.nan)

    result = band_of_draws(ruptured(2000), times, np.zeros(25), IDENTITY, 0.9, np.random.default_rng(1), grows=True)
    new = ruptured(2000)
    assert np.isinf(result.median[-1])
    inside = (np.isnan(new) | ((new >= result.lowest) & (new <= result.highest))).all(axis=1).mean()
    assert inside == pytest.approx(0.92, abs=0.05)


def test_an_output_that_ends_says_nothing_after_most_have_ended():
    curves = 1.0 + 0.01 * RNG.standard_normal((1000, 4))
    curves[:600, 3] = np.nan
    result = band(curves, grows=False)
    assert np.isnan(result.low[3])
    assert np.isfinite(result.low[:3]).all()
