"""A text file as rows of cells, with the `# key: value` lines above them.

A large table of numbers alone is read as numbers at once; else the cells are kept as texts, column by column.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from pathlib import Path

import numpy as np

from creepkit.arrays import Ints
from creepkit.errors import HistoryError
from creepkit.files.delimited_text import (
    Dialect,
    decode_text,
    detect_dialect,
    is_number,
    parts_of_lines,
    split_line,
    split_lines,
    table_of_numbers,
    text_lines,
)
from creepkit.files.labview import is_labview, table_of_labview
from creepkit.files.reading import FileKind, read_bytes
from creepkit.files.time_stamps import is_clock_time
from creepkit.readers.cell_grids import CellGrid, table_of, without_ignored
from creepkit.readers.comment_lines import (
    BEFORE_COMMENT,
    entry_of,
    head_entries,
    is_comment,
    late_entries,
    stated_decimal,
)
from creepkit.readers.cut_files import cut_number
from creepkit.readers.table_limits import (
    MAXIMUM_CELL,
    MAXIMUM_COLUMNS,
    refuse_long_cells,
    refuse_long_lines,
    refuse_many,
    refuse_many_skipped,
    refuse_many_texts,
)
from creepkit.readers.table_rows import NumberRows, TableRow
from creepkit.readers.text_tables import SourceText, TextTable

TABLE_FILE = FileKind("a table of a test", HistoryError, "save the table as CSV in UTF-8", maximum_bytes=1_000_000_000)


_LARGE_TEXT = 65_536
"""Characters above which the rows of a text are read as numbers at once where they hold nothing else."""


_DELIMITERS = " ,;|\t"
"""What stands alone in a row of empty cells."""


_CHECKED_LINES = 10_000
"""Lines that are skipped before their number is compared with the rows anew."""


_HEAD_LINES = 1000
"""Lines of a large text within which its names must stand for that."""


def read_text_grid(path: Path) -> CellGrid:
    """Read a text table of any delimiter, decimal sign and encoding; HistoryError where it holds no table."""
    return _grid_of(path, decode_text(read_bytes(path, TABLE_FILE), path))


def peek_grid(path: Path) -> CellGrid | None:
    """The beginning of a text as a grid; None where it is no table; never raises for what it holds."""
    try:
        return _grid_of(path, decode_text(_beginning(path), path), decimal=".")
    except HistoryError:
        return None


def _grid_of(path: Path, text: str, decimal: str | None = None) -> CellGrid:
    """The grid of a text; decimal : its sign, where it does not matter or is known."""
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    refuse_long_lines(text, path)
    if is_labview(text):
        text = table_of_labview(text)
    head, offset = _head_of(path, text)
    text, head, offset = _with_names_behind_marks(text, head, offset)
    if offset == len(text):
        problem = "holds a header but no table" if any(line.strip() for line in head) else "is empty"
        raise HistoryError(f"{path}: the file {problem}; write a line of columns such as time_s,strain_pct, then rows")
    grid = None
    if len(text) > _LARGE_TEXT and len(head) < _HEAD_LINES:
        grid = _grid_of_numbers(path, text, head, offset)
    if grid is None:
        grid = _grid_of_texts(path, text, head, offset, decimal)
    return replace(grid, cut=cut_number(text, grid.dialect))


def _head_of(path: Path, text: str) -> tuple[list[str], int]:
    """The lines above the first row, and the character with which that begins."""
    head, offset = list[str](), 0
    while offset < len(text):
        end = text.find("\n", offset)
        line = text[offset : len(text) if end < 0 else end]
        if line.strip() and not is_comment(line):
            break
        head.append(line)
        refuse_many_skipped(path, len(head), 0)
        offset += len(line) + 1
    return head, min(offset, len(text))


def _with_names_behind_marks(text: str, head: list[str], offset: int) -> tuple[str, list[str], int]:
    """The text with names of columns, that stand behind a mark of comments above rows of numbers, as its first row.

    numpy.savetxt and digitisers write them so. They are the first of the last comments that have as many cells as the
    row below has; further ones are rows of the head too.
    """
    sample = [line for line in text[offset : offset + _LARGE_TEXT].split("\n")[:50] if line.strip()]
    try:
        dialect = detect_dialect(sample, decimal=".")
        first = split_line(sample[0], dialect) if sample else []
    except HistoryError:
        return text, head, offset
    comma = Dialect(dialect.delimiter, ",")
    numeric = [is_number(cell, dialect) or is_number(cell, comma) or is_clock_time(cell) for cell in first if cell]
    if len(first) < 2 or not numeric or not all(numeric):
        return text, head, offset
    names = list[str]()
    for line in reversed(head):
        cells = _names_behind_mark(line, len(first), dialect)
        if not cells:
            break
        names.insert(0, dialect.delimiter.join(f'"{c}"' if dialect.delimiter in c else c for c in cells))
    kept = head[: len(head) - len(names)]
    start = sum(len(line) + 1 for line in kept)
    return ("\n".join([*kept, *names, text[offset:]]), kept, start) if names else (text, head, offset)


def _names_behind_mark(line: str, count: int, dialect: Dialect) -> list[str]:
    """The cells of a comment, as many as a row has and none of them a number; [] of any other line."""
    entry = entry_of(line)
    body = line.strip().lstrip("#/ ")
    for delimiter in dict.fromkeys((dialect.delimiter, "\t", ";", ",", "|", " ")):
        try:
            cells = split_line(body, Dialect(delimiter))
        except HistoryError:
            continue
        if len(cells) == count and all(cells) and not any(is_number(cell, Dialect(delimiter)) for cell in cells):
            return [] if entry[1] and delimiter == " " else cells
    return []


def read_head_alone(path: Path) -> dict[str, SourceText]:
    """The entries of a file that holds `# key: value` lines and no table; {} where it holds one."""
    start = read_bytes(path, TABLE_FILE, first=_LARGE_TEXT)
    lines = text_lines(decode_text(start, path)) if len(start) < _LARGE_TEXT else [" a table"]
    if any(line.strip() and not is_comment(line) for line in lines):
        return {}
    return head_entries(path, lines, (), Dialect(decimal=stated_decimal(path, lines) or "."))


@dataclass
class _TableLines:
    """The lines of a text from its first row on, taken one by one.

    offset, first : the character and the line with which that begins. comments : of the lines that were taken, those
    that are `# key: value`.
    """

    path: Path
    text: str
    offset: int
    first: int
    comments: list[tuple[int, str]] = field(default_factory=list)

    def numbered(self) -> Iterator[tuple[int, str]]:
        """Number and text of each line that is neither empty nor a comment."""
        self.comments.clear()
        number, skipped = self.first, 0
        for part in parts_of_lines(self.text, self.offset):
            lines = part.split("\n")
            for k, line in enumerate(lines, number):
                if line and not line.isspace():
                    if not (line[0] in BEFORE_COMMENT and is_comment(line)):
                        yield k, line
                        if line[0] not in _DELIMITERS or line.strip(_DELIMITERS):
                            continue
                    elif ":" in line:
                        self.comments.append((k, line))
                skipped += 1
                if not skipped % _CHECKED_LINES:
                    refuse_many_skipped(self.path, skipped, k + 1 - self.first - skipped)
            number += len(lines)


def _grid_of_texts(path: Path, text: str, head: Sequence[str], offset: int, decimal: str | None) -> CellGrid:
    """The grid of a table that holds not numbers alone, whose first row begins at character `offset`."""
    first = len(head) + 1
    lines = _TableLines(path, text, offset, first)
    dialect = detect_dialect((line for _, line in lines.numbered()), str(path), decimal or stated_decimal(path, head))
    width = len(split_line(next(lines.numbered())[1], dialect, f"{path}:{first}"))
    refuse_many_texts(path, text.count("\n", offset) * max(width, 2))  # a table has two columns or more
    rows = list(_rows(lines.numbered(), dialect, path))
    if not rows:
        raise HistoryError(f"{path}:{first}: no cell holds anything; write a line of columns, then rows")
    late = late_entries(path, lines.comments, dialect)
    return CellGrid(path, "", dialect, head_entries(path, head, rows[0].cells, dialect), rows, None, late)


def _rows(numbered: Iterator[tuple[int, str]], dialect: Dialect, path: Path) -> Iterator[TableRow]:
    """The rows in which a cell holds something; HistoryError for what no table holds."""
    for number, line, cells in split_lines(numbered, dialect, path):
        if len(cells) > MAXIMUM_COLUMNS:
            refuse_many(f"{path}:{number}", len(cells), 0)
        if len(line) > MAXIMUM_CELL:
            refuse_long_cells(f"{path}:{number}", line, cells)
        if cells[0] or any(cells):
            yield TableRow(number, cells)


def _grid_of_numbers(path: Path, text: str, head: Sequence[str], offset: int) -> CellGrid | None:
    """The grid of a table that holds numbers alone below its names; None of any other."""
    first = len(head) + 1
    sample = list(islice(_TableLines(path, text, offset, first).numbered(), _HEAD_LINES))
    names = sample[0][1]
    try:
        dialect = detect_dialect((line for _, line in sample), decimal=stated_decimal(path, head))
    except HistoryError:  # told by who reads line by line
        return None
    if dialect.delimiter == " " or '"' in names:
        return None
    body, line_numbers, comments = _without_comments(path, text[offset + len(names) + 1 :].rstrip("\n"), first + 1)
    numbers = table_of_numbers(body, dialect) if body.strip() else None
    cells = split_line(names, dialect, f"{path}:{first}")
    if numbers is None or numbers.shape != (line_numbers.size, len(cells)) or not np.isfinite(numbers).all():
        return None
    refuse_many(f"{path}:{first}", len(cells), 0)
    refuse_long_cells(f"{path}:{first}", names, cells)
    rows, header = NumberRows(numbers, line_numbers, dialect.decimal), head_entries(path, head, cells, dialect)
    return CellGrid(path, "", dialect, header, [TableRow(first, cells)], rows, late_entries(path, comments, dialect))


def _without_comments(path: Path, body: str, first_line: int) -> tuple[str, Ints, list[tuple[int, str]]]:
    """A text without comments and empty lines, the number of each line that stays, and the comments by line."""
    if "\n\n" not in body and not body.startswith("\n") and "#" not in body and "/" not in body:
        return body, first_line + np.arange(body.count("\n") + 1), []
    parts, numbers, comments, number = list[str](), list[Ints](), list[tuple[int, str]](), first_line
    for part in parts_of_lines(body):
        lines = part.split("\n")
        kept = [k for k, line in enumerate(lines) if line and line[0] not in ' \t"#/']
        others = sorted(set(range(len(lines))).difference(kept)) if len(kept) < len(lines) else []
        comments += [(number + k, lines[k]) for k in others if is_comment(lines[k])]
        kept += [k for k in others if lines[k].strip() and not is_comment(lines[k])]
        kept.sort()
        if kept:
            parts.append("\n".join([lines[k] for k in kept]))
            numbers.append(number + np.array(kept, dtype=int))
        number += len(lines)
        rows = sum(each.size for each in numbers)
        refuse_many_skipped(path, number - first_line - rows, rows)
    return "\n".join(parts), np.concatenate(numbers) if numbers else np.zeros(0, dtype=int), comments


def read_table(path: Path, ignored: Collection[str] = ()) -> TextTable:
    """Read a file of one table: its first row names the columns, whatever they are, but those left out."""
    return table_of(without_ignored(read_text_grid(path), 0, ignored))


def _beginning(path: Path, byte_limit: int = _LARGE_TEXT) -> bytes:
    """The whole lines with which a file begins."""
    content = read_bytes(path, TABLE_FILE, first=byte_limit)
    if len(content) < byte_limit:
        return content
    end = content.rfind(b"\n") + 1  # not within a character: a line feed of UTF-16 has two bytes
    return content[: end + end % 2] if content[:2] in (b"\xff\xfe", b"\xfe\xff") else content[:end]


def peek_columns(path: Path) -> tuple[str, ...]:
    """The columns of a file as far as its beginning shows them, () when it has none; never raises for what it holds."""
    grid = peek_grid(path)
    return () if grid is None else tuple(grid.rows[0].cells)
