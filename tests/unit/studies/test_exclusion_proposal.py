"""A proposed study names what it will leave out of the tests."""

import numpy as np

import creepkit as ck
from creepkit.studies.proposal import propose_study


def test_frames_that_fall_are_named_with_their_test_in_the_summary_and_in_the_file(tmp_path):
    times, rng = np.geomspace(60.0, 3.6e5, 40), np.random.default_rng(1)
    for k, stress in enumerate((80.0, 100.0, 120.0)):
        strain = 1e-18 * stress**5 * times + rng.normal(0.0, 2e-6, 40)
        if k == 1:
            strain[30:] = strain[29] - 2e-4 + rng.normal(0.0, 2e-6, 10)
        history = ck.History(f"P{k}", times, {"strain": strain}, ck.constant_stress(stress), 1073.15)
        ck.write_history(history, tmp_path / f"P{k}.csv")
    proposal = propose_study(tmp_path, tmp_path / "study.toml")
    (line,) = (one for one in proposal.summary if one.startswith("left out of"))
    assert line.startswith("left out of P1: frames ")
    assert "falling" in line
    assert f"# {line}" in proposal.text.splitlines()
    flags = ck.check_data_quality(ck.read_histories([tmp_path]))
    assert all(flag.reason in line for flag in flags if flag.kind == "falling")
