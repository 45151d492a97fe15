"""Converted values: the same rates along the same curve, round trips, and values without a counterpart."""

import re
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from creepkit_classic.conversions import convert, per_second

import creepkit as ck

NAMES = ["norton-bailey-time", "norton-bailey-rate", "norton-bailey-strain", "time-hardening", "strain-hardening"]
TEXTBOOK = {"A": 4e-13, "n": 4.0, "m": 0.4}
"""strain = A s^n t^m."""


@pytest.mark.parametrize("name", NAMES)
def test_rates_are_those_of_the_curve(name: str) -> None:
    """At constant stress and the strain A s^n t^m every notation's rate is A m s^n t^(m-1)."""
    stress, time = (grid.ravel() for grid in np.meshgrid([20.0, 90.0, 300.0], np.geomspace(1.0, 1e7, 8)))
    kernel = ck.lower(ck.law(name), "numpy")

    rate = kernel.rate(
        convert(TEXTBOOK, "norton-bailey-time", name), stress=stress, time=time, strain=4e-13 * stress**4 * time**0.4
    )

    np.testing.assert_allclose(rate, 1.6e-13 * stress**4 * time**-0.6, rtol=1e-12)


@pytest.mark.parametrize(("given", "wanted"), list(product(NAMES, NAMES)))
def test_there_and_back(given: str, wanted: str) -> None:
    values = convert(TEXTBOOK, "norton-bailey-time", given)

    assert convert(convert(values, given, wanted), wanted, given) == pytest.approx(values, rel=1e-12, abs=0)


def test_the_numbers_of_each_notation_by_hand() -> None:
    """strain = 4e-12 s^2 t^(1/2): rate = 2e-12 s^2 t^(-1/2), and with t = (e/(4e-12 s^2))^2, rate = 8e-24 s^4/e."""
    given = {"A": 4e-12, "n": 2.0, "m": 0.5}

    assert convert(given, "norton-bailey-time", "norton-bailey-rate") == {"A": 2e-12, "n": 2.0, "m": -0.5}
    assert convert(given, "norton-bailey-time", "norton-bailey-strain") == {"A": 2e-12, "n": 2.0, "m": -0.5}
    by_strain = convert(given, "norton-bailey-time", "strain-hardening")
    assert by_strain == pytest.approx({"A": 8e-24, "n": 4.0, "m": -1.0}, rel=1e-12)


def test_steady_creep_is_the_same_in_all_of_them() -> None:
    for name in NAMES:
        m = 1.0 if name == "norton-bailey-time" else 0.0
        assert convert({"A": 1e-15, "n": 5.0, "m": 1.0}, "norton-bailey-time", name) == pytest.approx(
            {"A": 1e-15, "n": 5.0, "m": m}
        )


@pytest.mark.parametrize("name", NAMES)
def test_hours_become_seconds(name: str) -> None:
    """The rate per hour at 1, 10, 100 h with the values for hours is 3600 times that per second."""
    in_hours = convert(TEXTBOOK, "norton-bailey-time", name)
    kernel, hours = ck.lower(ck.law(name), "numpy"), np.array([1.0, 10.0, 100.0])
    per_hour = kernel.rate(in_hours, stress=80.0, time=hours, strain=1e-3)

    rate = kernel.rate(per_second(in_hours, name, "h"), stress=80.0, time=3600 * hours, strain=1e-3)

    np.testing.assert_allclose(3600 * rate, per_hour, rtol=1e-12)


def test_the_example_of_the_readme() -> None:
    """strain = 2.16e-13 s^4 t^0.5 in hours is 3.6e-15 s^4 t^0.5 in seconds; with t eliminated, 6.48e-30 s^8/e."""
    (block,) = re.findall(r"```python\n(.*?)```", (Path(__file__).parents[1] / "README.md").read_text(), re.DOTALL)
    found: dict[str, dict[str, float]] = {}
    exec(block, found)

    assert found["textbook"] == pytest.approx({"A": 3.6e-15, "n": 4.0, "m": 0.5}, rel=1e-12)
    assert found["abaqus"] == pytest.approx({"A": 1.8e-15, "n": 4.0, "m": -0.5}, rel=1e-12)
    assert found["ansys"] == pytest.approx({"A": 6.48e-30, "n": 8.0, "m": -1.0}, rel=1e-12)
