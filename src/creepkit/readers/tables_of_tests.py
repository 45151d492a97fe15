"""The rows of tables with one row a test, with what stands above, between, beside and below them."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path

from creepkit.errors import HistoryError, quoted
from creepkit.files.delimited_text import Dialect, is_missing, is_number
from creepkit.readers.column_names import KnownNames, split_written_name
from creepkit.readers.columns_of_tests import (
    TestTableHead,
    head_of_tests,
    is_number_like,
    is_test_table,
    key_of_column,
    only_text,
)
from creepkit.readers.condition_texts import conditions_in_text, sources_of_names
from creepkit.readers.questions import Question
from creepkit.readers.table import CellTable, SourceText, TableRow, cells_of_width, without_ignored
from creepkit.readers.text_files import read_text_table
from creepkit.readers.vocabulary import HeaderVocabulary, plain_name

TEXT_SUFFIXES, SPREADSHEET_SUFFIXES = (".csv", ".tsv", ".txt", ".dat", ".asc"), (".xlsx", ".xlsm")


@dataclass(frozen=True)
class TestRow:
    """The row of one test.

    cells : of the columns. stated : what a row above says of its group. filled : columns whose cell is that of a row
    above. is_open : whether a cell is asked for.
    """

    line: int
    cells: tuple[str, ...]
    stated: Mapping[str, SourceText] = field(default_factory=dict)
    filled: tuple[int, ...] = ()
    is_open: bool = False


@dataclass(frozen=True)
class TestTable:
    """A table with one row a test.

    names : of the columns, as written, with their units. line : in which they stand. header : what holds for all tests.
    notes : titles and remarks around the table. assumptions : what was assumed of it. positions : of its columns in the
    file, from 0. sources : conditions in titles and in the names of sheet and file.
    """

    grid: CellTable
    names: tuple[str, ...]
    line: int
    rows: tuple[TestRow, ...]
    header: Mapping[str, SourceText]
    notes: tuple[str, ...] = ()
    assumptions: tuple[str, ...] = ()
    positions: tuple[int, ...] = ()
    sources: tuple[SourceText, ...] = ()

    def location(self, line: int) -> str:
        """Where a row stands."""
        return self.grid.location(line)

    def entry(self, row: TestRow, column: int, is_number: bool = True) -> SourceText:
        """A cell of a row; of a number without separators between thousands, with a decimal point."""
        text, decimal = row.cells[column], self.grid.dialect.decimal
        if is_number or re.fullmatch(r"[+-]?\d*,\d+", text):
            text, decimal = plain_number(text, decimal)
        return SourceText(text, self.location(row.line), decimal, self.names[column])


_GROUPED = re.compile(r"\d{1,3}(?:\.\d{3})+,\d+|\d{1,3}(?:,\d{3})+\.\d+|\d{1,3}(?:[\s'’]\d{3})+(?:[.,]\d+)?(?![\d.,])")
"""A number with separators between thousands that cannot be a decimal sign."""

_POWER = re.compile(r"(?<=[\d.,])\s*(?:[x×·*∙]\s*)10\s*\^?\s*\(?([+-]?\d+|[⁻⁺⁰¹²³⁴-⁹]+)\)?")
"""A power of ten, written as such."""


def plain_number(text: str, decimal: str) -> tuple[str, str]:
    """A text with a number without separators between thousands, and the decimal sign of that: a point if it may be."""

    def plain(found: re.Match[str]) -> str:
        sign = max(".,", key=found[0].rfind)
        whole, _, part = found[0].rpartition(sign) if found[0].count(sign) == 1 else (found[0], "", "")
        return re.sub(r"[.,\s'’]", "", whole) + (f".{part}" if part else "")

    text = _POWER.sub(lambda found: f"e{unicodedata.normalize('NFKC', found[1]).replace('−', '-')}", text)
    changed, count = _GROUPED.subn(plain, text)
    if not count and decimal == "," and re.fullmatch(r"\D*\d*,\d+(?:[eE][+-]?\d+)?\D*", text):
        changed, count = text.replace(",", "."), 1
    return changed, "." if count else decimal


def grids_of(path: Path) -> list[CellTable]:
    """The cells of a text file, or of the sheets of a spreadsheet."""
    if path.suffix.lower() not in SPREADSHEET_SUFFIXES:
        return [read_text_table(path)]
    from creepkit.readers.spreadsheets import read_sheets

    return read_sheets(path)


def head_in(grid: CellTable, vocabulary: HeaderVocabulary) -> TestTableHead | None:
    """The head of a grid with one row a test; None of any other grid."""
    return head_of_tests(grid.rows, grid.dialect, vocabulary.synonyms)


def tables_in(path: Path, vocabulary: HeaderVocabulary) -> list[TestTable]:
    """The tables of tests in a file, without columns that are left out; HistoryError where there is none."""
    found = [(grid, head_in(grid, vocabulary)) for grid in grids_of(path)]
    if not any(head for _, head in found):
        turned = next((grid for grid, _ in found if stands_in_columns(grid, vocabulary)), None)
        if turned is not None:
            what = "each test stands in a column; transpose the table, so that each stands in a row"
            raise HistoryError(f"{turned.place}: {what}")
        raise HistoryError(
            f"{path}: no row names the columns of tests; name a stress or temperature, and a rate or a time, such as "
            "stress_MPa,temperature_C,rupture_h"
        )
    aside = tuple(f"sheet '{grid.sheet}' not read as it is no table of tests" for grid, head in found if head is None)
    texts = tuple(only_text(row, grid.dialect) for grid, head in found if head is None for row in grid.rows)
    tables = [_table(grid, head, vocabulary, aside) for grid, head in found if head is not None]
    return [replace(table, notes=(*table.notes, *filter(None, texts))) for table in tables]


_MOST_ROWS_OF_COLUMNS = 30


def stands_in_columns(grid: CellTable, vocabulary: HeaderVocabulary) -> bool:
    """Whether the first cells of the rows name what is known of tests, each of which stands in a column."""
    names = [row.cells[0] for row in grid.rows[:_MOST_ROWS_OF_COLUMNS] if row.cells[0]]
    known = [bool(key_of_column(vocabulary.synonyms.get(name, name))[0]) for name in names]
    filled = [sum(map(bool, row.cells)) for row in grid.rows[:_MOST_ROWS_OF_COLUMNS]]
    return 2 * sum(known) > len(known) and min(filled) > 2 and is_test_table(names)


def _table(grid: CellTable, head: TestTableHead, vocabulary: HeaderVocabulary, aside: tuple[str, ...]) -> TestTable:
    rows = list(grid.rows)
    known, line = KnownNames.of(vocabulary), rows[head.line].line
    heading = {tuple(row.cells) for row in rows[head.first : head.body]}
    body = [row for row in rows[head.body :] if tuple(row.cells) not in heading]
    below = without_ignored(replace(grid, rows=[TableRow(line, list(head.names)), *body]), 0, vocabulary.ignored)
    header, notes = _around(replace(grid, header=below.header), rows[: head.first], known)
    names, body = below.rows[0].cells, list(below.rows[1:])
    while body and _is_note(body[-1], grid):
        notes.append(" ".join(dict.fromkeys(filter(None, body.pop().cells))))
    width = max((k for k, name in enumerate(names, 1) if name), default=0)
    tests, stated = list[TestRow](), dict[str, SourceText]()
    for row in body:
        if text := only_text(row, grid.dialect):
            stated = conditions_of_group(text, grid.location(row.line), known)
        else:
            cells = cells_of_width(grid, row, width, beside=True)
            if any(cells[k] for k in range(width) if names[k]):
                tests.append(TestRow(row.line, tuple(cells), stated))
    beside = [k for k in range(max((len(row.cells) for row in tests), default=width)) if k >= width or not names[k]]
    written = [name or "note" for name in names[:width]] + ["note"] * any(k >= width for k in beside)
    tests = [_with_margin(row, width, len(written), grid) for row in tests]
    kept = [k for k in range(len(written)) if (k < width and names[k]) or any(row.cells[k] for row in tests)]
    rows_of_tests = tuple(replace(row, cells=tuple(row.cells[k] for k in kept)) for row in tests)
    columns, positions = tuple(written[k] for k in kept), below.positions or range(len(written))
    return TestTable(
        *(grid, columns, line, rows_of_tests, header, tuple(notes), (*grid.assumptions, *aside)),
        tuple(positions[k] if k < len(positions) else k for k in kept),
        (*_sources(rows[: head.first], grid, known), *sources_of_names(grid, vocabulary)),
    )


def _sources(above: Sequence[TableRow], grid: CellTable, known: KnownNames) -> list[SourceText]:
    """Conditions in titles above a table."""
    titles = [(row.line, only_text(row, grid.dialect)) for row in above]
    return [one for line, text in titles for one in conditions_in_text(text, grid.location(line), known)]


def _with_margin(row: TestRow, width: int, columns: int, grid: CellTable) -> TestRow:
    """The row with what stands beside the table as the note in its last column; HistoryError for a number there."""
    beside = [cell for cell in row.cells[width:] if cell]
    if any(is_number_like(cell, grid.dialect) for cell in beside):
        raise HistoryError(
            f"{grid.location(row.line)}: '{quoted(beside[0])}' stands in a column without a name; name that column"
        )
    return replace(row, cells=(*row.cells[:width], *[" ".join(beside)] * (columns - width)))


def _is_note(row: TableRow, grid: CellTable) -> bool:
    """Whether a row below the tests is one of remarks: it holds texts in one or two cells, and no number."""
    filled = [cell for cell in row.cells if cell]
    few = len(filled) <= 2 < len(row.cells) and not any(is_number_like(cell, grid.dialect) for cell in filled)
    return few or bool(only_text(row, grid.dialect))


def _around(grid: CellTable, above: Sequence[TableRow], known: KnownNames) -> tuple[dict[str, SourceText], list[str]]:
    """What lines above a table state of all its tests, and what is a note."""
    header, notes = dict(grid.header), list[str]()
    for row in above:
        filled = list(dict.fromkeys(cell for cell in row.cells if cell))
        if len(filled) == 1 and ":" in filled[0]:
            filled = [part.strip() for part in filled[0].split(":", 1)]
        key = filled[0].rstrip(": =")
        if len(filled) in (2, 3) and known.is_condition(key):
            unit = f" ({filled[2]})" if len(filled) == 3 and not split_written_name(key)[1] else ""
            header[f"{key}{unit}"] = SourceText(filled[1], grid.location(row.line), grid.dialect.decimal)
        else:
            notes.append(" ".join(filled))
    for line, key, entry in grid.comments:
        if known.is_condition(key):
            raise HistoryError(
                f"{grid.location(line)}: '{key}' stands below the names of the columns; move it above them"
            )
        notes.append(f"{key}: {entry.text}")
    return header, notes


def conditions_of_group(text: str, place: str, known: KnownNames) -> dict[str, SourceText]:
    """What a row of its own says of the tests below it: stress and temperature, or else a label of the group."""
    found = {one.key: SourceText(one.text, place) for one in conditions_in_text(text, place, known)}
    return found or {"label group": SourceText(text, place)}


# ---- conditions that stand once for a group ------------------------------------------------------------------------

_GROUP_SIZE = 1.5
"""Rows of a group, on average, above which empty cells below a filled one are a way of writing, and no lost values."""


_DITTO = frozenset(('"', "''", "″", "〃", "”", "ditto", "idem", "do.", "dto", "dto.", "s.o.", "id."))
"""Marks that repeat the cell above, in small letters."""


def with_groups(table: TestTable, keys: Sequence[str], errors: list[HistoryError]) -> TestTable:
    """The table with conditions that stand once for a group in all of its rows; a lost value is an error.

    keys : quantities of the columns, without units. Empty cells below a filled one are those of its group where no
    value is written twice below itself, and groups have more than one row; in merged cells they are in any case.
    """
    cells = [list(row.cells) for row in table.rows]
    filled, asked = [list[int]() for _ in cells], set[int]()
    for k, key in enumerate(keys):
        if key not in ("stress", "temperature", "label heat", "alloy", "label laboratory"):
            continue
        column = [row[k] for row in cells]
        ditto = {r for r, cell in enumerate(column) if cell.casefold() in _DITTO}
        gaps = [r for r, cell in enumerate(column) if is_missing(cell) or r in ditto]
        if not gaps or len(gaps) == len(column):
            continue
        values = len(column) - len(gaps)
        is_repeated = any(a == b and not is_missing(a) for a, b in pairwise(column))
        is_grouped = not is_repeated and len(column) > _GROUP_SIZE * values and gaps[0] > 0
        for r in gaps:
            if r > 0 and (is_grouped or r in ditto or (table.rows[r].line, table.positions[k]) in table.grid.merged):
                cells[r][k] = cells[r - 1][k]
                filled[r].append(k)
        missing = [r for r in gaps if is_missing(cells[r][k])]
        if missing and key in ("stress", "temperature") and not _is_stated(key, table, missing):
            errors.append(_empty_cell(table, k, key, missing))
            asked.update(missing)
    rows = [
        replace(row, cells=tuple(cells[r]), filled=tuple(filled[r]), is_open=r in asked)
        for r, row in enumerate(table.rows)
    ]
    return replace(table, rows=tuple(rows))


def _is_stated(key: str, table: TestTable, rows: Sequence[int]) -> bool:
    """Whether the condition of some rows is stated for the table, or for their groups."""
    names = [*table.header, *(name for r in rows[:1] for name in table.rows[r].stated)]
    return any(plain_name(name).startswith(key) for name in names)


def _empty_cell(table: TestTable, column: int, key: str, rows: Sequence[int]) -> Question:
    name, place = table.names[column], table.location(table.rows[rows[0]].line)
    others = f", and {len(rows) - 1} more" if len(rows) > 1 else ""
    above = [row.cells[column] for row in table.rows[: rows[0]] if not is_missing(row.cells[column])]
    unit = split_written_name(name)[1]
    suffix = unit.replace("°", "").strip() or ("C" if key == "temperature" else "MPa")
    likely = above[-1] if above else next(r.cells[column] for r in table.rows if not is_missing(r.cells[column]))
    plain = likely.replace(",", ".")
    number = float(plain) if is_number(plain, Dialect()) else likely
    return Question(
        table.grid.path,
        place,
        f"the cell of '{quoted(name, 60)}' is empty{others}; which {key} is it?",
        f"{key}_{suffix}",
        (number,),
        is_free=True,
    )
