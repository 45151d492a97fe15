"""Forged reports, and names of exports: a study writes beside itself alone, and only over what is its own."""

from __future__ import annotations

import base64
import io
import re
import zipfile
from pathlib import Path

import pytest

import creepkit as ck
from creepkit.errors import CreepkitError, StudyError
from creepkit.reports.attachments import embed
from creepkit.reports.contents import Attachment
from creepkit.studies.study import study_of_report

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
    """A file of its archive is renamed: no name is followed, and not even the sound files are written."""
    page, before, archive = tmp_path / "page.html", sorted(tmp_path.rglob("*")), io.BytesIO()
    with zipfile.ZipFile(archive, "w") as packed:
        packed.writestr("study.toml", STUDY)
        packed.writestr(name, "x")
    sound = embed([Attachment("study.toml", b"")])
    forged = base64.b64encode(archive.getvalue()).decode()
    page.write_text(re.sub(">.*<", lambda found: f">{forged}<", sound))
    with pytest.raises(CreepkitError, match="cannot be trusted: the name .* is not a plain path") as caught:
        study_of_report(page, tmp_path / "made")
    assert "\n" not in str(caught.value)
    assert sorted(tmp_path.rglob("*")) == [*before, page]
    assert not Path("/stolen.csv").exists()


@pytest.mark.parametrize("name", ["data", "one.csv", "study.lock", "STUDY.toml", "-rf", "con.py", ".law.py", "~law.py"])
def test_exports_replace_neither_data_nor_the_study(study: Path, name: str) -> None:
    if name == "one.csv":
        (study.parent / "data" / "one.csv").rename(study.parent / "one.csv")
    text = STUDY.replace("law.py", name).replace("data/*.csv", "data" if name == "data" else "*.csv")
    study.write_text(text if name in ("data", "one.csv") else STUDY.replace("law.py", name))
    with pytest.raises(CreepkitError, match=r"give file|plain name|of the study itself"):
        ck.Study.load(study)
