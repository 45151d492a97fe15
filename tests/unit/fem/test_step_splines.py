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
