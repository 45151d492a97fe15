"""Clocks: times and positions are inverse, derivatives are exact, and hardening becomes a straight line."""

from __future__ import annotations

import numpy as np
import pytest

from creepkit.integration.time_discretisation import SMALLEST_EXPONENT
from helpers.time_transformation import (
    TimeTransformation,
    power_law_transformation,
    shifted_power_law_transformation,
    transformed_times,
)

CLOCKS = [
    TimeTransformation(0.0, 1e5, 0.3, 0.0),
    TimeTransformation(0.0, 1e5, 0.05, 0.0),
    TimeTransformation(3e3, 1e5, 0.4, 2.0),
    TimeTransformation(3e3, 1e5, 0.4, 4e9),
    TimeTransformation(3e3, 1e5, -0.7, 5e2),
    TimeTransformation(7.0, 20.0, 1.0, 20.0),
]


@pytest.mark.parametrize("clock", CLOCKS)
def test_position_and_moment_are_inverse(clock: TimeTransformation) -> None:
    s = np.array([1e-3, 0.2, 0.7, 1.0])
    found = transformed_times(clock, s)
    np.testing.assert_allclose(found.position, s, rtol=1e-8)
    assert transformed_times(clock, 1e-300).position == pytest.approx(0.0, abs=1e-15)
    assert found.time[-1] == pytest.approx(clock.start + clock.length, rel=1e-14)


@pytest.mark.parametrize("clock", CLOCKS)
def test_pace_is_the_derivative_of_time(clock: TimeTransformation) -> None:
    s = np.array([0.1, 0.5, 0.9])
    h = 1e-5 * s
    difference = (transformed_times(clock, s + h).time - transformed_times(clock, s - h).time) / (2 * h)
    np.testing.assert_allclose(np.exp(transformed_times(clock, s).log_pace), difference, rtol=1e-6)


@pytest.mark.parametrize("clock", CLOCKS[:3] + CLOCKS[4:5])
def test_velocity_is_the_derivative_to_the_clock(clock: TimeTransformation) -> None:
    found = transformed_times(clock, 0.4)
    for field in ("beta", "tau"):
        value = getattr(clock, field)
        by_time, by_pace = getattr(found, f"time_by_{field}"), getattr(found, f"log_pace_by_{field}")
        if value == 0.0:
            assert (by_time, by_pace) == (0.0, 0.0)
            continue
        h = 1e-5 * value
        up, down = (transformed_times(clock._replace(**{field: value + d}), 0.4) for d in (h, -h))
        assert by_time == pytest.approx((up.time - down.time) / (2 * h), rel=1e-6)
        assert by_pace == pytest.approx((up.log_pace - down.log_pace) / (2 * h), rel=1e-6)


@pytest.mark.parametrize(("exponent", "lag"), [(0.4, 50.0), (0.9, 3e4), (-0.5, 1e3)])
def test_a_shifted_power_of_time_gives_its_own_clock(exponent: float, lag: float) -> None:
    """For p = (1 + y/lag)^exponent, p'' = r p' with r = (exponent - 1)/(lag + y)."""
    clock = shifted_power_law_transformation(10.0, 1e4, (exponent - 1) / lag, -(exponent - 1) / lag**2)
    assert (clock.beta, clock.tau) == pytest.approx((exponent, lag), rel=1e-12)


def test_a_curve_that_does_not_harden_gets_plain_time() -> None:
    for bend, rate in ((1e-3, 1e-6), (-1e-3, -1e-6), (float("nan"), 1.0), (0.0, 0.0)):
        assert shifted_power_law_transformation(0.0, 100.0, bend, rate) == (0.0, 100.0, 1.0, 100.0)
    times = transformed_times(TimeTransformation(5.0, 100.0, 1.0, 100.0), [0.25, 0.5]).time
    np.testing.assert_allclose(times, [30.0, 55.0], rtol=1e-15)


def test_exponents_are_kept_within_reach() -> None:
    assert power_law_transformation(0.0, 1.0, 1e-3).beta == SMALLEST_EXPONENT
    assert power_law_transformation(0.0, 1.0, 7.0).beta == 1.0
