"""Correlations against linear regression, and sentences about what is not determined."""

import numpy as np
import pytest

from creepkit.errors import FitError
from creepkit.inverse.identify import identify
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.uncertainty.correlation import correlation, undetermined
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.norton import NORTON
from helpers.log_rate_predictor import known_scatter, least_squares, measured
from helpers.steady_rate_predictor import Steady, planted

TRUTH = {"A": float(np.exp(-15.0 - 4.0 * np.log(50.0))), "n": 4.0}
QUICK = IdentificationSettings(starts=3, sobol_points=16, frames=20)


@pytest.fixture(scope="module")
def fit():
    return known_scatter(NORTON, measured(NORTON, TRUTH, (30.0, 50.0, 80.0), sd=0.2, seed=3), 0.2)


def test_author_parameters_are_tied_as_in_regression(fit):
    """Of intercept and slope: -mean(x) / sqrt(mean(x^2)), x = ln stress."""
    x = np.log([30.0, 50.0, 80.0])
    found = correlation(fit)
    assert found.names == ("ln A", "n")
    assert found.between("ln A", "n") == pytest.approx(-x.mean() / np.sqrt((x**2).mean()), abs=1e-4)
    ours = least_squares(fit.histories, 0.2)[1]
    assert found.matrix[0, 1] == pytest.approx(ours[0, 1] / np.sqrt(ours[0, 0] * ours[1, 1]), abs=1e-4)
    with pytest.raises(FitError, match="no 'm' in this correlation"):
        found.between("m", "n")


def test_conditioned_coordinates_are_not(fit):
    """The reference stress is the geometric mean of the tests': intercept and slope about the mean are independent."""
    found = correlation(fit, "conditioned")
    assert found.names == ("ln rate", "n")
    assert abs(found.matrix[0, 1]) < 1e-3
    with pytest.raises(FitError, match="allowed are 'author' and 'conditioned'"):
        correlation(fit, "raw")


def test_one_stress_determines_the_rate_there_alone():
    """A 50^n is known: ln A + ln(50) n."""
    truth = {"A": 1e-16, "n": 5.2}
    tests = planted(NORTON, truth, [(50.0, 1050.0)] * 4, seed=2, rate=0.1, noise=1e-5)
    first, second = undetermined(identify(NORTON, tests, Steady(), settings=QUICK))
    assert first.startswith("the parameters A and n are not determined singly; their combination ln A + 3.91 n = ")
    value, sd = (float(v) for v in first.removesuffix(" is").split(" = ")[1].split(" +- "))
    assert abs(value - np.log(1e-16 * 50**5.2)) < 3 * sd + 0.01
    assert "what the tests see at 50 MPa" in second


def test_a_sinh_over_narrow_stresses_is_known_by_its_exponent():
    truth = {"A": 1e-14, "n": 4.0}
    conditions = [(s, 1050.0) for s in (50, 55, 60, 50, 55, 60)]
    fit = identify(HYPERBOLIC_SINE, planted(NORTON, truth, conditions, seed=4, rate=0.03, noise=1e-5), Steady(),
                   settings=QUICK.changed({"weights": "noise"}))  # fmt: skip
    first, second = undetermined(fit)
    assert "n and B are not determined singly" in first
    found = correlation(fit, "conditioned")
    assert found.names == ("ln rate", "local exponent", "ln B")
    assert abs(found.between("ln rate", "local exponent")) < 0.5
    assert abs(correlation(fit).between("n", "ln B")) > 0.95
    assert "the local exponent is" in second


def test_where_all_is_determined_nothing_is_said(fit):
    assert undetermined(fit) == ()
