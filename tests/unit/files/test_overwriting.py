"""Which files are replaced: those that creepkit wrote and nobody changed; no others without force."""

import os
import stat
import subprocess
import sys
import warnings
from pathlib import Path

import pytest

from creepkit.errors import CacheWarning, ExportError
from creepkit.files import writing
from creepkit.files.writing import (
    RECORD,
    check_folder_target,
    check_target,
    is_foreign,
    made_from,
    overwriting,
    write_bytes,
    write_text,
)
from helpers.command_line import creepkit

FOREIGN = "creepkit did not write it as it is now"


def test_a_file_of_ours_is_written_again_until_it_is_changed(tmp_path):
    path = write_text("first", tmp_path / "note", ExportError)
    write_text("second", path, ExportError)
    path.write_text("first")  # what creepkit wrote under this name once
    write_text("third", path, ExportError)
    path.write_text("third, and my remarks")
    with pytest.raises(ExportError, match=FOREIGN):
        write_text("fourth", path, ExportError)
    assert path.read_text() == "third, and my remarks"
    write_text("fourth", path, ExportError, force=True)
    assert not is_foreign(path)


def test_a_file_of_somebody_else_stays(tmp_path):
    path = tmp_path / "measured.csv"
    path.write_text("1,2")
    with pytest.raises(ExportError, match=FOREIGN):
        check_target(path, ExportError)
    with overwriting():
        check_target(path, ExportError)
        write_text("3,4", path, ExportError)
    write_text("5,6", path, ExportError)
    copy = tmp_path / "copy.csv"
    copy.write_text("5,6")  # the same content under another name is somebody else's
    with pytest.raises(ExportError, match=FOREIGN):
        check_target(copy, ExportError)


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="links and owners are those of POSIX")
def test_nothing_is_written_through_links(tmp_path):
    (tmp_path / "target").write_text("mine")
    (tmp_path / "link").symlink_to("target")
    (tmp_path / "dangling").symlink_to("none")
    for name in ("link", "dangling"):
        with pytest.raises(ExportError, match="it is a symbolic link to .*, and nothing is written through links"):
            write_text("new", tmp_path / name, ExportError, force=True)
    assert not (tmp_path / "none").exists()
    os.link(write_text("old", tmp_path / "one", ExportError), tmp_path / "other")
    write_text("new", tmp_path / "one", ExportError)
    assert [(tmp_path / name).read_text() for name in ("target", "one", "other")] == ["mine", "new", "old"]


def test_devices_folders_and_missing_folders_are_refused_even_by_force(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path, problem in (
        (Path("/dev/null"), "it is a device, a pipe or the like"),
        (tmp_path / "pipe", "it is a device, a pipe or the like"),
        (tmp_path, "it is a folder"),
        (tmp_path / "none" / "note", "there is no folder"),
        (tmp_path / ("n" * 300), "File name too long"),
        (tmp_path / "null\0byte", "cannot be written"),
    ):
        with pytest.raises(ExportError, match=problem):
            write_text("new", path, ExportError, force=True)
    write_text("long", tmp_path / ("n" * 255), ExportError)


def test_permissions_are_kept_and_read_only_files_stay(tmp_path):
    path = write_text("old", tmp_path / "note", ExportError)
    path.chmod(0o600)
    write_text("new", path, ExportError)
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    path.chmod(0o444)
    with pytest.raises(ExportError, match="it is there and read-only"):
        write_text("newer", path, ExportError)
    write_text("newer", path, ExportError, force=True)
    assert path.read_text() == "newer"


def test_what_was_made_from_another_file_stays(tmp_path, monkeypatch):
    path = tmp_path / "tests" / "D1.csv"
    path.parent.mkdir()
    for text in ("first", "second"):  # the same again, whatever it holds now
        with made_from(tmp_path / "camera.csv"):
            write_text(text, path, ExportError)
    with made_from(tmp_path / "b.csv"), pytest.raises(ExportError, match=r"creepkit made it from \.\./camera\.csv;"):
        write_text("third", path, ExportError)
    monkeypatch.chdir(tmp_path)
    with made_from("b.csv"), overwriting():
        write_text("third", path, ExportError)
    write_text("fourth", path, ExportError)  # whose name a person chose
    with made_from("camera.csv"), pytest.raises(ExportError, match=r"creepkit made it by another command;"):
        write_text("fifth", path, ExportError)


TABLE = (
    "# name: D1\n# specimen: uniaxial\n# stress_MPa: {}\n# temperature_C: 750\ntime_h,strain_pct\n1,0.1\n2,0.2\n3,0.3\n"
)


def test_a_received_file_does_not_choose_which_converted_test_is_lost(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("camera.csv").write_text(TABLE.format(100))
    Path("received.csv").write_text(TABLE.format(50))
    for source in ("camera.csv", str(tmp_path / "camera.csv")):
        assert creepkit("read", source, "--to", "tests").exit_code == 0
    refused = creepkit("read", "received.csv", "--to", "tests")
    assert refused.exit_code == 1
    assert "tests/D1.csv: cannot be written: it is there, and creepkit made it from ../camera.csv;" in refused.stderr
    assert "stress_MPa: 100" in Path("tests/D1.csv").read_text()
    assert creepkit("read", "received.csv", "--to", "tests", "--force").exit_code == 0


def test_a_folder_is_checked_with_what_goes_into_it(tmp_path):
    check_folder_target(tmp_path / "new" / "deeper", ExportError, ("a",))
    (tmp_path / "a").write_text("mine")
    with pytest.raises(ExportError, match=FOREIGN):
        check_folder_target(tmp_path, ExportError, ("a",))
    with pytest.raises(ExportError, match="is no folder; name a folder for the results"):
        check_folder_target(tmp_path / "a" / "b", ExportError)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="limits of a process are those of Linux")
def test_a_full_disk_leaves_the_old_file(tmp_path):
    """A limit on the size of files stands for the disk: both are OSErrors of write()."""
    path = write_text("old", tmp_path / "note", ExportError)
    program = (
        "import resource, signal; from pathlib import Path; from creepkit.errors import ExportError\n"
        "from creepkit.files.writing import write_bytes\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN); resource.setrlimit(resource.RLIMIT_FSIZE, (5000, 5000))\n"
        "try: write_bytes(b'x' * 10000, Path('note'), ExportError)\n"
        "except ExportError as error: print(error)"
    )
    run = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert run.stdout == "note: cannot be written: File too large; free some space and start again\n"
    assert path.read_text() == "old"
    assert sorted(os.listdir(tmp_path)) == [RECORD, "note"]


def test_two_writers_leave_one_whole_file_that_is_ours(tmp_path):
    program = (
        "from pathlib import Path; from creepkit.errors import ExportError; from creepkit.files.writing import "
        "write_bytes; import sys\n"
        "for k in range(40): write_bytes(sys.argv[1].encode() * 100_000, Path('note'), ExportError)"
    )
    runs = [subprocess.Popen([sys.executable, "-c", program, letter], cwd=tmp_path) for letter in "ab"]
    assert [run.wait() for run in runs] == [0, 0]
    assert (tmp_path / "note").read_bytes() in (b"a" * 100_000, b"b" * 100_000)
    assert not is_foreign(tmp_path / "note")
    assert sorted(os.listdir(tmp_path)) == [RECORD, "note"]
    write_bytes(b"c", tmp_path / "note", ExportError)


# ---- cache folders ---------------------------------------------------------------------------------------------------

# Which cache folders are used: those that are ours alone to write to.


OWNERS = pytest.mark.skipif(not hasattr(os, "geteuid"), reason="modes of files say nothing of others here")


@pytest.fixture(autouse=True)
def _nothing_decided(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No warning given yet, and a home of its own."""
    writing.warn_once.cache_clear()
    for name in ("CREEPKIT_CACHE", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))


def refused(message: str) -> None:
    """No folder is used, which is said once."""
    with pytest.warns(CacheWarning, match=message) as warned:
        assert writing.cache_folder("kernels") is None
    assert "set CREEPKIT_CACHE to a folder of your own" in str(warned[0].message)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert writing.cache_folder("kernels") is None


def test_the_folder_is_that_of_the_variables_in_their_order(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert writing.cache_folder("a") == tmp_path / ".cache" / "creepkit" / "a"
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    assert writing.cache_folder("a") == tmp_path / "xdg" / "creepkit" / "a"
    monkeypatch.setenv("CREEPKIT_CACHE", str(tmp_path / "mine"))
    assert writing.cache_folder("a") == tmp_path / "mine" / "a"


@OWNERS
def test_what_is_made_is_for_its_owner_alone_and_used_while_no_other_can_write_to_it() -> None:
    before = os.umask(0)
    try:
        folder = writing.cache_folder("kernels")
    finally:
        os.umask(before)
    assert folder.stat().st_mode & 0o777 == 0o700
    folder.chmod(0o720)
    refused("others can write to it")


@OWNERS
def test_a_link_or_a_file_of_another_user_is_not_ours(tmp_path: Path) -> None:
    (tmp_path / "own").touch(mode=0o600)
    (tmp_path / "link").symlink_to("own")
    assert writing.is_ours_alone(tmp_path / "own")
    assert not writing.is_ours_alone(tmp_path / "link")
    if os.geteuid() == 0:  # only root gives files away
        os.chown(tmp_path / "own", 12345, 12345)
        assert not writing.is_ours_alone(tmp_path / "own")


def test_a_relative_folder_would_lie_beside_the_data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "data").mkdir()
    monkeypatch.chdir(tmp_path / "data")
    monkeypatch.setenv("CREEPKIT_CACHE", "cache")
    refused("not an absolute path")
    assert list((tmp_path / "data").iterdir()) == []


def test_no_home_can_be_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("no folder")
    monkeypatch.setenv("HOME", str(tmp_path / "file"))
    refused("the cache folder cannot be used")
