"""Frames in text: the line of columns is found by the names in it, whatever stands above; rows are read by the core."""

from __future__ import annotations

import ctypes
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import islice
from mmap import ACCESS_READ, mmap
from pathlib import Path

import numpy as np

from creepkit import core
from creepkit.arrays import Floats
from creepkit.errors import HistoryError, quoted
from creepkit.files.delimited_text import ERROR_VALUES, Dialect, decode_text, split_line
from creepkit.files.reading import FileKind, open_binary, read_bytes, read_range

FRAME_FILE = FileKind("a frame of cameras", HistoryError, "name a table of points", maximum_bytes=200_000_000)


HEAD_BYTES = 65536
"""In which the line of columns must stand."""


HEAD_LINES = 500


DELIMITERS = (";", "\t", ",", " ")


BAD_CELL_COUNT, TOO_MANY_ROWS = -1, -3
"""Of NumberTableError in the core."""


LEAST_COLUMNS = 4
"""x, y, u and v."""


_LINE = re.compile(rb"([^\r\n]*)(?:\r\n|\n|\r|\Z)")


_BEGINS_WITH_NUMBER = re.compile(
    rb'\s*"?[+-]?(?:(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eEdD][+-]?\d+)?|nan)"?\s*(?:[;\t,\s]|\Z)', re.IGNORECASE
)
"""A row of numbers, or of a lost point, which names no columns."""


SAMPLE_ROWS = 50
"""Rows whose cells show the decimal sign."""


@dataclass(frozen=True)
class TextHead:
    """The line of columns of a text file.

    line : as it stands in the file, without its end. number : of that line, from 1; 0 of the names of arrays. end :
    first byte behind it.
    """

    line: bytes
    number: int
    end: int
    delimiter: str
    names: tuple[str, ...]

    def location(self, path: Path) -> str:
        """Where it stands, 'file:line'; the names of arrays have no line."""
        return f"{path}:{self.number}" if self.number else str(path)

    @property
    def again(self) -> re.Pattern[bytes]:
        """A whole line that is the same."""
        line = re.escape(self.line)  # which comes first, so that a search looks for its bytes
        return re.compile(line + rb"(?<=[\r\n]" + line + rb")(?=[\r\n]|\Z)")


def is_remark(line: bytes) -> bool:
    """Whether a line is a remark, and no row that begins with #N/A."""
    text = line.lstrip()
    return text.startswith(b"#") and not text.startswith(tuple(word.encode() for word in ERROR_VALUES))


def plain_bytes(content: bytes, path: Path) -> bytes:
    """Text as bytes without a byte order mark and of one byte a digit; HistoryError for what is no text."""
    if content.startswith((b"\xff\xfe", b"\xfe\xff")) or b"\0" in content:
        return decode_text(content, path).encode()
    return content.removeprefix(b"\xef\xbb\xbf")


def head_bytes(path: Path) -> bytes:
    """The beginning of a text file, to the end of a line."""
    content = read_bytes(path, FRAME_FILE, first=HEAD_BYTES)
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return plain_bytes(read_bytes(path, FRAME_FILE), path)[:HEAD_BYTES]
    if len(content) == HEAD_BYTES:
        content = content[: max(content.rfind(b"\n"), content.rfind(b"\r")) + 1] or content
    return plain_bytes(content, path)


def candidate_heads(content: bytes) -> Iterator[TextHead]:
    """The lines of a file that may name columns, divided by each delimiter that they have."""
    for number, found in enumerate(islice(_LINE.finditer(content), HEAD_LINES), start=1):
        if _BEGINS_WITH_NUMBER.match(found[1]):
            continue
        text = _decoded(found[1])
        for delimiter in DELIMITERS:
            names = _names(text, delimiter)
            if len(names) >= LEAST_COLUMNS:
                yield TextHead(found[1], number, found.end(), delimiter, names)


def _decoded(line: bytes) -> str:
    try:
        return line.decode("utf-8")
    except UnicodeDecodeError:
        return line.decode("cp1252", errors="replace")


@lru_cache(maxsize=256)
def _names(text: str, delimiter: str) -> tuple[str, ...]:
    """The cells of a line of columns, which may begin with #; () where the delimiter is not in it."""
    text = text.strip().removeprefix("#").strip(" ")
    if delimiter not in text:
        return ()
    try:
        return tuple(split_line(text, Dialect(delimiter)))
    except HistoryError:
        return ()


@dataclass(frozen=True)
class FrameText:
    """The table of one frame: the bytes of its rows, and where they stand.

    rows : bytes of the rows. names : of all columns. first_line : counts to the line of the first row, for messages.
    """

    path: Path
    rows: bytes
    delimiter: str
    names: tuple[str, ...]
    first_line: Callable[[], int]

    def numbers(self, positions: Sequence[int]) -> Floats:
        """(rows, positions) the numbers of some columns; HistoryError with line and column for what is none."""
        places = np.full(len(self.names), -1, dtype=np.int64)
        places[list(positions)] = np.arange(len(positions))
        capacity = (self.rows.count(b"\n") or self.rows.count(b"\r")) + 1
        out = np.empty((capacity, len(positions)))
        where = np.zeros(3, dtype=np.int64)
        decimal = self._decimal(positions)
        read = core.function("creepkit_read_number_table")(
            self.rows,
            ctypes.c_int64(len(self.rows)),
            ctypes.c_int64(ord(self.delimiter)),
            ctypes.c_int64(ord(decimal)),
            ctypes.c_int64(len(self.names)),
            core.address(places),
            ctypes.c_int64(len(positions)),
            ctypes.c_int64(capacity),
            core.address(out),
            core.address(where),
        )
        if read == TOO_MANY_ROWS:
            raise HistoryError(f"{self.path}: its lines end now in line feeds, now in carriage returns; save it anew")
        if read < 0:
            raise HistoryError(self._problem(int(read), [int(one) for one in where], decimal))
        return out[:read]

    def location(self, row: int) -> str:
        """Where a row of numbers stands, 'file:line'."""
        number = self.first_line()
        for line in self.rows.splitlines():
            if line.strip() and not is_remark(line):
                if row == 0:
                    break
                row -= 1
            number += 1
        return f"{self.path}:{number}"

    def first_row(self) -> FrameText:
        """The table of its first row alone."""
        lines = (line for line in self.rows.splitlines(keepends=True) if line.strip() and not is_remark(line))
        return replace(self, rows=next(lines, b""))

    def _decimal(self, positions: Sequence[int]) -> str:
        """The decimal sign: that in the first of the cells that have one, which between commas stand in quotes."""
        sample = self.rows[:HEAD_BYTES]
        if b"," not in self.rows or (self.delimiter == "," and b'"' not in sample):
            return "."
        rows = [_names(_decoded(line), self.delimiter) for line in sample.splitlines()[:SAMPLE_ROWS]]
        wanted = (cells[k] for cells in rows for k in positions if k < len(cells))
        return next((sign for cell in wanted for sign in ",." if sign in cell), "." if self.delimiter == "," else ",")

    def _problem(self, kind: int, where: list[int], decimal: str) -> str:
        first, last, column = where
        before = self.rows[:first]
        number = self.first_line() + len(before.splitlines()) - (not before.endswith((b"\n", b"\r")) and bool(before))
        found = _decoded(self.rows[first:last]).strip()
        if kind == BAD_CELL_COUNT:
            cells = len(_names(found, self.delimiter)) or 1
            return (
                f"{self.path}:{number}: number of cells {cells}, of columns {len(self.names)}; a row has one cell a "
                "column, so the file may be cut off or damaged"
            )
        sign = "comma" if decimal == "," else "point"
        return (
            f"{self.path}:{number}: '{quoted(self.names[column])}' is '{quoted(found)}'; write a finite number with a "
            f"decimal {sign}, or nan for a lost point"
        )


def table_in_file(path: Path, find: Callable[[bytes], TextHead], *, beginning: bool = False) -> FrameText:
    """The table of a file with one frame, or its beginning.

    find : the line of columns in the beginning of a file; HistoryError where it has none.
    """
    content = head_bytes(path) if beginning else plain_bytes(read_bytes(path, FRAME_FILE), path)
    head = find(content[:HEAD_BYTES])
    if again := head.again.search(content, head.end):
        raise HistoryError(
            f"{path}:{content[: again.start()].count(10) + 1}: the line of columns comes again, as in a file of "
            "several images; give such a file by its own name, or one image a file"
        )
    return FrameText(path, content[head.end :], head.delimiter, head.names, lambda: head.number + 1)


def frame_ranges(path: Path, head: TextHead, mark: int) -> list[tuple[int, int]]:
    """First byte and end of the rows of each image in a file that repeats its line of columns.

    mark : bytes of a byte order mark before the text.
    """
    with open_binary(path, FRAME_FILE, any_size=True) as stream, mmap(stream.fileno(), 0, access=ACCESS_READ) as text:
        heads = [found.span() for found in head.again.finditer(text, head.end + mark)]
        starts = [head.end + mark, *(end for _, end in heads)]
        return list(zip(starts, [*(start for start, _ in heads), len(text)], strict=True))


def table_in_range(path: Path, head: TextHead, start: int, end: int, is_last: bool) -> FrameText:
    """The table of one image in a file of several: its bytes, less the title lines of the next image."""
    if end - start > FRAME_FILE.maximum_bytes:
        raise HistoryError(f"{path}: one image of {(end - start) / 1e6:.0f} MB, larger than any; is it a table?")
    rows = plain_bytes(read_range(path, FRAME_FILE, start, end - start), path)
    if not is_last:
        rows = _without_titles(rows, head)

    def first_line() -> int:
        before = read_range(path, FRAME_FILE, 0, start)
        return 1 + (before.count(b"\n") or before.count(b"\r"))

    return FrameText(path, rows, head.delimiter, head.names, first_line)


def _without_titles(rows: bytes, head: TextHead) -> bytes:
    """Rows without the lines of words at their end, of which an image has at most three above its line of columns."""
    for _ in range(3):
        trimmed = rows.rstrip()
        start = max(trimmed.rfind(b"\n"), trimmed.rfind(b"\r")) + 1
        last = _decoded(trimmed[start:]).strip().strip('"')
        if not start or len(_names(last, head.delimiter)) == len(head.names) or last[:1] in "+-.0123456789":
            break
        rows = rows[:start]
    return rows
