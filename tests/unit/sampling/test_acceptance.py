"""The dry run: shares that an integral gives, and what the table and the figure say."""

from __future__ import annotations

import numpy as np

import creepkit as ck
from creepkit.sampling.domains import acceptance, sampling_design

DIMPLE = ck.specimen("bulge")


def test_what_criteria_1_and_2_reject_of_nortons_law():
    """log10 A uniform in -40 .. -5, n in 1 .. 8: the shares are integrals of a clipped line over n."""
    found = acceptance(sampling_design(ck.law("norton"), DIMPLE, "paper"), draws=4096, seed=1)
    n = np.linspace(1, 8, 100_001)
    first = np.clip((-5 - (-20 - n * np.log10(600))) / 35, 0, 1).mean()
    second = np.clip((-n * np.log10(50) + 40) / 35, 0, 1).mean()
    np.testing.assert_allclose(
        [found.criteria_met["1"].mean(), found.criteria_met["2"].mean()], [first, second], atol=2e-3
    )
    np.testing.assert_allclose(found.kept.mean(), first + second - 1, atol=4e-3)  # no law breaks both


def test_the_table_says_what_is_known_before_simulation():
    text = str(acceptance(sampling_design(ck.law("combined"), DIMPLE, "paper"), draws=1024, seed=1))
    lines = text.splitlines()
    assert lines[0] == "law 'combined', paper sampling domain, bulge test of 289 frames: 1024 draws, seed 1"
    assert [line.split()[0] for line in lines[2:7]] == ["1", "2", "3", "4", "5"]
    assert all("after simulation" in line for line in lines[4:7])
    assert "would be simulated" in lines[-1]


def test_few_laws_of_the_papers_box_are_useful_and_nearly_all_of_the_conditioned_one():
    law = ck.law("combined")
    assert acceptance(sampling_design(law, DIMPLE, "paper"), 1024).useful.mean() < 0.15
    assert acceptance(sampling_design(law, DIMPLE), 1024).useful.mean() > 0.99
