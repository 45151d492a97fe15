"""Forged results and reports, links, and names: a study writes beside itself alone, and only over what is its own."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import creepkit as ck
from creepkit.errors import CreepkitError, StudyError
from creepkit.files.writing import RECORD
from creepkit.reports.attachments import embed
from creepkit.reports.contents import Attachment
from creepkit.studies.carried_study import study_of_report

STUDY = """\
[data]
files = ["data/*.csv"]
[identification]
laws = ["norton"]
group_by = "none"
temperature = "none"
starts = 1
frames = 8
[[export]]
target = "python"
file = "law.py"
"""


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """A study of one test."""
    (tmp_path / "home" / "data").mkdir(parents=True)
    source = next(iter(sorted(ck.example_data("planted creep curves").glob("*750C*MPa.csv"))))
    (tmp_path / "home" / "data" / "one.csv").write_text(source.read_text())
    path = tmp_path / "home" / "study.toml"
    path.write_text(STUDY)
    return path


def forge(study: Path, pattern: str, change: Callable[[Any], object]) -> None:
    (path,) = (study.parent / "study.results").glob(pattern)
    content = json.loads(path.read_text())
    change(content["result"])
    path.write_text(json.dumps(content))


def files_of(folder: Path) -> set[str]:
    return {
        str(path.relative_to(folder)) for path in folder.rglob("*") if not {"study.results", RECORD} & {*path.parts}
    }


def test_a_forged_result_neither_writes_elsewhere_nor_changes_numbers(study: Path, tmp_path: Path) -> None:
    first = ck.Study.load(study).run()
    before = files_of(tmp_path)
    for name in (str(tmp_path / "stolen.sh"), "../stolen.sh", "study.toml", "a\x00b", "", "a" * 5000):
        forge(study, "export*.json", lambda result, name=name: result["record"].update(name=name, text="stolen"))
        again = ck.Study.load(study).run()
        assert files_of(tmp_path) == before
        assert "stolen" not in (study.parent / "law.py").read_text()
        assert again.exports == first.exports
    forge(study, "export*.json", lambda result: result["record"].update(text="\ud800"))
    assert ck.Study.load(study).run().exports == first.exports
    forge(study, "identification*.json", lambda result: result["numbers"].update(values={"norton": {"n": 99.0}}))
    kept = {one.name: one.numbers for one in ck.Study.load(study).run().stages}
    assert kept == {one.name: one.numbers for one in first.stages}


@pytest.mark.parametrize("name", ["study.results/quality.json", "law.py", "inputs", "Makefile"])
def test_a_report_gives_back_study_lock_and_data_alone(study: Path, tmp_path: Path, name: str) -> None:
    page = tmp_path / "page.html"
    data = (study.parent / "data" / "one.csv").read_bytes()
    carried = [Attachment("study.toml", STUDY.encode())]
    page.write_text(embed([*carried, Attachment("inputs/data/one.csv", data)]))
    assert study_of_report(page, tmp_path / "sound").path.is_file()
    page.write_text(embed([*carried, Attachment(name, b"{}")]))
    with pytest.raises(StudyError, match="alone; use the report"):
        study_of_report(page, tmp_path / "made")
    assert not (tmp_path / "made").exists()


@pytest.mark.parametrize(
    "name", ["../stolen.csv", "inputs/../../stolen.csv", "/stolen.csv", "C:/stolen.csv", "..\\stolen.csv"]
)
def test_a_forged_report_writes_nothing_outside_its_folder_or_inside(study: Path, tmp_path: Path, name: str) -> None:
    """Its list of files is altered in the page: no name is followed, and not even the sound files are written."""
    page, before = tmp_path / "page.html", sorted(tmp_path.rglob("*"))
    sound = embed([Attachment("study.toml", STUDY.encode()), Attachment("inputs/data/one.csv", b"x")])
    page.write_text(sound.replace('"inputs/data/one.csv"', json.dumps(name)))
    with pytest.raises(CreepkitError, match="cannot be trusted: the name .* is not a plain path") as caught:
        study_of_report(page, tmp_path / "made")
    assert "\n" not in str(caught.value)
    assert sorted(tmp_path.rglob("*")) == [*before, page]
    assert not Path("/stolen.csv").exists()


@pytest.mark.parametrize("link", ["inputs", "inputs/data", "study.toml", "study.lock", "."])
def test_a_report_is_not_written_through_a_link(study: Path, tmp_path: Path, link: str) -> None:
    page, made, elsewhere = tmp_path / "page.html", tmp_path / "made", tmp_path / "elsewhere"
    data = (study.parent / "data" / "one.csv").read_bytes()
    page.write_text(embed([Attachment("study.toml", STUDY.encode()), Attachment("inputs/data/one.csv", data)]))
    elsewhere.mkdir()
    (made / link).parent.mkdir(parents=True, exist_ok=True)
    if link == ".":
        os.symlink(elsewhere, made)
    else:
        os.symlink(elsewhere / "dangling" if "." in link else elsewhere, made / link)
    with pytest.raises(StudyError, match="is a link"):
        study_of_report(page, made).run(only="quality")
    assert not list(elsewhere.iterdir())


@pytest.mark.parametrize("link", ["study.results", "study.results/fits", "study.results/running.lock", "study.lock"])
def test_links_in_the_place_of_what_a_run_keeps_are_refused(study: Path, tmp_path: Path, link: str) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "b.json").write_text("precious 12")
    target = {"running.lock": elsewhere / "b.json", "study.lock": tmp_path / "none"}.get(Path(link).name, elsewhere)
    (study.parent / link).parent.mkdir(exist_ok=True)
    os.symlink(target, study.parent / link)
    with pytest.raises(StudyError):
        ck.Study.load(study).run(only="quality", force=True)
    assert (elsewhere / "b.json").read_text() == "precious 12"
    assert not (tmp_path / "none").exists()


def test_a_pipe_in_the_place_of_the_lock_of_a_run_is_refused(study: Path) -> None:
    (study.parent / "study.results").mkdir()
    os.mkfifo(study.parent / "study.results" / "running.lock")
    with pytest.raises(StudyError, match="cannot be kept there"):
        ck.Study.load(study).run(only="quality")


@pytest.mark.parametrize("name", ["data", "one.csv", "study.lock", "STUDY.toml", "-rf", "con.py", ".law.py", "~law.py"])
def test_exports_replace_neither_data_nor_the_study(study: Path, name: str) -> None:
    if name == "one.csv":
        (study.parent / "data" / "one.csv").rename(study.parent / "one.csv")
    text = STUDY.replace("law.py", name).replace("data/*.csv", "data" if name == "data" else "*.csv")
    study.write_text(text if name in ("data", "one.csv") else STUDY.replace("law.py", name))
    with pytest.raises(CreepkitError, match=r"give file|plain name|of the study itself"):
        ck.Study.load(study)


def test_what_a_forged_lock_says_does_not_steer_the_terminal(study: Path) -> None:
    from typer.testing import CliRunner

    from creepkit.cli.app import app

    ck.Study.load(study).run(only="quality")
    lock = study.parent / "study.lock"
    content = json.loads(lock.read_text())
    content["inputs"] = {"\x1b[31mred\u202e\u009b": "0"}
    lock.write_text(json.dumps(content))
    shown = CliRunner().invoke(app, ["run", str(study), "--only", "quality"])
    assert shown.exit_code == 0
    assert "\\u001b[31mred\\u202e\\u009b" in shown.output
    assert not set("\x1b\u202e\u009b") & set(shown.output)
