"""Files that the HDF5 library never returns from, or crashes at, end in a sentence."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np
import pytest

from creepkit.errors import CreepkitError
from creepkit.files import hdf5_trial
from creepkit.files.hdf5_files import open_hdf5, write_names
from creepkit.files.reading import FileKind

KIND = FileKind("a data set", CreepkitError, "give another")


@pytest.fixture
def own_trial(monkeypatch: pytest.MonkeyPatch) -> Iterator[hdf5_trial._Trial]:
    trial = hdf5_trial._Trial()
    monkeypatch.setattr(hdf5_trial, "_trial", trial)
    monkeypatch.setattr(hdf5_trial, "CPU_SECONDS", 1)
    yield trial
    trial.close()


def whole_file(path: Path) -> Path:
    with h5py.File(path, "w") as file:
        write_names(file, "names", ("first", "second"))
        file.create_dataset("values", data=np.arange(1000.0), chunks=(100,), compression="gzip")
    return path


def endless_file(path: Path) -> Path:
    """A file whose first text is free space of no size, over which libhdf5 1.14 steps for ever."""
    content = bytearray(whole_file(path).read_bytes())
    first = content.index(b"GCOL") + 16
    content[first : first + 16] = bytes(16)
    path.write_bytes(content)
    return path


def opened(path: Path) -> float:
    with open_hdf5(path, KIND) as file:
        return float(file["values"][7])


@pytest.mark.usefixtures("own_trial")
def test_a_file_that_has_no_end_is_refused_and_the_next_one_read(tmp_path: Path) -> None:
    with pytest.raises(CreepkitError, match=r"endless.h5: the HDF5 library does not come to the end .* give another, "):
        opened(endless_file(tmp_path / "endless.h5"))
    assert opened(whole_file(tmp_path / "whole.h5")) == 7.0


@pytest.mark.usefixtures("own_trial")
@pytest.mark.parametrize(
    "program", ["print('ready', flush=True); input()", "print('ready', flush=True); import os; os.abort()"]
)
def test_a_process_that_dies_at_a_file_says_that_it_is_damaged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, program: str
) -> None:
    path = tmp_path / "program.py"
    path.write_text(program, encoding="utf-8")
    monkeypatch.setattr(hdf5_trial, "_PROGRAM", path)
    with pytest.raises(CreepkitError, match="or crashes at it"):
        opened(whole_file(tmp_path / "whole.h5"))


@pytest.mark.usefixtures("own_trial")
@pytest.mark.parametrize("program", ["", "import no_such_module"])
def test_where_no_process_can_try_files_are_read_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, program: str
) -> None:
    path = tmp_path / "program.py"
    path.write_text(program, encoding="utf-8")
    monkeypatch.setattr(hdf5_trial, "_PROGRAM", path)
    assert opened(whole_file(tmp_path / "whole.h5")) == 7.0
    monkeypatch.setattr(sys, "executable", str(tmp_path / "nothing"))
    assert opened(tmp_path / "whole.h5") == 7.0


def test_one_process_tries_all_files(own_trial: hdf5_trial._Trial, tmp_path: Path) -> None:
    whole_file(tmp_path / "line end \n in a name.h5")
    opened(tmp_path / "line end \n in a name.h5")
    first = own_trial._process
    opened(whole_file(tmp_path / "whole.h5"))
    assert first is not None
    assert own_trial._process is first
    own_trial.close()
    assert first.poll() == 0
