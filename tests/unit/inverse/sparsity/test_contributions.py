"""Contributions of terms over what tests visit, against closed forms; where tests go."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from creepkit.errors import FitError
from creepkit.inverse.sparsity.contributions import STRESS_FACTORS, EvaluationPoints, strain_history, stress_history
from creepkit.language import Elastic, arrhenius
from creepkit.laws.combined import COMBINED
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.records import History, PressureJump, StressSteps, constant_stress
from helpers.term_contributions import bar, contributions, internal

HOUR = 3600.0


def test_two_power_laws_at_one_stress_have_the_closed_form():
    """c_i over sigma x {.5, .8, 1, 1.3}, with f_1 / f_2 = (A_1 / A_2) sigma^(n_1 - n_2) at each."""
    law, sigma = NORTON + NORTON, 40.0
    own = contributions(law, [bar(sigma)])
    u = own.coordinates.u(internal(law, A_1=2e-13, n_1=3.0, A_2=1e-16, n_2=5.0))
    stress = sigma * np.array(STRESS_FACTORS)
    first, second = 2e-13 * stress**3, 1e-16 * stress**5
    share = first / (first + second)
    wanted = [np.sqrt(np.mean(share**2)), np.sqrt(np.mean((1 - share) ** 2))]
    assert_allclose(own.values(u[None])[0], wanted, rtol=1e-12)
    assert own.by_term(u) == pytest.approx(dict(zip(law.terms, wanted, strict=True)))


def test_equal_rates_everywhere_are_equal_shares():
    law = NORTON + NORTON
    own = contributions(law, [bar(30.0), bar(60.0, "other")])
    u = own.coordinates.u(internal(law, A_1=1e-14, n_1=4.0, A_2=1e-14, n_2=4.0))
    assert_allclose(own.values(u[None])[0], [0.5, 0.5], rtol=1e-12)


def test_an_arrhenius_factor_on_all_terms_changes_no_share():
    plain = NORTON + STRAIN_HARDENING
    warm = plain.times(arrhenius(T_ref=1000.0))
    tests = [bar(30.0, T=950.0), bar(30.0, "hot", T=1050.0)]
    values = dict(A_1=1e-14, n_1=4.0, A_2=1e-17, n_2=3.0, m=-0.5)
    first, second = contributions(plain, tests), contributions(warm, tests)
    u, v = first.coordinates.u(internal(plain, **values)), second.coordinates.u(internal(warm, **values, Q=3e5))
    assert_allclose(second.values(v[None]), first.values(u[None]), rtol=1e-9)


def test_factors_of_single_terms_shift_shares_between_temperatures():
    """Q of 200 kJ/mol in one term: its rate over the other's grows by exp(Q/R (1/T_1 - 1/T_2)) from test to test."""
    law = NORTON.times(arrhenius(T_ref=1000.0)) + NORTON
    tests = [bar(30.0, T=950.0), bar(30.0, "hot", T=1050.0)]
    own = contributions(law, tests)
    u = own.coordinates.u(internal(law, A_1=1e-14, n_1=4.0, Q=2e5, A_2=1e-14, n_2=4.0))
    ratio = np.exp(-2e5 / 8.314462618 * (1 / np.array([950.0, 1050.0]) - 1 / 1000.0))
    share = ratio / (1 + ratio)
    assert_allclose(own.values(u[None])[0, 0], np.sqrt(np.mean(share**2)), rtol=1e-9)


def test_candidates_are_taken_at_once():
    own = contributions(COMBINED, [bar(40.0)])
    rng = np.random.default_rng(2)
    u = own.coordinates.u(internal(COMBINED, **COMBINED.center())) + rng.normal(0, 0.3, (7, len(COMBINED.params)))
    assert own.values(u).shape == (7, 3)
    assert_allclose(own.values(u)[4], own.values(u[4:5])[0], rtol=1e-13)


def test_the_jacobian_is_that_of_the_closed_form():
    """d share_i / d ln A_j = share_i (delta_ij - share_j); A_j moves with its log rate at the reference."""
    law = NORTON + NORTON
    own = contributions(law, [bar(40.0)])
    u = own.coordinates.u(internal(law, A_1=2e-13, n_1=3.0, A_2=1e-16, n_2=5.0))
    s, c = own.fractions(u[None])[0], own.values(u[None])[0]
    slopes = s[:, :, None] * (np.eye(2) - s[:, None, :])
    wanted = np.einsum("p,pi,pij->ij", own.points.weight, s, slopes) / c[:, None]
    found = own.jacobian(u)
    assert_allclose(found[:, [law.names.index("A_1"), law.names.index("A_2")]], wanted, atol=1e-9)


def test_nothing_overflows_where_rates_do():
    """sinh(400/1)^8 is e^3194."""
    own = contributions(COMBINED, [bar(400.0)])
    values = {**COMBINED.center(), "A_1": 1e-5, "n_1": 8.0, "B": 1.0}
    c = own.values(own.coordinates.u(internal(COMBINED, **values))[None])[0]
    assert_allclose(c, [1.0, 0.0, 0.0], atol=1e-12)


def test_all_tests_weigh_alike():
    visited = EvaluationPoints.from_histories([bar(40.0, frames=3), bar(80.0, "long", frames=400)])
    assert visited.weight.sum() == pytest.approx(1.0)
    assert visited.weight[visited.stress > 1.31 * 40.0].sum() == pytest.approx(0.5, abs=0.2)
    low = np.isin(np.round(visited.stress / 40.0, 6), STRESS_FACTORS) & (visited.weight > visited.weight.min())
    assert visited.weight[low].sum() == pytest.approx(0.5)


# ---- where tests go ------------------------------------------------------------------------------------------------


class Dimple:
    """A predictor that states a reference stress for each level of pressure."""

    def reference_stress(self, history):
        levels = np.unique(history.loading.program().values)
        return 12.5 * levels[levels > 0]

    def growth_per_strain(self, history):
        return 30.0


def dimple(**more):
    times = np.arange(1, 49) * 900.0
    grown = 0.05 + 0.3 * times / times[-1]
    return History(
        "dimple", times, {"amplitude": grown}, PressureJump(P1=8, P2=10, Tj=4 * HOUR), 1000.0, specimen="bulge",
        elastic=Elastic(150e3), **more,
    )  # fmt: skip


def test_stress_follows_the_jump_of_pressure():
    times = np.array([1 * HOUR, 3.9 * HOUR, 4.1 * HOUR, 12 * HOUR])
    assert_allclose(stress_history(dimple(), Dimple(), times)[:, 0], [100.0, 100.0, 125.0, 125.0])


def test_stress_of_a_bar_follows_its_steps():
    steps = StressSteps(((0.0, 30.0), (5 * HOUR, 60.0), (8 * HOUR, 30.0)), "stress")
    test = bar(30.0).replace(loading=steps)
    times = np.array([1.0, 6.0, 9.0]) * HOUR
    assert_allclose(stress_history(test, None, times)[:, 0], [30.0, 60.0, 30.0])


def test_strain_of_a_dimple_is_its_growth_over_that_of_a_unit_of_strain():
    course = strain_history(dimple(), Dimple())
    assert course[-1] == pytest.approx((0.3 * 47 / 48) / 30.0, rel=1e-6)
    assert (np.diff(course) >= 0).all()
    assert course[0] > 0


def test_a_test_without_load_is_left_out_and_none_is_an_error():
    idle = bar(30.0, "idle").replace(loading=constant_stress(0.0, "stress"))
    assert_allclose(
        np.unique(EvaluationPoints.from_histories([idle, bar(40.0)]).stress), 40.0 * np.array(STRESS_FACTORS)
    )
    with pytest.raises(FitError, match="no test is ever under load"):
        EvaluationPoints.from_histories([idle])
