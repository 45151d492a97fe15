"""Which cache folders are used: those that are ours from the root down, and otherwise a private temporary one."""

import os
import subprocess
import sys
import warnings
from pathlib import Path

import pytest

from creepkit.errors import CacheWarning
from creepkit.files import cache_folders
from creepkit.files.cache_folders import MARKER_FILE, cache_environment, cache_folder, is_marked

OWNERS = pytest.mark.skipif(not hasattr(os, "geteuid"), reason="modes of files say nothing of others here")


@pytest.fixture(autouse=True)
def _nothing_decided(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No temporary folder yet, and no warning given; temporary folders in one of their own."""
    (tmp_path / "temporary").mkdir(mode=0o700)
    monkeypatch.setattr(cache_folders.tempfile, "tempdir", str(tmp_path / "temporary"))
    monkeypatch.setattr(cache_folders, "_TEMPORARY", [])
    cache_folders._warn.cache_clear()
    for name in ("CREEPKIT_CACHE", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))


def replaced(tmp_path: Path, message: str) -> Path:
    """The temporary folder that takes the place of one that is not used, with one warning."""
    with pytest.warns(CacheWarning, match=message) as warned:
        folder = cache_folder("kernels")
    assert len(warned) == 1
    assert "set CREEPKIT_CACHE to a folder of your own" in str(warned[0].message)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert cache_folder("kernels") == folder, "said once"
    assert folder is not None
    assert folder.parent.parent == tmp_path / "temporary"
    assert folder.parent.stat().st_mode & 0o077 == 0
    return folder


def test_the_folder_is_that_of_the_variables_in_their_order(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert cache_folder("a") == tmp_path / ".cache" / "creepkit" / "a"
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")  # which the standard has ignored
    assert cache_folder("a") == tmp_path / ".cache" / "creepkit" / "a"
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    assert cache_folder("a") == tmp_path / "xdg" / "creepkit" / "a"
    monkeypatch.setenv("CREEPKIT_CACHE", str(tmp_path / "mine"))
    assert cache_folder("a") == tmp_path / "mine" / "a"
    assert cache_environment() == {}


@OWNERS
def test_what_is_made_is_for_its_owner_alone(tmp_path: Path) -> None:
    before = os.umask(0)
    try:
        folder = cache_folder("kernels")
    finally:
        os.umask(before)
    assert folder is not None
    assert is_marked(folder)
    for path in (folder, folder.parent, folder.parent.parent, folder / MARKER_FILE):
        assert path.stat().st_mode & 0o022 == 0


@OWNERS
@pytest.mark.parametrize("open_to_all", ["", "above", "above/cache", "above/cache/kernels"])
def test_a_folder_on_the_way_that_others_can_write_to(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, open_to_all: str
) -> None:
    (tmp_path / "above" / "cache" / "kernels").mkdir(parents=True)
    monkeypatch.setenv("CREEPKIT_CACHE", str(tmp_path / "above" / "cache"))
    shared = tmp_path / open_to_all
    shared.chmod(0o777)
    try:
        if open_to_all == "":  # the temporary folder lies below it as well
            with pytest.warns(CacheWarning, match="there is no private temporary folder either"):
                assert cache_folder("kernels") is None
        else:
            replaced(tmp_path, f"{shared} can be written by other users, so that nothing is read from there")
    finally:
        shared.chmod(0o700)
    assert list((tmp_path / "above" / "cache" / "kernels").iterdir()) == []


@OWNERS
def test_a_sticky_folder_above_may_be_open_but_the_cache_itself_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "cache").mkdir()
    (tmp_path / "cache").chmod(0o1777)
    monkeypatch.setenv("CREEPKIT_CACHE", str(tmp_path / "cache"))
    assert cache_folder("kernels") == tmp_path / "cache" / "kernels"
    (tmp_path / "cache" / "kernels").chmod(0o1777)
    replaced(tmp_path, "kernels can be written by other users")


@OWNERS
@pytest.mark.parametrize("target", ["open", "sub/../open", "chain"])
def test_a_link_is_followed_to_what_it_points_to(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, target: str) -> None:
    (tmp_path / "open" / "kernels").mkdir(parents=True)
    (tmp_path / "sub").mkdir()
    (tmp_path / "chain").symlink_to(tmp_path / "open")
    (tmp_path / "cache").symlink_to(target)
    monkeypatch.setenv("CREEPKIT_CACHE", str(tmp_path / "cache"))
    assert cache_folder("kernels") == tmp_path / "cache" / "kernels"
    (tmp_path / "open").chmod(0o777)
    replaced(tmp_path, f"{tmp_path / 'open'} can be written by other users")


@pytest.mark.parametrize("link", ["itself", "nowhere/else"])
def test_a_link_to_itself_or_to_nowhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, link: str) -> None:
    """What is missing behind a link is made, as it is for a folder; a chain without an end is refused."""
    (tmp_path / "itself").symlink_to(link)
    monkeypatch.setenv("CREEPKIT_CACHE", str(tmp_path / "itself"))
    if link == "itself":
        replaced(tmp_path, "chain of links")
    else:
        assert cache_folder("kernels") is not None
        assert (tmp_path / "nowhere" / "else" / "kernels").is_dir()


@OWNERS
def test_a_folder_of_another_user(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own = os.geteuid()
    if own != 0:
        pytest.skip("only root gives files away")
    (tmp_path / "theirs").mkdir()
    os.chown(tmp_path / "theirs", 12345, 12345)
    monkeypatch.setenv("CREEPKIT_CACHE", str(tmp_path / "theirs"))
    replaced(tmp_path, f"{tmp_path / 'theirs'} belongs to another user")
    os.chown(tmp_path / "theirs", 0, 0)
    (tmp_path / "link").symlink_to(tmp_path / "theirs")
    os.lchown(tmp_path / "link", 12345, 12345)
    cache_folders._TEMPORARY.clear()
    monkeypatch.setenv("CREEPKIT_CACHE", str(tmp_path / "link"))
    replaced(tmp_path, f"{tmp_path / 'link'} belongs to another user")


@pytest.mark.parametrize(("variable", "value"), [("CREEPKIT_CACHE", "cache"), ("HOME", ".")])
def test_a_relative_folder_would_lie_beside_the_data(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, variable: str, value: str
) -> None:
    (tmp_path / "data").mkdir()
    monkeypatch.chdir(tmp_path / "data")
    monkeypatch.setenv(variable, value)
    replaced(tmp_path, "not an absolute path")
    assert list((tmp_path / "data").iterdir()) == []


def test_no_home_can_be_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("no folder")
    monkeypatch.setenv("HOME", str(tmp_path / "file"))
    folder = replaced(tmp_path, "file is not a folder")
    assert cache_environment() == {"CREEPKIT_CACHE": str(folder.parent)}


def test_a_user_without_an_entry_and_without_any_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_home() -> Path:
        raise RuntimeError("Could not determine home directory.")

    def full(*arguments: object, **named: object) -> str:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(cache_folders.Path, "home", no_home)
    monkeypatch.setattr(cache_folders.tempfile, "mkdtemp", full)
    with pytest.warns(CacheWarning, match="this user has no home folder.*no private temporary folder either"):
        assert cache_folder("kernels") is None
    assert cache_environment() == {}


def test_the_temporary_folder_goes_with_its_process(tmp_path: Path) -> None:
    program = "from creepkit.files.cache_folders import cache_folder; print(cache_folder('kernels').is_dir())"
    variables = {**os.environ, "CREEPKIT_CACHE": "relative", "TMPDIR": str(tmp_path / "temporary")}
    done = subprocess.run([sys.executable, "-c", program], env=variables, capture_output=True, text=True, check=True)
    assert done.stdout == "True\n"
    assert done.stderr.count("CacheWarning") == 1
    assert list((tmp_path / "temporary").iterdir()) == []
