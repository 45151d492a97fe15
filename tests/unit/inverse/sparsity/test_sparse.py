"""Contributions of terms over what tests visit, against closed forms; where tests go."""

import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import approx_fprime

from creepkit.inverse.identification_document import CODEC
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.sparsity.contributions import STRESS_FACTORS
from creepkit.inverse.sparsity.penalties import PenalisedTerms, Subsets, switchable_exponents
from creepkit.inverse.sparsity.result import Sparsity
from creepkit.inverse.sparsity.term_selection import (
    TermChoice,
    confirmed_law,
    identify_full,
    identify_reduced,
    identify_sparse,
)
from creepkit.language import Elastic, arrhenius
from creepkit.laws.combined import COMBINED
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.laws.time_hardening import TIME_HARDENING
from creepkit.records import History, PressureJump
from helpers.reduced_bulge_predictor import OneDegree, Plan, planted
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


# ---- where tests go ------------------------------------------------------------------------------------------------


def dimple(**more):
    times = np.arange(1, 49) * 900.0
    grown = 0.05 + 0.3 * times / times[-1]
    return History(
        "dimple", times, {"amplitude": grown}, PressureJump(P1=8, P2=10, Tj=4 * HOUR), 1000.0, specimen="bulge",
        elastic=Elastic(150e3), **more,
    )  # fmt: skip


# ---- penalties -------------------------------------------------------------------------------------------------------

# The penalty on contributions: that least squares sees what it is.


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


# ---- sparse ----------------------------------------------------------------------------------------------------------

# A sum reduced to the terms that planted bulge tests need: single laws and two-term laws.


EXACT = OneDegree(exact=True)
QUICK = IdentificationSettings(starts=1, sobol_points=4, frames=24, nuisances=())
SINE, STRAIN, TIME = COMBINED.terms
TRUTH = {"A": 3e-14, "n": 3.5, "m": -0.4}


@pytest.fixture(scope="module")
def hardening():
    """Eq. (2) opened on one test of a dimple that hardens with strain."""
    tests = planted(STRAIN_HARDENING, TRUTH, [Plan(760, 8, 10)], seed=5, frames=24)
    return identify_full(COMBINED, tests, EXACT, None, QUICK, None)


@pytest.fixture(scope="module")
def reduced(hardening):
    return identify_reduced(Subsets(), *hardening)


def test_a_planted_single_law_is_found(reduced):
    assert reduced.sparsity.kept_terms == (STRAIN,)
    assert set(reduced.law.terms) == {STRAIN}
    for name, truth in (("n_2", 3.5), ("m_1", -0.4)):
        estimate = next(e for e in reduced.estimates if e.name == name)
        assert estimate.value == pytest.approx(truth, abs=4 * (estimate.high - estimate.low) / 3.92)
    assert reduced.sparsity.bic_difference < 0
    assert reduced.sparsity.p_value > 0.01


def test_memory_that_is_not_there_is_switched_off():
    """Planted Norton creep ends as strain hardening, or time hardening, of exponent zero, if not as a sinh."""
    tests = planted(NORTON, {"A": 2e-13, "n": 3.5}, [Plan(760, 8, 10)], seed=6, frames=24)
    fit = identify_sparse(STRAIN_HARDENING + TIME_HARDENING, tests, EXACT, penalty=Subsets(), settings=QUICK)
    assert len(fit.law.terms) == 1
    assert len(fit.law.params) == 2
    assert fit.sparsity.exponents_off in (("m_1",), ("m_2",))
    assert next(v for k, v in fit.values.items() if k.startswith("n")) == pytest.approx(3.5, abs=0.2)


def test_two_terms_are_kept_where_three_pressures_need_them():
    law = NORTON + TIME_HARDENING
    values = {"A_1": 1.5e-20, "n_1": 6.5, "A_2": 3.3e-9, "n_2": 2.0, "m": -0.6}
    plans = [Plan(760, P, 1.15 * P) for P in (6, 8, 10.5)]
    tests = planted(law, values, plans, seed=7, frames=12)
    exact = QUICK.changed({"usual_errors": "none"})
    fit = identify_sparse(law, tests, EXACT, penalty=Subsets(), settings=exact)
    assert fit.sparsity.kept_terms == ("power law", "time hardening")
    assert fit.values["n_1"] == pytest.approx(6.5, abs=0.3)


# ---- confirmation and the record -----------------------------------------------------------------------------------


def test_a_term_that_is_needed_comes_back(hardening):
    _, reductions = hardening
    wrong = TermChoice((SINE,), {SINE: 0.6, STRAIN: 0.3, TIME: 0.1}, reductions.problem.start)
    assert STRAIN in confirmed_law(reductions, wrong).kept_terms


def test_the_record_says_what_was_dropped_and_survives_a_file(reduced):
    told = reduced.sparsity
    assert "without 'hyperbolic sine' and 'time hardening' of 'combined' chi-square rises by" in told.verdict
    assert "'strain hardening' suffices" in told.verdict
    stored = json.loads(json.dumps(CODEC.to_json(told)))
    assert CODEC.from_json(Sparsity, stored) == told
    back = replace(told, proposed_terms=())
    assert "The penalty had dropped 'strain hardening' too" in back.verdict
