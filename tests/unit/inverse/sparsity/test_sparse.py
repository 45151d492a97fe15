"""A sum reduced to the terms that planted bulge tests need: single laws and two-term laws."""

import json
from dataclasses import replace

import pytest

from creepkit.inverse.identification_document import CODEC
from creepkit.inverse.search.particle_swarm import ParticleSwarm
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.sparsity.penalties import L2, PenalisedTerms, Subsets
from creepkit.inverse.sparsity.reduced_laws import terms_above
from creepkit.inverse.sparsity.result import Sparsity
from creepkit.inverse.sparsity.term_selection import (
    TermChoice,
    choose_terms,
    confirmed_law,
    identify_full,
    identify_reduced,
    identify_sparse,
)
from creepkit.laws.combined import COMBINED
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.laws.time_hardening import TIME_HARDENING
from helpers.reduced_bulge_predictor import OneDegree, Plan, planted

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


def test_a_swarm_searches_the_penalised_landscape(hardening):
    """Its cost at the optimum is what least squares has there, penalty included."""
    _, reductions = hardening
    stage = reductions.problem
    penalised = PenalisedTerms.from_problem(stage.problem, L2())
    searched, u = stage.search_problem(penalised), stage.start[: stage.parameter_count]
    wanted = 0.5 * stage.problem.chi_square(stage.start) + penalised.values(u[None])[0]
    assert searched.cost(u[None])[0] == pytest.approx(wanted, rel=1e-9)
    choice = choose_terms(reductions, L2(), ParticleSwarm(particles=8, iterations=2, refined_candidates=1))
    assert STRAIN in choice.kept_terms
    assert len(choice.trace) == 2


def test_squared_l2_shares_the_rate_out(hardening):
    """What one term gives alone is given by several: the penalty is smallest at equal shares."""
    stage = hardening[1].problem
    x = stage.minimise(stage.start, PenalisedTerms.from_problem(stage.problem, L2(240.0))).x
    contributions = stage.contributions_at(x)
    assert max(contributions.values()) < max(stage.contributions_at(stage.start).values())
    assert len(terms_above(contributions)) > 1


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


def test_the_largest_term_stays_whatever_the_least_share():
    assert terms_above({"a": 0.6, "b": 0.04}) == ("a",)
    assert terms_above({"a": 0.03, "b": 0.04}) == ("b",)


def test_the_record_says_what_was_dropped_and_survives_a_file(reduced):
    told = reduced.sparsity
    assert "without 'hyperbolic sine' and 'time hardening' of 'combined' chi-square rises by" in told.verdict
    assert "'strain hardening' suffices" in told.verdict
    stored = json.loads(json.dumps(CODEC.to_json(told)))
    assert CODEC.from_json(Sparsity, stored) == told
    back = replace(told, proposed_terms=())
    assert "The penalty had dropped 'strain hardening' too" in back.verdict
