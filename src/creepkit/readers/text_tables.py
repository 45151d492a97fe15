"""Text of a measured file as a table whose cells keep their location, and its frames as arrays.

Columns are converted to MPa, mm, s and K; times increase strictly.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.errors import HistoryError, nearest
from creepkit.files.reading import FileKind, read_bytes, read_text
from creepkit.readers.vocabulary import HeaderVocabulary, Terms, split_unit
from creepkit.records.quantities import QuantityKind

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


@dataclass(frozen=True)
class SourceText:
    """One piece of text and its place, 'file:line'."""

    text: str
    location: str

    def number(self, name: str) -> float:
        """The text as a finite number; `name` says in the error what it was meant to be."""
        if not _NUMBER.fullmatch(self.text):
            description = f"'{self.text}'" if self.text else "empty"
            raise HistoryError(f"{self.location}: '{name}' is {description}; write a finite number such as 1.5e-3")
        return float(self.text)


@dataclass(frozen=True)
class TableRow:
    """The cells of one line of a table."""

    line: int
    cells: Sequence[str]


@dataclass(frozen=True)
class TextTable:
    """A file as it was written: the entries of its head, its columns, its rows; all still text."""

    path: Path
    header: Mapping[str, SourceText]
    columns: Sequence[str]
    columns_line: int
    rows: Sequence[TableRow]

    def location(self, line_number: int) -> str:
        """Where a line stands, 'file:line'."""
        return f"{self.path}:{line_number}"

    def column(self, name: str) -> int:
        """The number of a column that must be there."""
        if name not in self.columns:
            result = ", ".join(self.columns)
            raise HistoryError(f"{self.location(self.columns_line)}: missing column '{name}'; found: {result}")
        return self.columns.index(name)

    def numbers(self, name: str) -> list[float]:
        """One column as numbers."""
        k = self.column(name)
        return [SourceText(row.cells[k], self.location(row.line)).number(name) for row in self.rows]

    def entries(self, row: TableRow) -> dict[str, SourceText]:
        """The cells of one row by column, those left empty excepted."""
        place = self.location(row.line)
        return {name: SourceText(cell, place) for name, cell in zip(self.columns, row.cells, strict=True) if cell}

    def with_rows(self, rows: Sequence[TableRow]) -> TextTable:
        """The same table with other rows."""
        return replace(self, rows=tuple(rows))


def read_table(path: Path) -> TextTable:
    """Read a CSV file: UTF-8, commas, at most one head of `# key: value` lines, one line of columns, then rows."""
    lines = _lines(path)
    start = next((k for k, line in enumerate(lines) if line.strip() and not line.lstrip().startswith("#")), None)
    if start is None:
        problem = "holds a header but no table" if any(line.strip() for line in lines) else "is empty"
        raise HistoryError(f"{path}: the file {problem}; write a line of columns such as time_s,strain, then rows")
    columns = _cells(path, start + 1, lines[start])
    _check_columns(f"{path}:{start + 1}", columns)
    numbered_lines = ((number, line) for number, line in enumerate(lines[start + 1 :], start + 2) if line.strip())
    rows = tuple(TableRow(number, _cells(path, number, line)) for number, line in numbered_lines)
    for row in rows:
        if len(row.cells) != len(columns):
            description = f"number of cells {len(row.cells)}, of columns {len(columns)}"
            raise HistoryError(f"{path}:{row.line}: {description}; write one cell a column, separated by commas")
    if not rows:
        raise HistoryError(f"{path}:{start + 1}: no rows below the line of columns; a table needs at least one")
    return TextTable(path, _header(path, lines[:start]), columns, start + 1, rows)


def read_head_alone(path: Path) -> dict[str, SourceText] | None:
    """The entries of a file that holds a head of `# key: value` lines and no table; None where it holds a table."""
    lines = _lines(path)
    entries = _header(path, lines) if all(not line.strip() or line.lstrip().startswith("#") for line in lines) else {}
    return entries or None


TABLE_FILE = FileKind("a table of a test", HistoryError, "save the table as CSV in UTF-8", maximum_bytes=1_000_000_000)


def peek_columns(path: Path, byte_limit: int = 65536) -> tuple[str, ...]:
    """The columns of a file as far as its beginning shows them, () when it has none; never raises for what it holds."""
    try:
        text = read_bytes(path, TABLE_FILE, first=byte_limit).decode("utf-8-sig", errors="replace")
    except HistoryError:
        return ()
    lines = (line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#"))
    return tuple(cell.strip() for cell in next(lines, "").split(","))


def _lines(path: Path) -> list[str]:
    """The lines of a text file as an editor counts them (str.splitlines also breaks at form feeds and the like)."""
    text = read_text(path, TABLE_FILE)
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def _cells(path: Path, number: int, line: str) -> tuple[str, ...]:
    """The cells of one line; read line by line so that a stray quote cannot swallow the rest of the file."""
    try:
        return tuple(cell.strip() for cell in next(csv.reader([line], strict=True)))
    except csv.Error as error:
        raise HistoryError(f"{path}:{number}: not a line of a CSV table ({error}); look for stray quotes") from error


def _header(path: Path, lines: Sequence[str]) -> dict[str, SourceText]:
    """The `# key: value` lines; a `#` line without a colon is a remark."""
    header: dict[str, SourceText] = {}
    for number, line in enumerate(lines, 1):
        key, colon, text = line.strip().removeprefix("#").partition(":")
        key = key.strip()
        if not colon:
            continue
        if key in header:
            first = header[key].location.rpartition(":")[2]
            raise HistoryError(f"{path}:{number}: '{key}' was already given in line {first}; keep one of them")
        header[key] = SourceText(text.strip(), f"{path}:{number}")
    return header


def _check_columns(location: str, columns: Sequence[str]) -> None:
    for name in columns:
        if not name:
            raise HistoryError(f"{location}: a column has no name; name every column, such as time_s,strain")
        if columns.count(name) > 1:
            raise HistoryError(f"{location}: the column '{name}' stands there twice; keep one of them")


@dataclass(frozen=True)
class TableFrames:
    """The frames of one test.

    values : {quantity: (frames,)} in MPa, mm, s, K; "time" is among them and increases strictly.
    lines : (frames,) the line of the file in which each frame stands.
    merged_count : number of frames that were merged into another one of the same time.
    """

    path: Path
    values: Mapping[str, Floats]
    lines: Ints
    merged_count: int = 0

    @property
    def times(self) -> Floats:
        """(frames,) s."""
        return self.values["time"]

    def location(self, frame: int) -> str:
        """Where a frame stands, 'file:line'."""
        return f"{self.path}:{self.lines[frame]}"


def read_frames(
    table: TextTable, vocabulary: HeaderVocabulary, terms: Terms, skipped_columns: Collection[str] = ()
) -> TableFrames:
    """Read the frames in a table, except the columns in `skip` and those that are averaged to labels."""
    kinds = terms.column_kinds
    ignored = {*skipped_columns, *(name for names in vocabulary.averaged_columns.values() for name in names)}
    values: dict[str, Floats] = {}
    for name in table.columns:
        if name not in ignored:
            quantity, suffix = _parsed_column(table, vocabulary.synonyms.get(name, name), kinds)
            if quantity in values:
                raise HistoryError(f"{table.location(table.columns_line)}: two columns hold the {quantity}; keep one")
            values[quantity] = _converted_column(table, name, kinds[quantity], suffix)
    if "time" not in values:
        place, result = table.location(table.columns_line), ", ".join(table.columns)
        raise HistoryError(f"{place}: missing column: no time among {result}; name one time_s, time_min or time_h")
    return _strictly_increasing(TableFrames(table.path, values, np.array([row.line for row in table.rows])))


def column_means(table: TextTable, vocabulary: HeaderVocabulary) -> dict[str, str]:
    """The labels that are means over all frames of some columns, with two decimals."""
    return {
        label: f"{np.mean([table.numbers(name) for name in names]):.2f}"
        for label, names in vocabulary.averaged_columns.items()
    }


def _parsed_column(table: TextTable, name: str, kinds: Mapping[str, QuantityKind]) -> tuple[str, str]:
    """Quantity and unit suffix of a column."""
    location = table.location(table.columns_line)
    result = split_unit(name, kinds)
    if result is None:
        raise HistoryError(f"{location}: column '{name}' is not understood; {nearest(name, kinds)}")
    quantity, suffix = result
    kinds[quantity].unit(suffix, location, name)
    return result


def _converted_column(table: TextTable, name: str, kind: QuantityKind, suffix: str) -> Floats:
    """One column in creepkit's unit."""
    locations = (table.location(row.line) for row in table.rows)
    return np.array(
        [kind.convert(x, suffix, place, name) for x, place in zip(table.numbers(name), locations, strict=True)]
    )


def _strictly_increasing(frames: TableFrames) -> TableFrames:
    """Refuse a time that falls; merge frames of equal time into their mean.

    A clock that is coarser than the recording, or a last reading at rupture, gives several frames one time. Their
    mean favours none of them; how many were merged is kept.
    """
    time_differences = np.diff(frames.times)
    if (time_differences < 0).any():
        k = int(np.argmax(time_differences < 0)) + 1
        before, after = frames.times[k - 1], frames.times[k]
        raise HistoryError(f"{frames.location(k)}: time falls from {before:g} s to {after:g} s; it must never decrease")
    first = np.flatnonzero(np.concatenate(([True], time_differences > 0)))
    counts = np.diff(np.append(first, frames.times.size))
    values = {name: np.add.reduceat(column, first) / counts for name, column in frames.values.items()}
    if first.size < 2:
        raise HistoryError(f"{frames.location(0)}: only one frame in time; at least two are needed to identify a law")
    return TableFrames(frames.path, values, frames.lines[first], frames.times.size - first.size)
