"""Bounded least squares: minima of closed form within bounds and penalties, and how many evaluations they take."""

import numpy as np
import pytest

from creepkit.inverse.bounds import Bounds
from creepkit.inverse.search.local_refinement import Tolerances, bounded_least_squares


def nothing(x):
    return np.zeros(0), np.zeros((0, x.size))


def minimum(data, start, low, high, *, others=nothing, fixed=None, loss="linear"):
    bounds = Bounds(np.array(low, float), np.array(high, float))
    tolerances, scale = Tolerances(max_steps=60, tolerance=1e-10), 0.1 * bounds.width
    start = np.array(start, float)
    return bounded_least_squares(data, others, start, bounds, scale, tolerances, fixed=fixed or {}, loss=loss)


def rosenbrock(x):
    return np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]]), np.array([[-20.0 * x[0], 10.0], [-1.0, 0.0]])


@pytest.mark.parametrize("start", [(-1.2, 1.0), (0.0, 0.0), (-2.0, -2.0)])
def test_a_curved_valley_is_followed_to_a_bound(start):
    """Rosenbrock's function for x <= 0.5: y = x^2, and (1 - x)^2 / 2 is left."""
    found = minimum(rosenbrock, start, (-2.0, -2.0), (0.5, 2.0))
    assert found.x == pytest.approx([0.5, 0.25], abs=1e-6)
    assert found.cost == pytest.approx(0.125)
    assert found.converged
    assert found.evaluations <= 20


def test_a_penalty_with_a_corner_costs_no_evaluation():
    """The point of a disc that is nearest to (2, 1): the data are linear, so that one step finds it."""

    def data(x):
        return x - np.array([2.0, 1.0]), np.eye(2)

    def outside_disc(x):
        excess = x @ x - 1.0
        return np.array([1e4 * max(excess, 0.0)]), 1e4 * (excess > 0) * 2.0 * x[None]

    found = minimum(data, (0.1, -0.3), (-5.0, -5.0), (5.0, 5.0), others=outside_disc)
    assert found.x == pytest.approx(np.array([2.0, 1.0]) / np.sqrt(5.0), abs=1e-4)
    assert found.evaluations <= 3


def test_fixed_unknowns_stay_and_a_robust_loss_leaves_an_outlier_out():
    """Nine readings of 1 and one of 100: the median-like loss ends near 1, least squares at 10.9."""
    readings = np.array([1.0] * 9 + [100.0])

    def data(x):
        return x[0] - readings, np.stack([np.ones(10), np.zeros(10)], axis=1)

    robust = minimum(data, (5.0, 3.0), (0.0, 0.0), (200.0, 10.0), fixed={1: 3.0}, loss="cauchy")
    plain = minimum(data, (5.0, 3.0), (0.0, 0.0), (200.0, 10.0), fixed={1: 3.0})
    assert robust.x == pytest.approx([1.0, 3.0], abs=0.02)
    assert plain.x == pytest.approx([10.9, 3.0])
