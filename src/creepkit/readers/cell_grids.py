"""A text file as rows of cells, with the `# key: value` lines above them; a sheet of a spreadsheet is one too."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from creepkit.arrays import Ints
from creepkit.errors import HistoryError
from creepkit.files.delimited_text import (
    ERROR_VALUES,
    Dialect,
    decode_text,
    detect_dialect,
    split_line,
    split_lines,
    table_of_numbers,
    text_lines,
)
from creepkit.files.limits import how_to_raise, raised
from creepkit.files.reading import FileKind, read_bytes
from creepkit.readers.column_names import split_written_name
from creepkit.readers.text_tables import (
    NumberRows,
    SourceText,
    TableRow,
    TextTable,
    check_columns,
    location_in,
    some_of,
)
from creepkit.readers.vocabulary import plain_name

TABLE_FILE = FileKind("a table of a test", HistoryError, "save the table as CSV in UTF-8", maximum_bytes=1_000_000_000)


DECIMAL_SIGNS: Mapping[str, str] = {".": ".", ",": ",", "point": ".", "comma": ","}
"""What `# decimal:` may say."""


MAXIMUM_COLUMNS, MAXIMUM_LINE, MAXIMUM_KEYS = 2000, 1_000_000, 1000
"""Columns of a table, characters of a line, and `# key: value` lines of a head; no table of tests comes near them."""

MAXIMUM_CELL, MAXIMUM_TEXTS = 10_000, 6_000_000
"""Characters of a cell, for units are looked for in it; cells of a table that holds not numbers alone."""


_LARGE_TEXT = 65_536
"""Characters above which the rows of a text are read as numbers at once where they hold nothing else."""


_HEAD_LINES = 1000
"""Lines of a large text within which its names must stand for that."""


@dataclass(frozen=True)
class CellGrid:
    """Rows of cells as they stand in a file.

    sheet : of a spreadsheet, "" of a text. header : the entries of `# key: value` lines. rows : those of them that are
    no comment and not empty. numbers : the rows below the last of `rows`, where they hold numbers alone.
    comments : line, key and entry of each `# key: value` below the first row. positions : the column of the file, from
    0, in which each cell of a row stands, where some were left out. remarks : what was left aside, or read though it
    was hidden.
    """

    path: Path
    sheet: str
    dialect: Dialect
    header: Mapping[str, SourceText]
    rows: Sequence[TableRow]
    numbers: NumberRows | None = None
    comments: Sequence[tuple[int, str, SourceText]] = ()
    positions: Sequence[int] = ()
    remarks: tuple[str, ...] = ()

    def location(self, line: int) -> str:
        """Where a row stands."""
        return location_in(self.path, self.sheet, line)

    @property
    def place(self) -> str:
        """The file, and the sheet in it."""
        return f"{self.path}, sheet '{self.sheet}'" if self.sheet else str(self.path)


def read_text_grid(path: Path) -> CellGrid:
    """Read a text table of any delimiter, decimal sign and encoding; HistoryError where it holds no table."""
    text = decode_text(read_bytes(path, TABLE_FILE), path)
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    _refuse_long_lines(text, path)
    lines = text.split("\n", _HEAD_LINES) if len(text) > _LARGE_TEXT else text.split("\n")
    start = next((k for k, line in enumerate(lines[:_HEAD_LINES]) if line.strip() and not is_comment(line)), None)
    if start is not None and len(text) > _LARGE_TEXT:
        numbers = _number_rows(text, lines, start, _stated_decimal(path, lines[:start]))
        if numbers is not None:
            dialect, rows, comments = numbers
            names = TableRow(start + 1, split_line(lines[start], dialect, f"{path}:{start + 1}"))
            _refuse_many(f"{path}:{start + 1}", len(names.cells), 0)
            _refuse_long_cells(f"{path}:{start + 1}", lines[start], names.cells)
            return CellGrid(
                path,
                "",
                dialect,
                _header(path, lines[:start], names.cells, dialect),
                [names],
                rows,
                _late_entries(path, comments, dialect),
            )
    _refuse_many_texts(path, 2 * text.count("\n"))  # a table has two columns or more
    return _grid_of_lines(path, text_lines(text))


def _refuse_long_lines(text: str, path: Path) -> None:
    """Refuse a line that no table of tests has, before it is split into cells."""
    start, most = 0, raised(MAXIMUM_LINE)
    while len(text) - start > most:
        end = text.rfind("\n", start, start + most + 1)
        if end < 0:
            line = text.count("\n", 0, start) + 1
            raise HistoryError(
                f"{path}:{line}: the line has more than {most} characters; write shorter rows, or "
                f"{how_to_raise(2 * most, most)}"
            )
        start = end + 1


def _refuse_many(location: str, columns: int, keys: int) -> None:
    """Refuse more columns or keys than a table has."""
    for noun, found, usual, advice in (
        ("columns", columns, MAXIMUM_COLUMNS, "write the tests to several files"),
        ("keys above the table", keys, MAXIMUM_KEYS, "write only those that count"),
    ):
        if found > usual and found > (most := raised(usual)):
            raise HistoryError(
                f"{location}: number of {noun} {found}, more than {most}; {advice}, or {how_to_raise(found, most)}"
            )


def _refuse_many_texts(path: Path, count: int) -> None:
    """Refuse a table that is not of numbers alone and has more cells than memory holds as texts."""
    if count > (most := raised(MAXIMUM_TEXTS)):
        raise HistoryError(
            f"{path}: a table of {count} cells or more that are not all numbers, more than {most}; keep its numbers "
            f"alone, or {how_to_raise(count, most)}"
        )


def _refuse_long_cells(location: str, line: str, cells: Sequence[str]) -> None:
    """Refuse a cell that is no name, number or remark."""
    if len(line) > MAXIMUM_CELL and len(longest := max(cells, key=len)) > MAXIMUM_CELL:
        raise HistoryError(
            f"{location}: a cell of {len(longest)} characters, more than {MAXIMUM_CELL}; is a quote or a line missing?"
        )


def without_ignored(grid: CellGrid, names_at: int, ignored: Collection[str]) -> CellGrid:
    """The grid without the columns that its key `ignore` names, all of which must be there, and those in `ignored`.

    names_at : the row of the names. A name is told as it is written; else but for capitals and its unit.
    """
    key = next((key for key in grid.header if plain_name(key) == "ignore"), None)
    cells = grid.rows[names_at].cells
    left_out = {k for name in ignored for k in _columns_called(name, cells)}
    if key is not None:
        entry = grid.header[key]
        names = [name.strip() for name in entry.text.split(";" if ";" in entry.text else ",")]
        for name in [entry.text] if entry.text in cells else names:
            found = _columns_called(name, cells)
            if not found:
                raise HistoryError(
                    f"{entry.location}: ignore names '{name:.40}', which is no column; the columns are: "
                    f"{some_of(list(filter(None, cells)))}"
                )
            left_out.update(found)
    header = {name: entry for name, entry in grid.header.items() if name != key}
    if not left_out:
        return replace(grid, header=header)
    width = max(len(row.cells) for row in grid.rows)
    kept = [k for k in range(width) if k not in left_out]
    rows = [TableRow(row.line, [row.cells[k] for k in kept if k < len(row.cells)]) for row in grid.rows]
    numbers = grid.numbers and replace(grid.numbers, numbers=grid.numbers.numbers[:, kept])
    return replace(grid, header=header, rows=[r for r in rows if any(r.cells)], numbers=numbers, positions=kept)


def _columns_called(name: str, cells: Sequence[str]) -> list[int]:
    """The columns of a name as it is written, else of one that differs in capitals, or lacks the unit."""
    plain = plain_name(name)
    filled = [k for k, cell in enumerate(cells) if cell]
    exact = [k for k in filled if cells[k] == name]
    alike = exact or [k for k in filled if plain_name(cells[k]) == plain]
    return alike or [k for k in filled if plain_name(split_written_name(cells[k])[0]) == plain]


def read_head_alone(path: Path) -> dict[str, SourceText]:
    """The entries of a file that holds `# key: value` lines and no table; {} where it holds one."""
    start = read_bytes(path, TABLE_FILE, first=_LARGE_TEXT)
    lines = text_lines(decode_text(start, path)) if len(start) < _LARGE_TEXT else [" a table"]
    if any(line.strip() and not is_comment(line) for line in lines):
        return {}
    return _header(path, lines, (), Dialect(decimal=_stated_decimal(path, lines) or "."))


def _grid_of_lines(path: Path, lines: Sequence[str]) -> CellGrid:
    start = next((k for k, line in enumerate(lines) if line.strip() and not is_comment(line)), None)
    if start is None:
        problem = "holds a header but no table" if any(line.strip() for line in lines) else "is empty"
        raise HistoryError(f"{path}: the file {problem}; write a line of columns such as time_s,strain_pct, then rows")
    head = lines[:start]
    numbered, comments = list[tuple[int, str]](), list[tuple[int, str]]()
    for number, line in enumerate(lines[start:], start + 1):
        if line and not line.isspace():
            (comments if line[0] in _BEFORE_COMMENT and is_comment(line) else numbered).append((number, line))
    dialect = detect_dialect([line for _, line in numbered], str(path), _stated_decimal(path, head))
    _refuse_many_texts(path, len(numbered) * len(split_line(lines[start], dialect, f"{path}:{start + 1}")))
    late = _late_entries(path, comments, dialect)
    rows = []
    for number, line, cells in split_lines(numbered, dialect, path):
        if len(cells) > MAXIMUM_COLUMNS:
            _refuse_many(f"{path}:{number}", len(cells), 0)
        if len(line) > MAXIMUM_CELL:
            _refuse_long_cells(f"{path}:{number}", line, cells)
        if cells[0] or any(cells):
            rows.append(TableRow(number, cells))
    if not rows:
        raise HistoryError(f"{path}:{start + 1}: no cell holds anything; write a line of columns, then rows")
    return CellGrid(path, "", dialect, _header(path, head, rows[0].cells, dialect), rows, None, late)


def _late_entries(
    path: Path, comments: Sequence[tuple[int, str]], dialect: Dialect
) -> list[tuple[int, str, SourceText]]:
    """Line, key and entry of the `# key: value` lines among comments."""
    found = ((line, *_entry_of(comment)) for line, comment in comments)
    return [(k, key, SourceText(text, f"{path}:{k}", dialect.decimal)) for k, key, colon, text in found if colon]


def grid_of_rows(path: Path, sheet: str, rows: Sequence[TableRow]) -> CellGrid:
    """The grid of the rows of a sheet, where comments fill the first cell; `# key:` may have its value beside it."""
    start = next((k for k, row in enumerate(rows) if not is_comment(row.cells[0] if row.cells else "")), len(rows))
    if start == len(rows):
        raise HistoryError(f"{path}, sheet '{sheet}': holds comments but no table; write a row of columns, then rows")
    header: dict[str, SourceText] = {}
    comments: list[tuple[int, str, SourceText]] = []
    kept: list[TableRow] = []
    for k, row in enumerate(rows):
        _refuse_many(location_in(path, sheet, row.line), len(row.cells), 0)
        if not is_comment(row.cells[0]):
            kept.append(row)
            continue
        key, colon, text = _entry_of(row.cells[0])
        location, beside = location_in(path, sheet, row.line), [cell for cell in row.cells[1:] if cell]
        if key in header or len(beside) > (not text):
            raise HistoryError(f"{location}: '{row.cells[0]:.40}' is given twice or with several values; keep one")
        if (colon or beside) and k < start:
            header[key] = SourceText(text or "".join(beside), location)
            _refuse_many(location, 0, len(header))
        elif colon or beside:
            comments.append((row.line, key, SourceText(text or "".join(beside), location)))
    return CellGrid(path, sheet, Dialect("\t"), header, kept, None, comments)


_BEFORE_COMMENT = frozenset(' \t"\ufeff#/')
"""Characters with which a comment may begin."""


def is_comment(line: str) -> bool:
    """Whether a line, or the first cell of a row, is a comment."""
    text = line.lstrip(' \t"\ufeff')
    return text.startswith(("#", "//")) and not text.startswith(ERROR_VALUES)


def _number_rows(
    text: str, lines: Sequence[str], start: int, decimal: str | None
) -> tuple[Dialect, NumberRows, list[tuple[int, str]]] | None:
    """The rows of a large text and its comments by line, where it holds numbers alone; None where it does not."""
    sample = [line for line in lines[start:_HEAD_LINES] if line.strip() and not is_comment(line)]
    try:
        dialect = detect_dialect(sample, decimal=decimal)
    except HistoryError:  # told by who reads line by line
        return None
    if dialect.delimiter == " " or '"' in lines[start]:
        return None
    body = text[sum(len(line) + 1 for line in lines[: start + 1]) :].rstrip("\n")
    body, line_numbers, comments = _without_comments(body, start + 2)
    if not body.strip():
        return None
    numbers = table_of_numbers(body, dialect)
    if numbers is None:
        return None
    if numbers.shape != (line_numbers.size, len(split_line(lines[start], dialect))) or not np.isfinite(numbers).all():
        return None
    return dialect, NumberRows(numbers, line_numbers, dialect.decimal), comments


def _without_comments(body: str, first_line: int) -> tuple[str, Ints, list[tuple[int, str]]]:
    """A text without comments and empty lines, the number of each line that stays, and the comments by line."""
    if "\n\n" not in body and not body.startswith("\n") and "#" not in body and "/" not in body:
        return body, first_line + np.arange(body.count("\n") + 1), []
    lines = body.split("\n")
    kept = [k for k, line in enumerate(lines) if line and line[0] not in ' \t"#/']
    others = sorted(set(range(len(lines))).difference(kept))
    comments = [(first_line + k, lines[k]) for k in others if is_comment(lines[k])]
    kept += [k for k in others if lines[k].strip() and not is_comment(lines[k])]
    kept.sort()
    return "\n".join([lines[k] for k in kept]), first_line + np.array(kept, dtype=int), comments


def _stated_decimal(path: Path, head: Sequence[str]) -> str | None:
    for number, line in enumerate(head, 1):
        key, colon, text = _entry_of(line)
        if colon and plain_name(key) == "decimal":
            sign = text if text in DECIMAL_SIGNS else text.rstrip(";,\t ")
            if sign not in DECIMAL_SIGNS:
                raise HistoryError(f"{path}:{number}: decimal is '{text:.40}'; allowed: point, comma")
            return DECIMAL_SIGNS[sign]
    return None


def _entry_of(line: str) -> tuple[str, bool, str]:
    """Key, whether there is a colon, and text of a comment, which a spreadsheet may have put in quotes."""
    text = line.strip().strip("\ufeff")
    if text.startswith('"') and text.endswith('"'):
        text = text[1:-1].replace('""', '"')
    key, colon, value = text.lstrip("#/").partition(":")
    return key.strip(), bool(colon), value.strip()


def _header(path: Path, lines: Sequence[str], names: Sequence[str], dialect: Dialect) -> dict[str, SourceText]:
    """The `# key: value` lines; a comment without a colon is a remark.

    A spreadsheet writes them with an empty cell for each further column; these cells are cut off.
    """
    padding = dialect.delimiter * (len(names) - 1)
    comments = [line.rstrip(" ") for line in lines if line.strip()]
    is_padded = len(names) > 1 and all(line.endswith(padding) for line in comments)
    header: dict[str, SourceText] = {}
    for number, line in enumerate(lines, 1):
        key, colon, text = _entry_of(line.rstrip(" ").removesuffix(padding) if is_padded else line)
        if not colon or plain_name(key) == "decimal":
            continue
        if key in header:
            first = header[key].location.rpartition(":")[2]
            raise HistoryError(f"{path}:{number}: '{key}' was already given in line {first}; keep one of them")
        header[key] = SourceText(text, f"{path}:{number}", dialect.decimal)
        _refuse_many(f"{path}:{number}", 0, len(header))
    return header


def read_table(path: Path, ignored: Collection[str] = ()) -> TextTable:
    """Read a file of one table: its first row names the columns, whatever they are, but those left out."""
    return table_of(without_ignored(read_text_grid(path), 0, ignored))


def table_of(grid: CellGrid) -> TextTable:
    """The table of a grid whose first row names its columns."""
    names, *rows = grid.rows
    width = max((k for k, cell in enumerate(names.cells, 1) if cell), default=0)
    columns = names.cells[:width]
    check_columns(grid.location(names.line), columns)
    body: Sequence[TableRow] = grid.numbers if grid.numbers is not None else tuple(_cut_rows(grid, rows, width))
    if not body:
        place = grid.location(names.line)
        raise HistoryError(f"{place}: no rows below the line of columns; a table needs at least one")
    return TextTable(grid.path, grid.header, columns, names.line, body, grid.dialect, grid.sheet, grid.positions)


def _cut_rows(grid: CellGrid, rows: Sequence[TableRow], width: int) -> Iterator[TableRow]:
    """The rows with as many cells as there are columns; empty ones behind them are none."""
    for row in rows:
        cells = row.cells
        if len(cells) == width:
            yield row
            continue
        if len(cells) > width and not any(cells[width:]):
            cells = cells[:width]
        if len(cells) < width and grid.sheet:  # empty cells at the end of a sheet's row are not stored
            cells = [*cells, *[""] * (width - len(cells))]
        if len(cells) != width and grid.sheet:
            raise HistoryError(
                f"{grid.location(row.line)}: '{next(filter(None, cells[width:])):.40}' stands in a column without a "
                "name; name it or remove it"
            )
        if len(cells) != width:
            description = f"number of cells {len(cells)}, of columns {width}"
            advice = "" if grid.dialect.delimiter != "," else "; decimal commas need another delimiter, such as ;"
            raise HistoryError(
                f"{grid.location(row.line)}: {description}; write one cell a column, separated by "
                f"{str(grid.dialect).partition(',')[0]}{advice}"
            )
        yield TableRow(row.line, cells)


def peek_columns(path: Path, byte_limit: int = 65536) -> tuple[str, ...]:
    """The columns of a file as far as its beginning shows them, () when it has none; never raises for what it holds."""
    try:
        content = read_bytes(path, TABLE_FILE, first=byte_limit)
        is_cut = len(content) == byte_limit
        if is_cut:  # not within a character: a line feed of UTF-16 has two bytes
            end = content.rfind(b"\n") + 1
            content = content[: end + end % 2] if content[:2] in (b"\xff\xfe", b"\xfe\xff") else content[:end]
        lines = [line for line in text_lines(decode_text(content, path)) if line.strip() and not is_comment(line)]
        if not lines:
            return ()
        return tuple(split_line(lines[0], detect_dialect(lines, decimal=".")))
    except HistoryError:
        return ()
