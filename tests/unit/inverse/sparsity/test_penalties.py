"""Penalties on contributions: where they are smallest, and that least squares sees what they are."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import approx_fprime

from creepkit.inverse.sparsity.penalties import L2, GroupL2, PenalisedTerms, Sqrt, switchable_exponents
from creepkit.laws.combined import COMBINED
from creepkit.laws.norton import NORTON
from helpers.term_contributions import bar, contributions, internal

EVERY = (L2(3.0), GroupL2(3.0), Sqrt(3.0))


def simplex(count=60):
    """Shares of three terms that add up to one, corners and centre among them."""
    rng = np.random.default_rng(0)
    return np.concatenate([np.eye(3), np.full((1, 3), 1 / 3), rng.dirichlet(np.ones(3), count)])


def test_squared_l2_is_smallest_at_equal_shares():
    """By Cauchy and Schwarz, sum c^2 >= (sum c)^2 / 3 with equality only there: it spreads, it does not select."""
    values = L2.OF_CONTRIBUTIONS.value(simplex())
    assert values.argmin() == 3
    assert values[3] == pytest.approx(1 / 3)
    assert_allclose(values[:3], 1.0)


def test_the_square_root_is_smallest_in_a_corner():
    values = Sqrt.OF_CONTRIBUTIONS.value(simplex())
    assert values.argmin() in (0, 1, 2)
    assert values[3] == values.max()


def test_group_l2_is_the_same_all_over_the_simplex():
    assert_allclose(GroupL2.OF_CONTRIBUTIONS.value(simplex()), 1.0)


@pytest.mark.parametrize("penalty", EVERY, ids=lambda p: type(p).__name__)
def test_parabolas_touch_the_penalty_and_lie_above_it(penalty):
    """w c^2 + const through c_0, of equal slope there; for concave functions of c^2 it majorises."""
    penalty, grid = penalty.OF_CONTRIBUTIONS, np.linspace(0.0, 1.0, 201)[:, None]
    for c in (0.01, 0.2, 0.9):
        at = np.array([[c]])
        w = penalty.weights(at)
        parabola = penalty.value(at) + (w * (grid**2 - at**2))[:, 0]
        assert (parabola >= penalty.value(grid) - 1e-12).all()
        slope = (penalty.value(at + 1e-6) - penalty.value(at - 1e-6)) / 2e-6
        assert slope[0] == pytest.approx(2 * w[0, 0] * c, rel=1e-5)


@pytest.fixture(scope="module")
def combined():
    """Contributions of Eq. (2), and a point at which all terms matter."""
    own = contributions(COMBINED, [bar(40.0), bar(55.0, "other")])
    u = own.coordinates.u(internal(COMBINED, **{**COMBINED.center(), "m_1": -0.3, "m_2": -0.6}))
    rates = list(own.coordinates.term_rates)
    u[rates] = np.log([0.5, 0.3, 0.2]) - 14.0
    return own, u


@pytest.mark.parametrize("penalty", EVERY, ids=lambda p: type(p).__name__)
def test_residuals_are_the_penalty_and_their_gradient_is_its_gradient(penalty, combined):
    own, u = combined
    found = PenalisedTerms(own, penalty, 3.0)
    residuals, jacobian = found.residuals(u), found.jacobian(u)
    assert 0.5 * (residuals**2).sum() == pytest.approx(found.values(u[None])[0], rel=1e-12)
    wanted = approx_fprime(u, lambda v: found.values(v[None])[0], 1e-7)
    assert_allclose(jacobian.T @ residuals, wanted, atol=2e-5)


@pytest.mark.parametrize("penalty", EVERY, ids=lambda p: type(p).__name__)
def test_with_weights_kept_residuals_touch_at_that_point_and_lie_above_elsewhere(penalty, combined):
    own, u = combined
    found = PenalisedTerms(own, penalty, 3.0)
    kept = found.frozen_weights_at(u)
    assert 0.5 * (kept.residuals(u) ** 2).sum() == pytest.approx(found.values(u[None])[0], rel=1e-12)
    rng = np.random.default_rng(1)
    for v in u + rng.normal(0, 0.3, (20, u.size)):
        assert 0.5 * (kept.residuals(v) ** 2).sum() >= found.values(v[None])[0] - 1e-9
    slopes = approx_fprime(u, kept.residuals, 1e-7)
    assert_allclose(kept.jacobian(u), slopes, atol=3e-6)


def test_unknowns_of_tests_cost_nothing(combined):
    own, u = combined
    found, x = PenalisedTerms(own, Sqrt(), 3.0), np.append(u, [0.02, -0.1])
    assert_allclose(found.residuals(x), found.residuals(u))
    assert found.values(x[None]) == found.values(u[None])
    assert found.jacobian(x).shape == (6, u.size + 2)
    assert (found.jacobian(x)[:, -2:] == 0).all()


def test_exponents_that_can_be_off_are_those_of_memory():
    """n of 1 to 8 has {0} outside its bounds; m of -1 to 0 can get there."""
    assert [COMBINED.names[k] for k, _ in switchable_exponents(COMBINED)] == ["m_1", "m_2"]
    assert switchable_exponents(NORTON) == []


def test_a_simple_term_costs_less_than_one_with_memory(combined):
    own, u = combined
    simple = u.copy()
    simple[COMBINED.names.index("m_1")] = 0.0
    both = np.stack([u, simple])
    same = PenalisedTerms(own, Sqrt(exponents=0.0), 1.0).values(both)
    dearer = PenalisedTerms(own, Sqrt(), 1.0).values(both) - same
    assert dearer[0] > dearer[1]


def test_a_law_without_such_exponents_is_penalised_too():
    law = NORTON + NORTON
    own = contributions(law, [bar(40.0)])
    u = own.coordinates.u(internal(law, A_1=2e-13, n_1=3.0, A_2=1e-16, n_2=5.0))
    assert PenalisedTerms(own, Sqrt(), 1.0).residuals(u).shape == (3,)
