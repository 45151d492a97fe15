"""What intervals rest on stands beside them, the same in the text of an identification and in a report."""

from dataclasses import replace

import numpy as np
import pytest

import creepkit as ck
from creepkit.reports.contents import ReportGroup
from creepkit.reports.html.elements import Paragraph, sentence
from creepkit.reports.html.findings import findings_of, verdict_blocks
from creepkit.reports.interval_basis import interval_basis
from helpers.rupture_tests import BAR


@pytest.fixture(scope="module")
def tests_under_load():
    times, rng = np.geomspace(3.6e3, 3.6e5, 20), np.random.default_rng(3)
    values = {"A": 1e-18, "n": 5.0}
    found = [
        ck.simulate("norton", "uniaxial", values, times=times, loading=load, temperature=1073.15)
        for load in (ck.constant_stress(s, "load") for s in (80.0, 100.0, 120.0))
    ]
    return [
        replace(h, name=f"bar {k}", outputs={"strain": h.outputs["strain"] + rng.normal(0.0, 2e-6, 20)})
        for k, h in enumerate(found)
    ]


@pytest.mark.parametrize("weights", ["noise", "likelihood"])
def test_texts_and_findings_say_which_weights_an_interval_rests_on_and_that_the_form_of_the_law_bears_it(
    tests_under_load, weights
):
    fit = ck.identify("norton", tests_under_load, using=BAR, starts=1, weights=weights)
    lines = interval_basis(fit)
    assert f'(weights "{weights}")' in lines[0]
    assert len(lines) == 2
    assert "its interval holds only if the form of the law is right" in lines[1]
    assert all(line in str(fit) for line in lines)
    found = findings_of(ReportGroup("", fit))
    paragraphs = [str(one.text) for one in verdict_blocks(found) if isinstance(one, Paragraph)]
    assert all(sentence(line) in paragraphs for line in lines)


def test_of_constant_true_stress_nothing_is_said_of_the_curvature(tests_under_load):
    under_stress = [replace(h, loading=ck.constant_stress(100.0, "stress")) for h in tests_under_load[:2]]
    fit = ck.identify("norton", under_stress, using=BAR, starts=1)
    assert len(interval_basis(fit)) == 1
