"""Text of a measured file as a table whose cells keep their location, and its frames as arrays.

Whatever the cells come from, text in any dialect or a sheet, they arrive here as a TextTable. Columns are converted to
MPa, mm, s and K; times increase strictly.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from pathlib import Path

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.errors import HistoryError, quoted
from creepkit.files.delimited_text import Dialect, is_missing, is_number, parse_number, parse_numbers
from creepkit.readers.column_names import NameTable, split_written_name
from creepkit.readers.ends_of_tests import FIRM, LABEL, kind_of_column
from creepkit.readers.questions import Question
from creepkit.readers.table_rows import NumberRows, TableRow, cells_of
from creepkit.readers.vocabulary import HeaderVocabulary, Terms, split_unit
from creepkit.records.quantities import QuantityKind


@dataclass(frozen=True)
class SourceText:
    """One piece of text and its place, 'file:line'.

    decimal : the decimal sign of the table that it stands beside; a decimal point is understood in any case.
    key : the key or column as it was written, where it is known by another name; "" else.
    """

    text: str
    location: str
    decimal: str = "."
    key: str = ""

    def number(self, name: str) -> float:
        """The text as a finite number; `name` says in the error what it was meant to be."""
        dialect = Dialect(decimal=self.decimal)
        if self.decimal == "," and not is_number(self.text, dialect) and not _POINT_OF_THOUSANDS.fullmatch(self.text):
            dialect = Dialect()
        return parse_number(self.text, dialect, self.location, name)


_POINT_OF_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2}\.\d{3}", re.ASCII)
"""Beside decimal commas 1.234 may be 1234."""


NOISE_OF_ZERO = 0.01
"""Of the largest reading of a load: a reading that is less below zero is one of none."""


def some_of(names: Sequence[str], count: int = 12) -> str:
    """Names as messages list them: the first ones, each not longer than 40, and how many there are."""
    shown = ", ".join(quoted(name, 40) for name in names[:count])
    return shown if len(names) <= count else f"{shown} and {len(names) - count} more"


@dataclass(frozen=True)
class TextTable:
    """A table as it was written: the entries of its head, its columns, its rows; all still text.

    sheet : of a spreadsheet, "" elsewhere. positions : the column of the file, from 0, in which each column stands,
    where errors must tell it. assumptions : what was assumed of the table, for the label "assumed". written : the
    columns as they were written, where they were given creepkit's names. sources : what titles and names of sheets and
    files state of its test, which must agree with what else does.
    """

    path: Path
    header: Mapping[str, SourceText]
    columns: Sequence[str]
    columns_line: int
    rows: Sequence[TableRow]
    dialect: Dialect = field(default_factory=Dialect)
    sheet: str = ""
    positions: Sequence[int] = ()
    assumptions: tuple[str, ...] = ()
    written: Sequence[str] = ()
    sources: tuple[SourceText, ...] = ()

    def location(self, line_number: int, column: int | None = None) -> str:
        """Where a line stands, 'file:line', or 'file, sheet 'creep', row 3' in a spreadsheet; or a cell of it."""
        place = location_in(self.path, self.sheet, line_number)
        return place if column is None or not self.positions else f"{place}, column {self._column_label(column)}"

    def column(self, name: str) -> int:
        """The number of a column that must be there."""
        if name not in self.columns:
            result = some_of(self.columns)
            raise HistoryError(f"{self.location(self.columns_line)}: missing column '{name}'; found: {result}")
        return self.columns.index(name)

    def as_written(self, column: int) -> str:
        """The name of a column as the file has it."""
        return (self.written or self.columns)[column]

    def numbers(self, name: str) -> Floats:
        """(rows,) One column as numbers."""
        k = self.column(name)
        if isinstance(self.rows, NumberRows):
            return self.rows.numbers[:, k]
        cells = list(cells_of(self.rows, k))
        return parse_numbers(cells, self.dialect, lambda row: self.location(self.rows[row].line, k), self.as_written(k))

    @property
    def lines(self) -> Ints:
        """(rows,) The line of the file in which each row stands."""
        if isinstance(self.rows, NumberRows):
            return self.rows.lines
        return np.array([row.line for row in self.rows], dtype=int)

    def entries(self, row: TableRow) -> dict[str, SourceText]:
        """The cells of one row by column, those left empty excepted."""
        place, decimal = self.location(row.line), self.dialect.decimal
        return {
            n: SourceText(cell, place, decimal)
            for n, cell in zip(self.columns, row.cells, strict=True)
            if not is_missing(cell)
        }

    def empty_columns(self, row: TableRow) -> list[str]:
        """The columns whose cell in one row is empty: what they would say of it is unknown."""
        return [name for name, cell in zip(self.columns, row.cells, strict=True) if is_missing(cell)]

    def with_rows(self, rows: Sequence[TableRow]) -> TextTable:
        """The same table with other rows."""
        return replace(self, rows=rows)

    def _column_label(self, column: int) -> str:
        """The letters of a spreadsheet's column, elsewhere its number from 1."""
        number = self.positions[column] + 1
        if not self.sheet:
            return str(number)
        letters = ""
        while number:
            number, digit = divmod(number - 1, 26)
            letters = chr(ord("A") + digit) + letters
        return letters


def location_in(path: Path, sheet: str, line: int) -> str:
    """Where a line of a text or a row of a sheet stands."""
    return f"{path}, sheet '{sheet}', row {line}" if sheet else f"{path}:{line}"


def check_columns(location: str, columns: Sequence[str]) -> None:
    """Refuse a column without a name, and a name that stands there twice."""
    if "" in columns:
        raise HistoryError(f"{location}: a column has no name; name every column, such as time_s,strain_pct")
    seen: set[str] = set()
    for name in columns:
        if name in seen:
            raise HistoryError(f"{location}: the column '{name}' stands there twice; keep one of them")
        seen.add(name)


@dataclass(frozen=True)
class TableFrames:
    """The frames of one test.

    values : {quantity: (frames,)} in MPa, mm, s, K; "time" is among them and increases strictly.
    lines : (frames,) the line of the file in which each frame stands.
    merged_count : number of frames that were merged into another one of the same time.
    """

    table: TextTable
    values: Mapping[str, Floats]
    lines: Ints
    merged_count: int = 0

    @property
    def times(self) -> Floats:
        """(frames,) s."""
        return self.values["time"]

    def location(self, frame: int) -> str:
        """Where a frame stands, 'file:line'."""
        return self.table.location(int(self.lines[frame]))


def read_frames(
    table: TextTable, vocabulary: HeaderVocabulary, terms: Terms, skipped_columns: Collection[str] = ()
) -> TableFrames:
    """Read the frames in a table, except `skipped_columns` and those that are averaged to labels."""
    kinds = terms.column_kinds
    averaged = (name for names in vocabulary.averaged_columns.values() for name in names)
    ignored = {*skipped_columns, *vocabulary.labels, *averaged}
    values: dict[str, Floats] = {}
    found: dict[str, str] = {}
    for k, name in enumerate(table.columns):
        written = table.as_written(k)
        if ignored.isdisjoint((name, written)):
            quantity, suffix = _parsed_column(table, k, vocabulary.synonyms.get(name, name), kinds)
            if quantity in values:
                raise column_question(
                    table,
                    f"'{found[quantity]}' and '{written}' both hold the {quantity}; which counts?",
                    *({one: UNUSED} for one in (written, found[quantity])),
                )
            values[quantity] = _converted_column(table, name, kinds[quantity], suffix)
            if quantity == "used":
                _check_marks(table, k, values[quantity])
            found[quantity] = written
    if "time" not in values:
        place, names = table.location(table.columns_line), table.written or table.columns
        result = f"among {some_of(names)}" if names else "as every column is the same in all rows"
        raise HistoryError(f"{place}: missing column: no time {result}; name one time_s, time_min or time_h")
    return _strictly_increasing(TableFrames(table, values, table.lines))


def column_means(table: TextTable, vocabulary: HeaderVocabulary) -> dict[str, str]:
    """The labels that are means over all frames of some columns, with two decimals."""
    return {
        label: f"{np.mean([table.numbers(name) for name in names]):.2f}"
        for label, names in vocabulary.averaged_columns.items()
    }


def unknown_text(quantity: str) -> str:
    """What is assumed of a condition whose cell is empty."""
    return f"{quantity} unknown (empty cell)"


UNUSED = "unused"
"""What an answer says of a column that stays unread."""


def column_question(table: TextTable, sentence: str, *choices: dict[str, str]) -> Question:
    """The question of what columns of a table are; choices : {column: what it is}, the likely one first."""
    place = table.location(table.columns_line)
    return Question(table.path, place, sentence, "columns", choices, is_free=True)


def _parsed_column(table: TextTable, k: int, name: str, kinds: Mapping[str, QuantityKind]) -> tuple[str, str]:
    """Quantity and unit suffix of a column."""
    location, written = table.location(table.columns_line), table.as_written(k)
    result = split_unit(name, kinds)
    if result is None:
        unit = split_written_name(written)[1]
        sensor, names = _sensor(written, kinds), table.written or table.columns
        others = [other for other in names if other != written and sensor and _sensor(other, kinds) == sensor]
        measured = f"{sensor} ({unit})" if unit else sensor
        if others:
            counts = [
                {one: measured, **{o: UNUSED for o in (written, *others) if o != one}} for one in (written, *others)
            ]
            what = f"'{written}' and '{others[0]}' seem to be several sensors of the {sensor}; which counts?"
            raise column_question(table, what, *counts[:3])
        if sensor and sensor not in {(split_unit(other, kinds) or ("",))[0] for other in table.columns}:
            what = f"'{written}' seems to be a sensor of the {sensor}; is it?"
            raise column_question(table, what, {written: measured}, {written: UNUSED})
        if kind_of_column(written) in (*FIRM, "remark"):
            what = f"column '{written}' holds words beside frames; is it a label of the test?"
            raise column_question(table, what, {written: LABEL}, {written: UNUSED})
        near = get_close_matches(written, kinds, 1, cutoff=0.55)
        meant = f"column '{written}' is not understood; " + (
            f"did you mean '{near[0]}'?" if near else "what does it hold?"
        )
        raise column_question(table, meant, *({written: f"{one} ({unit})"} for one in near), {written: UNUSED})
    quantity, suffix = result
    kinds[quantity].unit(suffix, location, written)
    return result


def _sensor(name: str, kinds: Mapping[str, QuantityKind]) -> str:
    """The quantity that one sensor of several measures, `T1_C` or `Temperature top (C)`; "" where it is none."""
    words = split_written_name(name)[0]
    stem = re.split(r"(?<=[^\d\s_])[\s_.-]*\d+$|[\s_]+(?:top|mid|middle|bot|bottom|[A-Z])$", words)[0]
    return NameTable(kinds).meaning(stem) or ("temperature" if stem.casefold() in ("tc", "thermocouple") else "")


def _converted_column(table: TextTable, name: str, kind: QuantityKind, suffix: str) -> Floats:
    """One column in creepkit's unit."""
    k, numbers = table.column(name), table.numbers(name)
    written = table.as_written(k)
    if kind.low == 0.0 and kind.name in ("stress", "pressure") and numbers.size:  # a reading of none may be below it
        numbers = np.where((numbers < 0.0) & (numbers >= -NOISE_OF_ZERO * numbers.max()), 0.0, numbers)
    return kind.convert_all(numbers, suffix, lambda row: table.location(int(table.lines[row]), k), written)


def _check_marks(table: TextTable, k: int, marks: Floats) -> None:
    """Refuse what neither uses a frame nor leaves it out."""
    for row in np.flatnonzero((marks != 0.0) & (marks != 1.0))[:1]:
        raise HistoryError(
            f"{table.location(int(table.lines[row]), k)}: '{table.as_written(k)}' is {marks[row]:g}; allowed: 1 for a "
            "frame that is used, 0 for one that is not"
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
    return TableFrames(frames.table, values, frames.lines[first], frames.times.size - first.size)
