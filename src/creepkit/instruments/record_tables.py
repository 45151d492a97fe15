"""Tables of instruments, read part by part: only the columns that were asked for are kept, averaged where asked."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.errors import HistoryError, quoted
from creepkit.files.delimited_text import (
    ERROR_VALUES,
    Dialect,
    decode_text,
    detect_dialect,
    is_number,
    parse_numbers,
    split_line,
)
from creepkit.files.labview import is_labview, table_of_labview
from creepkit.files.limits import how_to_raise, raised
from creepkit.files.reading import FileKind, open_binary, read_range
from creepkit.files.time_stamps import ClockColumn, is_clock_time
from creepkit.instruments.column_heads import TIME_UNITS, channel_unit

RECORD_FILE = FileKind(
    "a record of an instrument", HistoryError, "export the record as a table of text", maximum_bytes=8_000_000_000
)


PART_BYTES, LONGEST_LINE = 2_000_000, 1_000_000
"""Bytes that are read at once, and of a line; the smallest table of 20,000 columns fits in."""


MOST_VALUES = 60_000_000
"""Readings that are kept: half a gigabyte."""


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


@dataclass(frozen=True)
class TableHead:
    """Where a table begins.

    dialect : of its rows. names, units : of its columns, units only where they stand in a row of their own.
    names_line, first_row : line numbers. remarks : the lines above the names.
    """

    dialect: Dialect
    names: tuple[str, ...]
    units: tuple[str, ...]
    names_line: int
    first_row: int
    remarks: tuple[str, ...]


def is_remark(line: str) -> bool:
    """Whether a line is a remark, and no row that begins with #N/A."""
    text = line.lstrip()
    return text.startswith("#") and not text.startswith(ERROR_VALUES)


def numbered_lines(path: Path) -> Iterator[list[tuple[int, str]]]:
    """The lines of a file with their numbers, part by part, empty ones and remarks that begin with # included."""
    number, rest = 1, b""
    with open_binary(path, RECORD_FILE) as stream:
        while True:
            part = stream.read(PART_BYTES)
            if number == 1 and not rest and part[:2] in (b"\xff\xfe", b"\xfe\xff"):
                part += stream.read(500_000_000)  # two bytes a character, so that parts could not be cut at line ends
                if stream.read(1):
                    raise HistoryError(f"{path}: larger than 500 MB in UTF-16; save it in UTF-8")
            content = rest + part
            if number == 1 and is_labview(content[:200].decode("latin-1")):
                yield _lines_of_labview(content + stream.read(500_000_000), path)
                return
            cut = len(content) if not part or content[:2] in (b"\xff\xfe", b"\xfe\xff") else _last_line_end(content)
            if cut == 0 and len(content) > LONGEST_LINE:
                raise HistoryError(
                    f"{path}:{number}: a line of more than {LONGEST_LINE} characters; save it as a table"
                )
            if cut:
                lines = _decoded_lines(content[:cut], path, number)
                if cut < len(content) or (part and content[cut - 1 : cut] in b"\r\n"):
                    lines.pop()  # what follows the last line end
                yield list(enumerate(lines, number))
                number += len(lines)
            rest = content[cut:]
            if not part:
                return


def _lines_of_labview(content: bytes, path: Path) -> list[tuple[int, str]]:
    """The numbered lines of a LabVIEW measurement as a table."""
    text = "\n".join(_decoded_lines(content, path, 1))
    return list(enumerate(table_of_labview(text).split("\n"), 1))


def ends_with_line_end(path: Path) -> bool:
    """Whether a line that the instrument wrote to its end is the last one."""
    last = read_range(path, RECORD_FILE, max(path.stat().st_size - 2, 0), 2).replace(b"\0", b"")  # also in UTF-16
    return last[-1:] in (b"\n", b"\r")


def _last_line_end(content: bytes) -> int:
    """Bytes up to the last end of a line; one by a carriage return needs a character behind it."""
    return max(content.rfind(b"\n"), content.rfind(b"\r", 0, -1)) + 1


def _decoded_lines(content: bytes, path: Path, first: int) -> list[str]:
    try:
        text = decode_text(content, path)
    except HistoryError as error:
        place, _, message = str(error).removeprefix(f"{path}:").partition(":")
        if place.isdigit():
            raise HistoryError(f"{path}:{int(place) + first - 1}:{message}") from None
        raise
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    if len(content) > LONGEST_LINE:
        for k, line in enumerate(lines):
            if len(line) > LONGEST_LINE:
                raise HistoryError(f"{path}:{first + k}: a line of {len(line)} characters; save it as a table of text")
    return lines


def find_head(path: Path, lines: Sequence[tuple[int, str]]) -> TableHead:
    """The beginning of the table: the first row of readings, the line of names above it, maybe one of units between."""
    sample = [(number, line) for number, line in lines[:_HEAD_LINES] if line.strip()]
    if not sample:
        raise HistoryError(f"{path}: the file is empty; a record needs a line of names and rows of readings")
    plain = [line for _, line in sample if not is_remark(line)]
    dialect = detect_dialect(plain[len(plain) // 2 :] or plain, str(path))
    for k, (number, line) in enumerate(sample):
        if is_remark(line):
            continue
        cells = _cells(line, dialect, f"{path}:{number}")
        if not _is_row(cells, dialect):
            continue
        above = [(n, _cells(text.lstrip().removeprefix("#"), dialect, f"{path}:{n}")) for n, text in sample[:k]]
        fitting = [(n, names) for n, names in above if abs(len(names) - len(cells)) <= 1 and len(names) > 1]
        if not fitting:
            raise HistoryError(
                f"{path}:{number}: the rows begin here, with {len(cells)} columns, and no line above names as many; "
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
            names.pop()
        units = [*units, *[""] * len(names)][: len(names)]
        remarks = tuple(text.strip() for n, text in sample if n < names_line)
        return TableHead(dialect, tuple(names), tuple(units), names_line, number, remarks)
    for number, line in sample:
        _check_decimal_signs(_cells(line, dialect, f"{path}:{number}"), dialect, f"{path}:{number}")
    raise HistoryError(
        f"{path}:{sample[0][0]}: no row of readings, a time and numbers, in the first {_HEAD_LINES} lines; name a table"
    )


def has_clock(path: Path) -> bool:
    """Whether the first row of readings has a date or a time of day, as records of instruments do."""
    lines = next(numbered_lines(path), [])
    head = find_head(path, lines)
    first = next((line for number, line in lines if number == head.first_row), "")
    return any(is_clock_time(cell) for cell in _cells(first, head.dialect, f"{path}:{head.first_row}"))


def _cells(line: str, dialect: Dialect, location: str) -> list[str]:
    if '"' in line:
        return split_line(line, dialect, location)
    return line.split() if dialect.delimiter == " " else [cell.strip() for cell in line.split(dialect.delimiter)]


def _is_row(cells: Sequence[str], dialect: Dialect) -> bool:
    """Whether a line holds readings: at least one number or time, and nothing else but lost readings."""
    count = sum(is_number(cell, dialect) or is_clock_time(cell) for cell in cells)
    return len(cells) > 1 and count > 0 and count + sum(cell in MISSING for cell in cells) >= 0.8 * len(cells)


def _check_decimal_signs(cells: Sequence[str], dialect: Dialect, location: str) -> None:
    """HistoryError for a row that would be one of readings if all its decimal signs were the same."""
    other = Dialect(dialect.delimiter, "," if dialect.decimal == "." else ".")
    numbers = sum(is_number(cell, dialect) or is_clock_time(cell) for cell in cells)
    odd = [cell for cell in cells if is_number(cell, other) and not is_number(cell, dialect)]
    if len(cells) > 1 and odd and numbers + len(odd) >= 0.8 * len(cells):
        words = "points" if dialect.decimal == "." else "commas"
        raise HistoryError(
            f"{location}: '{quoted(odd[0])}', where the other numbers have decimal {words}; write all numbers alike, "
            "without separators between thousands"
        )


def _is_units(cells: Sequence[str]) -> bool:
    texts = [cell.strip("()[] ") for cell in cells if cell.strip("()[] ")]
    known = sum(channel_unit(text) is not None or text in TIME_UNITS for text in texts)
    return bool(texts) and known >= 0.5 * len(cells)


@dataclass
class KeptColumns:
    """What is read of the rows, part by part.

    columns : positions of the channels. times : positions of the column of time, or of date and time.
    every : rows that are averaged to one.
    """

    path: Path
    head: TableHead
    columns: tuple[int, ...]
    times: tuple[int, ...]
    every: int
    missing: frozenset[str]

    def __post_init__(self) -> None:
        self.clock: ClockColumn | None = None
        self.numbers: list[Floats] = []
        self.values: list[list[Floats]] = [[] for _ in self.columns]
        self.lines: list[Ints] = []
        self.incomplete = 0
        self._pending: list[tuple[int, list[str]]] = []
        self._rows = 0

    def add(self, lines: Sequence[tuple[int, str]], last: bool) -> None:
        """Read more lines. last : whether the file ends with them."""
        dialect, first, count = self.head.dialect, self.head.first_row, len(self.head.names)
        rows = self._pending
        for number, line in lines:
            if number < first or not line.strip() or is_remark(line):
                continue
            if '"' in line or dialect.delimiter == " ":
                cells = _cells(line, dialect, f"{self.path}:{number}")
            else:
                cells = line.split(dialect.delimiter)  # blanks are taken off those that are read
            if len(cells) != count:
                cells = self._fitted(cells, number, count, last and number == lines[-1][0])
                if not cells:
                    continue
            rows.append((number, cells))
        whole = len(rows) if last else len(rows) - len(rows) % self.every
        self._pending = rows[whole:]
        if whole:
            self._read(rows[:whole])

    def _fitted(self, cells: list[str], number: int, count: int, is_last: bool) -> list[str]:
        """The cells of a row, one for each name; [] for a last one that was cut off."""
        if len(cells) == count + 1 and not cells[-1].strip():
            return cells[:-1]
        if self.head.dialect.delimiter == " " and len(cells) == count + 1 and is_clock_time(" ".join(cells[:2])):
            return [" ".join(cells[:2]), *cells[2:]]
        if is_last and len(cells) < count:
            self.incomplete = number
            return []
        raise HistoryError(
            f"{self.path}:{number}: number of cells {len(cells)}, of names {count} (line {self.head.names_line}); "
            "write one cell a column"
        )

    def _read(self, rows: list[tuple[int, list[str]]]) -> None:
        self._rows += len(rows)
        if len(self.columns) * self._rows > MOST_VALUES * self.every and (
            len(self.columns) * self._rows > (most := raised(MOST_VALUES)) * self.every
        ):
            raise HistoryError(
                f"{self.path}: more than {most} readings; ask for channels=[...], or for every=10, the mean of ten "
                f"rows; or {how_to_raise(2 * most, most)}"
            )
        numbers = [number for number, _ in rows]
        self.lines.append(np.array(numbers, dtype=np.int64))
        self._read_times(rows)
        for k, column in enumerate(self.columns):
            self.values[k].append(block_means(self._column(rows, column), self.every))

    def _read_times(self, rows: list[tuple[int, list[str]]]) -> None:
        column = self.times[-1]
        if len(self.times) == 2:
            texts = [f"{cells[self.times[0]].strip()} {cells[column].strip()}" for _, cells in rows]
        else:
            texts = [cells[column].strip() for _, cells in rows]
        if self.clock is None and not self.numbers and is_clock_time(texts[0]):
            self.clock = ClockColumn()
        if self.clock is not None:
            self.clock.add(texts, [f"{self.path}:{number}, column {column + 1}" for number, _ in rows])
            return
        self.numbers.append(parse_numbers(texts, self.head.dialect, self._place(rows, column), self.head.names[column]))

    def _place(self, rows: list[tuple[int, list[str]]], column: int) -> Callable[[int], str]:
        return lambda k: f"{self.path}:{rows[k][0]}, column {column + 1}"

    def _column(self, rows: list[tuple[int, list[str]]], column: int) -> Floats:
        texts = [cells[column].strip() for _, cells in rows]
        values = parse_numbers(
            texts, self.head.dialect, self._place(rows, column), self.head.names[column], self.missing
        )
        lost = np.isin(values, SENTINELS)
        if lost.any():
            values = np.where(lost, np.nan, values)
        return values


def block_means(values: Floats, every: int) -> Floats:
    """(blocks,) means of `every` of the values (rows,) after each other, NaN left out; the last of what is left."""
    if every == 1:
        return values
    edges = np.arange(0, values.size, every)
    seen = ~np.isnan(values)
    counts = np.add.reduceat(seen.astype(float), edges)
    sums = np.add.reduceat(np.where(seen, values, 0.0), edges)
    return np.asarray(np.divide(sums, counts, out=np.full(counts.size, np.nan), where=counts > 0))
