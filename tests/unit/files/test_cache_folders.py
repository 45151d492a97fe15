"""Which cache folders are used: those that are ours alone to write to."""

import os
import warnings
from pathlib import Path

import pytest

from creepkit.errors import CacheWarning
from creepkit.files.cache_folders import cache_folder, is_ours_alone, warn_once

OWNERS = pytest.mark.skipif(not hasattr(os, "geteuid"), reason="modes of files say nothing of others here")


@pytest.fixture(autouse=True)
def _nothing_decided(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No warning given yet, and a home of its own."""
    warn_once.cache_clear()
    for name in ("CREEPKIT_CACHE", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))


def refused(message: str) -> None:
    """No folder is used, which is said once."""
    with pytest.warns(CacheWarning, match=message) as warned:
        assert cache_folder("kernels") is None
    assert "set CREEPKIT_CACHE to a folder of your own" in str(warned[0].message)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert cache_folder("kernels") is None


def test_the_folder_is_that_of_the_variables_in_their_order(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert cache_folder("a") == tmp_path / ".cache" / "creepkit" / "a"
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    assert cache_folder("a") == tmp_path / "xdg" / "creepkit" / "a"
    monkeypatch.setenv("CREEPKIT_CACHE", str(tmp_path / "mine"))
    assert cache_folder("a") == tmp_path / "mine" / "a"


@OWNERS
def test_what_is_made_is_for_its_owner_alone() -> None:
    before = os.umask(0)
    try:
        folder = cache_folder("kernels")
    finally:
        os.umask(before)
    assert folder is not None
    assert folder.stat().st_mode & 0o777 == 0o700


@OWNERS
@pytest.mark.parametrize("mode", [0o777, 0o1777, 0o720])
def test_a_folder_that_others_can_write_to_is_not_used(mode: int) -> None:
    folder = cache_folder("kernels")
    assert folder is not None
    folder.chmod(mode)
    refused("others can write to it")


@OWNERS
def test_a_link_or_a_file_of_another_user_is_not_ours(tmp_path: Path) -> None:
    (tmp_path / "own").touch(mode=0o600)
    (tmp_path / "link").symlink_to("own")
    assert is_ours_alone(tmp_path / "own")
    assert not is_ours_alone(tmp_path / "link")
    if os.geteuid() == 0:  # only root gives files away
        os.chown(tmp_path / "own", 12345, 12345)
        assert not is_ours_alone(tmp_path / "own")


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
