"""The folder of `creepkit identify` holds one run: a later one replaces it."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.cli.identified_folder import check_identified_folder, write_ranking
from creepkit.errors import FitError
from creepkit.inverse.ranking_document import load_ranking
from creepkit.inverse.selection import rank
from helpers.rupture_tests import BAR


@pytest.fixture(scope="module")
def rankings():
    times, rng = np.geomspace(3.6e3, 3.6e5, 12), np.random.default_rng(3)
    tests = [
        ck.History(
            f"bar {s:g}", times, {"strain": 1e-18 * s**5 * times + rng.normal(0.0, 2e-6, 12)},
            ck.constant_stress(s, "stress"), 1073.15,
        )
        for s in (80.0, 100.0, 120.0)
    ]  # fmt: skip
    how = {"using": BAR, "starts": 1, "nuisances": [ck.Nuisance("rate", sd=0.1)]}
    norton, hardening = (ck.identify(name, tests, **how) for name in ("norton", "strain-hardening"))
    return rank([norton], challenge=False), rank([hardening], challenge=False)


def _names(folder):
    return sorted(path.name for path in folder.iterdir() if not path.name.startswith("."))


def _run(ranking, folder):
    check_identified_folder(folder, [one.fit.law for one in ranking.laws])
    return write_ranking(ranking, folder)


def test_a_later_run_leaves_nothing_of_the_former_one_and_what_is_not_its(rankings, tmp_path):
    _run(rankings[0], tmp_path)
    (tmp_path / "notes.txt").write_text("mine")
    ck.export(rankings[0].best, "c", to=tmp_path / "norton.c")  # of creepkit, and of another command
    written = _run(rankings[1], tmp_path)
    assert _names(tmp_path) == sorted([*(path.name for path in written), "notes.txt", "norton.c"])
    assert [fit.law.name for fit in load_ranking(tmp_path / "ranking.json").fits] == ["strain-hardening"]


def test_a_changed_file_of_the_former_run_is_neither_removed_nor_mixed_with_another_run(rankings, tmp_path):
    _run(rankings[0], tmp_path)
    (tmp_path / "norton.tex").write_text("edited by hand")
    before = _names(tmp_path)
    with pytest.raises(FitError, match=r"norton\.tex: .*creepkit did not write it as it is now"):
        _run(rankings[1], tmp_path)
    assert _names(tmp_path) == before
    assert (tmp_path / "norton.tex").read_text() == "edited by hand"


def test_a_ranking_refuses_a_file_that_another_run_has_written_under_the_same_name(rankings, tmp_path):
    _run(rankings[0], tmp_path)
    rankings[1].best.save(tmp_path / "norton.json")
    with pytest.raises(FitError, match=r"norton\.json is not the file that this ranking was made with"):
        load_ranking(tmp_path / "ranking.json")
