"""Files that are made to harm: one sentence with the file's name for each, and nothing else opened."""

import os
import re
import struct
from pathlib import Path

import h5py
import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import CreepkitError, FitError, HistoryError, SolveError, printable, quoted
from creepkit.fem.mesh_files import read_input_deck, read_mesh
from creepkit.files.hdf5_files import open_hdf5
from creepkit.files.json_documents import parse_json
from creepkit.files.limits import VARIABLE, raised
from creepkit.files.reading import FileKind, read_bytes
from creepkit.records import histories_in

NOTE = FileKind("a note", FitError, "give a note", maximum_bytes=100)
SECRET = b"a line of another file"


def read_hdf5(path):
    with open_hdf5(path, NOTE_HDF5) as file:
        return {name: file[name][()] for name in file}


NOTE_HDF5 = FileKind("a note", FitError, "give a note")


def test_messages_are_printable_and_quotes_short():
    text = "a\x1b[31m\n\u202eb\x00\ud800"
    assert printable(text) == "a\\u001b[31m\\u000a\\u202eb\\u0000\\ud800"
    assert str(FitError(f"x: {text}")).isprintable()
    assert printable(printable(text)) == printable(text)
    assert len(quoted("9" * 20_000)) == 40
    long = str(FitError("file: " + "9" * 20_000 + "; write less"))
    assert len(long) <= 2000
    assert (long[:6], long[-12:]) == ("file: ", "; write less")


def test_limits_are_raised_by_the_environment(tmp_path, monkeypatch):
    path = tmp_path / "note"
    path.write_bytes(b"x" * 250)
    with pytest.raises(FitError, match="CREEPKIT_LIMITS=3 in the environment allows more"):
        read_bytes(path, NOTE)
    monkeypatch.setenv(VARIABLE, "3")
    assert len(read_bytes(path, NOTE)) == 250
    for wrong in ("0.5", "nan", "many", "9" * 5000, "-1"):
        monkeypatch.setenv(VARIABLE, wrong)
        with pytest.raises(CreepkitError, match="CREEPKIT_LIMITS is '.{1,40}'; write a number from 1 to 1e"):
            raised(100)


@pytest.mark.parametrize("kind", ["external link", "soft link", "raw storage", "virtual"])
def test_nothing_outside_an_hdf5_file_is_read(tmp_path, kind):
    outside, path = tmp_path / "secret", tmp_path / "x.h5"
    outside.write_bytes(SECRET)
    with h5py.File(tmp_path / "other.h5", "w") as other:
        other["x"] = np.frombuffer(SECRET, dtype="u1")
    with h5py.File(path, "w") as file:
        if kind == "external link":
            file["x"] = h5py.ExternalLink("other.h5", "/x")
        elif kind == "soft link":
            file["x"] = h5py.SoftLink("/y")
        elif kind == "raw storage":
            file.create_dataset("x", (len(SECRET),), dtype="u1", external=[(str(outside), 0, len(SECRET))])
        else:
            layout = h5py.VirtualLayout((len(SECRET),), dtype="u1")
            layout[:] = h5py.VirtualSource("other.h5", "x", (len(SECRET),))
            file.create_virtual_dataset("x", layout)
    with pytest.raises(FitError, match="x.h5: 'x' is a link to elsewhere, which is not followed"):
        read_hdf5(path)


def test_an_hdf5_file_is_bounded_as_it_unpacks(tmp_path, monkeypatch):
    path = tmp_path / "x.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset("x", (10**9,), dtype="f8", chunks=(10**6,), compression="gzip")
    with pytest.raises(FitError, match="its arrays have more than 100 MB unpacked; give a note, or if it is right"):
        read_hdf5(path)
    with h5py.File(path, "w") as file:
        file.create_dataset("x", data=np.zeros(10_000), chunks=(10_000,), compression="gzip")
    assert read_hdf5(path)["x"].shape == (10_000,)


def test_json_of_honest_size_is_read():
    """As of 50 MB of numbers of 15 digits, in rows of 8."""
    rows = ",".join(["[" + ",".join(["0.12345678901234"] * 8) + "]"] * 300_000)
    assert np.array(parse_json(f'{{"samples": [{rows}]}}', "x.json", NOTE)["samples"]).shape == (300_000, 8)


@pytest.mark.parametrize(
    ("lines", "problem"),
    [
        ("*NSET,NSET=A,GENERATE\n1,1000000000000,1", "more than 10000000 numbers"),
        ("*NSET,NSET=A,GENERATE\n1," + "9" * 5000, "write a whole number"),
        ("*NSET,NSET=A,GENERATE\n1", "GENERATE needs first, last and step"),
        ("*NSET,NSET=A\n" + "9" * 5000, "write a whole number"),
        ("*NSET,NSET=A\n\u00b2", "there is no node set"),
        ("*NODE" + ",\n" * 20_000, "no such|needs|id|node|mesh|element"),
    ],
)
def test_decks_are_bounded(tmp_path, lines, problem):
    path = tmp_path / "x.inp"
    path.write_text(f"*NODE\n1,0,0\n{lines}\n", encoding="utf-8")
    with pytest.raises(SolveError, match=problem):
        read_input_deck(path)


def test_a_long_cell_of_a_mesh_is_refused(tmp_path):
    path = tmp_path / "x.csv"
    path.write_text('id,r_mm,z_mm\n"' + "1" * 200_000 + '",0,0\n', encoding="utf-8")
    with pytest.raises(SolveError, match="x.csv:2: no line of a CSV table"):
        read_mesh(path, path, path)


def test_meshes_are_bounded_before_memory_is_taken():
    corners = ((1.0, 0.0), (2.0, 1.0))
    for columns, layers in ((10**9, 1), (1, 10**9), (10**5, 10**5)):
        with pytest.raises(SolveError, match="at most 1000000 are made"):
            ck.Section.rectangle(*corners, columns, layers)
    with pytest.raises(SolveError, match="allowed are whole numbers from 1 on"):
        ck.Section.rectangle(*corners, float("inf"), 1)


class FailingReader:
    """A reader of a plugin that raises what it is given."""

    name, title = "failing", "fails"

    def __init__(self, error: BaseException) -> None:
        self.error = error

    def accepts(self, path: Path) -> bool:
        return True

    def read(self, path: Path) -> list[ck.History]:
        raise self.error


@pytest.mark.parametrize(
    "error",
    [
        OSError(5, "Input/output error"),
        ValueError("bad\n\x1b[31m value " + "9" * 9000),
        RecursionError(),
        MemoryError(),
        UnicodeDecodeError("utf-8", b"\xff", 0, 1, "invalid"),
        struct.error("short"),
        KeyError("x"),
        SystemExit(3),
    ],
    ids=lambda error: type(error).__name__,
)
def test_whatever_a_reader_raises_names_file_and_reader(tmp_path, error):
    path = tmp_path / "x.dat"
    path.write_bytes(b"x")
    with pytest.raises(HistoryError) as caught:
        histories_in(FailingReader(error), path)
    message = str(caught.value)
    assert message.startswith(f"{path}: read() of reader 'failing' ")
    assert message.isprintable()
    assert len(message) < 1000


def test_special_files_are_refused_by_every_reader(tmp_path):
    os.mkfifo(tmp_path / "x.csv")
    for read in (ck.read_histories, ck.read_frames, ck.read_record, ck.load, ck.surrogate, ck.read_dataset):
        with pytest.raises(CreepkitError, match=re.escape(str(tmp_path))):
            read(tmp_path / "x.csv")
