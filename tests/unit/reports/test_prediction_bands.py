"""Bands of fitted curves: closed forms for a Norton bar, the joint covariance, and the rates that tests show."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from creepkit.inverse.identification import IdentificationSettings
from creepkit.inverse.identify import identify
from creepkit.inverse.uncertainty.laplace_approximation import interval_quantile
from creepkit.laws.norton import NORTON
from creepkit.reports.prediction_bands import fitted_curves, joint_covariance, rates_of_tests
from helpers.steady_rate_predictor import Steady, planted

QUICK = IdentificationSettings(starts=2, sobol_points=16, frames=20)
TRUTH = {"A": 1e-16, "n": 5.2}
STRESSES = (30.0, 50.0, 80.0)


@pytest.fixture(scope="module")
def fit():
    tests = planted(NORTON, TRUTH, [(s, 1050.0) for s in STRESSES], seed=5, rate=0.1, noise=1e-6)
    return identify(NORTON, tests, Steady(), settings=QUICK)


def test_the_band_of_a_norton_bar_is_that_of_its_rate(fit):
    """strain = A s^n t: ln strain has the standard deviation of ln rate at that stress, at every time."""
    curves, quantile = fitted_curves(fit), interval_quantile(fit.freedom)
    jacobian = fit.coordinates.jacobian(fit.u)  # of (ln A, n) to u
    for k, stress in enumerate(STRESSES):
        to_log_rate = np.array([1.0, np.log(stress)]) @ jacobian
        sd = np.sqrt(to_log_rate @ fit.covariance @ to_log_rate)
        curve, half_width = curves.of(k, "strain")
        strain = curve - fit.tests[k].offset
        np.testing.assert_allclose(half_width / strain, quantile * sd, rtol=1e-4)
        _, low, high = fit.rate(stress, 1050.0)
        np.testing.assert_allclose(0.5 * np.log(high / low), quantile * sd, rtol=1e-4)


def test_the_curve_is_that_of_predict(fit):
    curves, prediction = fitted_curves(fit), fit.predict()
    for k in range(len(STRESSES)):
        np.testing.assert_allclose(curves.of(k, "strain")[0], prediction.of(k)[:, 0], rtol=1e-12)


def test_a_test_shows_its_own_rate(fit):
    """Without noise the growth of strain is the rate: that of a faster test lies as far above the law's."""
    factor = 1.3
    faster = [h.replace(outputs={"strain": factor * h.outputs["strain"]}) for h in fit.histories[:1]]
    changed = replace(fit, histories=(*faster, *fit.histories[1:]), problem=None)
    before, after = (rates_of_tests(f, fit.predict()) for f in (fit, changed))
    assert [r.stress for r in before] == list(STRESSES)
    assert after[0].rate == pytest.approx(factor * before[0].rate, rel=1e-9)
    assert after[1].rate == pytest.approx(before[1].rate, rel=1e-9)
    for one, history in zip(before, fit.histories, strict=True):
        slope = np.polyfit(history.times, history.outputs["strain"], 1)[0]
        assert one.rate == pytest.approx(slope, rel=0.02)


def test_the_joint_covariance_keeps_that_of_the_law_and_completes_it():
    """Against the inverse of the precision, where the law's part is just that inverse."""
    rng = np.random.default_rng(0)
    jacobian = rng.normal(size=(12, 5))
    expected = np.linalg.inv(jacobian.T @ jacobian)
    fit = SimpleNamespace(
        u=np.zeros(3),
        nuisances=(None, None),
        x=np.zeros(5),
        covariance=expected[:3, :3],
        least_squares_problem=SimpleNamespace(jacobian=lambda _: jacobian),
    )
    np.testing.assert_allclose(joint_covariance(fit), expected, rtol=1e-9)
    fit.covariance = 4 * expected[:3, :3]
    np.testing.assert_allclose(joint_covariance(fit)[:3, :3], fit.covariance, rtol=1e-9)
