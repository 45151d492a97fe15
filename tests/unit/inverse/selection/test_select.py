"""select: planted laws are chosen, sums when they are needed, and one failure does not take the others down."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import sympy

import creepkit as ck
from creepkit.errors import FitError
from creepkit.inverse.adequacy import Adequacy
from creepkit.inverse.selection import rank
from creepkit.inverse.selection.select import _richer_laws, sums_of_two
from creepkit.language import Param, arrhenius, strain, temperature, time
from creepkit.records import History, Program

TIMES = np.geomspace(600.0, 4e5, 40)
LAWS = ("norton", "strain-hardening", "time-hardening", "hyperbolic-sine")
NOISE = 2e-4
SAID: list[tuple[str, int, int]] = []
"""Progress of the ranking."""


def measured(law, values, stresses=(60.0, 85.0, 120.0), seed=0):
    rng, bar = np.random.default_rng(seed), ck.specimen("uniaxial")
    found = []
    for stress in stresses:
        run = ck.simulate(law, bar, values, loading=ck.constant_stress(stress), times=TIMES)
        strain = run.outputs["strain"] + NOISE * rng.standard_normal(TIMES.size)
        found.append(
            History(name=f"{stress:g} MPa", times=TIMES, outputs={"strain": strain}, loading=run.loading,
                    temperature=Program.constant(293.15), standard_deviation={"strain": np.full(TIMES.size, NOISE)})
        )  # fmt: skip
    return found


@pytest.fixture(scope="module")
def ranking():
    tests = measured("strain-hardening", {"A": 5e-16, "n": 4.0, "m": -0.4})
    return ck.select(LAWS, tests, "uniaxial", nuisances=[], starts=4, progress=lambda *one: SAID.append(one))


def test_the_planted_law_is_singled_out_and_what_constant_loads_allow_beside_it_is_named(ranking):
    """Under one constant stress hardening by strain and by time are one curve: a sum of both cannot be excluded."""
    assert ranking.best.law.name == "strain-hardening"
    assert ranking.singled_out
    assert not ranking.decisive
    assert "its sum with time-hardening, tried with 30 % of the rate carried by it," in ranking.verdict
    assert ranking.laws[0].chi_square == pytest.approx(120 - 3, abs=3 * np.sqrt(2 * 120))


def test_its_values_lie_within_three_standard_errors(ranking):
    table = ranking.best.law.table
    for e, true in zip(ranking.best.estimates, (5e-16, 4.0, -0.4), strict=True):
        value, low, high = (table[e.name].to_internal(v) for v in (e.value, e.low, e.high))
        assert table[e.name].to_internal(true) == pytest.approx(value, abs=1.5 * 0.5 * (high - low))


def test_the_criteria_are_their_formulas(ranking):
    """BIC and AICc of the same chi-squares, by hand."""
    chi2 = np.array([r.chi_square for r in ranking.laws])
    count = np.array([len(r.fit.u) for r in ranking.laws])
    bic = chi2 + count * np.log(ranking.independent_frames)
    assert [r.excess for r in ranking.laws] == pytest.approx(bic - bic[0], abs=1e-6)
    weights = np.exp(-0.5 * (bic - bic.min()))
    assert [r.weight for r in ranking.laws] == pytest.approx(weights / weights.sum(), rel=1e-9)
    fits = [r.fit for r in ranking.laws]
    n = ranking.independent_frames
    aicc = chi2 + 2 * count + 2 * count * (count + 1) / (n - count - 1)
    assert [r.excess for r in rank(fits, "aicc").laws] == pytest.approx(np.sort(aicc - aicc.min()), abs=1e-6)


def test_a_law_and_its_special_case_are_not_told_apart():
    ranking = ck.select(
        LAWS[:2], measured("norton", {"A": 1e-16, "n": 4.2}, seed=2), "uniaxial", nuisances=[], starts=3
    )
    assert ranking.best.law.name == "norton"
    assert ranking.laws[1].chi_square == pytest.approx(ranking.laws[0].chi_square, abs=6.0)
    assert "strain-hardening" in str(ranking)


def test_hold_out_and_sums_are_asked_for_by_name():
    values = {"A_1": 2e-17, "n_1": 4.5, "A_2": 1e-16, "n_2": 4.0, "m": -0.5}
    law = ck.law("norton") + ck.law("strain-hardening")
    tests = measured(law, values)
    ranking = ck.select(LAWS[:2], tests, "uniaxial", nuisances=[], starts=3, sums=True)
    assert ranking.best.law.fingerprint == law.fingerprint
    held = ck.select(LAWS[:2], tests, "uniaxial", nuisances=[], starts=3, by="hold-out")
    assert held.best.law.name == "strain-hardening"


def test_single_terms_of_the_combined_law_with_exponents_in_or_out_hold_the_laws_of_table_1():
    law = ck.law("combined")
    single = [law.only(term) for term in law.terms]
    off = [one.fix(**{name: 0.0}) for one in single for name, p in one.table.items() if p.scale != "log" and p.off == 0]
    assert {form(ck.law(name)) for name in LAWS} <= {form(one) for one in (*single, *off)}


def form(law):
    """The rate with its parameters renamed in the law's order."""
    names = {symbol: f"p{k}" for k, symbol in enumerate(law.params)}
    return sum(law.terms.values()).subs(names)


def test_sums_leave_out_what_is_there_already():
    laws = [ck.law("norton"), ck.law("norton"), ck.law("strain-hardening")]
    assert [law.fingerprint for law in sums_of_two(laws)] == [(laws[0] + laws[2]).fingerprint]


def test_a_law_that_cannot_be_identified_is_named_and_the_others_go_on():
    hopeless = replace(ck.law("norton").with_bounds(A=(1e-40, 1e-30), n=(1, 5)), name="hopeless")
    tests = measured("norton", {"A": 1e-16, "n": 4.2})
    ranking = ck.select(["norton", hopeless], tests, "uniaxial", nuisances=[], starts=3)
    assert [r.fit.law.name for r in ranking.laws] == ["norton"]
    assert "bounds exclude the data" in ranking.failed["hopeless"]
    assert "hopeless: law 'hopeless': the bounds exclude" in str(ranking)
    with pytest.raises(FitError, match="none of the 1 laws could be identified; hopeless: "):
        ck.select([hopeless], tests, "uniaxial", nuisances=[], starts=3)
    with pytest.raises(FitError, match="there are no candidate laws"):
        ck.select([], tests, "uniaxial")


# ---- where no candidate explains the tests -------------------------------------------------------------------------

NAN = float("nan")
LEAVES = Adequacy("leaves a discrepancy", (), 5.0, 100.0, 1e-9, NAN, None)


def tried(*adequacies, laws=("norton", "hyperbolic-sine")):
    """A ranking of stand-ins: laws, best first, with what is known of their adequacy."""
    ranked = [
        SimpleNamespace(fit=SimpleNamespace(law=ck.law(name) if isinstance(name, str) else name, adequacy=adequacy))
        for name, adequacy in zip(laws, adequacies, strict=True)
    ]
    return SimpleNamespace(laws=ranked)


@pytest.mark.parametrize(
    "adequacies",
    [
        (LEAVES, replace(LEAVES, verdict="explains")),
        (replace(LEAVES, verdict="cannot be judged"), LEAVES),
        (None, LEAVES),
        (LEAVES, replace(LEAVES, remedies=("thickness",))),
    ],
    ids=["one explains", "one cannot be judged", "unknown", "an effect would explain"],
)
def test_nothing_further_is_tried_without_need(adequacies):
    assert _richer_laws(tried(*adequacies), []) == []


def test_sums_with_the_best_come_first_then_laws_with_a_memory_that_none_of_the_tried_has():
    richer = _richer_laws(tried(LEAVES, LEAVES), [])
    assert richer[0].fingerprint == (ck.law("norton") + ck.law("hyperbolic-sine")).fingerprint
    prints = [law.fingerprint for law in richer]
    assert len(set(prints)) == len(prints)
    assert not {ck.law(name).fingerprint for name in ("norton", "hyperbolic-sine")} & set(prints)
    has_memory = [bool(law.uses(strain) or law.uses(time) or law.states) for law in richer[1:]]
    assert has_memory == sorted(has_memory, reverse=True)
    assert has_memory[0]
    assert not has_memory[-1]
    assert not any(law.uses(temperature) for law in richer)
    remembering = [len(law.params) for law in richer[1 : 1 + sum(has_memory)]]
    assert remembering == sorted(remembering)


def test_with_temperatures_all_of_them_have_one():
    laws = [ck.law(name).times(arrhenius(T_ref=1000.0)) for name in ("norton", "strain-hardening")]
    plain = measured("norton", {"A": 1e-16, "n": 4.2})
    tests = [h.replace(temperature=T) for h, T in zip(plain, (950.0, 1000.0, 1050.0), strict=True)]
    assert all(law.uses(temperature) for law in _richer_laws(tried(LEAVES, LEAVES, laws=laws), tests))


def softening():
    """Norton's law that is three times as fast at a strain of 4 %: none of the built-in laws of one term."""
    k = sympy.Symbol("k", real=True)
    terms = {label: term * (1 + k * strain) for label, term in ck.law("norton").terms.items()}
    params = {**ck.law("norton").params, k: Param("softening", bounds=(0.0, 200.0))}
    return replace(ck.law("norton"), name="softening", terms=terms, params=params)


@pytest.mark.parametrize("seed", range(3))
def test_a_truth_outside_the_set_is_flagged_and_never_decisive(seed):
    tests = measured(softening(), {"A": 6e-17, "n": 4.2, "k": 50.0}, seed=seed)
    ranking = ck.select(LAWS, tests, "uniaxial", nuisances=[], starts=1, sobol_points=8, frames=24, further_laws=0)
    assert not ranking.decisive
    assert ranking.further == ()
    assert ranking.adequacy.verdict == "leaves a discrepancy"
    assert ranking.verdict.startswith("not decisive: none of 4 laws tried explains the tests; the best, ")


def test_further_laws_are_tried_within_their_budget_and_are_proposals():
    tests = measured(softening(), {"A": 6e-17, "n": 4.2, "k": 50.0})
    ranking = ck.select(LAWS[:2], tests, "uniaxial", nuisances=[], starts=1, sobol_points=8, frames=24, further_laws=2)
    assert 1 <= len(ranking.further) <= 2
    assert len(ranking.laws) + len(ranking.failed) == 4
    assert ranking.further[0] == "mpc-omega", "rates that rise ask for a law with tertiary creep"
    assert not ranking.decisive
    single = ck.select(LAWS[:2], tests, "uniaxial", nuisances=[], starts=1, sobol_points=8, frames=24, sums=False)
    assert single.further == ()
    assert len(single.laws) == 2
