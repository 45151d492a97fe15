"""Lists of what creepkit wrote: what is hashed, lists of before, and results that were made from something else."""

from __future__ import annotations

import hashlib
import os
import subprocess
import time
from pathlib import Path

import pytest

from creepkit.errors import ExportError
from creepkit.files.writing import overwriting, replace_on_success, write_text
from creepkit.files.written_lists import RECORD, is_foreign, made_from, written_files
from helpers.command_line import creepkit, one_line

TERABYTES = 4 * 2**40


def enlarge(path: Path, size: int = TERABYTES) -> None:
    """Give a file a length that is not stored."""
    try:
        os.truncate(path, size)
    except OSError:
        pytest.skip("this file system has no files with holes of that length")


def old_list(folder: Path) -> None:
    """What lists held before they had comments."""
    lines = (folder / RECORD).read_bytes().splitlines(keepends=True)
    (folder / RECORD).write_bytes(b"".join(line for line in lines if line[:2] != b"# "))


@pytest.mark.parametrize("listed", ["never", "with its size", "as before"])
def test_terabytes_of_holes_are_foreign_at_once(listed: str, tmp_path: Path):
    path = tmp_path / "note"
    if listed == "never":
        path.touch()
    else:
        write_text("ours", path, ExportError)
    if listed == "as before":
        old_list(tmp_path)
    enlarge(path)
    begin = time.process_time()
    assert is_foreign(path)
    assert written_files(tmp_path) == []
    with pytest.raises(ExportError, match="creepkit did not write it as it is now"):
        write_text("new", path, ExportError)
    assert time.process_time() - begin < 5.0, "to hash it would take hours"


def test_a_list_that_is_forged_has_no_holes_hashed(tmp_path: Path):
    """A folder that was received may hold a list that names the length."""
    path = tmp_path / "note"
    path.touch()
    enlarge(path)
    (tmp_path / RECORD).write_text(f"# {TERABYTES} \n{'0' * 64}  note\n")
    assert is_foreign(path)


def test_lists_of_before_are_read(tmp_path: Path):
    path = tmp_path / "note"
    path.write_text("old")
    (tmp_path / RECORD).write_text(f"{hashlib.sha256(b'old').hexdigest()}  note\n")
    with made_from(tmp_path / "study.toml"):  # which they do not hold
        write_text("new", path, ExportError)
    assert f"# 3 study.toml\n{hashlib.sha256(b'new').hexdigest()}  note\n" in (tmp_path / RECORD).read_text()


def test_what_was_made_from_another_file_stays(tmp_path: Path, monkeypatch):
    path = tmp_path / "tests" / "D1.csv"
    path.parent.mkdir()
    for text in ("first", "second"):  # the same again, whatever it holds now
        with made_from(tmp_path / "camera.csv"):
            write_text(text, path, ExportError)
    for other in ("received.csv", "tests/camera.csv", "camera.csv\n"):
        with made_from(tmp_path / other), pytest.raises(ExportError, match=r"creepkit made it from \.\./camera\.csv;"):
            write_text("third", path, ExportError)
    monkeypatch.chdir(tmp_path)
    with made_from("camera.csv"):
        write_text("third", path, ExportError)
    with made_from("received.csv"), overwriting():
        write_text("fourth", path, ExportError)
    with made_from("camera.csv"), pytest.raises(ExportError, match=r"creepkit made it from \.\./received\.csv;"):
        write_text("fourth", path, ExportError)
    write_text("fifth", path, ExportError)  # whose name a person chose
    with made_from("camera.csv"), pytest.raises(ExportError, match=r"creepkit made it by another command;"):
        write_text("sixth", path, ExportError)
    check = subprocess.run(["sha256sum", "-c", RECORD], cwd=path.parent, capture_output=True, text=True, check=False)
    assert check.stdout.count("D1.csv: OK") == 1
    assert "improperly formatted" not in check.stderr


def test_the_same_content_of_another_origin_is_noted(tmp_path: Path):
    for name in ("a\nb \\ \udcff.csv", "plain.csv"):
        with made_from(tmp_path / name), overwriting():
            write_text("same", tmp_path / "note", ExportError)
        with made_from(tmp_path / name):
            write_text("same", tmp_path / "note", ExportError)


def test_a_result_beside_another_that_came_meanwhile_is_kept(tmp_path: Path):
    path = tmp_path / "D1.csv"

    def write() -> None:
        with made_from("b"), overwriting("beside"), replace_on_success(path, ExportError) as unfinished:
            unfinished.write_bytes(b"mine")
            with made_from("a"), overwriting("refuse"):
                write_text("theirs", path, ExportError)

    with pytest.raises(ExportError, match=r"left as it is; the result is .*D1-2\.csv"):
        write()
    assert (path.read_text(), (tmp_path / "D1-2.csv").read_text()) == ("theirs", "mine")


TABLE = (
    "# name: D1\n# specimen: uniaxial\n# stress_MPa: {}\n# temperature_C: 750\ntime_h,strain_pct\n1,0.1\n2,0.2\n3,0.3\n"
)


def test_a_received_file_does_not_choose_which_converted_test_is_lost(tmp_path: Path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("camera.csv").write_text(TABLE.format(100))
    Path("received.csv").write_text(TABLE.format(50))
    assert creepkit("read", "camera.csv", "--to", "tests").exit_code == 0
    Path("camera.csv").write_text(TABLE.format(120))
    assert creepkit("read", str(tmp_path / "camera.csv"), "--to", "tests").exit_code == 0
    refused = creepkit("read", "received.csv", "--to", "tests")
    assert refused.exit_code == 1
    assert "tests/D1.csv: cannot be written: it is there, and creepkit made it from ../camera.csv;" in refused.stderr
    assert "stress_MPa: 120" in Path("tests/D1.csv").read_text()
    assert creepkit("read", "received.csv", "--to", "tests", "--force").exit_code == 0
    assert "stress_MPa: 50" in Path("tests/D1.csv").read_text()


def test_a_command_does_not_wait_for_terabytes(tmp_path: Path):
    path = tmp_path / "t.csv"
    path.touch()
    enlarge(path)
    words = ("simulate", "norton", "--set", "A=1e-16", "--set", "n=4", "--stress", "60", "--end-h", "1")
    assert "creepkit did not write it as it is now" in one_line(creepkit(*words, "--to", str(path)))
