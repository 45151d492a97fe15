"""Tables of instruments, read part by part: a record of days at ten rows a second must not fill the memory."""

from __future__ import annotations

import codecs
import io
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.errors import HistoryError
from creepkit.files.delimited_text import (
    Dialect,
    detect_dialect,
    is_number,
    parse_numbers,
    refuse_unprintable,
    split_line,
)
from creepkit.files.labview import is_labview, table_of_labview
from creepkit.files.reading import FileKind, open_binary
from creepkit.files.time_stamps import ClockColumn, is_clock_time
from creepkit.instruments.column_heads import channel_unit, time_factor
from creepkit.readers.table import is_comment

RECORD_FILE = FileKind(
    "a record of an instrument", HistoryError, "export the record as a table of text", maximum_bytes=8_000_000_000
)


PART_CHARACTERS, LONGEST_LINE = 2_000_000, 1_000_000
"""That are read at once, and of a line; the smallest table of 20,000 columns fits in."""


_HEAD_LINES = 300
"""Lines within which the rows of a table begin."""


MISSING = frozenset(
    form
    for word in (
        *("", "-", "--", "---", "nan", "-nan", "n/a", "na", "#n/a", "null", "none", "ol", "-ol", "o.l", "overload"),
        *("over", "overrange", "open", "err", "error", "inf", "-inf", "+inf", "-nan(ind)", "1.#qnan", "-1.#ind"),
        *("infinity", "bad", "fault", "invalid", "no data", "*****", "####", "#value!", "1.#inf"),
    )
    for form in (word, word.upper(), word.title(), word.capitalize(), "NaN" if word == "nan" else word)
)
"""What data loggers write in the place of a reading."""


SENTINELS = (-999.0, -9999.0, -99999.0, -999.9, -9999.9)
"""Numbers that data loggers write in the place of a reading."""


def _western(error: UnicodeError) -> tuple[str, int]:
    """The bytes that are not UTF-8 as those of Windows Latin."""
    assert isinstance(error, UnicodeDecodeError)
    return error.object[error.start : error.end].decode("cp1252"), error.end


codecs.register_error("creepkit.western", _western)


def numbered_lines(path: Path) -> Iterator[tuple[int, str]]:
    """Number and text, with its line feed, of each line of a file, whatever its encoding and its ends of lines."""
    with open_binary(path, RECORD_FILE) as stream:
        start = stream.read(LONGEST_LINE)
        stream.seek(0)
        is_wide = start.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
        if b"\0" in start and not is_wide:  # before a line without an end is read
            raise _no_text(path, start[: start.index(b"\0")].count(b"\n") + 1, 0)
        if len(start) == LONGEST_LINE and not {*b"\r\n"} & {*start}:
            raise HistoryError(f"{path}:1: a line of more than {LONGEST_LINE} characters; save it as a table")
        encoding, errors = ("utf-16", "strict") if is_wide else ("utf-8-sig", "creepkit.western")
        whole, has_heads = io.TextIOWrapper(stream, encoding, errors), is_labview(start[:200].decode("latin-1"))
        text: io.TextIOBase = io.StringIO(table_of_labview(whole.read()) + "\n") if has_heads else whole
        first = 1
        try:
            while lines := text.readlines(PART_CHARACTERS):
                part = "".join(lines)
                if "\0" in part:
                    raise _no_text(path, first + part[: part.index("\0")].count("\n"), 0)
                refuse_unprintable(part, lambda k: f"{path}:{first + part[:k].count(chr(10))}")  # noqa: B023
                yield from enumerate(lines, first)
                first += len(lines)
        except UnicodeDecodeError as error:
            raise _no_text(path, first, error.object[error.start]) from None


def _no_text(path: Path, line: int, byte: int) -> HistoryError:
    return HistoryError(f"{path}:{line}: byte 0x{byte:02x} is not text; save the table as text in UTF-8")


@dataclass(frozen=True)
class TableHead:
    """Where a table begins.

    dialect : of its rows. names, units : of its columns, units only where they stand in a row of their own.
    names_line, first_row : line numbers. first_cells : of the first row.
    """

    path: Path
    dialect: Dialect
    names: tuple[str, ...]
    units: tuple[str, ...]
    names_line: int
    first_row: int
    first_cells: tuple[str, ...]

    @property
    def place(self) -> str:
        """Where the names stand."""
        return f"{self.path}:{self.names_line}"

    @property
    def has_clock(self) -> bool:
        """Whether the first row has a date or a time of day, as records of instruments do."""
        return any(map(is_clock_time, self.first_cells))


def find_head(path: Path) -> TableHead:
    """The beginning of the table: the first row of readings, the line of names above it, maybe one of units between."""
    sample = [(number, line) for number, line in islice(numbered_lines(path), _HEAD_LINES) if line.strip()]
    if not sample:
        raise HistoryError(f"{path}: the file is empty; a record needs a line of names and rows of readings")
    plain = [line for _, line in sample if not is_comment(line)]
    dialect = detect_dialect(plain[len(plain) // 2 :] or plain, str(path))

    def cells_of(number: int, line: str) -> list[str]:
        text = line.lstrip().removeprefix("#") if is_comment(line) else line
        return split_line(text.strip("\n"), dialect, f"{path}:{number}")

    rows = (k for k, (n, line) in enumerate(sample) if not is_comment(line) and _is_row(cells_of(n, line), dialect))
    at = next(rows, None)
    if at is None:
        other = Dialect(dialect.delimiter, ",.".replace(dialect.decimal, ""))
        for number, line in sample:  # a row of readings, were all its decimal signs the same, is told by its odd one
            cells = [cell for cell in cells_of(number, line) if not is_clock_time(cell)]
            if len(cells) > 1 and all(is_number(cell, dialect) or is_number(cell, other) for cell in cells):
                parse_numbers(cells, dialect, f"{path}:{number}".format, "a reading")
        raise HistoryError(
            f"{path}:{sample[0][0]}: no row of readings, a time and numbers, in the first {_HEAD_LINES} lines; name a "
            "table"
        )
    number, first = sample[at][0], cells_of(*sample[at])
    above = [(n, cells_of(n, line)) for n, line in sample[:at]]
    fitting = [(n, names) for n, names in above if abs(len(names) - len(first)) <= 1 and len(names) > 1]
    if not fitting:
        raise HistoryError(
            f"{path}:{number}: the rows begin here, with {len(first)} columns, and no line above names as many; "
            "write a line of names such as time_s,pressure_bar,temperature_C"
        )
    names_line, names = fitting[-1]
    units: list[str] = []
    if len(fitting) > 1 and _is_units(names) and not _is_units(fitting[-2][1]):
        units, (names_line, names) = [text.strip("()[] ") for text in names], fitting[-2]
    for n, between in above:
        if n > names_line and any(is_number(cell, dialect) or is_clock_time(cell) for cell in between):
            raise HistoryError(
                f"{path}:{n}: a row of {len(between)} cells, and the names above it are {len(names)}; write one "
                "cell a column, or remove the row"
            )
    while len(names) > 1 and not names[-1]:
        names = names[:-1]
    units = [*units, *[""] * len(names)][: len(names)]
    return TableHead(path, dialect, tuple(names), tuple(units), names_line, number, tuple(first))


def _is_row(cells: Sequence[str], dialect: Dialect) -> bool:
    """Whether a line holds readings: at least one number or time, and nothing else but lost readings."""
    count = sum(is_number(cell, dialect) or is_clock_time(cell) for cell in cells)
    return len(cells) > 1 and count > 0 and count + sum(cell in MISSING for cell in cells) >= 0.8 * len(cells)


def _is_units(cells: Sequence[str]) -> bool:
    texts = [cell.strip("()[] ") for cell in cells if cell.strip("()[] ")]
    known = sum(bool(channel_unit(text) or time_factor(text)) for text in texts)
    return bool(texts) and known >= 0.5 * len(cells)


@dataclass(frozen=True)
class Rows:
    """Some rows of a table. lines : (rows,) their numbers. cells : of each."""

    head: TableHead
    lines: Ints
    cells: Sequence[Sequence[str]]

    def texts(self, column: int) -> list[str]:
        """The cells of a column."""
        return [row[column].strip() for row in self.cells]

    def place(self, column: int) -> Callable[[int], str]:
        """Where a cell of a column stands, by its row."""
        return lambda k: f"{self.head.path}:{self.lines[k]}, column {column + 1}"

    def numbers(self, column: int, missing: frozenset[str] = frozenset()) -> Floats:
        """(rows,) of a column; NaN for texts that stand for a lost reading."""
        head = self.head
        return parse_numbers(self.texts(column), head.dialect, self.place(column), head.names[column], missing)

    def readings(self, column: int, missing: frozenset[str]) -> Floats:
        """(rows,) of a channel; NaN for texts and numbers that stand for a lost reading."""
        values = self.numbers(column, missing)
        return np.where(np.isin(values, SENTINELS), np.nan, values)

    def add_to(self, clock: ClockColumn, columns: Sequence[int]) -> None:
        """Read clock times, of one column or of date and time."""
        parts = [self.texts(column) for column in columns]
        place = self.place(columns[-1])
        clock.add([" ".join(texts) for texts in zip(*parts, strict=True)], [place(k) for k in range(len(self.cells))])


class RowReader:
    """Reads the rows of a table, part by part.

    cut : line of a last row that was cut off, 0 where none was. has_end : whether the last line has a line end.
    """

    def __init__(self, head: TableHead) -> None:
        self.head, self.cut, self.has_end = head, 0, True

    def parts(self) -> Iterator[Rows]:
        """The parts, none of them empty."""
        lines, cells, size = list[int](), list[Sequence[str]](), 0
        for number, line in numbered_lines(self.head.path):
            self.has_end = line.endswith("\n")
            if number < self.head.first_row or not line.strip() or is_comment(line):
                continue
            if self.cut:
                raise HistoryError(self._wrong_count(*self._shorter))
            row = self._row(line.removesuffix("\n"), number)
            if row:
                lines.append(number)
                cells.append(row)
                size += len(line)
            if size > PART_CHARACTERS:
                yield Rows(self.head, np.array(lines), cells)
                lines, cells, size = [], [], 0
        if lines:
            yield Rows(self.head, np.array(lines), cells)

    def _row(self, line: str, number: int) -> Sequence[str]:
        """The cells of a row, one for each name; () for one with fewer, as the last one may be that was cut off."""
        head, count = self.head, len(self.head.names)
        is_plain = '"' not in line and head.dialect.delimiter != " "  # blanks are taken off those that are read
        cells = (
            line.split(head.dialect.delimiter) if is_plain else split_line(line, head.dialect, f"{head.path}:{number}")
        )
        if len(cells) == count:
            return cells
        if len(cells) == count + 1 and not cells[-1].strip():
            return cells[:-1]
        if head.dialect.delimiter == " " and len(cells) == count + 1 and is_clock_time(" ".join(cells[:2])):
            return [" ".join(cells[:2]), *cells[2:]]
        if len(cells) > count:
            raise HistoryError(self._wrong_count(number, len(cells)))
        self.cut, self._shorter = number, (number, len(cells))
        return ()

    def _wrong_count(self, number: int, cells: int) -> str:
        head = self.head
        return (
            f"{head.path}:{number}: number of cells {cells}, of names {len(head.names)} (line {head.names_line}); "
            "write one cell a column"
        )


def means(values: Floats, starts: Ints) -> Floats:
    """(groups,) means of values (rows,) from each of the starts (groups,) to the next, NaN left out."""
    seen = ~np.isnan(values)
    counts = np.add.reduceat(seen.astype(float), starts)
    sums = np.add.reduceat(np.where(seen, values, 0.0), starts)
    return np.asarray(np.divide(sums, counts, out=np.full(counts.size, np.nan), where=counts > 0))
