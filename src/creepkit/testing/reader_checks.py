"""Checks of readers: what they make of foreign files, and whether what they read survives creepkit's own CSV files."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from creepkit.errors import HistoryError, nearest
from creepkit.readers.history_csv import HISTORY_CSV, write_history
from creepkit.records import History, Reader, accepts_path, histories_in, known_specimens, outputs_of
from creepkit.testing.reports import ConformanceCheck

FOREIGN_FILES: dict[str, bytes] = {
    "empty.csv": b"",
    "empty.txt": b"",
    "no_suffix": b"some words\nof a letter\n",
    "binary.csv": bytes(range(256)) * 8,
    "picture.png": b"\x89PNG\r\n\x1a\n" + bytes(64),
    "foreign.csv": b"date;what;how much\n1.4.2021;rent;900,00\n",
    "one_line.csv": b"time_s,strain",
    "utf16.csv": "time_s,strain\n0,0\n1,1\n".encode("utf-16"),
    "broken.json": b'{"tests": [',
    "long_line.dat": b"7" * 100_000,
    "sheet.xlsx": b"PK\x03\x04" + bytes(128),
}
"""{name: content} of files that are none of a laboratory's tests."""


@dataclass(frozen=True)
class ReaderCase:
    """A reader, and an example file or folder of its author's, if there is one."""

    reader: Reader
    path: Path | None = None


def check_foreign_files(case: ReaderCase) -> Iterator[ConformanceCheck]:
    """accepts() says no or yes to whatever there is, and read() refuses in one sentence what holds no test."""
    reader = case.reader
    with tempfile.TemporaryDirectory() as folder:
        places = _foreign_paths(Path(folder))
        for place in places:
            try:
                accepts_path(reader, place)
            except HistoryError as error:
                detail = f"{error}; answer False for what is not understood".replace(f"{folder}/", "")
                yield ConformanceCheck("accepts() of foreign files", False, detail)
                return
        yield ConformanceCheck("accepts() of foreign files", True, f"{len(places)} files and folders")
        refused = 0
        for place in places:
            try:
                histories_in(reader, place)
            except HistoryError as error:
                text = str(error).replace(f"{folder}/", "")
                if " raised " in text or "\n" in text:
                    detail = f"{text!r}; raise creepkit.errors.HistoryError with the file, one sentence"
                    yield ConformanceCheck("read() of foreign files", False, detail)
                    return
                refused += 1
        detail = f"{refused} of {len(places)} refused in one sentence, the others are tests to it"
        yield ConformanceCheck("read() of foreign files", True, detail)


def _foreign_paths(folder: Path) -> list[Path]:
    for name, content in FOREIGN_FILES.items():
        (folder / name).write_bytes(content)
    (folder / "empty folder").mkdir()
    (folder / "folder.csv").mkdir()
    (folder / "folder.csv" / "index.csv").write_bytes(b"")
    return [*sorted(folder.iterdir()), folder, folder / "missing.csv"]


def check_own_files(case: ReaderCase) -> Iterator[ConformanceCheck]:
    """What write_history() writes is read back equal by a reader that accepts it."""
    with tempfile.TemporaryDirectory() as folder:
        file = write_history(_written_example(), Path(folder) / "example.csv")
        if not accepts_path(case.reader, file):
            yield ConformanceCheck("files of write_history()", True, "not accepted; they are left to the reader csv")
            return
        found = histories_in(case.reader, file)
        difference = "it finds none" if not found else history_difference(_written_example(), found[0])
        yield ConformanceCheck("files of write_history()", not difference, difference or "read back equal")


def _written_example() -> History:
    from creepkit.records import constant_stress

    times = np.array([0.0, 3600.0, 7200.0])
    return History("example", times, {"strain": np.array([0.0, 1e-3, 1.5e-3])}, constant_stress(120.0), 1033.15)


def check_example(case: ReaderCase) -> Iterator[ConformanceCheck]:
    """An example of the author's is accepted, and its histories are equal after writing as CSV and reading."""
    path, reader = case.path, case.reader
    if path is None:
        yield ConformanceCheck(
            "example file", True, "not checked: no example file; --example FILE, or check_reader(reader, path)"
        )
        return
    if not accepts_path(reader, path):
        yield ConformanceCheck("example file", False, f"{path} is not accepted by accepts(); recognise it there")
        return
    found = histories_in(reader, path)
    if not found:
        yield ConformanceCheck(
            "example file", False, f"{path} holds no history; raise HistoryError where there is none"
        )
        return
    yield ConformanceCheck("example file", True, f"{len(found)} histories")
    names = [history.name for history in found]
    repeated = sorted({name for name in names if names.count(name) > 1})
    detail = f"'{repeated[0]}' comes twice; name each test" if repeated else "each once"
    yield ConformanceCheck("names of tests", not repeated, detail)
    again = histories_in(reader, path)
    gaps = [gap for a, b in zip(found, again, strict=False) if (gap := history_difference(a, b))]
    yield ConformanceCheck("reading twice", not gaps and len(again) == len(found), gaps[0] if gaps else "equal")
    known = known_specimens()
    foreign = sorted({h.specimen for h in found} - set(known))
    detail = f"'{foreign[0]}' is not registered; known are {', '.join(sorted(known))}" if foreign else "registered"
    yield ConformanceCheck("specimens", not foreign, detail)
    yield _known_outputs([history for history in found if history.specimen in known])
    yield _round_trip(found)


def _known_outputs(histories: list[History]) -> ConformanceCheck:
    """Outputs are those of the specimen that a history names."""
    for history in histories:
        names = [str(name) for name in outputs_of(known_specimens()[history.specimen])]
        unknown = [name for name in history.outputs if name not in names]
        if unknown:
            detail = f"test '{history.name}': a {history.specimen} specimen shows no '{unknown[0]}'"
            return ConformanceCheck("outputs", False, f"{detail}; {nearest(unknown[0], names)}")
    return ConformanceCheck("outputs", True, "those of the specimens")


def _round_trip(histories: list[History]) -> ConformanceCheck:
    name = "written as CSV and read back"
    with tempfile.TemporaryDirectory() as folder:
        for position, history in enumerate(histories):
            file = Path(folder) / f"{position}.csv"
            try:
                write_history(history, file)
                (back,) = HISTORY_CSV.read(file)
            except HistoryError as error:
                return ConformanceCheck(name, False, str(error).replace(f"{folder}/", ""))
            difference = history_difference(history, back)
            if difference:
                return ConformanceCheck(name, False, f"test '{history.name}': {difference}")
    return ConformanceCheck(name, True, f"{len(histories)} histories equal")


_PLAIN = (
    *("name", "specimen", "strain_measure", "includes_elastic", "operator", "alloy", "rupture_time", "unruptured"),
    *("minimum_rate", "minimum_rate_sd"),
)


def history_difference(first: History, second: History) -> str:
    """In which field two histories differ, in a sentence; "" where they are equal but for their source."""
    for field in _PLAIN:
        a, b = getattr(first, field), getattr(second, field)
        if a != b:
            return f"{field} is {a!r} and {b!r}"
    for field in ("geometry", "labels", "noise_correlation"):
        a, b = dict(getattr(first, field)), dict(getattr(second, field))
        if a != b:
            return f"{field} is {a} and {b}"
    if first.times.shape != second.times.shape:
        return f"there are {first.times.size} and {second.times.size} frames"
    for field in ("outputs", "standard_deviation"):
        one, other = getattr(first, field), getattr(second, field)
        if list(one) != list(other):
            return f"{field} are {', '.join(one) or 'none'} and {', '.join(other) or 'none'}"
        for name, values in one.items():
            if not np.allclose(values, other[name], rtol=1e-12, atol=0.0, equal_nan=True):
                return f"{field} of '{name}' differ"
    if not np.allclose(first.times, second.times, rtol=1e-12, atol=0.0):
        return "times differ"
    if not np.array_equal(first.used, second.used):
        return "the frames that are used differ"
    marks = np.union1d(first.times, first.loading.program().times)
    programs = {
        "temperature": (first.temperature_program(), second.temperature_program()),
        "loading": (first.loading.program(), second.loading.program()),
    }
    for what, (a, b) in programs.items():
        if not np.allclose(a.at(marks), b.at(marks), rtol=1e-12, atol=1e-12):
            return f"{what} differs"
    if first.loading.quantity != second.loading.quantity:
        return f"loading is {first.loading.quantity} and {second.loading.quantity}"
    return _elastic_difference(first, second)


def _elastic_difference(first: History, second: History) -> str:
    if (first.elastic is None) != (second.elastic is None):
        return "elastic data are there in one of them only"
    if first.elastic is None or second.elastic is None:
        return ""
    a, b = (h.elastic.at(h.mean_temperature) for h in (first, second) if h.elastic is not None)
    same = np.allclose([float(a.E), float(a.nu)], [float(b.E), float(b.nu)], rtol=1e-9)
    return "" if same else f"elastic data are {a} and {b}"
