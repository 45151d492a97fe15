"""Temporary files of processes that were killed are removed, and no others."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from creepkit.errors import CreepkitError
from creepkit.files import temporary_names
from creepkit.files.temporary_names import temporary_name
from creepkit.files.writing import write_text
from helpers.written_files import names_in

KILLED = """
import os, signal, sys
from pathlib import Path
from creepkit.errors import CreepkitError
from creepkit.files.writing import replace_on_success
with replace_on_success(Path(sys.argv[1]), CreepkitError) as temporary:
    temporary.write_bytes(b"half")
    os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.fixture
def fresh(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(temporary_names, "_tidied", set())


@pytest.mark.skipif(os.name == "nt", reason="processes cannot be asked for")
@pytest.mark.usefixtures("fresh")
def test_what_a_killed_process_left_is_removed_whatever_is_written_next(tmp_path: Path) -> None:
    for name in ("note.txt", "n" * 250, "line\nend"):
        done = subprocess.run([sys.executable, "-P", "-c", KILLED, str(tmp_path / name)], check=False)
        assert done.returncode == -9
        assert len(names_in(tmp_path)) == 1, "each removes what the one before has left"
    write_text("whole", tmp_path / "other.txt", CreepkitError)
    assert names_in(tmp_path) == ["other.txt"]


@pytest.mark.usefixtures("fresh")
def test_files_of_living_processes_of_other_places_and_of_other_names_stay(tmp_path: Path) -> None:
    own = temporary_name(tmp_path / "own.txt")
    dead = own.name.replace(f"-{os.getpid()}-", "-4194999-")  # more than a process can have
    kept = [
        own.name,
        dead.replace(temporary_names._place(), "00000000"),
        f".{dead}.bak",
        dead.removeprefix("."),
        ".note.0123abcd.part",
    ]
    for name in (*kept, dead):
        (tmp_path / name).touch()
    (tmp_path / dead.replace("own", "folder")).mkdir()
    (tmp_path / dead.replace("own", "link")).symlink_to("own.txt")
    temporary_names._tidied.clear()
    temporary_name(tmp_path / "own.txt")
    links_and_folders = [dead.replace("own", "folder"), dead.replace("own", "link")]
    assert names_in(tmp_path) == sorted([*kept, *links_and_folders] + ([dead] if os.name == "nt" else []))


def test_a_folder_is_looked_through_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    looked = []
    monkeypatch.setattr(temporary_names, "remove_leftovers", looked.append)
    for k in range(3):
        temporary_name(tmp_path / f"{k}.txt")
    assert looked == [tmp_path]
