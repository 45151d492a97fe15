"""The censored likelihood against closed forms, numerical integration, and published maximum likelihood estimates."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import multivariate_normal, norm

from creepkit.rupture_assessment.fitting import GroupedTimes, conditions_of, fit_method
from creepkit.rupture_assessment.methods import METHODS, RuptureMethod
from creepkit.rupture_assessment.observed_tests import rupture_tests
from creepkit.rupture_assessment.rupture_fit import variance_freedom
from helpers.planted_rupture import MOTORETTES, larson_miller, planted, rupture_test


def unknown(temperature):
    return np.full(np.shape(temperature), np.nan)


def fitted(method, histories, degree=2, **fixed):
    tests, _, _ = rupture_tests(histories)
    at = conditions_of(tests, unknown)
    return fit_method(method, tests, at, degree=degree, fixed=fixed, level=0.95), tests


def test_without_heats_and_run_outs_it_is_least_squares():
    fit, tests = fitted(METHODS["larson-miller"], planted(larson_miller, count=40))
    x, T = np.log10(tests.stress), tests.temperature
    X = np.column_stack([-np.ones(40), 1 / T, x / T, x**2 / T])
    expected, (squares,), *_ = np.linalg.lstsq(X, tests.log_time, rcond=None)
    np.testing.assert_allclose(fit.coefficients, expected, rtol=1e-8)
    assert fit.scale == pytest.approx(np.sqrt(squares / 40), rel=1e-8)
    covariance = squares / 36 * np.linalg.inv(X.T @ X)
    np.testing.assert_allclose(np.diag(fit.covariance)[:4], np.diag(covariance), rtol=1e-4)
    C = fit["C"]
    assert C.value == pytest.approx(expected[0], rel=1e-8)
    # Student's quantile at 36 degrees of freedom is 2.0281.
    assert C.high - C.value == pytest.approx(2.0281 * np.sqrt(covariance[0, 0]), rel=1e-3)


def test_balanced_heats_have_the_closed_form_of_a_mixed_model():
    """Searle, Casella, McCulloch (1992), Variance components, 3.7: maximum likelihood of the balanced one-way model."""
    rng, heats, each = np.random.default_rng(3), 6, 8
    stress = np.geomspace(60.0, 200.0, each)
    effects = 0.2 * rng.standard_normal(heats)
    y = 9.0 - 3.0 * np.log10(stress) + effects[:, None] + 0.1 * rng.standard_normal((heats, each))
    histories = [
        rupture_test(f"{h} {k}", stress[k], 900.0, 10 ** y[h, k], labels={"heat": f"H{h}"})
        for h in range(heats)
        for k in range(each)
    ]
    fit, _ = fitted(METHODS["isothermal"], histories, degree=1)
    x = np.log10(stress) - np.log10(stress).mean()
    slope = (y @ x).mean() / (x @ x)
    within = y - y.mean(axis=1, keepdims=True) - slope * x
    variance = (within**2).sum() / (heats * (each - 1))
    between = each * ((y.mean(axis=1) - y.mean()) ** 2).sum() / heats
    assert fit["a_1"].value == pytest.approx(slope, rel=1e-8)
    assert fit.scale**2 == pytest.approx(variance, rel=1e-7)
    assert fit.scatter["heat"] ** 2 == pytest.approx((between - variance) / each, rel=1e-7)
    assert fit.scatter_corrected["heat"] ** 2 == pytest.approx(fit.scatter["heat"] ** 2 * 6 / 5, rel=1e-9)


@pytest.mark.parametrize("kinds", [1, 2])
def test_effects_of_complete_data_integrate_to_a_normal_distribution(kinds):
    rng, n = np.random.default_rng(5), 30
    groups = {"heat": [f"H{k}" for k in rng.integers(0, 5, n)], "laboratory": [f"L{k}" for k in rng.integers(0, 3, n)]}
    chosen = dict(list(groups.items())[:kinds])
    y, mean, scatter = rng.normal(2.0, 0.5, n), rng.normal(2.0, 0.1, n), np.array([0.3, 0.15])[:kinds]
    times = GroupedTimes.of(y, np.zeros(n, bool), chosen)
    covariance = 0.2**2 * np.eye(n) + sum(
        s**2 * members @ members.T for s, members in zip(scatter, times.members, strict=True)
    )
    value = times.log_likelihood(mean[None], np.array([0.2]), scatter[None])[0]
    assert value == pytest.approx(multivariate_normal(mean, covariance).logpdf(y), abs=1e-9)


def test_effects_of_run_outs_are_integrated():
    y, censored = np.array([2.0, 2.2, 2.4, 2.4, 2.1, 2.5]), np.array([0, 0, 1, 1, 1, 1], bool)
    heats, mean, s, tau = ["a", "a", "a", "a", "b", "b"], np.linspace(1.9, 2.5, 6), 0.12, 0.25
    times = GroupedTimes.of(y, censored, {"heat": heats})

    def density(b, k):
        z = (y[k] - mean[k] - b) / s
        return norm.sf(z) if censored[k] else norm.pdf(z) / s

    expected = 0.0
    for members in ((0, 1, 2, 3), (4, 5)):

        def product(b, members=members):
            return norm.pdf(b, 0, tau) * np.prod([density(b, k) for k in members])

        expected += np.log(quad(product, -2.0, 2.0, epsabs=1e-14, limit=200)[0])
    value = times.log_likelihood(mean[None], np.array([s]), np.array([[tau]]))[0]
    assert value == pytest.approx(expected, abs=2e-4)


def motorettes(function):
    """A method of one function of the temperature, and the motorette tests."""
    method = RuptureMethod(
        "motorettes", "", lambda at, *_: {"b_0": np.ones(at.stress.size), "b_1": function(at.temperature)}
    )
    tests = [
        rupture_test(f"{T:g} {k}", 1.0, T + 273.2, abs(h), end=abs(h) if h < 0 else np.inf)
        for T, hours in MOTORETTES.items()
        for k, h in enumerate(hours)
    ]
    return method, tests


def test_motorettes_with_a_normal_distribution():
    """log10 h = b_0 + b_1 1000 / (T + 273.2): -6.019, 4.311, sigma 0.2592 (Schmee, Hahn (1979); Tanner (1993), 4.2)."""
    fit, _ = fitted(*motorettes(lambda T: 1000.0 / T))
    assert fit["b_0"].value == pytest.approx(-6.019, abs=5e-4)
    assert fit["b_1"].value == pytest.approx(4.311, abs=5e-4)
    assert fit.scale == pytest.approx(0.2592, abs=5e-5)


# ---- degrees of freedom ----------------------------------------------------------------------------------------------

# Degrees of freedom of balanced tests are those of an analysis of variance.


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
