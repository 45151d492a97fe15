"""Intervals that end at a bound of the search are named, of rates as of exponents, and no others."""

from __future__ import annotations

import pytest

import creepkit as ck
from creepkit.inverse.uncertainty.laplace_approximation import Estimate, cut_interval_notes, cut_intervals

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
