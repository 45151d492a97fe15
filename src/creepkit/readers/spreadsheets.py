"""Spreadsheets (.xlsx): their sheets as grids of cells, with the values that were last computed; nothing is evaluated.

A sheet of frames has a column of time; a sheet with a column of tests
and none of time states conditions, one row a test; other sheets are left aside, which the label "assumed" says.
"""

from __future__ import annotations

import io
import posixpath
import warnings
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from functools import partial
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from creepkit.errors import HistoryError, quoted
from creepkit.files.delimited_text import Dialect, detect_dialect, is_number, refuse_unprintable
from creepkit.files.limits import how_to_raise, raised
from creepkit.files.reading import MAXIMUM_UNPACKED_BYTES, FileKind, check_readable, read_bytes
from creepkit.readers.cell_grids import CellGrid, grid_of_rows, table_of, without_ignored
from creepkit.readers.column_names import TEST_NAME_COLUMNS, KnownNames, words_of
from creepkit.readers.grouped_rows import TabulatedTest
from creepkit.readers.history_csv import histories_of_tests
from creepkit.readers.number_formats import number_text
from creepkit.readers.table_layouts import names_time, tests_in
from creepkit.readers.table_rows import TableRow
from creepkit.readers.text_tables import SourceText, unknown_text
from creepkit.readers.vocabulary import HeaderVocabulary
from creepkit.records import History

SPREADSHEET_FILE = FileKind("a spreadsheet of tests", HistoryError, "save the sheet as .xlsx or CSV", 100_000_000)


_FILLED_ROWS = 60
"""Rows from the top in which a merged cell counts for all the columns that it covers."""


_MOST_REMARKS = 20
"""Cells of a sheet of remarks that is kept as a label."""


_LAST_ROW = 1_048_576
"""That the format has."""


_DAY_ZERO, _FIRST_DATE = datetime(1899, 12, 31), datetime(1902, 1, 1)
"""The day that a spreadsheet counts as 0, and the first on which a creep test may have been made."""


def read_sheets(path: Path) -> list[CellGrid]:
    """The sheets that hold something; HistoryError for a file that is no spreadsheet, or too large unpacked."""
    content = read_bytes(path, SPREADSHEET_FILE)
    from openpyxl import load_workbook

    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive, warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of what a workbook holds beside its cells
            size, most = sum(part.file_size for part in archive.infolist()), raised(MAXIMUM_UNPACKED_BYTES)
            if size > most:
                raise HistoryError(
                    f"{path}: unpacks to {size / 1e6:.0f} MB, more than {most / 1e6:g} MB; save it as CSV, or "
                    f"{how_to_raise(size, most)}"
                )
            book = load_workbook(io.BytesIO(content), read_only=True, data_only=True, keep_links=False)
            visible = [sheet for sheet in book.worksheets if sheet.sheet_state == "visible"]
            notes = {sheet.title: _notes_of(archive, sheet) for sheet in visible}
            grids = [_grid(path, sheet, notes[sheet.title]) for sheet in visible]
            aside = [f"hidden sheet '{one.title}' not read" for one in book.worksheets if one not in visible]
    except (HistoryError, MemoryError):
        raise
    except Exception:  # of openpyxl and of what it calls, which let all kinds through where a file is damaged
        raise HistoryError(
            f"{path}: is no spreadsheet that can be read, or it is damaged; save it anew as .xlsx or CSV"
        ) from None
    found = [grid for grid in grids if grid is not None]
    if aside and not found:
        raise HistoryError(f"{path}: {aside[0]}, and no other holds anything; unhide the sheets that count")
    return [
        replace(
            grid,
            remarks=(*notes[grid.sheet].remarks(grid.sheet), *aside),
            header={
                **grid.header,
                **{
                    f"label cell {cell}": SourceText(text, f"{grid.place}, comment of cell {cell}")
                    for cell, text in notes[grid.sheet].comments
                },
            },
        )
        for grid in found
    ]


@dataclass(frozen=True)
class _SheetNotes:
    """What openpyxl does not say of a sheet that it reads row by row.

    hidden : numbers of rows. hidden_columns : whether there are some. uncomputed : the first cell with a formula and no
    value, "" for none. merged : first row and column, last row and column of each range of merged cells, from 1.
    comments : cell and text.
    """

    hidden: tuple[str, ...]
    hidden_columns: bool
    uncomputed: str
    merged: tuple[tuple[int, int, int, int], ...]
    comments: tuple[tuple[str, str], ...] = ()

    def remarks(self, sheet: str) -> tuple[str, ...]:
        """What was hidden and read nevertheless, for the label "assumed"."""
        shown = " ".join(self.hidden[:5]) + (" ..." if len(self.hidden) > 5 else "")
        rows = [f"hidden rows of sheet '{sheet}' read too: {shown}"] if self.hidden else []
        return (*rows, *([f"hidden columns of sheet '{sheet}' read too"] if self.hidden_columns else []))


def _notes_of(archive: zipfile.ZipFile, sheet: Any) -> _SheetNotes:
    """The notes of a sheet; ValueError for a row that no spreadsheet has."""
    from openpyxl.utils import range_boundaries

    hidden, merged, uncomputed, hidden_columns = list[str](), list[tuple[int, int, int, int]](), "", False
    with archive.open(sheet._worksheet_path.lstrip("/")) as stream:
        for _, element in ElementTree.iterparse(stream):
            kind, is_hidden = element.tag.rpartition("}")[2], element.get("hidden") in ("1", "true")
            if kind == "row":
                if int(element.get("r", 1)) > _LAST_ROW:
                    raise ValueError
                hidden += [element.get("r", "?")] if is_hidden else []
                element.clear()
            elif kind == "c" and not uncomputed:
                entries = {child.tag.rpartition("}")[2]: child.text for child in element}
                if "f" in entries and not (entries.get("v") or "").strip():
                    uncomputed = element.get("r", "?")
            elif kind == "col":
                hidden_columns |= is_hidden
            elif kind == "mergeCell":
                first, row, last, below = range_boundaries(element.get("ref", ""))
                merged.append((row, first, below, last))
    comments = tuple(_comments_of(archive, sheet._worksheet_path.lstrip("/")))
    return _SheetNotes(tuple(hidden), hidden_columns, uncomputed, tuple(merged), comments)


def _comments_of(archive: zipfile.ZipFile, sheet: str) -> Iterator[tuple[str, str]]:
    """Cell and text of each comment of a sheet, by the path of its part."""
    folder, _, name = sheet.rpartition("/")
    relations = f"{folder}/_rels/{name}.rels"
    if relations not in archive.namelist():
        return
    for relation in ElementTree.fromstring(archive.read(relations)):
        if not relation.get("Type", "").endswith("/comments"):
            continue
        target = relation.get("Target", "")
        part = target.lstrip("/") if target.startswith("/") else posixpath.normpath(f"{folder}/{target}")
        for element in ElementTree.fromstring(archive.read(part)).iter():
            if element.tag.rpartition("}")[2] == "comment":
                texts = (one.text or "" for one in element.iter() if one.tag.rpartition("}")[2] == "t")
                if text := " ".join("".join(texts).split()):
                    yield element.get("ref", "?"), text


def _grid(path: Path, sheet: Any, notes: _SheetNotes) -> CellGrid | None:
    """A sheet as a grid, None where it is empty."""
    place = f"{path}, sheet '{sheet.title}'"
    rows: list[TableRow] = []
    texts: list[str] = []
    known: dict[str, str] = {}
    if notes.uncomputed:
        raise HistoryError(
            f"{place}, cell {notes.uncomputed}: a formula without a computed value; open the file in a spreadsheet "
            "program and save it, or paste the values"
        )
    sheet.reset_dimensions()
    for number, row in enumerate(sheet.iter_rows(), 1):
        if not row:
            continue
        cells = [_cell_text(cell, known) for cell in row]
        refuse_unprintable("".join(cells), partial(str.format, "{}, row {}", place, number))
        if any(cells):
            texts += [cell for cell, source in zip(cells, row, strict=True) if "," in cell and _is_text(source)]
            rows.append(TableRow(number, cells))
    if not rows:
        return None
    rows = _with_points(rows, texts, place)
    grid = grid_of_rows(path, str(sheet.title), _with_merged(rows, notes.merged))
    return replace(grid, merged=_cells_below(rows, notes.merged))


def _is_text(cell: Any) -> bool:
    return isinstance(cell.value, str)


def _cell_text(cell: Any, known: dict[str, str]) -> str:
    """A cell as text; a number shown in per cent as the number that is shown, with the sign.

    known : {text of a cell: without further blanks}, so that many cells with one text take the memory of one.
    """
    value = cell.value
    if value is None:
        return ""
    if isinstance(value, str):
        if value not in known:
            known[value] = " ".join(value.split())
        return known[value]
    if isinstance(value, bool):
        return str(value).upper()
    if isinstance(value, (int, float)):
        return number_text(value, str(cell.number_format))
    if isinstance(value, datetime) and value >= _FIRST_DATE:
        return value.isoformat(" ")
    if isinstance(value, datetime):  # an elapsed time above a day, shown as h:mm:ss
        return _clock_text(value - _DAY_ZERO)
    return _clock_text(value) if isinstance(value, timedelta) else str(value)


def _clock_text(elapsed: timedelta) -> str:
    """An elapsed time as h:mm:ss, with the part of a second where there is one."""
    seconds, part = divmod(elapsed // timedelta(microseconds=1), 1_000_000)
    hours, rest = divmod(seconds, 3600)
    return f"{hours}:{rest // 60:02d}:{rest % 60:02d}{f'.{part:06d}' if part else ''}"


def _with_points(rows: list[TableRow], texts: list[str], place: str) -> list[TableRow]:
    """The rows with decimal points in numbers that were entered as text with a decimal comma."""
    comma = Dialect("\t", ",")
    numbers = [text for text in texts if is_number(text, comma)]
    if not numbers or detect_dialect([f"{text}\t0" for text in numbers], place).decimal == ".":
        return rows
    return [
        TableRow(row.line, [c.replace(",", ".") if "," in c and is_number(c, comma) else c for c in row.cells])
        for row in rows
    ]


def _cells_below(rows: list[TableRow], merged: Sequence[tuple[int, int, int, int]]) -> frozenset[tuple[int, int]]:
    """Row and column, from 0, of cells that are merged with one above them."""
    lines, width = {row.line for row in rows}, max(len(row.cells) for row in rows)
    ranges = [(top, first, min(bottom, max(lines)), min(last, width)) for top, first, bottom, last in merged]
    return frozenset(
        (line, column - 1)
        for top, first, bottom, last in ranges
        for line in range(top + 1, bottom + 1)
        for column in range(first, last + 1)
    )


def _with_merged(rows: list[TableRow], merged: Sequence[tuple[int, int, int, int]]) -> list[TableRow]:
    """The rows with the text of each merged cell in all columns that it covers, in its first row."""
    by_line = {row.line: row for row in rows}
    for line, first, _, last in merged:
        row = by_line.get(line)
        if row is None or row.line > _FILLED_ROWS or last - first > 1000 or first > len(row.cells):
            continue
        cells = [*row.cells, *[""] * (last - len(row.cells))]
        cells[first - 1 : last] = [cells[first - 1]] * (last - first + 1)
        by_line[row.line] = TableRow(row.line, cells)
    return list(by_line.values())


@dataclass(frozen=True)
class SpreadsheetReader:
    """Reader of spreadsheets of one laboratory; vocabulary : names that it uses in heads and columns."""

    name: str
    title: str
    vocabulary: HeaderVocabulary = field(default_factory=HeaderVocabulary)

    def accepts(self, path: Path) -> bool:
        """Say whether `path` is a file .xlsx."""
        return path.suffix.lower() in (".xlsx", ".xlsm") and path.is_file()

    def read(self, path: Path) -> list[History]:
        """Return the histories in all sheets."""
        check_readable(path, SPREADSHEET_FILE)
        left_out = {name.casefold() for name in self.vocabulary.ignored}
        grids = [grid for grid in read_sheets(path) if grid.sheet.casefold() not in left_out]
        framed = [grid for grid in grids if names_time(grid, self.vocabulary)]
        if not framed:
            sheets = ", ".join(f"'{grid.sheet}'" for grid in grids) or "none that holds anything"
            raise HistoryError(f"{path}: no sheet has a column of time (sheets: {sheets}); name one time_h or Time (h)")
        stated: dict[str, dict[str, SourceText]] = {}
        aside: list[str] = []
        notes: dict[str, SourceText] = {}
        found = [(grid, test) for grid in framed for test in tests_in(grid, self.vocabulary)]
        names = {name for grid, test in found for name in (grid.sheet, test.name)}
        for grid in grids:
            if grid not in framed:
                conditions = _conditions_by_test(grid, self.vocabulary)
                if conditions.keys() & names or any(map(_states_a_condition, conditions.values())):
                    _add_conditions(stated, conditions, grid)
                else:  # remarks
                    aside.append(f"sheet '{grid.sheet}' not read as it has no column of time")
                    notes |= _note_of_sheet(grid)
        found = [(grid, replace(test, entries={**notes, **test.entries})) for grid, test in found]
        return histories_of_tests(_with_conditions(path, found, stated, aside), path, self.vocabulary)


_TEST_NAMES = (*TEST_NAME_COLUMNS, "name", "sheet")
"""Names, in small letters, of the column that says to which test or sheet conditions belong."""


def _names_tests(row: TableRow) -> bool:
    """Whether a row names columns of conditions, one of them that of the tests."""
    cells = [words_of(cell) for cell in row.cells if cell]
    return len(cells) > 1 and not set(cells).isdisjoint(_TEST_NAMES)


def _conditions_by_test(grid: CellGrid, vocabulary: HeaderVocabulary) -> dict[str, dict[str, SourceText]]:
    """{test: its conditions} of a sheet with a column of tests; {} of any other sheet."""
    head = [k for k, row in enumerate(grid.rows[:_FILLED_ROWS]) if _names_tests(row)]
    if not head or head[0] + 1 >= len(grid.rows):
        return {}
    grid = replace(grid, rows=grid.rows[head[0] :])  # rows above the names are titles
    table, known = table_of(without_ignored(grid, 0, vocabulary.ignored)), KnownNames.of(vocabulary)
    columns = [k for k, name in enumerate(table.columns) if words_of(name) in _TEST_NAMES]
    if not columns:
        return {}
    tests: dict[str, dict[str, SourceText]] = {}
    for row in table.rows:
        test, place = row.cells[columns[0]], table.location(row.line)
        if not test or test in tests:
            raise HistoryError(f"{place}: the test is '{quoted(test)}', which is empty or named before; name each once")
        tests[test] = {
            known.condition(name) if known.is_condition(name) else f"label {name}": replace(entry, key=name)
            for name, entry in table.entries(row).items()
            if name != table.columns[columns[0]]
        }
        if empty := [name for name in table.empty_columns(row) if known.is_condition(name)]:
            tests[test]["label assumed"] = SourceText(", ".join(map(unknown_text, empty)), place)
    return tests


def _note_of_sheet(grid: CellGrid) -> dict[str, SourceText]:
    """The texts of a sheet of few remarks as one label; {} of a sheet that holds more."""
    cells = [cell for row in grid.rows for cell in row.cells if cell]
    text = "; ".join(cells)
    is_note = len(cells) <= _MOST_REMARKS and not any(is_number(cell, grid.dialect) for cell in cells)
    return {f"label sheet {grid.sheet}": SourceText(text, grid.place)} if is_note else {}


def _states_a_condition(entries: Mapping[str, SourceText]) -> bool:
    return any(not key.startswith("label ") for key in entries)


def _add_conditions(
    stated: dict[str, dict[str, SourceText]], conditions: Mapping[str, dict[str, SourceText]], grid: CellGrid
) -> None:
    for test, entries in conditions.items():
        if test in stated:
            raise HistoryError(
                f"{grid.place}: test '{quoted(test)}' has conditions in another sheet too; keep one of them"
            )
        stated[test] = entries


def _with_conditions(
    path: Path,
    found: list[tuple[CellGrid, TabulatedTest]],
    stated: Mapping[str, Mapping[str, SourceText]],
    aside: list[str],
) -> list[tuple[CellGrid, TabulatedTest]]:
    """The tests with what the sheets of conditions say of them, by their name or that of their sheet."""
    results, used = [], set[str]()
    for grid, test in found:
        key = test.name if test.name in stated else grid.sheet
        extra = stated.get(key, {})
        used.add(key)
        clash = sorted(extra.keys() & test.entries.keys())
        if clash:
            raise HistoryError(f"{extra[clash[0]].location}: '{clash[0]}' was already given; keep one of them")
        table = replace(test.table, assumptions=(*test.table.assumptions, *grid.remarks, *aside))
        results.append((grid, replace(test, entries={**test.entries, **extra}, table=table)))
    unused = sorted(stated.keys() - used)
    if unused:
        entries = stated[unused[0]].values()
        where = next((entry.location for entry in entries), str(path))
        raise HistoryError(
            f"{where}: '{quoted(unused[0])}' has conditions, but no sheet or column of that name; correct the name, or "
            "leave the sheet out by its name: --ignore, in Python ignore=[...]"
        )
    return results


SPREADSHEET = SpreadsheetReader("xlsx", "a spreadsheet .xlsx: a test a sheet, or several side by side")
