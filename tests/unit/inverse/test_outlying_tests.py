"""Outlying tests: told from scatter, which is none; a strain ten times too large is not explained by a law."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.inverse.outlying_tests import outlying_tests
from creepkit.records import History, StressSteps
from creepkit.reports.tests_apart import apart_sentence

HOUR = 3600.0


@pytest.mark.parametrize("count", [5, 8, 12, 30])
@pytest.mark.parametrize("scatter", [0.05, 0.3, 0.6])
def test_scatter_alone_is_hardly_ever_an_outlier(count, scatter):
    rng = np.random.default_rng(count)
    found = [outlying_tests(scatter * rng.standard_normal(count)).any() for _ in range(500)]
    assert np.mean(found) < 0.02


def test_one_and_two_far_tests_are_found_among_ten():
    rng = np.random.default_rng(0)
    for far in ([3.2], [3.2, -2.5]):
        rates = np.concatenate([0.2 * rng.standard_normal(10), far])
        assert np.flatnonzero(outlying_tests(rates)).tolist() == list(range(10, 10 + len(far)))


def test_three_others_cannot_say_how_rates_scatter():
    assert not outlying_tests(np.array([0.0, 0.1, -0.1, 3.2])).any()


def hardening_tests(strain_factor):
    """Eight bars under constant true stress, e^1.5 = 1.5 A s^6 t, rates scattering by 8 %: the last strain is wrong."""
    rng = np.random.default_rng(4)
    tests = []
    for k, stress in enumerate((120.0, 130.0, 140.0, 150.0, 160.0, 170.0, 180.0, 145.0)):
        times = np.linspace(10.0, 500.0, 40) * HOUR
        rate = 3e-24 * np.exp(0.08 * rng.standard_normal()) * stress**6
        strain = (1.5 * rate * times) ** (2.0 / 3.0) + 1e-6 * rng.standard_normal(40)
        strain *= strain_factor if k == 7 else 1.0
        tests.append(
            History(f"t{k}", times, {"strain": strain}, StressSteps([(0.0, stress)], control="stress"), 873.15)
        )
    return tests


def test_a_strain_ten_times_too_large_is_not_explained_and_its_cause_is_named():
    fit = ck.identify(ck.law("strain-hardening"), hardening_tests(10.0), starts=1, weights="likelihood")
    assert fit.adequacy.rejects
    ((name, factor),) = fit.adequacy.outlying
    assert name == "t7"
    usual = np.median([one.rate_factor for one in fit.tests if one.name != name])
    assert factor / usual == pytest.approx(10**1.5, rel=0.3)
    assert fit.adequacy.rate_scatter < 0.5, "that of the other tests, planted as 0.08; the wrong one draws the exponent"
    assert "test 't7'" in str(fit.adequacy)
    said = apart_sentence(fit)
    assert "strain" in said
    assert "(nearly 10 or 9.81)" in said


def test_without_the_error_all_tests_are_explained():
    fit = ck.identify(ck.law("strain-hardening"), hardening_tests(1.0), starts=1, weights="likelihood")
    assert fit.adequacy.explains
    assert fit.adequacy.outlying == ()
    assert apart_sentence(fit) == ""
