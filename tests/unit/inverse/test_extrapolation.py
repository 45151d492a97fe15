"""A point outside the tests is said once a call, with what the tests cover."""

import warnings

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import FitWarning
from creepkit.inverse.extrapolation import extrapolation_text
from creepkit.laws.norton import NORTON
from helpers.steady_rate_predictor import Steady, planted

RANGES = {"stress": (50.0, 100.0), "temperature": (1000.0, 1050.0), "strain": (0.0, 0.02), "time": (60.0, 1e6)}


@pytest.mark.parametrize(
    ("point", "sentence"),
    [
        ({"stress": 80.0, "temperature": None}, ""),
        ({"stress": [50.0, 100.0], "temperature": 1050.4}, ""),
        ({"stress": 120.0}, "extrapolated: stress 120 MPa (the tests cover 50 to 100 MPa; 1.2 times beyond)"),
        (
            {"stress": [20, 80.0], "time": 1e7},
            "extrapolated: stress 20 to 80 MPa (the tests cover 50 to 100 MPa; 2.5 times beyond), ",
        ),
        ({"temperature": 950.0}, "extrapolated: temperature 950 K (the tests cover 1000 to 1050 K; 50 K beyond)"),
        ({"strain": 0.05}, "extrapolated: strain 0.05 (the tests cover 0 to 0.02; 2.5 times beyond)"),
        ({"stress": []}, ""),
    ],
)
def test_what_lies_outside_is_named_with_the_range(point, sentence):
    found = extrapolation_text(RANGES, point)
    assert found.startswith(sentence) if sentence else found == ""


@pytest.fixture(scope="module")
def fit():
    law = NORTON.times(ck.arrhenius(T_ref=1025.0))
    plans = [(s, T) for T in (1000.0, 1050.0) for s in (50.0, 70.0, 100.0)]
    return ck.identify(law, planted(law, {"A": 1e-16, "n": 5.0, "Q": 3e5}, plans, seed=1), using=Steady(), starts=1)


def test_rates_and_exponents_warn_once_a_call_and_may_be_told_not_to(fit):
    for ask in (fit.rate, fit.local_exponent):
        with pytest.warns(FitWarning, match="stress 20 to 150 MPa") as caught:
            ask([20.0, 80.0, 150.0], 990.0)
        assert len(caught) == 1
        assert caught[0].filename == __file__
        ask([20.0, 150.0], 990.0, warn=False)
        ask([50.0, 100.0], 1000.0)


def test_a_rate_without_a_temperature_is_that_at_the_reference_temperature(fit):
    """The median of the tests, which the printed answer names."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        np.testing.assert_array_equal(fit.rate(80.0), fit.rate(80.0, fit.reference.temperature))
    assert fit.reference.temperature == 1025.0
    assert fit.adequacy.explains  # of simulated tests without noise: what they round is no bend over the stress
    assert "MPa and 752 °C" in fit.details()
