"""The penalty on contributions: where it is smallest, and that least squares sees what it is."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import approx_fprime

from creepkit.inverse.sparsity.penalties import PenalisedTerms, switchable_exponents
from creepkit.laws.combined import COMBINED
from creepkit.laws.norton import NORTON
from helpers.term_contributions import bar, contributions, internal


@pytest.fixture(scope="module")
def combined():
    """Contributions of Eq. (2), and a point at which all terms matter."""
    own = contributions(COMBINED, [bar(40.0), bar(55.0, "other")])
    u = own.coordinates.u(internal(COMBINED, **{**COMBINED.center(), "m_1": -0.3, "m_2": -0.6}))
    rates = list(own.coordinates.term_rates)
    u[rates] = np.log([0.5, 0.3, 0.2]) - 14.0
    return own, u


def test_residuals_are_the_penalty_and_their_derivatives_its_gradient_without_unknowns_of_tests(combined):
    own, u = combined
    found, x = PenalisedTerms(own, 3.0), np.append(u, [0.02, -0.1])
    residuals, jacobian = found.residuals(x), found.jacobian(x)
    assert 0.5 * (residuals**2).sum() == pytest.approx(3.0 * (own.values(u[None]) ** 2).sum(), rel=1e-12)
    assert 0.5 * (residuals**2).sum() == pytest.approx(found.values(x[None])[0], rel=1e-12)
    wanted = approx_fprime(u, lambda v: found.values(v[None])[0], 1e-7)
    assert_allclose(jacobian.T @ residuals, [*wanted, 0.0, 0.0], atol=2e-5)


def test_exponents_that_can_be_off_are_those_of_memory():
    """n of 1 to 8 has {0} outside its bounds; m of -1 to 0 can get there."""
    assert [COMBINED.names[k] for k, _ in switchable_exponents(COMBINED)] == ["m_1", "m_2"]
    assert switchable_exponents(NORTON) == []
