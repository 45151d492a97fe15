"""A text of any encoding, delimiter and decimal sign as a table, with the `# key: value` lines above it."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path

from creepkit.errors import HistoryError, quoted
from creepkit.files.delimited_text import (
    Dialect,
    decode_text,
    detect_dialect,
    is_number,
    parts_of_lines,
    split_line,
    split_lines,
    text_lines,
)
from creepkit.files.labview import is_labview, table_of_labview
from creepkit.files.reading import FileKind, read_bytes
from creepkit.files.time_stamps import is_clock_time
from creepkit.readers.table import (
    MAXIMUM_CELL,
    CellTable,
    SourceText,
    TableRow,
    dialect_of,
    entry_of,
    in_plain_numbers,
    is_comment,
    named_columns,
    refuse_long_cells,
    without_ignored,
)
from creepkit.readers.tests_file import DECIMAL_SIGNS, answers_of
from creepkit.readers.vocabulary import plain_name, unit_suffix

TABLE_FILE = FileKind("a table of a test", HistoryError, "save the table as CSV in UTF-8", maximum_bytes=1_000_000_000)


_BEGINNING = 65_536
"""Bytes with which a file is recognised."""


_BEFORE_COMMENT = frozenset(' \t"\ufeff#/')
"""Characters with which a comment may begin."""


def read_table(path: Path, ignored: Collection[str] = ()) -> CellTable:
    """Read a file of one table: its first row names the columns, whatever they are, but those left out."""
    return named_columns(without_ignored(read_text_table(path), 0, ignored))


def read_text_table(path: Path) -> CellTable:
    """Read a text table of any delimiter, decimal sign and encoding; HistoryError where it holds no table."""
    return table_of_text(path, decode_text(read_bytes(path, TABLE_FILE), path), answers_of(path).decimal)


def peek_table(path: Path) -> CellTable | None:
    """The beginning of a text as a table; None where it is no table; never raises for what it holds."""
    try:
        return table_of_text(path, decode_text(_beginning(path), path), decimal=".")
    except HistoryError:
        return None


def _beginning(path: Path) -> bytes:
    """The whole lines with which a file begins."""
    content = read_bytes(path, TABLE_FILE, first=_BEGINNING)
    if len(content) < _BEGINNING:
        return content
    end = content.rfind(b"\n") + 1  # not within a character: a line feed of UTF-16 has two bytes
    return content[: end + end % 2] if content[:2] in (b"\xff\xfe", b"\xfe\xff") else content[:end]


def read_head_alone(path: Path) -> dict[str, SourceText]:
    """The entries of a file that holds `# key: value` lines and no table; {} where it holds one."""
    start = read_bytes(path, TABLE_FILE, first=_BEGINNING)
    lines = text_lines(decode_text(start, path)) if len(start) < _BEGINNING else [" a table"]
    if any(line.strip() and not is_comment(line) for line in lines):
        return {}
    table = CellTable(path, (), dialect=Dialect(decimal=_stated_decimal(path, lines) or "."))
    return dict(table.with_comments(((k, [line]) for k, line in enumerate(lines, 1)), len(lines) + 1).header)


def table_of_text(path: Path, text: str, decimal: str = "") -> CellTable:
    """The table of a text; path : whence it came. decimal : its sign, where it does not matter or is known."""
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    if is_labview(text):
        text = table_of_labview(text)
    text, head, offset = _with_names_behind_marks(text, *_head_of(text))
    if offset == len(text):
        problem = "holds a header but no table" if any(line.strip() for line in head) else "is empty"
        raise HistoryError(f"{path}: the file {problem}; write a line of columns such as time_s,strain_pct, then rows")
    comments, first = list[tuple[int, str]](), len(head) + 1
    decimal = decimal or _stated_decimal(path, head)
    dialect = dialect_of((line for _, line in _numbered(text, offset, first)), path, str(path), decimal)
    rows = list(_rows_of_texts(_numbered(text, offset, first, comments), dialect, path))
    if not rows:
        raise HistoryError(f"{path}:{first}: no cell holds anything; write a line of columns, then rows")
    head = _without_padding(head, rows[0].cells, dialect)
    every = [*enumerate(head, 1), *comments]
    table = CellTable(path, rows, dialect=dialect).with_comments(((k, [line]) for k, line in every), first)
    return in_plain_numbers(table, is_stated=bool(decimal))


def _numbered(
    text: str, offset: int, first: int, comments: list[tuple[int, str]] | None = None
) -> Iterator[tuple[int, str]]:
    """Number and text of each line that is neither empty nor a comment, from character `offset` on, in line `first`.

    comments : to which those with a colon are added.
    """
    for part in parts_of_lines(text, offset):
        lines = part.split("\n")
        for k, line in enumerate(lines, first):
            if not line or line.isspace():
                continue
            if not (line[0] in _BEFORE_COMMENT and is_comment(line)):
                yield k, line
            elif comments is not None and ":" in line:
                comments.append((k, line))
        first += len(lines)


def _rows_of_texts(numbered: Iterator[tuple[int, str]], dialect: Dialect, path: Path) -> Iterator[TableRow]:
    """The rows in which a cell holds something; HistoryError for what no table holds."""
    above, count = "", 0
    for number, line, cells in split_lines(numbered, dialect, path):
        if dialect.delimiter == "|" and line.strip()[0] == "|" == line.strip()[-1]:
            cells = [] if _RULE.fullmatch(line) else cells[1:-1]
        if len(line) > MAXIMUM_CELL:
            refuse_long_cells(f"{path}:{number}", cells)
        if dialect.delimiter == " " and len(cells) < count and all(map(unit_suffix, cells)) and {*cells} != {"1"}:
            cells = _under_names(line, above, f"{path}:{number}")
        if any(cells):
            yield TableRow(number, cells)
        above, count = line, len(cells)


_RULE = re.compile(r"[|:\-\s]*")


def _under_names(line: str, names: str, place: str) -> list[str]:
    """The cells of a row of units, each in the column of the name above it, whose middle is nearest to its own."""
    units, columns = ([*re.finditer(r"\S+", text.expandtabs())] for text in (line, names))
    middles = [sum(one.span()) for one in columns]
    found = [min(range(len(columns)), key=lambda k: abs(middles[k] - sum(one.span()))) for one in units]
    if found != sorted({*found}):
        what = f"{len(units)} units below {len(columns)} names; write - below a column without a unit"
        raise HistoryError(f"{place}: {what}")
    named = dict(zip(found, (one[0] for one in units), strict=True))
    return [named.get(k, "") for k in range(len(columns))]


# ---- the head ------------------------------------------------------------------------------------------------------


def _head_of(text: str) -> tuple[list[str], int]:
    """The lines above the first row, and the character with which that begins."""
    head, offset = list[str](), 0
    while offset < len(text):
        end = text.find("\n", offset)
        line = text[offset : len(text) if end < 0 else end]
        if line.strip() and not is_comment(line):
            break
        head.append(line)
        offset += len(line) + 1
    return head, min(offset, len(text))


def _with_names_behind_marks(text: str, head: list[str], offset: int) -> tuple[str, list[str], int]:
    """The text with names of columns, that stand behind a mark of comments above rows of numbers, as its first row.

    numpy.savetxt and digitisers write them so. They are the first of the last comments that have as many cells as the
    row below has; further ones are rows of the head too.
    """
    sample = [line for line in text[offset : offset + _BEGINNING].split("\n")[:50] if line.strip()]
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
    body = line.strip().lstrip("#/ ")
    for delimiter in dict.fromkeys((dialect.delimiter, "\t", ";", ",", "|", " ")):
        try:
            cells = split_line(body, Dialect(delimiter))
        except HistoryError:
            continue
        if len(cells) == count and all(cells) and not any(is_number(cell, Dialect(delimiter)) for cell in cells):
            return [] if entry_of(line)[1] and delimiter == " " else cells
    return []


def _stated_decimal(path: Path, head: Sequence[str]) -> str:
    """The decimal sign that `# decimal:` states in a head."""
    for number, line in enumerate(head, 1):
        key, colon, text = entry_of(line)
        if colon and plain_name(key) == "decimal":
            sign = text if text in DECIMAL_SIGNS else text.rstrip(";,\t ")
            if sign not in DECIMAL_SIGNS:
                raise HistoryError(f"{path}:{number}: decimal is '{quoted(text)}'; allowed: point, comma")
            return DECIMAL_SIGNS[sign]
    return ""


def _without_padding(lines: Sequence[str], names: Sequence[str], dialect: Dialect) -> list[str]:
    """The lines of a head without the empty cells that a spreadsheet writes for each further column."""
    padding = dialect.delimiter * (len(names) - 1)
    is_padded = len(names) > 1 and all(line.rstrip(" ").endswith(padding) for line in lines if line.strip())
    return [line.rstrip(" ").removesuffix(padding) for line in lines] if is_padded else list(lines)
