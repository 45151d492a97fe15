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


@pytest.mark.usefixtures("own_trial")
def test_an_attribute_that_cannot_be_read_hides_nothing(tmp_path: Path) -> None:
    """What comes before it by name would be read by name."""
    path = tmp_path / "a.h5"
    with h5py.File(path, "w", libver=("earliest", "v108")) as file:
        write_names(file, "names", ("first", "second"))
        file.attrs["zzz_last"] = 1
    content = bytearray(path.read_bytes())
    version = content.rindex(b"zzz_last") - 8
    assert content[version] in (1, 3)
    content[version] = 99
    path.write_bytes(content)
    with pytest.raises(CreepkitError, match="cannot be read, it seems damaged: "):
        opened(path)


@pytest.mark.usefixtures("own_trial")
@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="memory is limited where a process knows its own")
def test_texts_that_are_all_the_same_one_do_not_fill_the_memory(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    with h5py.File(path, "w", libver=("earliest", "v108")) as file:
        file.attrs.create("names", np.array(["x" * 1_000_000] + ["y"] * 1999, dtype=object), dtype=h5py.string_dtype())
    content = path.read_bytes()
    first = content.index((1_000_000).to_bytes(4, "little"), content.index(b"names\0"))
    content = content[:first] + content[first : first + 16] * 2000 + content[first + 16 * 2000 :]
    path.write_bytes(content)
    with pytest.raises(CreepkitError, match="cannot be read, it seems damaged|does not come to the end"):
        opened(path)


@pytest.mark.usefixtures("own_trial")
def test_a_file_is_tried_once_while_it_stays_as_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = whole_file(tmp_path / "a.h5")
    opened(path)
    monkeypatch.setattr(hdf5_trial._Trial, "problem_with", lambda *_: "tried again")
    assert opened(path) == 7.0
    path.write_bytes(path.read_bytes() + b"\0")
    with pytest.raises(CreepkitError, match="tried again"):
        opened(path)
