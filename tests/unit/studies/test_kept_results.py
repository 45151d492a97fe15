"""What a run keeps: one that goes on gives what an uninterrupted one gives; altered results are made again."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import creepkit as ck
from creepkit.errors import StudyError
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


def copy_of(study: Path, folder: Path) -> Path:
    shutil.copytree(study.parent, folder / "copy")
    return folder / "copy" / study.name


@pytest.mark.parametrize("lost", [0, 1, None])
def test_a_run_that_goes_on_gives_what_an_uninterrupted_one_gives(
    drifting: Path, tmp_path: Path, lost: int | None
) -> None:
    """Also what rests on parts of an identification that its own file leaves out."""
    whole = ck.Study.load(drifting).run()
    kinds = [one.kind for one in whole.rankings[""].challenges]
    assert "unmodelled effect" in kinds
    study = copy_of(drifting, tmp_path)
    results = study.parent / "study.results"
    (results / "identification.json").unlink()
    fits = sorted((results / "fits").glob("*.json"))
    assert len(fits) == 2
    if lost is not None:
        fits[lost].unlink()
    again = ck.Study.load(study).run()
    assert numbers(again) == numbers(whole)
    assert again.rankings[""].challenges == whole.rankings[""].challenges
    assert [one.text for one in again.exports] == [one.text for one in whole.exports]


def forge(study: Path, pattern: str, change: Callable[[Any], object]) -> None:
    (path,) = (study.parent / "study.results").glob(pattern)
    content = json.loads(path.read_text())
    change(content["result"]["record"])
    path.write_text(json.dumps(content))


def halve(ranking: Any) -> None:
    for law in ranking["laws"]:
        law["weight"] = 0.5


@pytest.mark.parametrize(
    ("pattern", "change"),
    [("export-1-*.json", lambda record: record.update(text="\\input{stolen}")), ("identification.json", halve)],
)
def test_altered_results_are_made_again_and_a_locked_run_refuses_them(
    drifting: Path, tmp_path: Path, pattern: str, change: Callable[[Any], object]
) -> None:
    """Whether the list of what was written is there or not, and in a locked run only where something differs."""
    study = copy_of(drifting, tmp_path)
    text, lock = (study.parent / "law.tex").read_text(), (study.parent / "study.lock").read_bytes()
    assert ck.Study.load(study).run(locked=True).changes == ()
    forge(study, pattern, change)
    with pytest.raises(StudyError, match="is not what study.lock states; leave --locked out"):
        ck.Study.load(study).run(locked=True)
    again = ck.Study.load(study).run()
    (made,) = [one for one in again.stages if one.state == "made" and one.kind != "report"]
    assert "had been changed since it was written" in made.sentence
    assert (study.parent / "law.tex").read_text() == text
    assert (study.parent / "study.lock").read_bytes() == lock
    assert ck.Study.load(study).run(locked=True).changes == ()
    (study.parent / "study.results" / ".creepkit-written").unlink()
    assert {one.state for one in ck.Study.load(study).run(locked=True).stages} == {"kept"}
    forge(study, pattern, change)
    with pytest.raises(StudyError, match="is not what study.lock states"):
        ck.Study.load(study).run(locked=True)


def test_a_changed_result_makes_again_what_was_made_from_it(drifting: Path, tmp_path: Path) -> None:
    """Though the settings of both are the same; and the lock says whose text is another one."""
    from creepkit.studies.documents import ResultFolder

    study = copy_of(drifting, tmp_path)
    results = ResultFolder(study.parent / "study.results")
    path = results.path("identification")
    content = json.loads(path.read_text())
    halve(content["result"]["record"])
    results.save("identification", content["key"].partition(" ")[0], content["result"])  # as another computer would
    (study.parent / "study.lock").unlink()
    again = ck.Study.load(study).run()
    assert {one.name: one.state for one in again.stages} == {
        "quality": "kept",
        "identification": "kept",
        "export 1: latex": "made",
    }
    lock = study.parent / "study.lock"
    content = json.loads(lock.read_text())
    content["stages"]["export 1: latex"]["sha256"] = "0"
    lock.write_text(json.dumps(content))
    assert ck.Study.load(study).run().changes == (
        "result of export 1: latex: its text is another one than the lock states",
    )


def test_an_altered_fit_is_made_again(drifting: Path, tmp_path: Path) -> None:
    study = copy_of(drifting, tmp_path)
    results = study.parent / "study.results"
    fit = min((results / "fits").glob("*.json"))
    fit.write_text(fit.read_text() + " ")
    (results / "identification.json").unlink()
    again = ck.Study.load(study).run()
    (made,) = [one for one in again.stages if one.state == "made"]
    assert "had been changed since it was written" in made.sentence


def test_identified_files_are_not_written_through_links_and_foreign_ones_stay(drifting: Path, tmp_path: Path) -> None:
    study = copy_of(drifting, tmp_path)
    identified, elsewhere = study.parent / "study.results" / "identified", tmp_path / "elsewhere"
    (identified / "mine.json").write_text("{}")
    (identified / "strain-hardening_arrhenius-2.json").symlink_to(study)
    ck.Study.load(study).run()
    assert (identified / "mine.json").read_text() == "{}"
    identified.rename(elsewhere)
    os.symlink(elsewhere, identified)
    with pytest.raises(StudyError, match="is a link"):
        ck.Study.load(study).run()
    assert (elsewhere / "mine.json").exists()
