"""Minimum creep rates of measured curves: closed forms, brute force over a curve with noise, and a known exponent."""

import numpy as np
import pytest

from creepkit.inverse.identified_values import minimum_rates_of
from creepkit.inverse.identify import identify
from creepkit.inverse.minimum_rates import apparent_exponent, least_slope, measured_minimum_rate
from creepkit.inverse.settings import IdentificationSettings
from creepkit.laws.norton import NORTON
from creepkit.records import History, Program, constant_stress
from helpers.steady_rate_predictor import Steady, planted

END = 1e6


def curve(t: np.ndarray) -> np.ndarray:
    """Primary, secondary and tertiary creep."""
    return 4e-3 * (t / END) ** (1 / 3) + 5e-3 * (t / END) + 1e-2 * (t / END) ** 4


def test_the_least_slope_is_that_of_the_curve_at_its_inflection() -> None:
    times = np.linspace(0.0, END, 400)[1:]
    fine = np.linspace(0.0, END, 100_001)[1:]
    exact = np.min(np.diff(curve(fine)) / np.diff(fine))
    found = least_slope(times, curve(times), np.zeros(times.size))
    assert found == pytest.approx(exact, rel=0.03)
    assert found >= exact * (1 - 1e-6)  # a chord of a curve is never below its least slope


def test_noise_does_not_lower_it_by_more_than_it_is_allowed_to() -> None:
    times = np.linspace(0.0, END, 120)[1:]
    noise = 1e-4
    fine = np.linspace(0.0, END, 100_001)[1:]
    exact = np.min(np.diff(curve(fine)) / np.diff(fine))
    rng = np.random.default_rng(0)
    found = [
        least_slope(times, curve(times) + noise * rng.normal(size=times.size), np.full(times.size, noise))
        for _ in range(20)
    ]
    assert np.median(found) == pytest.approx(exact, rel=0.1)
    assert np.abs(np.log(found) - np.log(exact)).max() < 0.25


def test_a_slope_that_noise_hides_is_not_known() -> None:
    times = np.linspace(0.0, END, 30)[1:]
    assert np.isnan(least_slope(times, 1e-6 * times / END, np.full(times.size, 1e-4)))


def test_a_test_under_a_load_that_changes_has_none() -> None:
    times = np.linspace(0.0, END, 40)[1:]
    bar = History("bar", times, {"strain": 1e-9 * times}, constant_stress(50.0, "stress"), 1000.0)
    assert measured_minimum_rate(bar) == pytest.approx(1e-9, rel=1e-9)
    heated = bar.replace(temperature=Program(np.array([0.0, END]), np.array([900.0, 1000.0])))
    assert np.isnan(measured_minimum_rate(heated))
    assert measured_minimum_rate(bar.replace(minimum_rate=2e-9)) == 2e-9


def test_of_steady_creep_measured_and_predicted_rates_are_that_of_the_law() -> None:
    values = {"A": 1e-16, "n": 5.2}
    tests = planted(NORTON, values, [(s, 1050.0) for s in (30.0, 50.0, 80.0)], seed=5, noise=1e-6)
    fit = identify(NORTON, tests, Steady(), settings=IdentificationSettings(starts=2, sobol_points=16, frames=40))
    rates = minimum_rates_of(fit)
    assert [r.stress for r in rates] == [30.0, 50.0, 80.0]
    for one in rates:
        exact = values["A"] * one.stress ** values["n"]
        assert one.measured == pytest.approx(exact, rel=0.01)
        assert one.predicted == pytest.approx(float(fit.rate(one.stress, 1050.0)[0]), rel=1e-6)
        assert one.low < one.predicted < one.high


def test_the_apparent_exponent_is_that_of_a_power_law_at_each_temperature() -> None:
    stresses = np.array([50.0, 80.0, 120.0, 60.0, 90.0])
    temperatures = np.array([900.0, 900.0, 900.0, 1000.0, 1000.0])
    rates = 1e-18 * stresses**6.5 * np.where(temperatures > 950.0, 40.0, 1.0)
    assert apparent_exponent(stresses, rates, temperatures) == pytest.approx(6.5, rel=1e-9)
    assert np.isnan(apparent_exponent(np.full(3, 50.0), rates[:3], temperatures[:3]))
