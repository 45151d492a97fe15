"""What a run keeps: one that goes on gives what an uninterrupted one gives."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

import creepkit as ck
from helpers.study_runs import numbers

DRIFTING = """\
[data]
files = ["creep_tests.xlsx"]
[identification]
laws = ["strain-hardening", "time-hardening"]
starts = 1
[selection]
sums = false
further_laws = 0
[[export]]
target = "latex"
"""
EXAMPLE = Path(__file__).parents[3] / "examples" / "studies" / "spreadsheet_to_abaqus" / "creep_tests.xlsx"


@pytest.fixture(scope="module")
def drifting(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study that was carried out, of two laws between which an unmodelled drift of the furnace decides."""
    folder = tmp_path_factory.mktemp("drifting")
    shutil.copy(EXAMPLE, folder)
    path = folder / "study.toml"
    path.write_text(DRIFTING)
    ck.Study.load(path).run()
    return path


@pytest.mark.parametrize("lost", [0, 1, None])
def test_a_run_that_goes_on_gives_what_an_uninterrupted_one_gives(
    drifting: Path, tmp_path: Path, lost: int | None
) -> None:
    """Also what rests on parts of an identification that its own file leaves out."""
    whole = ck.Study.load(drifting).run()
    kinds = [one.kind for one in whole.rankings[""].challenges]
    assert "unmodelled effect" in kinds
    shutil.copytree(drifting.parent, tmp_path / "copy")
    results = tmp_path / "copy" / "study.results"
    (results / "identification.json").unlink()
    fits = sorted((results / "fits").glob("*.json"))
    assert len(fits) == 2
    if lost is not None:
        fits[lost].unlink()
    again = ck.Study.load(tmp_path / "copy" / "study.toml").run()
    assert numbers(again) == numbers(whole)
    assert again.rankings[""].challenges == whole.rankings[""].challenges
    assert [one.text for one in again.exports] == [one.text for one in whole.exports]
