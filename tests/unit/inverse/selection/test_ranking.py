"""Verdicts: one sentence for each case, and decisive only where everything that decisiveness needs is there."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import creepkit as ck
from creepkit.inverse.adequacy import Adequacy, LargestDeviation, OutputAdequacy
from creepkit.inverse.identify import identify
from creepkit.inverse.selection.perturbation_trials import Challenge
from creepkit.inverse.selection.ranking import RankedLaw, Ranking, challenged, rank, ranking_from_scores, verdict_of
from creepkit.inverse.settings import IdentificationSettings
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.norton import NORTON
from helpers.steady_rate_predictor import Steady, planted

NAN = float("nan")
STRAIN = OutputAdequacy("strain", 120, 2e-5, "stated", 1.02, 0.4, 0.0)
EXPLAINS = Adequacy("explains", (STRAIN,), 1.02, 117.0, 0.4, NAN, None)
LEAVES = Adequacy(
    "leaves a discrepancy", (replace(STRAIN, chi_square=5.0, p_value=1e-20, discrepancy=4e-5),), 5.0, 117.0, 1e-20, 0.3,
    LargestDeviation("bar 1", "strain", 5400.0, 4e-5, 2.0),
)  # fmt: skip
UNKNOWN = Adequacy("cannot be judged", (), NAN, 0.0, NAN, NAN, None)
SUM = Challenge("sum", "norton+sinh", "norton+sinh with 30 % of the rate from sinh explains them as well")
DRIFT = Challenge("unmodelled effect", "temperature drift", "a temperature drift would leave it a weight of 0.52")


def fit(name, adequacy=EXPLAINS, **more):
    values = {"predictor": None, "histories": (), **more}
    return SimpleNamespace(law=SimpleNamespace(name=name), adequacy=adequacy, **values)


def ranking(weights, adequacies=None, names=("norton", "sinh", "theta"), **more):
    adequacies = adequacies or [EXPLAINS] * len(weights)
    laws = [
        RankedLaw(fit(name, adequacy), 0.0, weight)
        for name, adequacy, weight in zip(names, adequacies, weights, strict=False)
    ]
    return Ranking(tuple(laws), **{"challenges": (), **more})


def test_decisive_is_a_law_that_was_asked_for_explains_has_the_weight_and_stands_every_challenge():
    best = ranking([0.97, 0.02, 0.01])
    assert best.decisive
    assert best.verdict == f"decisive: norton, of 3 laws tried; it {EXPLAINS}"


def test_with_any_part_missing_it_is_not_decisive():
    short = {
        "weight": ranking([0.95, 0.04, 0.01]),
        "adequacy": ranking([0.97, 0.02, 0.01], [LEAVES, EXPLAINS, EXPLAINS]),
        "no noise": ranking([0.97, 0.02, 0.01], [UNKNOWN] * 3),
        "no adequacy": ranking([0.97, 0.02, 0.01], [None] * 3),
        "not asked for": ranking([0.97, 0.02, 0.01], further=("norton",)),
        "unexamined": ranking([0.97, 0.02, 0.01], challenges=None),
        "challenge": ranking([0.97, 0.02, 0.01], challenges=(DRIFT,)),
        "alone": ranking([1.0]),
    }
    assert [why for why, one in short.items() if one.decisive or one.verdict.startswith("decisive")] == []


def test_singled_out_needs_adequacy_and_weight_but_no_challenge():
    assert ranking([0.97, 0.03], challenges=None).singled_out
    assert ranking([0.97, 0.03], further=("norton",)).singled_out
    assert not ranking([0.9, 0.1]).singled_out
    assert not ranking([0.97, 0.03], [LEAVES, EXPLAINS]).singled_out
    assert not ranking([0.97, 0.03], [None, None]).singled_out


# ---- rankings ----------------------------------------------------------------------------------------------------


def test_scores_are_ordered_and_weighted():
    """exp(-excess / 2) over its sum."""
    fits = [fit(name) for name in ("norton", "sinh", "theta")]
    found = ranking_from_scores(fits, np.array([12.0, 10.0, 14.0]), "bic", independent_frames=40.0)
    assert [r.fit.law.name for r in found.laws] == ["sinh", "norton", "theta"]
    assert [r.excess for r in found.laws] == pytest.approx([0.0, 2.0, 4.0])
    weights = np.exp([0.0, -1.0, -2.0])
    assert [r.weight for r in found.laws] == pytest.approx(weights / weights.sum())
    assert found.challenges is None
    assert [r.fit.law.name for r in found.credible] == ["sinh", "norton", "theta"]


@pytest.mark.parametrize("score", [8.0, NAN], ids=["test not predicted", "misfit is no number"])
def test_a_law_that_does_not_predict_every_test_is_never_first(score):
    """Of readings that it does not predict a law has no misfit: its criterion is no smaller for them."""
    adequacy = EXPLAINS.with_unpredicted(("bar 1",) if score == score else ())
    fits = [fit("norton", adequacy), fit("sinh"), fit("theta")]
    found = ranking_from_scores(fits, np.array([score, 10.0, 12.0]), "bic", independent_frames=40.0)
    assert [r.fit.law.name for r in found.laws] == ["sinh", "theta", "norton"]
    assert [r.weight for r in found.laws] == pytest.approx([1 / (1 + np.exp(-1)), np.exp(-1) / (1 + np.exp(-1)), 0.0])
    alone = ranking_from_scores(fits[:1], np.array([score]), "bic", independent_frames=40.0)
    assert not alone.decisive


def test_what_is_not_predicted_has_no_positive_verdict():
    missing = EXPLAINS.with_unpredicted(("bar 1", "bar 2"))
    for more in ({"weights": [0.99, 0.01]}, {"weights": [0.6, 0.4]}, {"weights": [0.99, 0.01], "further": ("norton",)}):
        found = ranking(more.pop("weights"), [missing, missing], **more)
        assert not found.singled_out
        assert not found.decisive
        assert "not contradicted" not in found.verdict
        assert "it does not predict every reading of test 'bar 1' and 1 more" in found.verdict


def test_only_a_law_that_is_singled_out_and_can_be_predicted_is_challenged(monkeypatch):
    monkeypatch.setattr("creepkit.inverse.selection.challenges.challenges_of", lambda fits: (SUM,))
    trials = "creepkit.inverse.selection.perturbation_trials.explaining_effects"
    monkeypatch.setattr(trials, lambda fits, weights: ())
    at_hand = {"predictor": object(), "histories": (object(),)}
    whole = Ranking(tuple(RankedLaw(fit(n, **at_hand), 0.0, w) for n, w in (("norton", 0.99), ("sinh", 0.01))))
    assert challenged(whole).challenges == (SUM,)
    assert not challenged(whole).decisive
    from_file = Ranking(tuple(RankedLaw(fit(n), 0.0, w) for n, w in (("norton", 0.99), ("sinh", 0.01))))
    undecided = Ranking(tuple(RankedLaw(fit(n, **at_hand), 0.0, 0.5) for n in ("norton", "sinh")))
    alone = Ranking((RankedLaw(fit("norton", **at_hand), 0.0, 1.0),))
    for other in (from_file, undecided, alone):
        assert challenged(other) is other


def test_an_export_of_a_ranking_carries_its_verdict():
    """What is not decisive must not be read as proved where the law is used."""
    tests = planted(NORTON, {"A": 1e-15, "n": 4.0}, [(55.0, 1000.0), (65.0, 1000.0)], seed=0, noise=2e-4)
    settings = IdentificationSettings(starts=1, sobol_points=8, frames=20, weights="likelihood", nuisances=())
    found = rank([identify(law, tests, Steady(), settings=settings) for law in (NORTON, HYPERBOLIC_SINE)])
    assert not found.decisive
    for target, marker in (("latex", "%"), ("python", "#"), ("ansys", "")):
        text = " ".join(ck.export(found, target).replace(marker or "\0", " ").split())
        assert "not decisive; weights" in text
    assert "decisive; weights" not in ck.export(found.best, "latex")


THINNER = Challenge("unmodelled effect", "thickness", "with a thickness 4.8 % smaller sinh would explain them")
NONE = "not decisive: none of {} laws tried explains the tests"
APART = "not decisive: of 3 laws tried these tests cannot tell apart norton and sinh"
SENTENCES = [
    (
        ranking([1.0, 0.0, 0.0], [LEAVES] * 3),
        f"{NONE.format(3)}; the best, norton (weight 1.00 of the laws tried), leaves 4e-05 of strain (2 times its "
        "stated noise) unexplained",
        "most in strain of 'bar 1' about 1.5 h, where it lies 4e-05 above what was measured",
    ),
    (
        ranking([0.6, 0.35, 0.05], [LEAVES] * 3),
        "norton (weight 0.60 of the laws tried, not told apart from sinh), leaves",
    ),
    # of the best law an effect stands in its adequacy; of another one it is said beside it
    (
        ranking([1.0, 0.0], [replace(LEAVES, remedies=("thickness",)), LEAVES]),
        "it would explain them with thickness, which nobody modelled",
    ),
    (
        ranking([1.0, 0.0], [LEAVES, replace(LEAVES, remedies=("thickness", "temperature drift"))]),
        "; with thickness or temperature drift, which nobody modelled, sinh would explain them)",
    ),
    (
        ranking([0.99, 0.01], [LEAVES, LEAVES], challenges=(THINNER,)),
        f"{NONE.format(2)} as they are stated; {THINNER}; the best, norton (weight 0.99 of the laws tried), leaves",
    ),
    (ranking([0.5, 0.45, 0.05], challenges=(THINNER,)), f"{APART}; {THINNER}; the best is norton: it {EXPLAINS}"),
    (ranking([0.5, 0.45, 0.05]), f"{APART}; the best is norton: it {EXPLAINS}"),
    (
        ranking([0.99, 0.01, 0.0], [EXPLAINS, LEAVES, LEAVES], further=("norton", "theta")),
        "not decisive: the law asked for does not explain the tests; of 2 more that were tried, norton is not "
        "contradicted by them (weight 0.99 of the laws tried): plan tests that can refute it",
    ),
    (
        ranking([0.99, 0.01, 0.0], [EXPLAINS, LEAVES, LEAVES], further=("norton",)),
        "not decisive: none of the 2 laws asked for explains the tests; of 1 more",
    ),
    (
        ranking([0.99, 0.01], challenges=(SUM, DRIFT)),
        "not decisive: of 2 laws tried norton has nearly all the weight (weight 0.99 of the laws tried) and is not "
        f"contradicted by the tests; but {SUM}; and {DRIFT}",
    ),
    (
        ranking([0.99, 0.01], [UNKNOWN, UNKNOWN]),
        "not decisive: of 2 laws tried norton is best (weight 0.99 of the laws tried); it cannot be judged: no noise",
    ),
]


def test_verdicts_name_the_best_law_what_it_leaves_and_what_else_the_tests_allow():
    said = [(verdict_of(one), words) for one, *several in SENTENCES for words in several]
    assert [(verdict, words) for verdict, words in said if words not in verdict] == []
