"""Runs of studies: only what changed runs again, whatever kills a process; stages that fail."""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import creepkit as ck
from creepkit.errors import StudyError
from creepkit.files.writing import write_text
from creepkit.reports.html.page import report_html
from creepkit.reports.verdicts import challenge_text
from helpers.study_runs import ONE_FIT, STUDY, made, numbers, study_in


def test_only_what_changed_runs_again(study: Path) -> None:
    groups = {
        f"{one} of {group}{rest}" for one, rest in (("identification", ""), ("export 1", ": python")) for group in "AB"
    }
    everything = {"quality", "forecast of next", *groups}
    first = ck.Study.load(study).run()
    assert made(first) == everything
    assert "A: strain at 50\xa0h, " in report_html(first.report_contents()).partition('id="materials"')[0]
    assert made(ck.Study.load(study).run()) == set()

    one = study.parent / "data" / "planted_850C_70MPa.csv"
    one.write_text(one.read_text().replace(",", ", "))  # another file, the same data
    assert made(ck.Study.load(study).run()) == set()

    lines = one.read_text().splitlines()
    one.write_text("\n".join(lines[:-1]) + "\n")  # without the last frame
    assert made(ck.Study.load(study).run()) == {"quality", "identification of B", "export 1 of B: python"}

    study.write_text(STUDY.replace("end_h = 50", "end_h = 60"))
    assert made(ck.Study.load(study).run()) == {"forecast of next"}

    study.write_text(STUDY.replace("end_h = 50", "end_h = 60").replace('"python"', '"latex"'))
    assert made(ck.Study.load(study).run()) == {"export 1 of A: latex", "export 1 of B: latex"}

    study.write_text(STUDY.replace("frames = 12", "frames = 11"))
    assert made(ck.Study.load(study).run()) == everything - {"quality"}
    assert made(ck.Study.load(study).run(only="quality", again=True)) == {"quality"}


def test_a_study_searches_laws_beside_its_candidates(study: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def searched(tests: Any, using: Any, *, settings: Any, progress: Any, **options: Any) -> Any:
        assert options == {"budget": 7.0}
        return SimpleNamespace(ranking=ck.rank([ck.identify("norton", tests, using, settings=settings)]))

    monkeypatch.setattr(ck, "search_laws", searched)
    study.write_text(
        ONE_FIT.replace('"norton"', '"hyperbolic-sine"')
        + "[selection]\nsums = false\nfurther_laws = 0\n[law_search]\nbudget_s = 7\n"
    )
    (ranking,) = ck.Study.load(study).run().rankings.values()
    assert {ranked.fit.law.name for ranked in ranking.laws} == {"norton", "hyperbolic-sine"}


def test_other_code_of_the_package_makes_results_again(study: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also under the same version, as in a checkout that somebody works on."""
    from creepkit.inverse import kept_fits
    from creepkit.studies import kept_results

    study.write_text(ONE_FIT)
    name = "identification"
    assert name in made(ck.Study.load(study).run())
    for module in (kept_fits, kept_results):
        monkeypatch.setattr(module, "code_fingerprint", lambda: "other code")
    assert name in made(ck.Study.load(study).run())
    assert made(ck.Study.load(study).run()) == set()


def test_a_result_of_another_stage_is_made_again(study: Path) -> None:
    ck.Study.load(study).run(only="quality")
    (path,) = [
        one for one in (study.parent / "study.results").glob("*.json") if '"stage": "quality"' in one.read_text()
    ]
    path.write_text(path.read_text().replace('"stage": "quality"', '"sage": "quality"'))
    assert "quality" in made(ck.Study.load(study).run(only="quality"))


def test_a_result_that_cannot_be_stored_says_so(study: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from creepkit.files.record_codec import RecordError
    from creepkit.studies.kept_results import ResultFolder

    def refuses(self: Any, stage: str, key: str, result: Any) -> None:
        raise RecordError("a record of a plugin")

    monkeypatch.setattr(ResultFolder, "save", refuses)
    (record,) = [one for one in ck.Study.load(study).run(only="quality").stages if one.name == "quality"]
    assert record.sentence == "is made again in each run, for it cannot be stored: a record of a plugin"


def test_identifications_are_written_as_other_commands_read_them(study: Path) -> None:
    """Each law of each group as ck.load reads it, and rankings with the weights; the page holds the same files."""
    result = ck.Study.load(study).run(only="identification")
    folder = study.parent / "study.results" / "identified"
    for group, ranking in result.rankings.items():
        loaded = ck.load(folder / f"{group}_ranking.json")
        assert (loaded.verdict, loaded.challenges) == (ranking.verdict, ranking.challenges)
        assert [one.fit.values for one in loaded.laws] == [one.fit.values for one in ranking.laws]
        assert ck.load(folder / f"{group}_norton.json").law.name == "norton"
    carried = {one.name: one.text for one in result.report_contents().exports}
    assert carried.items() >= {path.name: path.read_text() for path in folder.glob("*.json")}.items()
    write_text("{}", folder / "earlier.json", StudyError)  # of a law that was taken out of the study
    ck.Study.load(study).run(only="identification")
    assert sorted(carried) == sorted(path.name for path in folder.glob("*.json"))


def test_python_the_command_line_and_a_study_give_the_same_answer(study: Path) -> None:
    result = ck.Study.load(study).run(only="identification")
    tests = [h for h in ck.read_histories(study.parent / "data") if h.alloy == "B"]
    ranking = ck.select(["norton", "strain-hardening"], tests, sums=False, starts=1, frames=12, further_laws=0)
    assert ranking.verdict == result.rankings["B"].verdict
    assert ranking.best.values == result.rankings["B"].best.values
    assert [one.weight for one in ranking.laws] == [one.weight for one in result.rankings["B"].laws]


def test_kept_results_are_the_records_that_were_made(study: Path) -> None:
    first = ck.Study.load(study).run()
    kept = ck.Study.load(study).run()
    assert numbers(first) == numbers(kept)
    assert kept.rankings["A"].equivalents() == first.rankings["A"].equivalents()
    assert kept.rankings["A"].best.predict().values.tolist() == first.rankings["A"].best.predict().values.tolist()


RUN = "import sys, creepkit as ck; ck.Study.load(sys.argv[1]).run()"


def test_a_run_that_is_killed_anywhere_goes_on_to_the_same_result(tmp_path: Path) -> None:
    text = ONE_FIT + STUDY[STUDY.index("[selection]") :].replace('group = "A"\n', "")
    expected = ck.Study.load(study_in(tmp_path / "whole", text)).run()
    study = study_in(tmp_path / "killed", text)
    seed = random.Random(3)
    kills = 0
    for _ in range(2):
        process = subprocess.Popen([sys.executable, "-c", RUN, str(study)], start_new_session=True)
        begun = time.monotonic()
        files = len(list(study.parent.rglob("*.json")))
        # until a random number of further files has been written, or begins to be
        aim = files + seed.randint(0, 2)
        while process.poll() is None and time.monotonic() - begun < 120:
            if len(list(study.parent.rglob("*.json"))) >= aim and (study.parent / "study.results").exists():
                time.sleep(seed.uniform(0.0, 0.05))
                break
            time.sleep(0.002)
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
            kills += 1
        process.wait()
    assert kills >= 1
    result = ck.Study.load(study).run()
    assert numbers(result) == numbers(expected)
    assert not list((study.parent / "study.results").rglob("*.part"))


def test_files_that_a_study_has_not_written_stay(study: Path, tmp_path: Path) -> None:
    own = tmp_path / "law_A.py"
    own.write_text("mine")
    with pytest.raises(StudyError, match="creepkit did not write it as it is now"):
        ck.Study.load(study).run()
    assert own.read_text() == "mine"
    own.unlink()
    ck.Study.load(study).run()
    text = own.read_text()
    own.write_text("changed")
    with pytest.raises(StudyError, match="creepkit did not write it as it is now"):
        ck.Study.load(study).run()
    assert own.read_text() == "changed"
    with ck.overwriting():
        assert ck.Study.load(study).run(only="export", again=True).failures == ()
    assert own.read_text() == text
    own.unlink()
    assert made(ck.Study.load(study).run()) == {"quality", "forecast of next"}
    assert own.read_text() == text


def test_any_error_of_a_stage_leaves_the_others(study: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also one that is no error of creepkit's, as of a plugin."""
    import creepkit.exporters.exporting as exporting

    def fails(*_: Any, **__: Any) -> None:
        raise ZeroDivisionError("of a plugin")

    monkeypatch.setattr(exporting, "exported_text", fails)
    result = ck.Study.load(study).run()
    assert {one.sentence for one in result.failures} == {"ZeroDivisionError: of a plugin"}
    assert set(result.rankings) == {"A", "B"}


def test_two_processes_do_not_run_one_study_at_once(study: Path) -> None:
    from creepkit.studies.execution import running_alone

    with running_alone(study.parent / "study.results"), pytest.raises(StudyError, match="another process"):
        ck.Study.load(study).run()
    assert ck.Study.load(study).run(only="quality").failures == ()


# ---- kept results ----------------------------------------------------------------------------------------------------

# What a run keeps: one that goes on gives what an uninterrupted one gives.


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
    told, expected = ([*map(challenge_text, run.rankings[""].challenges)] for run in (again, whole))
    assert told == expected
    assert [one.text for one in again.exports] == [one.text for one in whole.exports]
