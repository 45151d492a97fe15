"""The distance of a point from a curve in the plane of ln time and ln strain."""

import numpy as np
import pytest

from creepkit.inverse.residuals import orthogonal_distance


@pytest.mark.parametrize("slope", [0.1, 1.0, 30.0])
@pytest.mark.parametrize("b", [-2.0, -1e-12, 1e-12, 1e-3, 0.5])
def test_a_straight_line(slope, b):
    """A line of this slope passes at |a b|/sqrt(a^2 + b^2); steady creep counts its ln strain."""
    a = slope * b
    found = orthogonal_distance(np.array(a), np.array(b), np.array(slope))
    assert found.values == pytest.approx(np.sqrt(2) * a / np.hypot(1, slope), rel=1e-12)
    moved = slope * found.strain_derivative + found.time_derivative  # the line shifts in time: db = 1, da = slope
    assert moved == pytest.approx(np.sqrt(2) * slope / np.hypot(1, slope), rel=1e-9)


@pytest.mark.parametrize(("a", "b"), [(0.3, 0.1), (-0.02, -2.0), (5.0, 0.01)])
def test_derivatives(a, b):
    step = 1e-6
    found = orthogonal_distance(np.array(a), np.array(b), np.array(np.nan))

    def value(a, b):
        return orthogonal_distance(np.array(a), np.array(b), np.array(np.nan)).values

    assert found.strain_derivative == pytest.approx(
        (value(a + step, b) - value(a - step, b)) / (2 * step), rel=1e-6, abs=1e-9
    )
    assert found.time_derivative == pytest.approx(
        (value(a, b + step) - value(a, b - step)) / (2 * step), rel=1e-6, abs=1e-9
    )


def test_after_rupture_time_alone_counts_and_before_arrival_strain_alone():
    broke = orthogonal_distance(np.array(np.inf), np.array(0.7), np.array(np.inf))
    assert (broke.values, broke.strain_derivative, broke.time_derivative) == pytest.approx(
        (np.sqrt(2) * 0.7, 0, np.sqrt(2))
    )
    never = orthogonal_distance(np.array(-0.7), np.array(-np.inf), np.array(np.nan))
    assert (never.values, never.strain_derivative, never.time_derivative) == pytest.approx(
        (-np.sqrt(2) * 0.7, np.sqrt(2), 0)
    )


def test_it_is_continuous_where_a_curve_becomes_vertical():
    b = 0.4
    near, at = (orthogonal_distance(np.array(a), np.array(b), np.array(1.0)).values for a in (1e8, np.inf))
    assert near == pytest.approx(at, rel=1e-12)
