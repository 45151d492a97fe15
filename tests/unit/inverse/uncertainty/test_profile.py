"""Profile likelihoods against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm
from scipy.stats import t as student

from creepkit.errors import FitError
from creepkit.inverse.identify import identify
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.uncertainty.profile_likelihood import profile
from creepkit.inverse.uncertainty.quantities import DerivedQuantity, exponent_at, rate_at
from creepkit.laws.norton import NORTON
from helpers.log_rate_predictor import known_scatter, least_squares, measured
from helpers.steady_rate_predictor import Steady, planted

TRUTH = {"A": float(np.exp(-15.0 - 4.0 * np.log(50.0))), "n": 4.0}
SD = 0.2
Z = float(norm.ppf(0.975))


@pytest.fixture(scope="module")
def tests():
    return measured(NORTON, TRUTH, (30.0, 50.0, 80.0), sd=SD, seed=3)


@pytest.fixture(scope="module")
def fit(tests):
    return known_scatter(NORTON, tests, SD)


def test_of_a_linear_problem_it_is_the_normal_interval(fit, tests):
    """chi2 is a parabola: the ends are estimate +- 1.96 standard errors of linear regression."""
    best, covariance = least_squares(tests, SD)
    for k, name in enumerate(("A", "n")):
        found, half = profile(fit, name), Z * np.sqrt(covariance[k, k])
        shown = np.exp if name == "A" else np.asarray
        assert shown(best[k]) == pytest.approx(found.best, rel=1e-3)
        assert found.low == pytest.approx(float(shown(best[k] - half)), rel=2e-3)
        assert found.high == pytest.approx(float(shown(best[k] + half)), rel=2e-3)
        assert found.notes == ()


def test_points_lie_on_the_parabola(fit, tests):
    best, covariance = least_squares(tests, SD)
    found = profile(fit, "n")
    expected = (found.values - best[1]) ** 2 / covariance[1, 1]
    assert np.allclose(found.chi_square, expected, atol=0.02)
    assert (np.diff(found.values) > 0).all()


def test_of_a_rate_and_a_local_exponent(fit, tests):
    """ln rate at s is (1, ln s) . (ln A, n): its variance follows; the exponent of a power law is n."""
    best, covariance = least_squares(tests, SD)
    way = np.array([1.0, np.log(100.0)])
    found = profile(fit, rate_at(100.0))
    half = Z * np.sqrt(way @ covariance @ way)
    assert np.log([found.low, found.high]) == pytest.approx([way @ best - half, way @ best + half], abs=2e-3)
    local = profile(fit, exponent_at(100.0))
    assert local.low == pytest.approx(profile(fit, "n").low, abs=1e-3)


def test_it_follows_a_change_of_variable(fit):
    """Ends of n squared are the squares of the ends of n: likelihood knows no scale, and Laplace's interval does."""
    own = profile(fit, "n")
    squared = profile(fit, DerivedQuantity("n squared", "1", "linear", lambda c: lambda u: c.theta(u)[..., 1] ** 2))
    assert (squared.low, squared.high) == pytest.approx((own.low**2, own.high**2), rel=1e-3)
    assert squared.high - squared.best > squared.best - squared.low


def test_level_and_freedom_set_the_rise(fit):
    wide = profile(replace(fit, freedom=4.0), "n")
    assert wide.limit == pytest.approx(student.ppf(0.975, 4.0) ** 2)
    narrow = profile(fit, "n", level=0.68)
    assert narrow.limit == pytest.approx(norm.ppf(0.84) ** 2)
    assert wide.low < profile(fit, "n").low < narrow.low
    with pytest.raises(FitError, match="level is 95"):
        profile(fit, "n", level=95)


def test_ends_at_the_laws_bounds_are_said_to_be_open():
    """One stress says nothing of n, from bound to bound."""
    tests = planted(NORTON, {"A": 1e-16, "n": 5.2}, [(50.0, 1050.0)] * 4, seed=3, rate=0.1, noise=1e-5)
    fit = identify(NORTON, tests, Steady(), settings=IdentificationSettings(starts=3, sobol_points=16, frames=20))
    found = profile(fit, "n")
    assert found.low is None
    assert found.high is None
    assert found.values[0] == pytest.approx(1.0, abs=1e-3)
    assert found.values[-1] == pytest.approx(8.0, abs=1e-3)
    assert "[open, open]" in str(found)
    assert "not bounded below within the law's bounds" in str(found)
    closed = profile(fit, rate_at(50.0))
    assert closed.low < 1e-16 * 50**5.2 < closed.high


def test_an_interval_cut_by_a_bound_is_open_on_that_side(tests):
    """The truth lies at n = 4 and the law allows n up to 4.1: only the lower end can be found."""
    short = NORTON.with_bounds(n=(1.0, 4.1))
    found = profile(known_scatter(short, tests, SD), "n")
    assert found.high is None
    assert found.low == pytest.approx(profile(known_scatter(NORTON, tests, SD), "n").low, abs=0.02)
