"""Degrees of freedom of balanced tests are those of an analysis of variance; Weibull bounds tend to closed forms."""

import numpy as np
import pytest
from scipy.stats import gumbel_l, t

from creepkit.rupture_assessment.rupture_fit import WeibullLogTime, variance_freedom

HEATS, EACH = 6, 8
MEMBERS = np.repeat(np.eye(HEATS), EACH, axis=0)


@pytest.mark.parametrize("between", [0.0, 0.01, 0.09])
def test_balanced_heats(between):
    """Mean of all: heats less one, whatever the scatters; a slope within heats: tests less heats less one."""
    slope = np.tile(np.linspace(-1.0, 1.0, EACH), HEATS)
    columns = np.column_stack([np.ones(HEATS * EACH), slope])
    freedom = variance_freedom(columns, [MEMBERS], 0.01, [between])
    assert freedom.of(np.array([[1.0, 0.0]]))[0] == pytest.approx(HEATS - 1)
    assert freedom.of(np.array([[0.0, 1.0]]))[0] == pytest.approx(HEATS * (EACH - 1) - 1)


def test_without_heats_it_is_tests_less_constants():
    columns = np.random.default_rng(0).standard_normal((20, 3))
    freedom = variance_freedom(columns, [], 0.04, [])
    np.testing.assert_allclose(freedom.of(np.eye(3), within=True), 17.0)


def test_weibull_bounds_between_the_extreme_value_and_student():
    one = np.ones(1)
    certain = WeibullLogTime(2.0 * one, 1e-6 * one, 0.1, 1e6 * one)
    for p in (0.025, 0.975):
        expected = 2.0 + 0.1 * (gumbel_l.ppf(p) - gumbel_l.ppf(0.5))
        assert certain.quantile(p)[0] == pytest.approx(expected, abs=1e-3)
    uncertain = WeibullLogTime(2.0 * one, 0.2 * one, 0.01, 5.0 * one)
    assert uncertain.quantile(0.975)[0] == pytest.approx(2.0 + 0.2 * t.ppf(0.975, 5), abs=5e-3)
