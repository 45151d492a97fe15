"""Checks of readers: what they make of foreign files, and whether what they read survives creepkit's own CSV files."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from creepkit.errors import HistoryError, nearest
from creepkit.readers.history_csv import HISTORY_CSV, write_history
from creepkit.records import History, Reader, accepts_path, histories_in, known_specimens, outputs_of
from creepkit.testing.reports import finding

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


@finding("accepts() of foreign files")
def check_accepts(reader: Reader, _: Path | None) -> str:
    """accepts() says no or yes to whatever there is."""
    errors = [refusal(accepts_path, reader, place) for place in foreign_places()]
    assert not any(errors), f"{next(filter(None, errors))}; answer False for what is not understood"
    return f"{len(errors)} files and folders"


@finding("read() of foreign files")
def check_refusals(reader: Reader, _: Path | None) -> str:
    """read() refuses in one sentence what holds no test."""
    errors = [refusal(histories_in, reader, place) for place in foreign_places()]
    bad = [error for error in errors if " raised " in error or "\n" in error]
    assert not bad, f"{bad[0]!r}; raise creepkit.errors.HistoryError with the file, one sentence"
    return f"{sum(map(bool, errors))} of {len(errors)} refused in one sentence, the others are tests to it"


def refusal(call: Callable[..., object], *arguments: Any) -> str:
    """What a call says that refuses a file, the last argument, without its folder; "" where it does not."""
    try:
        call(*arguments)
    except HistoryError as error:
        return str(error).replace(f"{Path(arguments[-1]).parent}/", "")
    return ""


def foreign_places() -> Iterator[Path]:
    """Files and folders that are none of a laboratory's tests, one after the other; they are gone after the last."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for file, content in FOREIGN_FILES.items():
            (folder / file).write_bytes(content)
        (folder / "empty folder").mkdir()
        (folder / "folder.csv").mkdir()
        (folder / "folder.csv" / "index.csv").write_bytes(b"")
        yield from (*sorted(folder.iterdir()), folder, folder / "missing.csv")


@finding("example file")
def check_example(reader: Reader, path: Path | None) -> str:
    """An example of the author's is accepted."""
    if path is None:
        return "not checked: no example file; --example FILE, or check_reader(reader, path)"
    assert accepts_path(reader, path), f"{path} is not accepted by accepts(); recognise it there"
    found = histories_in(reader, path)
    assert found, f"{path} holds no history; raise HistoryError where there is none"
    return f"{len(found)} histories"


def _of_example(reader: Reader, path: Path | None) -> Iterable[list[History]]:
    """The histories of an example that can be read; none, once, without one."""
    if path is not None and accepts_path(reader, path) and (found := histories_in(reader, path)):
        yield found


@finding("names of tests", each=_of_example)
def check_test_names(_: Reader, __: Path, found: list[History]) -> str:
    """Every test has a name of its own."""
    names = [history.name for history in found]
    repeated = sorted({name for name in names if names.count(name) > 1})
    assert not repeated, f"'{repeated[0]}' comes twice; name each test"
    return "each once"


@finding("reading twice", each=_of_example)
def check_reading_twice(reader: Reader, path: Path, found: list[History]) -> str:
    """The same file gives the same histories."""
    again = histories_in(reader, path)
    gaps = [gap for a, b in zip(found, again, strict=False) if (gap := history_difference(a, b))]
    assert not gaps and len(again) == len(found), gaps[0] if gaps else f"{len(found)} and {len(again)} histories"
    return "equal"


@finding("specimens and outputs", each=_of_example)
def check_specimens(_: Reader, __: Path, found: list[History]) -> str:
    """Specimens are registered, and outputs are theirs."""
    known = known_specimens()
    for history in found:
        assert history.specimen in known, (
            f"'{history.specimen}' is not registered; known are {', '.join(sorted(known))}"
        )
        names = [str(name) for name in outputs_of(known[history.specimen])]
        for name in history.outputs:
            assert name in names, (
                f"test '{history.name}': a {history.specimen} specimen shows no '{name}'; {nearest(name, names)}"
            )
    return "registered"


@finding("written as CSV and read back", each=_of_example)
def check_round_trip(_: Reader, __: Path, found: list[History]) -> str:
    """Histories are equal after writing as CSV and reading."""
    with tempfile.TemporaryDirectory() as folder:
        for position, history in enumerate(found):
            file = Path(folder) / f"{position}.csv"
            error = refusal(write_history, history, file) or refusal(HISTORY_CSV.read, file)
            assert not error, error
            difference = history_difference(history, HISTORY_CSV.read(file)[0])
            assert not difference, f"test '{history.name}': {difference}"
    return f"{len(found)} histories equal"


def history_difference(first: History, second: History) -> str:
    """In which field two histories differ, in a sentence; "" where they are equal but for their source."""
    if first.loading.quantity != second.loading.quantity:
        return f"loading is {first.loading.quantity} and {second.loading.quantity}"
    marks = np.union1d(first.times, first.loading.program().times)
    for field in fields(History):
        a, b = (_comparable(getattr(history, field.name), history, marks) for history in (first, second))
        if field.name != "source" and (gap := _gap(a, b)) is not None:
            return f"{field.name}{gap}"
    return ""


def _comparable(value: Any, history: History, marks: Any) -> Any:
    """A field of a history as numbers; loads and temperatures at these times, elastic data at the mean temperature."""
    if value is history.loading or value is history.temperature:
        program = history.loading.program() if value is history.loading else history.temperature_program()
        return np.asarray(program.at(marks), float)
    if history.elastic is not None and value is history.elastic:
        elastic = history.elastic.at(history.mean_temperature)
        return np.array([float(elastic.E), float(elastic.nu)])
    return value


def _gap(a: Any, b: Any) -> str | None:
    """How two values of a field differ, after its name; None where they do not."""
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        if a.shape != b.shape:
            return f" are {a.size} and {b.size}"
        if a.dtype.kind not in "fiu":
            return None if np.array_equal(a, b) else " differ"
        rounding = 1e-15 * float(np.nanmax(np.abs(a), initial=0.0))
        return None if np.allclose(a, b, rtol=1e-12, atol=rounding, equal_nan=True) else " differ"
    if isinstance(a, Mapping) and isinstance(b, Mapping):
        if list(a) != list(b):
            return f" are {', '.join(a) or 'none'} and {', '.join(b) or 'none'}"
        return next((f" of '{name}'{gap}" for name in a if (gap := _gap(a[name], b[name])) is not None), None)
    is_same = a is b or (isinstance(a, np.ndarray) == isinstance(b, np.ndarray) and a == b)
    return None if is_same else f" is {a!r} and {b!r}"
