"""Rows of cells as they stand in a file, with the `# key: value` lines above them; a sheet of a spreadsheet is one."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from creepkit.errors import HistoryError, quoted
from creepkit.files.delimited_text import Dialect
from creepkit.readers.column_names import split_written_name
from creepkit.readers.comment_lines import entry_of, is_comment
from creepkit.readers.cut_files import CutNumber
from creepkit.readers.table_limits import refuse_many
from creepkit.readers.table_rows import NumberRows, TableRow, with_columns
from creepkit.readers.text_tables import SourceText, TextTable, check_columns, location_in, some_of
from creepkit.readers.vocabulary import plain_name


@dataclass(frozen=True)
class CellGrid:
    """Rows of cells as they stand in a file.

    sheet : of a spreadsheet, "" of a text. header : the entries of `# key: value` lines. rows : those of them that are
    no comment and not empty. numbers : the rows below the last of `rows`, where they hold numbers alone.
    comments : line, key and entry of each `# key: value` below the first row. positions : the column of the file, from
    0, in which each cell of a row stands, where some were left out. remarks : what was left aside, or read though it
    was hidden. cut : the last number of the file, where the file may have been cut in it. merged : row and column, from
    0, of cells that are merged with one above them.
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
    cut: CutNumber | None = None
    merged: frozenset[tuple[int, int]] = frozenset()

    def location(self, line: int) -> str:
        """Where a row stands."""
        return location_in(self.path, self.sheet, line)

    @property
    def place(self) -> str:
        """The file, and the sheet in it."""
        return f"{self.path}, sheet '{self.sheet}'" if self.sheet else str(self.path)


def grid_of_rows(path: Path, sheet: str, rows: Sequence[TableRow]) -> CellGrid:
    """The grid of the rows of a sheet, where comments fill the first cell; `# key:` may have its value beside it."""
    start = next((k for k, row in enumerate(rows) if not is_comment(row.cells[0] if row.cells else "")), len(rows))
    if start == len(rows):
        raise HistoryError(f"{path}, sheet '{sheet}': holds comments but no table; write a row of columns, then rows")
    header: dict[str, SourceText] = {}
    comments: list[tuple[int, str, SourceText]] = []
    kept: list[TableRow] = []
    for k, row in enumerate(rows):
        refuse_many(location_in(path, sheet, row.line), len(row.cells), 0)
        if not is_comment(row.cells[0]):
            kept.append(row)
            continue
        key, colon, text = entry_of(row.cells[0])
        location, beside = location_in(path, sheet, row.line), [cell for cell in row.cells[1:] if cell]
        if key in header or len(beside) > (not text):
            raise HistoryError(f"{location}: '{quoted(row.cells[0])}' is given twice or with several values; keep one")
        if (colon or beside) and k < start:
            header[key] = SourceText(text or "".join(beside), location)
            refuse_many(location, 0, len(header))
        elif colon or beside:
            comments.append((row.line, key, SourceText(text or "".join(beside), location)))
    return CellGrid(path, sheet, Dialect("\t"), header, kept, None, comments)


def with_stated(grid: CellGrid, stated: Mapping[str, tuple[str, str]]) -> CellGrid:
    """The grid with what a file of answers states of its tests, {key: text and place}, in its head."""
    for key, (text, place) in stated.items():
        if key in grid.header and grid.header[key].text != text:
            raise HistoryError(f"{place}: {key} is '{quoted(text)}', and {grid.header[key].location} says another one")
    return replace(grid, header={**grid.header, **{key: SourceText(*one) for key, one in stated.items()}})


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
                    f"{entry.location}: ignore names '{quoted(name)}', which is no column; the columns are: "
                    f"{some_of(list(filter(None, cells)))}"
                )
            left_out.update(found)
    header = {name: entry for name, entry in grid.header.items() if name != key}
    if not left_out:
        return replace(grid, header=header)
    width = max(len(row.cells) for row in grid.rows)
    kept = [k for k in range(width) if k not in left_out]
    numbers = grid.numbers and replace(grid.numbers, numbers=grid.numbers.numbers[:, kept])
    rows = [row for row in with_columns(grid.rows, kept) if any(row.cells)]
    return replace(grid, header=header, rows=rows, numbers=numbers, positions=kept)


def _columns_called(name: str, cells: Sequence[str]) -> list[int]:
    """The columns of a name as it is written, else of one that differs in capitals, or lacks the unit."""
    plain = plain_name(name)
    filled = [k for k, cell in enumerate(cells) if cell]
    exact = [k for k in filled if cells[k] == name]
    alike = exact or [k for k in filled if plain_name(cells[k]) == plain]
    return alike or [k for k in filled if plain_name(split_written_name(cells[k])[0]) == plain]


def table_of(grid: CellGrid) -> TextTable:
    """The table of a grid whose first row names its columns."""
    names, rows = grid.rows[0], grid.rows[1:]
    width = max((k for k, cell in enumerate(names.cells, 1) if cell), default=0)
    columns = names.cells[:width]
    check_columns(grid.location(names.line), columns)
    body: Sequence[TableRow] = rows if grid.numbers is None else grid.numbers
    if not isinstance(body, NumberRows):
        body = list(_cut_rows(grid, rows, width))
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
                f"{grid.location(row.line)}: '{quoted(next(filter(None, cells[width:])))}' stands in a column "
                "without a "
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
