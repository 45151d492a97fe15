"""Intervals that end at a bound of the search are named, of rates as of exponents, and no others."""

from __future__ import annotations

import numpy as np
import pytest

import creepkit as ck
from creepkit.inverse.uncertainty.laplace_approximation import (
    Estimate,
    cut_interval_notes,
    cut_intervals,
    verdict_of_interval,
)

NORTON = ck.law("norton")


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
    (sentence,) = cut_interval_notes(NORTON, estimates(ends))
    assert sentence.startswith(f"the interval of {name} ends at its bound, {bound:.4g}")
    assert cut_interval_notes(NORTON, estimates(ends, "not determined")) == ()


def test_a_rate_far_below_1e_8_is_not_taken_for_its_bound() -> None:
    """The same number to within an absolute tolerance of 1e-8, and a factor of ten apart."""
    ends = {one: inside(one) for one in NORTON.table}
    name = next(one for one in NORTON.table if NORTON.table[one].bounds[0] < 1e-12)
    ends[name] = (NORTON.table[name].bounds[0] * 10, 1e-10)
    assert ends[name][0] < 1e-8
    assert cut_intervals(NORTON, estimates(ends)) == {}
    assert cut_interval_notes(NORTON, estimates(ends)) == ()


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


def test_a_coefficient_of_narrow_bounds_is_determined_by_a_quarter_of_them() -> None:
    """Bounds that are a factor of ten apart do not make every interval within them a determination."""
    param = ck.Param("rate coefficient", unit="1/s", bounds=(1e-6, 1e-5), scale="log")
    assert verdict_of_interval(param, np.log(3e-6), (np.log(1.5e-6), np.log(6e-6))) == "poorly determined"


def test_nearly_equal_intervals_from_near_zero_to_a_bound_have_one_verdict() -> None:
    """Two transients that the tests cannot tell apart: of each the interval goes over ten decades up to its bound."""
    param = ck.Param("rate coefficient", unit="1/s", bounds=(1e-14, 0.01), scale="log")
    for low in (5.132e-13, 5.195e-13):
        assert verdict_of_interval(param, np.log(8.2e-6), (np.log(low), np.log(0.01))) == "not determined"
