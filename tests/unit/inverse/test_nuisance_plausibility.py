"""Nuisances of implausible size: a planted jump of an output and a planted temperature weaken what is said of a law."""

import pytest

from creepkit.inverse.identify import identify
from creepkit.inverse.selection.ranking import rank
from creepkit.inverse.settings import IdentificationSettings
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.records import Nuisance
from creepkit.reports.ranking import ranking_text
from helpers.steady_rate_predictor import planted
from helpers.two_outputs_predictor import TwoOutputs, with_two_outputs

NOISE = {"amplitude": 2e-3, "width": 2e-2}


def fitted(jump, *nuisances, law=NORTON):
    """One law on three tests, of which the second has jumped by so many mm of amplitude at the start."""
    bars = planted(NORTON, {"A": 1e-15, "n": 4.0}, [(s, 1000.0) for s in (50.0, 70.0, 100.0)], seed=0, frames=40)
    tests = with_two_outputs(bars, NOISE, seed=1)
    moved = {**tests[1].outputs, "amplitude": tests[1].outputs["amplitude"] + jump}
    tests[1] = tests[1].replace(outputs=moved)
    settings = IdentificationSettings(
        starts=1, sobol_points=8, frames=60, weights="likelihood", nuisances=nuisances or (Nuisance("offset"),)
    )
    return identify(law, tests, TwoOutputs(), settings=settings), tests[1]


def test_a_law_that_needs_a_large_offset_explains_only_with_it():
    fit, test = fitted(0.3)
    share = 0.3 / test.outputs["amplitude"].max()
    assert share > 0.1  # else nothing is planted
    adequacy = fit.adequacy
    assert adequacy.explains
    assert not adequacy.explains_plausibly
    (named,) = adequacy.implausible
    assert (named.kind, named.owner, named.output, named.unit) == ("offset", test.name, "amplitude", "mm")
    assert named.value == pytest.approx(0.3, rel=0.03)
    assert named.standard_deviations == pytest.approx(0.3 / 2e-3, rel=0.03)
    assert named.share == pytest.approx(share, rel=0.03)
    assert f"only with an offset of 0.3 mm in amplitude of '{test.name}', {100 * share:.2g} %" in str(adequacy)
    (note,) = (n for n in fit.notes if "offset of amplitude" in n and "the noise of a frame (0.002 mm)" in n)
    assert f"{named.standard_deviations:.2g} times" in note


@pytest.mark.parametrize("jump", [0.0, 0.008])
def test_a_small_offset_is_not_named(jump):
    adequacy = fitted(jump)[0].adequacy
    assert adequacy.explains_plausibly
    assert "only with" not in str(adequacy)


def test_a_stated_prior_decides_what_is_plausible():
    wide = fitted(0.3, Nuisance("offset", output="amplitude", sd=0.2))[0].adequacy
    assert wide.explains_plausibly
    narrow = fitted(0.3, Nuisance("offset", output="amplitude", sd=0.02))[0].adequacy
    assert narrow.implausible[0].size_source == "stated"
    assert narrow.implausible[0].standard_deviations == pytest.approx(15.0, rel=0.1)


def test_no_answer_is_decisive_with_such_an_offset():
    ranking = rank([fitted(0.3)[0], fitted(0.3, law=STRAIN_HARDENING)[0]])
    assert not ranking.decisive
    assert "only with an offset of 0.3 mm" in ranking.verdict
    assert "only with a large offset" in ranking_text(ranking)
