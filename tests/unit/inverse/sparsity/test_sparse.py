"""Terms of a sum that planted tests need are kept, and contributions of terms are those of closed forms."""

import json

import numpy as np
import pytest

from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.identification_document import CODEC
from creepkit.inverse.reference_conditions import ReferencePoint
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.sparsity.result import Sparsity
from creepkit.inverse.sparsity.term_selection import (
    L2_STRENGTH,
    STRESS_FACTORS,
    TermContributions,
    contribution_norm,
    identify_sparse,
)
from creepkit.language import arrhenius
from creepkit.laws.combined import COMBINED
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.laws.time_hardening import TIME_HARDENING
from creepkit.records import History, constant_stress
from helpers.reduced_bulge_predictor import OneDegree, Plan, planted

HOUR = 3600.0


def bar(stress, name="bar", T=1000.0, frames=10):
    times = np.linspace(HOUR, 10 * HOUR, frames)
    return History(name, times, {"strain": 1e-6 * times / HOUR}, constant_stress(stress, "stress"), T)


def shares(law, tests, **values):
    """Contributions of the terms of a law."""
    coordinates = Coordinates(law, ReferencePoint.from_histories(tests))
    theta = np.array([p.to_internal(values[name]) for name, p in law.table.items()])
    return TermContributions(coordinates, tests).values(coordinates.u(theta))


def test_contributions_have_closed_forms():
    """c_i over sigma x {.5, .8, 1, 1.3}, with f_1 / f_2 = (A_1 / A_2) sigma^(n_1 - n_2) at each.

    With Q of 200 kJ/mol in one term its rate over the other's grows by exp(Q/R (1/T_1 - 1/T_2)) from test to test, and
    sinh(400/1)^8 is e^3194.
    """
    stress = 40.0 * np.array(STRESS_FACTORS)
    first, second = 2e-13 * stress**3, 1e-16 * stress**5
    share = first / (first + second)
    found = shares(NORTON + NORTON, [bar(40.0)], A_1=2e-13, n_1=3.0, A_2=1e-16, n_2=5.0)
    assert found == pytest.approx([np.sqrt(np.mean(share**2)), np.sqrt(np.mean((1 - share) ** 2))], rel=1e-12)

    tests = [bar(30.0, T=950.0), bar(30.0, "hot", T=1050.0)]
    law = NORTON.times(arrhenius(T_ref=1000.0)) + NORTON
    ratio = np.exp(-2e5 / 8.314462618 * (1 / np.array([950.0, 1050.0]) - 1 / 1000.0))
    found = shares(law, tests, A_1=1e-14, n_1=4.0, Q=2e5, A_2=1e-14, n_2=4.0)
    assert found[0] == pytest.approx(np.sqrt(np.mean((ratio / (1 + ratio)) ** 2)), rel=1e-9)

    plain, values = NORTON + STRAIN_HARDENING, dict(A_1=1e-14, n_1=4.0, A_2=1e-17, n_2=3.0, m=-0.5)
    warm = shares(plain.times(arrhenius(T_ref=1000.0)), tests, **values, Q=3e5)
    assert warm == pytest.approx(shares(plain, tests, **values), rel=1e-9)

    extreme = {**COMBINED.center(), "A_1": 1e-5, "n_1": 8.0, "B": 1.0}
    assert shares(COMBINED, [bar(400.0)], **extreme) == pytest.approx([1.0, 0.0, 0.0], abs=1e-12)


def test_the_norm_is_what_least_squares_see_with_the_derivatives_of_a_closed_form():
    """d share_i / d ln A_j = share_i (delta_ij - share_j); A_j moves with its log rate at the reference."""
    law, tests = NORTON + NORTON, [bar(40.0)]
    coordinates = Coordinates(law, ReferencePoint.from_histories(tests))
    values = {"A_1": 2e-13, "n_1": 3.0, "A_2": 1e-16, "n_2": 5.0}
    x = np.append(coordinates.u(np.array([p.to_internal(values[name]) for name, p in law.table.items()])), 0.02)
    norm, stress = contribution_norm(TermContributions(coordinates, tests)), 40.0 * np.array(STRESS_FACTORS)
    rates = np.stack([2e-13 * stress**3, 1e-16 * stress**5])
    share = rates / rates.sum(axis=0)
    c = np.sqrt((share**2).mean(axis=1))
    assert 0.5 * (norm(x)[0] ** 2).sum() == pytest.approx(L2_STRENGTH * (c**2).sum(), rel=1e-12)
    slopes = share[:, None] * (np.eye(2)[:, :, None] - share[None])
    wanted = (share[:, None] * slopes).mean(axis=2) / c[:, None]
    found = norm(x)[1][:, [law.names.index("A_1"), law.names.index("A_2")]]
    assert found == pytest.approx(np.sqrt(2 * L2_STRENGTH) * wanted, abs=1e-6)
    assert (norm(x)[1][:, -1] == 0).all()


# ---- sparse ----------------------------------------------------------------------------------------------------------

# A sum reduced to the terms that planted bulge tests need: single laws and two-term laws.


EXACT = OneDegree(exact=True)
QUICK = IdentificationSettings(starts=1, sobol_points=4, frames=24, nuisances=())
SINE, STRAIN, TIME = COMBINED.terms
TRUTH = {"A": 3e-14, "n": 3.5, "m": -0.4}


@pytest.fixture(scope="module")
def reduced():
    """Eq. (2) opened on one test of a dimple that hardens with strain."""
    tests = planted(STRAIN_HARDENING, TRUTH, [Plan(760, 8, 10)], seed=5, frames=24)
    return identify_sparse(COMBINED, tests, EXACT, settings=QUICK)


def test_a_planted_single_law_is_found(reduced):
    assert reduced.sparsity.kept_terms == (STRAIN,)
    assert set(reduced.law.terms) == {STRAIN}
    for name, truth in (("n_2", 3.5), ("m_1", -0.4)):
        estimate = next(e for e in reduced.estimates if e.name == name)
        assert estimate.value == pytest.approx(truth, abs=4 * (estimate.high - estimate.low) / 3.92)
    assert reduced.sparsity.score_difference < 0
    assert reduced.sparsity.p_value > 0.01


def test_the_norm_of_the_paper_leaves_the_terms_of_a_planted_law(reduced):
    """Where terms come back until BIC is not above that of the sum, the planted one is among them."""
    fit = identify_sparse(COMBINED, reduced.histories, EXACT, penalty="l2", settings=QUICK)
    assert STRAIN in fit.sparsity.kept_terms
    assert fit.sparsity.score_difference <= 0
    assert fit.values["n_2"] == pytest.approx(3.5, abs=0.5)


def test_memory_that_is_not_there_is_switched_off():
    """Planted Norton creep ends as strain hardening, or time hardening, of exponent zero, if not as a sinh."""
    tests = planted(NORTON, {"A": 2e-13, "n": 3.5}, [Plan(760, 8, 10)], seed=6, frames=24)
    fit = identify_sparse(STRAIN_HARDENING + TIME_HARDENING, tests, EXACT, settings=QUICK)
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
    fit = identify_sparse(law, tests, EXACT, settings=exact)
    assert fit.sparsity.kept_terms == ("power law", "time hardening")
    assert fit.values["n_1"] == pytest.approx(6.5, abs=0.3)


def test_the_record_says_what_was_dropped_and_survives_a_file(reduced):
    told = reduced.sparsity
    assert "without 'hyperbolic sine' and 'time hardening' of 'combined' chi-square rises by" in told.verdict
    assert "'strain hardening' suffices" in told.verdict
    stored = json.loads(json.dumps(CODEC.to_json(told)))
    assert CODEC.from_json(Sparsity, stored) == told
