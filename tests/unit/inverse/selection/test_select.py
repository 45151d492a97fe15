"""select: planted laws are chosen, sums when they are needed, and one failure does not take the others down."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import FitError
from creepkit.inverse.selection import rank
from creepkit.inverse.selection.select import reductions, sums_of_two
from creepkit.records import History, Program

TIMES = np.geomspace(600.0, 4e5, 40)
LAWS = ("norton", "strain-hardening", "time-hardening", "hyperbolic-sine")
NOISE = 2e-4


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
    return ck.select(LAWS, tests, "uniaxial", nuisances=[], starts=4)


def test_the_planted_law_is_decisive(ranking):
    assert ranking.best.law.name == "strain-hardening"
    assert ranking.decisive
    assert ranking.verdict.startswith("decisive: strain-hardening, of 4 laws tried; it explains the tests to their ")
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


def test_reductions_of_the_combined_law_hold_those_of_table_1():
    found = {form(law) for law in reductions(ck.law("combined")) if len(law.terms) == 1}
    assert {form(ck.law(name)) for name in LAWS} <= found


def form(law):
    """The rate with its parameters renamed in the law's order."""
    names = {symbol: f"p{k}" for k, symbol in enumerate(law.params)}
    return sum(law.terms.values()).subs(names)


def test_sums_leave_out_what_is_there_already():
    laws = [ck.law("norton"), ck.law("norton"), ck.law("strain-hardening")]
    assert [law.fingerprint for law in sums_of_two(laws)] == [(laws[0] + laws[2]).fingerprint]


def test_a_law_that_cannot_be_identified_is_named_and_the_others_go_on():
    from dataclasses import replace

    norton = ck.law("norton")
    A, n = norton.params
    narrow = {A: replace(norton.params[A], bounds=(1e-40, 1e-30)), n: replace(norton.params[n], bounds=(1, 5))}
    hopeless = replace(norton, name="hopeless", params=narrow)
    tests = measured("norton", {"A": 1e-16, "n": 4.2})
    ranking = ck.select(["norton", hopeless], tests, "uniaxial", nuisances=[], starts=3)
    assert [r.fit.law.name for r in ranking.laws] == ["norton"]
    assert "bounds exclude the data" in ranking.failed["hopeless"]
    assert "hopeless: law 'hopeless': the bounds exclude" in str(ranking)
    with pytest.raises(FitError, match="none of the 1 laws could be identified; hopeless: "):
        ck.select([hopeless], tests, "uniaxial", nuisances=[], starts=3)
    with pytest.raises(FitError, match="there are no candidate laws"):
        ck.select([], tests, "uniaxial")
