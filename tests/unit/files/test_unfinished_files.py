"""Writing where another user may rename files: what takes the temporary name is neither written through nor taken."""

from __future__ import annotations

import hashlib
import os
import stat
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from creepkit.errors import ExportError
from creepkit.files import writing
from creepkit.files.hdf5_files import write_hdf5
from creepkit.files.unfinished_files import UnfinishedFile
from creepkit.files.writing import replace_on_success, write_bytes, write_if_absent
from creepkit.files.written_lists import RECORD, is_foreign
from creepkit.reports.figures import save_figure

pytestmark = pytest.mark.skipif(not hasattr(os, "geteuid"), reason="links and owners are those of POSIX")


@pytest.fixture
def secret(tmp_path: Path) -> Path:
    """A private file."""
    path = tmp_path / "secret"
    path.write_text("mine alone")
    path.chmod(0o600)
    return path


def to_a_link(name: Path, secret: Path) -> None:
    name.unlink()
    name.symlink_to(secret)


def to_another_name(name: Path, secret: Path) -> None:
    name.unlink()
    os.link(secret, name)


def to_another_file(name: Path, secret: Path) -> None:
    (name.parent / "other").write_text("not the result")
    os.replace(name.parent / "other", name)


def to_nothing(name: Path, secret: Path) -> None:
    name.unlink()


CHANGES = (to_a_link, to_another_name, to_another_file, to_nothing)


def is_untouched(secret: Path) -> bool:
    return secret.read_text() == "mine alone" and stat.S_IMODE(secret.stat().st_mode) == 0o600


@pytest.mark.parametrize("change", CHANGES)
def test_a_name_that_became_another_s_is_refused_at_the_end(change: Callable[..., None], tmp_path: Path, secret: Path):
    (tmp_path / "open").mkdir()
    path = write_bytes(b"old", tmp_path / "open" / "note", ExportError)
    path.chmod(0o666)

    def write() -> None:
        with replace_on_success(path, ExportError) as unfinished:
            unfinished.write_bytes(b"new")
            change(unfinished.name, secret)
            unfinished.write_bytes(b"newer")

    with pytest.raises(ExportError, match="or put another in its place; choose a folder that nobody else may write to"):
        write()
    assert path.read_text() == "old"
    assert is_untouched(secret)
    assert sorted(os.listdir(path.parent)) == [RECORD, "note"]
    assert hashlib.sha256(b"mine alone").hexdigest() not in (path.parent / RECORD).read_text()


def write_array(path: Path) -> None:
    with write_hdf5(path, ExportError) as file:
        file["numbers"] = np.arange(1000.0)


def draw(path: Path) -> None:
    from matplotlib.figure import Figure

    save_figure(Figure(), path.with_suffix(".svg"), ExportError)


def write_first(path: Path) -> None:
    try:
        write_if_absent(path, "first")
    except OSError as error:
        raise ExportError(str(error)) from None


WRITERS = (lambda path: write_bytes(b"new", path, ExportError), write_array, draw, write_first)


@pytest.mark.parametrize("write", WRITERS)
@pytest.mark.parametrize("change", CHANGES)
def test_no_writer_opens_the_name_again(
    write: Callable[[Path], None], change: Callable[..., None], tmp_path: Path, secret: Path, monkeypatch
):
    class Taken(UnfinishedFile):
        def __init__(self, path: Path) -> None:
            super().__init__(path)
            change(self.name, secret)

    (tmp_path / "open").mkdir()
    monkeypatch.setattr(writing, "UnfinishedFile", Taken)
    with pytest.raises(ExportError, match="put another in its place"):
        write(tmp_path / "open" / "note")
    assert is_untouched(secret)
    assert [name for name in os.listdir(tmp_path / "open") if name != RECORD] == []


def test_a_name_that_changes_at_the_last_moment_is_said(tmp_path: Path, secret: Path, monkeypatch):
    """Between the look at the name and its end there is a moment: the link is then there, and is no result of ours."""
    replace = os.replace

    def as_attacked(source: Path, target: Path) -> None:
        to_a_link(Path(source), secret)
        replace(source, target)

    monkeypatch.setattr(os, "replace", as_attacked)
    with pytest.raises(ExportError, match="put another in its place"):
        write_bytes(b"new", tmp_path / "note", ExportError)
    assert is_untouched(secret)
    assert is_foreign(tmp_path / "note")


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root gives files away")
def test_permissions_of_another_users_file_are_not_taken(tmp_path: Path):
    usual = tmp_path / "usual"
    usual.touch()
    for mode in (0o666, 0o777, 0o600):
        path = tmp_path / f"note{mode:o}"
        path.write_text("theirs")
        path.chmod(mode)
        os.chown(path, 65534, 65534)
        write_bytes(b"new", path, ExportError, force=True)
        assert path.stat().st_mode == usual.stat().st_mode
        assert path.stat().st_uid == 0
