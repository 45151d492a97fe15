"""The F test of minimum rates against rupture times: a t test where nothing varies, and its level by brute force."""

import numpy as np
import pytest
from scipy.stats import binom, ttest_1samp

from creepkit.inverse.single_values import SIGNIFICANCE, SingleValue, contradicting_values
from creepkit.records import History, constant_stress


def bars_at(stresses, temperatures):
    return [
        History(f"t{k}", np.array([1e6]), {}, constant_stress(float(s), "load"), float(T))
        for k, (s, T) in enumerate(zip(stresses, temperatures, strict=True))
    ]


def values(rate_ratios, time_ratios, **further):
    return [
        (SingleValue(1.0, t, 0.1, 10.0, **further), SingleValue(1.0, r, 0.1, 10.0))
        for r, t in zip(rate_ratios, time_ratios, strict=True)
    ]


def test_of_tests_alike_it_is_students():
    """Rates twice the measured, times right: ln of the product is 0.69 and scatters."""
    rng = np.random.default_rng(0)
    tests = bars_at([100.0] * 12, [900.0] * 12)
    rates, times = 2.0 * np.exp(0.3 * rng.standard_normal(12)), np.exp(0.3 * rng.standard_normal(12))
    found = contradicting_values(tests, values(rates, times))
    assert found.p_value == pytest.approx(ttest_1samp(np.log(rates * times), 0.0).pvalue, rel=1e-9)
    assert found.rate_ratio == pytest.approx(np.exp(np.log(rates).mean()))
    assert found.scatter == pytest.approx(np.exp(np.log(rates * times).std(ddof=1)))
    assert contradicting_values(tests, values(rates, 0.5 * times)) is None


def test_a_trend_over_stress_shows():
    rng, stresses = np.random.default_rng(1), np.geomspace(50.0, 300.0, 15)
    tests = bars_at(stresses, np.tile([850.0, 900.0, 950.0], 5))
    trend = (stresses / stresses.prod() ** (1 / 15)) ** 0.8
    noise = np.exp(0.1 * rng.standard_normal((2, 15)))
    assert contradicting_values(tests, values(noise[0], noise[1])) is None
    found = contradicting_values(tests, values(trend * noise[0], noise[1]))
    assert "their ratio changes with stress or temperature" in str(found)


def test_a_factor_on_the_rate_of_a_test_is_no_contradiction():
    """It moves rate and time of a test against one another; ends that were not used, and run-outs, say nothing."""
    tests, factors = bars_at(np.geomspace(50, 300, 10), [900.0] * 10), np.exp(np.linspace(1.0, 3.0, 10))
    scatter = np.exp(0.1 * np.random.default_rng(2).standard_normal(10))
    assert contradicting_values(tests, values(factors * scatter, 1.0 / factors)) is None
    assert contradicting_values(tests, values(100.0 * factors, factors, used=False)) is None


def test_its_level():
    """1000 draws of right laws: no more are rejected than SIGNIFICANCE says."""
    rng, tests = np.random.default_rng(3), bars_at(np.geomspace(50, 300, 12), np.tile([850.0, 900.0, 950.0], 4))
    draws = np.exp(0.3 * rng.standard_normal((1000, 2, 12)))
    rejected = sum(contradicting_values(tests, values(*draw)) is not None for draw in draws)
    assert binom.ppf(0.001, 1000, SIGNIFICANCE) <= rejected <= binom.ppf(0.999, 1000, SIGNIFICANCE)
