"""What lies beside a study: files of another study, holes, folders with names of temporary files, links in a circle."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

import creepkit as ck
from creepkit.errors import StudyError
from creepkit.files.writing import temporary_name
from creepkit.studies import inputs
from creepkit.studies.inputs import resolve_paths
from helpers.study_runs import ONE_FIT, states

EXPORT = '[[export]]\ntarget = "c"\nfile = "c.f"\n'


def enlarge(path: Path) -> None:
    path.touch()
    try:
        os.truncate(path, 4 * 2**40)
    except OSError:
        pytest.skip("this file system has no files with holes of that length")


def test_the_files_of_another_study_stay_and_those_of_the_same_are_made_again(study: Path, plain_pages: None) -> None:
    first, second = study, study.with_name("second.toml")
    first.write_text(ONE_FIT + EXPORT + "[report]\n")
    ck.Study.load(first).run()
    first.write_text(ONE_FIT.replace("one law", "the same") + EXPORT + "[report]\n")
    assert states(ck.Study.load(first).run())["report"] == "made"
    before = {name: (study.parent / name).read_bytes() for name in ("c.f", "report.html")}
    second.write_text(ONE_FIT.replace("norton", "strain-hardening") + EXPORT)
    with pytest.raises(
        StudyError, match=r"c\.f: cannot be written: it is there, and creepkit made it from study\.toml;"
    ):
        ck.Study.load(second).run()
    second.write_text(ONE_FIT + "[report]\n")
    (failure,) = ck.Study.load(second).run(only="report").failures
    assert "report.html: cannot be written: it is there, and creepkit made it from study.toml;" in failure.sentence
    assert before == {name: (study.parent / name).read_bytes() for name in before}
    assert not ck.Study.load(second).run(only="report", force=True).failures
    assert before["report.html"] != (study.parent / "report.html").read_bytes()


def test_holes_beside_a_study_take_no_time(study: Path, plain_pages: None) -> None:
    study.write_text(ONE_FIT + "[report]\n")
    result = ck.Study.load(study).run(only="quality")
    enlarge(study.parent / "report.html")
    enlarge(study.parent / "study.results" / "quality.json")
    again = ck.Study.load(study).run(only="quality")
    assert states(again) == states(result)
    assert (study.parent / "study.results" / "quality.json").stat().st_size < 1e6
    (failure,) = ck.Study.load(study).run(only="report").failures
    assert "report.html: cannot be written: it is there, and creepkit did not write it as it is now" in failure.sentence
    enlarge(study.parent / "data" / "z850C.csv")
    with pytest.raises(StudyError, match=r"z850C\.csv: larger than 2000 MB"):
        ck.Study.load(study).run(only="quality")


def test_no_file_is_hashed_before_all_are_known_to_be_readable(study: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study.write_text(ONE_FIT)
    monkeypatch.setattr(inputs, "sha256_of", lambda path: pytest.fail(f"{path} is hashed"))
    os.mkfifo(study.parent / "data" / "z850C.csv")
    (study.parent / "data" / "a850C.csv").write_bytes(b"x" * 2000)
    monkeypatch.setattr(inputs, "DATA_FILE", inputs.DATA_FILE.__class__("a data file", StudyError, "name others", 1000))
    with pytest.raises(StudyError, match="larger than 0.001 MB"):
        ck.Study.load(study).run(only="quality")


def test_only_regular_files_with_names_of_ours_are_cleared(study: Path) -> None:
    study.write_text(ONE_FIT)
    results = study.parent / "study.results"
    left = temporary_name(results / "fits" / "a.json")
    left.parent.mkdir(parents=True)
    left.touch()
    kept = [results / ".x.01234567.part", results / "fits" / ".mine.part", temporary_name(results / "b.json")]
    for path in kept[::2]:
        path.mkdir()
    kept[1].touch()
    ck.Study.load(study).run(only="quality", force=True)
    assert not left.exists()
    assert all(path.exists() for path in kept)


def circle(folder: Path) -> None:
    """Folders Z0 and Z1 of links to each other, by which a pattern of k parts has 3^k paths."""
    for name, others in (("Z0", ("Z0", "Z1", "Z1")), ("Z1", ("Z0", "Z0", "Z1"))):
        (folder / name).mkdir()
        for k, other in enumerate(others):
            (folder / name / f"s{k}").symlink_to(Path("..", other))
    (folder / "Z0" / "end").mkdir()
    (folder / "Z0" / "end" / "t.csv").write_text("time_h,strain_pct\n1,0.1\n2,0.2\n")


def test_patterns_through_links_in_a_circle_visit_each_folder_once(study: Path) -> None:
    circle(study.parent)
    study.write_text(ONE_FIT)
    file = ck.Study.load(study).file
    patterns = [f"Z0{'/s[012]' * k}/end/t.csv" for k in range(1, 39)]
    begin = time.process_time()
    found = resolve_paths(file, ("data", "files"), patterns, None)
    assert time.process_time() - begin < 5.0, "without that, 3^38 paths are looked at"
    assert {path.resolve() for path in found} == {(study.parent / "Z0" / "end" / "t.csv").resolve()}
    assert len(found) == 38, "one path of each pattern"
    both = resolve_paths(file, ("data", "files"), ["Z[01]/s[012]"], None)
    assert len(both) == 2, "a folder that has several names is read once"


def test_the_names_that_all_patterns_look_at_are_limited(study: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study.write_text(ONE_FIT)
    file = ck.Study.load(study).file
    names = len(os.listdir(study.parent / "data"))
    monkeypatch.setattr(inputs, "MOST_NAMES", 3 * (names + 1) + 3)
    assert len(resolve_paths(file, ("data", "files"), ["data/*.csv"] * 3, None)) == names
    with pytest.raises(
        StudyError, match=r"files 4: '.*' and those before it look at more than \d+ names of files; name"
    ):
        resolve_paths(file, ("data", "files"), ["data/*.csv"] * 4, None)
