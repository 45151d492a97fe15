"""Splines between accepted steps: cubics, scipy's not-a-knot splines, and few steps."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from creepkit.fem.time_interpolation import OFFSET, TimeInterpolation

RNG = np.random.default_rng(4)


def one_segment(places, exponent=1.0):
    """Steps at places of the variable in which values are splines, ln(1 + (t / 20 s)^beta), and back."""
    times = OFFSET * np.expm1(places) ** (1 / exponent)
    rows = ((0, len(times) - 1),)
    return TimeInterpolation(times, np.zeros(1), rows, np.zeros(1), np.array([exponent])), times


def time_of(places, exponent=1.0):
    return OFFSET * np.expm1(places) ** (1 / exponent)


@pytest.mark.parametrize("steps", [4, 5, 6, 9, 60])
def test_cubics_are_met_everywhere(steps):
    places = np.cumsum(RNG.uniform(0.3, 1.0, steps)) / 8
    line, _ = one_segment(places)
    columns = RNG.normal(size=(4, 3))
    asked = RNG.permutation(np.append(np.linspace(0.5 * places[0], places[-1], 40), places))
    got = line.interpolate(np.polynomial.polynomial.polyval(places, columns).T, time_of(asked))
    exact = np.polynomial.polynomial.polyval(asked, columns).T
    np.testing.assert_allclose(got, exact, rtol=0, atol=1e-11)


@pytest.mark.parametrize("exponent", [1.0, 0.3])
@pytest.mark.parametrize("steps", [3, 4, 5, 17, 60])
def test_splines_are_those_of_scipy(steps, exponent):
    places = np.cumsum(RNG.uniform(0.3, 1.0, steps)) / 4
    line, times = one_segment(places, exponent)
    values = np.cumsum(RNG.normal(size=(steps, 2, 5)), axis=0)
    asked = np.append(RNG.uniform(0.0, times[-1], 50), times)
    variable = lambda t: np.log1p((t / OFFSET) ** exponent)  # noqa: E731
    expected = CubicSpline(variable(times), values)(variable(asked))
    np.testing.assert_allclose(line.interpolate(values, asked), expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def test_one_step_is_constant_and_two_are_straight_in_time():
    line, times = one_segment(np.array([0.7]))
    np.testing.assert_array_equal(line.interpolate(np.array([[2.0, 3.0]]), [0.0, times[0]]), [[2.0, 3.0]] * 2)
    line, times = one_segment(np.array([0.0, 0.7]))
    asked = np.linspace(0.0, times[1], 5)
    np.testing.assert_allclose(line.interpolate(np.array([1.0, 3.0]), asked), 1.0 + 2.0 * asked / times[1], rtol=1e-15)


def test_what_is_not_a_number_spoils_its_column_and_segment_alone():
    line, times = one_segment(np.linspace(0.0, 2.0, 7))
    values = np.ones((7, 3))
    values[4, 1] = np.nan
    got = line.interpolate(values, times)
    assert np.isnan(got[:, 1]).any()
    np.testing.assert_allclose(got[:, [0, 2]], 1.0, rtol=1e-15)
    assert np.isnan(line.interpolate(values, [np.nan, 1.1 * times[-1]])).all()


def test_no_times_and_no_columns_are_empty():
    line, times = one_segment(np.linspace(0.0, 2.0, 7))
    assert line.interpolate(np.zeros((7, 2)), []).shape == (0, 2)
    assert line.interpolate(np.zeros((7, 0)), times).shape == (7, 0)
