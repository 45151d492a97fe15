"""Correlations against linear regression, and sentences about what is not determined."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import norm

import creepkit as ck
from creepkit.errors import ArgumentError, FitError
from creepkit.inverse.identify import identify
from creepkit.inverse.selection.ranking import ModelAverage
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.uncertainty.correlation import correlation, undetermined
from creepkit.inverse.uncertainty.laplace_approximation import Estimate, cut_intervals, verdict_of_interval
from creepkit.inverse.uncertainty.mixture_distribution import MixtureDistribution
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.norton import NORTON
from creepkit.reports.verdicts import remarks
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
    with pytest.raises(ArgumentError, match="allowed is 'author' or 'conditioned'"):
        correlation(fit, "raw")


def test_a_sinh_over_narrow_stresses_is_known_by_its_exponent():
    truth = {"A": 1e-14, "n": 4.0}
    conditions = [(s, 1050.0) for s in (50, 55, 60, 50, 55, 60)]
    fit = identify(HYPERBOLIC_SINE, planted(NORTON, truth, conditions, seed=4, rate=0.03, noise=1e-5), Steady(),
                   settings=QUICK.changed({"weights": "equal"}))  # fmt: skip
    first, second = undetermined(fit)
    assert "A and B are not determined singly; their combination ln A - 3.97 ln B" in first  # A (s / B)^n
    found = correlation(fit, "conditioned")
    assert found.names == ("ln rate", "local exponent", "ln B")
    assert abs(found.between("ln rate", "local exponent")) < 0.5
    assert abs(correlation(fit).between("ln A", "ln B")) > 0.95
    assert "the local exponent is" in second


# ---- cut intervals ---------------------------------------------------------------------------------------------------

# Intervals that end at a bound of the search are named, of rates as of exponents, and no others.


def estimates(ends: dict[str, tuple[float, float]], verdict: str = "determined") -> list[Estimate]:
    return [Estimate(name, sum(ends[name]) / 2, *ends[name], "1", verdict) for name in NORTON.table]


def inside(name: str) -> tuple[float, float]:
    low, high = NORTON.table[name].bounds
    return low * (high / low) ** 0.4, low * (high / low) ** 0.6


@pytest.mark.parametrize("name", list(NORTON.table))
@pytest.mark.parametrize("end", [0, 1], ids=["low", "high"])
def test_an_interval_that_ends_at_a_bound_is_named(name: str, end: int) -> None:
    ends = {one: inside(one) for one in NORTON.table}
    bound = NORTON.table[name].bounds[end]
    ends[name] = (bound, ends[name][1]) if end == 0 else (ends[name][0], bound)
    assert cut_intervals(NORTON, estimates(ends)) == {name: bound}
    assert cut_intervals(NORTON, estimates(ends, "not determined")) == {}
    none = {"notes": (), "provenance": {}, "adequacy": None, "numerical_error": None, "unmodelled": ()}
    (sentence,) = remarks(SimpleNamespace(law=NORTON, estimates=estimates(ends), **none))
    assert sentence.startswith(f"the interval of {name} ends at its bound, {bound:.4g}")


@pytest.mark.parametrize(
    ("value", "interval", "verdict"),
    [
        (0.50, (0.40, 0.60), "determined"),
        (0.50, (0.37, 0.63), "poorly determined"),  # 26 % of the bounds, and by the tests on both sides
        (0.30, (0.00, 0.34), "not determined"),
        (0.50, (0.00, 1.00), "not determined"),
        (0.90, (0.60, 1.00), "not determined"),
        (0.90, (0.80, 1.00), "bounded on one side only"),
        (0.10, (0.00, 0.20), "bounded on one side only"),
        (1.00, (0.80, 1.00), "at its bound"),
    ],
)
def test_one_rule_says_what_is_determined(value: float, interval: tuple[float, float], verdict: str) -> None:
    assert verdict_of_interval(ck.Param("exponent", bounds=(0.0, 1.0)), value, interval) == verdict


@pytest.mark.parametrize(
    ("interval", "verdict"),
    [
        ((1.4e-18, 3.0e-11), "poorly determined"),  # seven decades of fifty
        ((1.0e-16, 1.1e-15), "poorly determined"),
        ((1.0e-16, 0.9e-15), "determined"),
        ((1.0e-40, 0.9e-39), "bounded on one side only"),
        ((1.0e-40, 1.0e-30), "not determined"),
    ],
)
def test_a_coefficient_is_determined_within_a_factor_of_ten(interval: tuple[float, float], verdict: str) -> None:
    low, high = np.log(interval)
    param = ck.Param("rate coefficient", unit="1/s", bounds=(1e-40, 1e10), scale="log")
    assert verdict_of_interval(param, 0.5 * (low + high), (low, high)) == verdict


def test_nearly_equal_intervals_from_near_zero_to_a_bound_have_one_verdict() -> None:
    """Two transients that the tests cannot tell apart: of each the interval goes over ten decades up to its bound."""
    param = ck.Param("rate coefficient", unit="1/s", bounds=(1e-14, 0.01), scale="log")
    for low in (5.132e-13, 5.195e-13):
        assert verdict_of_interval(param, np.log(8.2e-6), (np.log(low), np.log(0.01))) == "not determined"


# ---- mixture ---------------------------------------------------------------------------------------------------------

# Mixtures over laws against closed forms.


def parts(weight, middle, sd, freedom=1e9):
    columns = (np.array(v, float) for v in (weight, np.full(len(weight), freedom), middle, sd))
    weight, freedom, middle, sd = columns
    return MixtureDistribution(weight, freedom, middle, sd)


def test_two_parts_far_apart():
    """The lower tail of the mixture is that of the lower part alone, at its share: P(x < q) = w F(q)."""
    found = parts([0.4, 0.6], [0.0, 100.0], [1.0, 2.0])
    assert float(found.quantile(0.025)) == pytest.approx(norm.ppf(0.025 / 0.4), abs=1e-7)
    assert float(found.quantile(0.975)) == pytest.approx(100.0 + 2.0 * norm.ppf((0.975 - 0.4) / 0.6), abs=1e-7)


@pytest.fixture(scope="module")
def fit_of():
    """Of three rates of a power law."""
    return known_scatter(NORTON, measured(NORTON, TRUTH, (30.0, 50.0, 80.0), sd=0.2, seed=3), 0.2)


def test_two_laws_that_disagree_widen_the_interval(fit_of):
    """The same law at n + 3: at the reference stress both agree, and half of the belief each lies 3 apart in n."""
    other = replace(fit_of, u=fit_of.u + np.array([0.0, 3.0]))
    mixture = ModelAverage((fit_of, other), (1.0, 1.0))
    sd = float(np.sqrt(fit_of.covariance[1, 1]))
    _, low, high = mixture.local_exponent(60.0)
    assert float(low) == pytest.approx(fit_of.u[1] + sd * norm.ppf(0.05), abs=1e-4)
    assert float(high) == pytest.approx(fit_of.u[1] + 3.0 + sd * norm.ppf(0.95), abs=1e-4)
    r = fit_of.reference.stress
    assert mixture.rate(r) == pytest.approx(np.array(fit_of.rate(r)), rel=1e-6)
    assert "norton (0.5), norton (0.5)" in str(mixture)


def test_a_ranking_is_a_mixture_of_its_laws(fit_of):
    other = replace(fit_of, u=fit_of.u + np.array([0.0, 3.0]))
    weighed = [SimpleNamespace(fit=fit_of, excess=0.0), SimpleNamespace(fit=other, excess=2.0 * np.log(3.0))]
    ranking = SimpleNamespace(laws=[*weighed, SimpleNamespace(fit=None, excess=np.inf)])
    found = ModelAverage.from_ranking(ranking)
    assert found.weights == pytest.approx((0.75, 0.25))
    sd = float(np.sqrt(fit_of.covariance[1, 1]))
    assert float(found.local_exponent(60.0)[1]) == pytest.approx(fit_of.u[1] + sd * norm.ppf(0.025 / 0.75), abs=1e-4)
