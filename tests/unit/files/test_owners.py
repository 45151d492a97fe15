"""What another user made is not work of ours, and what another user can change is read from a private copy."""

from __future__ import annotations

import multiprocessing
import os
import threading
from pathlib import Path

import h5py
import numpy as np
import pytest

from creepkit.errors import CreepkitError
from creepkit.files import hdf5_trial, owners, private_copies
from creepkit.files.hdf5_files import open_hdf5
from creepkit.files.owners import check_owner, others_can_change
from creepkit.files.private_copies import unchanging
from creepkit.files.reading import FileKind, read_bytes
from helpers.other_users import HAS_OWNERS, give_to_another_user

KIND = FileKind("a data set", CreepkitError, "give another")
OWN_KIND = FileKind("a data set", CreepkitError, "give another", own=True)

pytestmark = HAS_OWNERS


def status_of(user: int) -> os.stat_result:
    return os.stat_result((0o100644, 1, 1, 1, user, user, 0, 0, 0, 0))


def test_files_of_root_and_of_oneself_are_ours(tmp_path: Path) -> None:
    for user in (0, os.geteuid()):
        check_owner(tmp_path / "a", status_of(user), CreepkitError)
    with pytest.raises(
        CreepkitError, match=r"a: belongs to another user \(.+\), .*; remove it, or choose another folder"
    ):
        check_owner(tmp_path / "a", status_of(4_000_001), CreepkitError)


def test_where_all_files_belong_to_one_user_nothing_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As on a share that is mounted for one user, where files that we make are not ours either."""
    monkeypatch.setattr(owners, "_owner_of_new_files", lambda folder: 4_000_001)
    check_owner(tmp_path / "a", status_of(4_000_001), CreepkitError)
    with pytest.raises(CreepkitError, match=r"\(number 4000002\)"):
        check_owner(tmp_path / "a", status_of(4_000_002), CreepkitError)


def test_a_file_of_another_user_is_read_where_it_is_asked_for_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a").write_bytes(b"data")
    assert read_bytes(tmp_path / "a", OWN_KIND) == b"data"
    give_to_another_user(tmp_path / "a", monkeypatch)
    assert read_bytes(tmp_path / "a", KIND) == b"data"
    with pytest.raises(CreepkitError, match=r"a: belongs to another user \(mallory\)"):
        read_bytes(tmp_path / "a", OWN_KIND)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a file, below folders that count as private."""
    (tmp_path / "folder").mkdir(mode=0o700)
    (tmp_path / "folder" / "a").write_bytes(b"data")
    (tmp_path / "folder" / "a").chmod(0o644)
    return tmp_path / "folder"


def test_who_can_change_a_file(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = folder / "a"
    if others_can_change(path):
        pytest.skip("temporary folders are open to others here")
    (tmp_path / "link").symlink_to(path)
    assert not others_can_change(tmp_path / "link")
    folder.chmod(0o1777)  # where only owners take the place of what they own
    assert not others_can_change(path)
    for open_to_others, mode in ((folder, 0o777), (folder, 0o770), (path, 0o666), (path, 0o664)):
        before = open_to_others.stat().st_mode & 0o7777
        open_to_others.chmod(mode)
        assert others_can_change(path), (open_to_others, oct(mode))
        assert others_can_change(tmp_path / "link")
        open_to_others.chmod(before)
    assert not others_can_change(path)
    give_to_another_user(path, monkeypatch)
    assert others_can_change(path)


def test_a_copy_is_what_the_file_was_wherever_its_holes_are(folder: Path) -> None:
    pieces = {0: b"first" * 100_000, 5_000_000: b"second", 9_000_000: b"last"}  # of holes alone it would be refused
    with (folder / "a").open("wb") as file:
        for place, piece in pieces.items():
            file.seek(place)
            file.write(piece)
        file.truncate(12_000_000)
    content = (folder / "a").read_bytes()
    folder.chmod(0o777)
    with unchanging(folder / "a", KIND) as stored:
        assert stored.path.parent != folder
        assert stored.path.stat().st_mode & 0o077 == 0 or stored.path.parent.stat().st_mode & 0o077 == 0
        (folder / "a").write_bytes(b"another")
        assert stored.path.read_bytes() == content
    assert not stored.path.parent.exists()
    folder.chmod(0o700)


def hdf5_file(path: Path, value: float) -> Path:
    with h5py.File(path, "w") as file:
        file["values"] = np.full(1000, value)
    return path


def test_what_is_checked_is_what_is_read(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another file, or a pipe that nobody writes to, takes the place of the one that was tried."""
    for swap in (lambda path: hdf5_file(path, 2.0), os.mkfifo):
        path = hdf5_file(folder / "a.h5", 1.0)
        folder.chmod(0o777)
        tried = hdf5_trial._Trial.problem_with

        def swapping(self, one, *rest, tried=tried, swap=swap, path=path):
            path.unlink()
            swap(path)
            return tried(self, one, *rest)

        monkeypatch.setattr(hdf5_trial._Trial, "problem_with", swapping)
        with open_hdf5(path, KIND) as file:
            assert file["values"][7] == 1.0
        monkeypatch.setattr(hdf5_trial._Trial, "problem_with", tried)
        path.unlink()


def test_a_copy_is_tried_once_by_what_it_holds(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, state = hdf5_file(folder / "a.h5", 3.0), (folder / "a.h5").stat()
    folder.chmod(0o777)
    with open_hdf5(path, KIND):
        pass
    monkeypatch.setattr(hdf5_trial._Trial, "problem_with", lambda *_: "tried again")
    with open_hdf5(path, KIND) as file:
        assert file["values"][7] == 3.0
    content = path.read_bytes().replace(np.float64(3.0).tobytes(), np.float64(4.0).tobytes())
    with path.open("r+b") as stream:  # of the same size, place and time
        stream.write(content)
    os.utime(path, ns=(state.st_atime_ns, state.st_mtime_ns))
    with pytest.raises(CreepkitError, match="tried again"), open_hdf5(path, KIND):
        pass


def test_where_no_copy_can_be_made_it_says_so(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder.chmod(0o777)

    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(private_copies.tempfile, "TemporaryDirectory", full)
    sentence = r"a: others can change this file while it is read, and no private copy can be made \(No space left"
    with pytest.raises(CreepkitError, match=sentence), unchanging(folder / "a", KIND):
        pass


@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="processes do not fork here")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_fork_reads_while_another_thread_of_its_parent_was_reading(tmp_path: Path) -> None:
    path, locked, done = hdf5_file(tmp_path / "a.h5", 1.0), threading.Event(), threading.Event()

    def read_long() -> None:
        with hdf5_trial._trial.lock:
            locked.set()
            done.wait(60.0)

    thread = threading.Thread(target=read_long)
    thread.start()
    locked.wait()

    def read() -> None:
        with open_hdf5(path, KIND):
            pass

    child = multiprocessing.get_context("fork").Process(target=read)
    child.start()
    child.join(60.0)
    done.set()
    thread.join()
    code = child.exitcode
    child.kill()
    assert code == 0
