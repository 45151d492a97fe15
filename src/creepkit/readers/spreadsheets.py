"""Spreadsheets (.xlsx): their sheets as tables, with the values that were last computed; nothing is evaluated.

A sheet of frames has a column of time; a sheet with a column of tests and none of time states conditions, one row a
test; other sheets are left aside, which the label "assumed" says.
"""

from __future__ import annotations

import io
import posixpath
import re
import warnings
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from decimal import Decimal
from functools import partial
from itertools import takewhile
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from creepkit.errors import HistoryError, quoted
from creepkit.files.delimited_text import Dialect, is_number, refuse_unprintable
from creepkit.files.reading import MAXIMUM_UNPACKED_BYTES, FileKind, check_readable, read_bytes
from creepkit.readers.columns_of_tests import column_called, head_of_tests
from creepkit.readers.frames import UNUSED, unknown_text
from creepkit.readers.history_csv import histories_of_tests
from creepkit.readers.parts_of_tests import parts_beside
from creepkit.readers.questions import Question
from creepkit.readers.separate_tables import separate_tables
from creepkit.readers.table import (
    CellTable,
    SourceText,
    TableRow,
    dialect_of,
    in_plain_numbers,
    is_comment,
    named_columns,
    refuse_long_cells,
    without_ignored,
)
from creepkit.readers.table_heads import HeadOfTest, names_time
from creepkit.readers.table_layouts import TabulatedTest, tests_in
from creepkit.readers.tests_file import SEPARATE, answers_of
from creepkit.readers.vocabulary import HeaderVocabulary, Terms, names_tests, unit_suffix, words_of
from creepkit.readers.weak_sources import conditions_in_text
from creepkit.records import History

SPREADSHEET_SUFFIXES = (".xlsx", ".xlsm")


SPREADSHEET_FILE = FileKind("a spreadsheet of tests", HistoryError, "save the sheet as .xlsx or CSV", 100_000_000)


_FILLED_ROWS, _FILLED_COLUMNS, _LAST_ROW = 60, 1000, 1_048_576
"""Rows from the top in which a merged cell counts for all the columns, this many at most, that it covers; the last row
that the format has."""


_MOST_REMARKS = 20
"""Cells of a sheet of remarks that is kept as a label."""


_DAY_ZERO, _FIRST_DATE = datetime(1904, 1, 1), timedelta(days=731)
"""One of the two days from which spreadsheets count; what is above so many days is a date, of 1902 or later, and what
is below it an elapsed time."""


def read_sheets(path: Path) -> list[CellTable]:
    """The sheets that hold something; HistoryError for a file that is no spreadsheet, or too large unpacked."""
    content = read_bytes(path, SPREADSHEET_FILE)
    from openpyxl import load_workbook

    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive, warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of what a workbook holds beside its cells
            size = sum(part.file_size for part in archive.infolist())
            if size > MAXIMUM_UNPACKED_BYTES:
                what = f"unpacks to {size / 1e6:.0f} MB, more than {MAXIMUM_UNPACKED_BYTES / 1e6:g} MB"
                raise HistoryError(f"{path}: {what}; save it as CSV")
            book = load_workbook(io.BytesIO(content), read_only=True, data_only=True, keep_links=False)
            # Counted from 1904, days come out as they are in the file; from 1900, the 59th and the 60th are one.
            first_day, book.epoch = book.epoch, _DAY_ZERO
            visible = [sheet for sheet in book.worksheets if sheet.sheet_state == "visible"]
            aside = [f"hidden sheet '{one.title}' not read" for one in book.worksheets if one not in visible]
            tables = [_table(path, sheet, _notes_of(archive, sheet), aside, first_day) for sheet in visible]
    except (HistoryError, MemoryError):
        raise
    except Exception:  # of openpyxl and of what it calls, which let all kinds through where a file is damaged
        raise HistoryError(
            f"{path}: is no spreadsheet that can be read, or it is damaged; save it anew as .xlsx or CSV"
        ) from None
    found = [table for table in tables if table is not None]
    if aside and not found:
        raise HistoryError(f"{path}: {aside[0]}, and no other holds anything; unhide the sheets that count")
    return found


@dataclass
class _SheetNotes:
    """What openpyxl does not say of a sheet that it reads row by row.

    hidden, struck : numbers of rows that are hidden, or struck through. hidden_columns : whether there are some.
    uncomputed : the first cell with a formula and no value, "" for none. merged : first row and column, last row and
    column of each range of merged cells, from 1. comments : {cell: text}.
    """

    hidden: list[str] = field(default_factory=list)
    struck: list[str] = field(default_factory=list)
    hidden_columns: bool = False
    uncomputed: str = ""
    merged: list[tuple[int, int, int, int]] = field(default_factory=list)
    comments: dict[str, str] = field(default_factory=dict)

    def remarks(self, sheet: str) -> list[str]:
        """What was hidden and read nevertheless, and what was struck through and not, for the label "assumed"."""
        found = (("hidden rows", self.hidden, "read too"), ("rows struck through", self.struck, "not read"))
        rows = [
            f"{what} of sheet '{sheet}' {how}: {' '.join(rows[:5])}{' ...' * (len(rows) > 5)}"
            for what, rows, how in found
            if rows
        ]
        return [*rows, *([f"hidden columns of sheet '{sheet}' read too"] if self.hidden_columns else [])]


def _tag(element: ElementTree.Element) -> str:
    return element.tag.rpartition("}")[2]


def _notes_of(archive: zipfile.ZipFile, sheet: Any) -> _SheetNotes:
    """The notes of a sheet; ValueError for a row that no spreadsheet has."""
    from openpyxl.utils import range_boundaries

    notes, part = _SheetNotes(), sheet._worksheet_path.lstrip("/")
    with archive.open(part) as stream:
        for _, element in ElementTree.iterparse(stream):
            kind, is_hidden = _tag(element), element.get("hidden") in ("1", "true")
            if kind == "row":
                if int(element.get("r", 1)) > _LAST_ROW:
                    raise ValueError
                notes.hidden += [element.get("r", "?")] if is_hidden else []
                element.clear()
            elif kind == "c" and not notes.uncomputed:
                entries = {_tag(child): child.text for child in element}
                if "f" in entries and not (entries.get("v") or "").strip():
                    notes.uncomputed = element.get("r", "?")
            elif kind == "col":
                notes.hidden_columns |= is_hidden
            elif kind == "mergeCell":
                first, row, last, below = range_boundaries(element.get("ref", ""))
                notes.merged.append((row, first, below, last))
    folder, _, name = part.rpartition("/")
    relations = f"{folder}/_rels/{name}.rels"
    for relation in ElementTree.fromstring(archive.read(relations)) if relations in archive.namelist() else ():
        if relation.get("Type", "").endswith("/comments"):
            target = posixpath.normpath(posixpath.join("/", folder, relation.get("Target", ""))).lstrip("/")
            for element in ElementTree.fromstring(archive.read(target)).iter():
                texts = (one.text or "" for one in element.iter() if _tag(one) == "t")
                if _tag(element) == "comment" and (text := " ".join("".join(texts).split())):
                    notes.comments[element.get("ref", "?")] = text
    return notes


def _table(path: Path, sheet: Any, notes: _SheetNotes, aside: Sequence[str], first_day: datetime) -> CellTable | None:
    """A sheet as a table, None where it is empty; comments fill the first cell, `# key:` may have its value beside it.

    aside : what was left aside of the file. first_day : from which its dates count.
    """
    table = CellTable(path, [], str(sheet.title), Dialect("\t"))
    if notes.uncomputed:
        what = "a formula without a computed value; save the file in a spreadsheet program, or paste the values"
        raise HistoryError(f"{table.place}, cell {notes.uncomputed}: {what}")
    rows, comments, texts, known = list[TableRow](), list[TableRow](), set[str](), dict[str, str]()
    sheet.reset_dimensions()
    for number, row in enumerate(sheet.iter_rows(), 1):
        if _is_struck(row):
            notes.struck.append(str(number))
            continue
        cells = [_cell_text(cell, known, first_day) for cell in row]
        refuse_unprintable("".join(cells), partial(str.format, "{}, row {}", table.place, number))
        if any(cells):
            refuse_long_cells(table.location(number), cells)
            texts |= {
                text for text, cell in zip(cells, row, strict=True) if "," in text and isinstance(cell.value, str)
            }
            (comments if is_comment(cells[0]) else rows).append(TableRow(number, cells))
    table = replace(table, assumptions=(*notes.remarks(sheet.title), *aside))
    if not rows and not comments:
        return None
    if not rows:
        raise HistoryError(f"{table.place}: holds comments but no table; write a row of columns, then rows")
    table = table.with_comments(((row.line, row.cells) for row in comments), rows[0].line)
    places = ((cell, f"{table.place}, comment of cell {cell}") for cell in notes.comments)
    header = {f"label cell {cell}": SourceText(notes.comments[cell], place) for cell, place in places}
    decimal, merged = answers_of(path).decimal, _cells_below(rows, notes.merged)
    filled = _with_merged(_with_points(table, rows, texts, decimal), notes.merged)
    table = replace(table, rows=filled, header={**table.header, **header}, merged=merged)
    return in_plain_numbers(table, is_stated=bool(decimal))


def _is_struck(row: Sequence[Any]) -> bool:
    """Whether somebody has struck out all that stands in a row."""
    written = [cell for cell in row if cell.value is not None]
    return bool(written) and all(cell.font.strike for cell in written)


# ---- cells ---------------------------------------------------------------------------------------------------------


def _cell_text(cell: Any, known: dict[str, str], first_day: datetime) -> str:
    """A cell as text; a number shown in per cent as the number that is shown, with the sign.

    known : {text of a cell: without further blanks}, so that many cells with one text take the memory of one.
    """
    value = cell.value
    if value is None:
        return ""
    if isinstance(value, str):
        return known.setdefault(value, " ".join(value.split()))
    if isinstance(value, bool):
        return str(value).upper()
    if isinstance(value, (int, float)):
        return number_text(value, str(cell.number_format))
    if isinstance(value, datetime):  # or an elapsed time above a day, shown as h:mm:ss
        value -= _DAY_ZERO
        if value >= _FIRST_DATE:
            return (first_day + value).isoformat(" ")
    return _clock_text(value) if isinstance(value, timedelta) else str(value)


def _clock_text(elapsed: timedelta) -> str:
    """An elapsed time as h:mm:ss, with the part of a second where there is one."""
    seconds, part = divmod(elapsed // timedelta(microseconds=1), 1_000_000)
    hours, rest = divmod(seconds, 3600)
    return f"{hours}:{rest // 60:02d}:{rest % 60:02d}{f'.{part:06d}' if part else ''}"


_SECTIONS = re.compile(r'(?:"[^"]*"?|\\.|[^;"\\])*', re.DOTALL)
"""A section of a number format, up to a semicolon that is neither quoted nor escaped."""


_LITERAL = re.compile(r'"([^"]*)"?|\\(.)|_.|\*.|\[[^\]]*\]?', re.DOTALL)
"""Parts of a format that are shown as they stand, the first two, and those of width, filling, colour and condition."""


def number_text(value: float, number_format: str) -> str:
    """A number as text, with the sign % where it is shown in per cent, as the number that is shown.

    Only a sign that is neither quoted nor escaped multiplies by 100: `0.00%` shows 0.005 as 0.50%, and `0.00" %"` shows
    0.5 as 0.50 %. Both are 0.5 %. Of several sections the second is that of negative numbers, the third that of zero.
    """
    text = repr(value)
    if "%" not in number_format:
        return text
    sections = [one for one in _SECTIONS.findall(number_format) if one]
    section = sections[min(1 if value < 0 else 2 if value == 0 and len(sections) > 2 else 0, len(sections) - 1)]
    if "%" in _LITERAL.sub("", section):
        return f"{Decimal(text).scaleb(2).normalize():f}%"
    shown = "".join((match[1] or match[2] or "") for match in _LITERAL.finditer(section))
    return f"{text}%" if shown.strip() == "%" else text


_COMMA = re.compile(r"(?P<number>[<>≥]?\s*[+-]?\d*,(?P<part>\d+)(?:[eEdD][+-]?\d+)?)(?P<unit>\s*[^\d\s,;][^,;]{0,11})?")
"""A number with a comma and perhaps a unit, `0,10 %`."""


def _with_points(table: CellTable, rows: list[TableRow], texts: set[str], decimal: str) -> list[TableRow]:
    """The rows with decimal points in numbers that were entered as text with a decimal comma.

    Cells that are numbers have no decimal sign, so texts decide; of three digits behind a comma those without a unit.
    decimal : the sign, where it is stated.
    """
    found = [match for text in texts if (match := _COMMA.fullmatch(text))]
    numbers = [match["number"].lstrip("<>≥ ") for match in found if not match["unit"] or len(match["part"]) != 3]
    lines = [f"{text}\t0" for text in numbers]
    if not lines or dialect_of(lines, table.path, table.place, decimal).decimal == ".":
        return rows
    changed = {match[0]: match[0].replace(",", ".") for match in found}
    return [TableRow(row.line, [changed.get(cell, cell) for cell in row.cells]) for row in rows]


def _cells_below(rows: list[TableRow], merged: Sequence[tuple[int, int, int, int]]) -> frozenset[tuple[int, int]]:
    """Row and column, from 0, of cells that are merged with one above them."""
    last_row, width = rows[-1].line, max(len(row.cells) for row in rows)
    return frozenset(
        (line, column - 1)
        for top, first, bottom, last in merged
        for line in range(top + 1, min(bottom, last_row) + 1)
        for column in range(first, min(last, width) + 1)
    )


def _with_merged(rows: list[TableRow], merged: Sequence[tuple[int, int, int, int]]) -> list[TableRow]:
    """The rows with the text of each merged cell in all columns that it covers, in its first row."""
    by_line = {row.line: row for row in rows}
    for line, first, _, last in merged:
        row = by_line.get(line)
        if row is None or line > _FILLED_ROWS or last - first > _FILLED_COLUMNS or first > len(row.cells):
            continue
        cells = [*row.cells, *[""] * (last - len(row.cells))]
        cells[first - 1 : last] = [cells[first - 1]] * (last - first + 1)
        by_line[line] = TableRow(line, cells)
    return list(by_line.values())


# ---- sheets --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class SpreadsheetReader:
    """Reader of spreadsheets of one laboratory; vocabulary : names that it uses in heads and columns."""

    name: str
    title: str
    vocabulary: HeaderVocabulary = field(default_factory=HeaderVocabulary)

    def accepts(self, path: Path) -> bool:
        """Say whether `path` is a file .xlsx."""
        return path.suffix.lower() in SPREADSHEET_SUFFIXES and path.is_file()

    def read(self, path: Path) -> list[History]:
        """Return the histories in all sheets."""
        check_readable(path, SPREADSHEET_FILE)
        if parts_beside(path):
            what = "is by its name a part of a test, and parts in spreadsheets are not joined: put their rows below one"
            raise Question(path, str(path), f"{what} another in one sheet. Or is it a test?", "parts", (SEPARATE,))
        left_out = {name.casefold() for name in self.vocabulary.ignored}
        sheets = [sheet for sheet in read_sheets(path) if sheet.sheet.casefold() not in left_out]
        framed = [sheet for sheet in sheets if holds_frames(sheet, self.vocabulary)]
        if not framed:
            for sheet in filter(_has_readings, sheets):  # whose error says what its head lacks
                tests_in(sheet, self.vocabulary)
            listed = ", ".join(f"'{sheet.sheet}'" for sheet in sheets) or "none that holds anything"
            raise HistoryError(f"{path}: no sheet has a column of time (sheets: {listed}); name one time_h or Time (h)")
        tests = [test for sheet in framed for test in tests_in(sheet, self.vocabulary)]
        notes, aside = dict[str, SourceText](), list[str]()
        for sheet in (one for one in sheets if one not in framed):
            conditions = _conditions_by_test(sheet, self.vocabulary)
            if stated := _stated_for_all(sheet, self.vocabulary):
                tests = [_with_entries(one, stated) for one in tests]
                continue
            states = any(not key.startswith("label ") for entries in conditions.values() for key in entries)
            if states or any(_agreement(key, test) for key in conditions for test in tests):
                titles = _titles(sheet, self.vocabulary.terms())
                tests = list(_with_conditions(sheet, tests, conditions, titles))
            else:  # remarks
                aside.append(f"sheet '{sheet.sheet}' not read as it has no column of time above readings")
                notes |= _note_of_sheet(sheet)
        tests = [replace(one, entries={**notes, **one.entries}, table=one.table.assuming(*aside)) for one in tests]
        return histories_of_tests(tests, path, self.vocabulary)


def holds_frames(sheet: CellTable, vocabulary: HeaderVocabulary) -> bool:
    """Whether a sheet has a column of time above frames, and not one row a test."""
    is_framed = _has_readings(sheet) and names_time(sheet, vocabulary)
    return is_framed and head_of_tests(separate_tables(sheet, vocabulary.synonyms)[0], vocabulary.synonyms) is None


def _has_readings(sheet: CellTable) -> bool:
    """Whether numbers stand beside one another in a row, as not in a sheet of a diagram."""
    return any(sum(cell[0].isdigit() for cell in row.cells if cell) > 1 for row in sheet.rows)


def _agreement(key: str, test: TabulatedTest) -> int:
    """How many words a row of conditions shares with the name of a test, its sheet or its alloy; 0 for another one.

    A test may have more words behind, `TA1 350 °C` those of `TA1`; all words of its name count a thousand.
    """
    alloy = test.entries["alloy"].text if "alloy" in test.entries else ""
    wanted, *named = (re.findall(r"\w+", one.casefold()) for one in (key, test.name, test.table.sheet, alloy))
    is_whole, is_front = wanted == named[0], any(one[: len(wanted)] == wanted for one in named)
    return 1000 * is_whole or len(wanted) * is_front


def _keys_tests(row: TableRow, known: Terms) -> list[int]:
    """The columns that say to which tests, sheets or alloys the conditions below belong, the surest first."""
    tests = [k for k, cell in enumerate(row.cells) if names_tests(cell) or words_of(cell) in _NAMES_OF_SHEETS]
    return tests + [k for k, cell in enumerate(row.cells) if cell and known.condition(cell) == "alloy"]


_NAMES_OF_SHEETS = ("name", "sheet", "specimen")


def _conditions_by_test(sheet: CellTable, vocabulary: HeaderVocabulary) -> dict[str, dict[str, SourceText]]:
    """{test, or alloy: its conditions} of a sheet with a column of them; {} of any other sheet."""
    known = vocabulary.terms()
    named = [sum(map(bool, row.cells)) > 1 and bool(_keys_tests(row, known)) for row in sheet.rows[:_FILLED_ROWS]]
    if True not in named[: len(sheet.rows) - 1]:
        return {}
    sheet = _in_one_row_a_test(replace(sheet, rows=sheet.rows[named.index(True) :]))
    table = named_columns(without_ignored(sheet, 0, vocabulary.ignored))
    (column, *_), tests = [*_keys_tests(TableRow(0, table.columns), known), -1], dict[str, dict[str, SourceText]]()
    by_alloy = known.condition(table.columns[column]) == "alloy"
    for row in table.rows if column >= 0 else ():
        test, place = row.cells[column], table.location(row.line)
        if by_alloy and (not test or test in tests):
            return {}  # of alloys at several temperatures, and the like
        if not test or test in tests:
            raise HistoryError(f"{place}: the test is '{quoted(test)}', which is empty or named before; name each once")
        tests[test] = {
            _key_of_condition(name, known): replace(entry, key=name)
            for name, entry in table.entries(row).items()
            if by_alloy or name != table.columns[column]
        }
        if empty := [name for name in table.empty_columns(row) if known.is_condition(name)]:
            tests[test]["label assumed"] = SourceText(", ".join(map(unknown_text, empty)), place)
    return tests


def _in_one_row_a_test(sheet: CellTable) -> CellTable:
    """A sheet of conditions with units beside its names, merged cells in each row, and without remarks below."""
    (names, *rows), above = sheet.rows, dict[int, str]()
    units = rows[0].cells if rows and all(unit_suffix(cell) for cell in rows[0].cells if cell) else ()
    for k, unit in enumerate(units):
        names = TableRow(names.line, [f"{c} ({unit})" if k == n and unit else c for n, c in enumerate(names.cells)])
    filled = list[TableRow]()
    for row in rows[bool(units) :]:
        cells = [above.get(k, "") if (row.line, k) in sheet.merged else cell for k, cell in enumerate(row.cells)]
        above |= dict(enumerate(cells))
        filled += [TableRow(row.line, cells)] * (sum(map(bool, row.cells)) > 1)
    return replace(sheet, rows=[names, *filled])


def _titles(sheet: CellTable, known: Terms) -> tuple[SourceText, ...]:
    """What rows above the names of a sheet of conditions state of all tests."""
    above = takewhile(lambda row: sum(map(bool, row.cells)) < 2 or not _keys_tests(row, known), sheet.rows)
    texts = ((cell, sheet.location(row.line)) for row in above for cell in row.cells)
    return tuple(one for text in texts for one in conditions_in_text(*text, known))


def _key_of_condition(name: str, known: Terms) -> str:
    return known.condition(name) if known.is_condition(name) else column_called(name).key or f"label {name}"


def _note_of_sheet(sheet: CellTable) -> dict[str, SourceText]:
    """The texts of a sheet of few remarks as one label; {} of a sheet that holds more."""
    cells = [cell for row in sheet.rows for cell in row.cells if cell]
    is_note = len(cells) <= _MOST_REMARKS and not any(is_number(cell, sheet.dialect) for cell in cells)
    return {f"label sheet {sheet.sheet}": SourceText("; ".join(cells), sheet.place)} if is_note else {}


def _with_conditions(
    sheet: CellTable,
    tests: Sequence[TabulatedTest],
    stated: Mapping[str, Mapping[str, SourceText]],
    titles: Sequence[SourceText],
) -> Iterator[TabulatedTest]:
    """The tests with what a sheet of conditions says of them, by their name, or that of their sheet or alloy.

    titles : what it says of all.
    """
    most = [max((_agreement(key, test) for key in stated), default=0) for test in tests]
    found = [[key for key in stated if n and _agreement(key, test) == n] for n, test in zip(most, tests, strict=True)]
    unused = sorted(stated.keys() - {key for keys in found for key in keys})
    twice = next((keys for keys in found if len(keys) > 1), [])
    if unused or twice:
        said = f"'{quoted(unused[0])}' has conditions, but no sheet or column of that name" if unused else ""
        said = said or f"'{quoted(twice[0])}' and '{quoted(twice[1])}' may be of one test"
        where = next((one.location for one in stated[(unused or twice)[0]].values()), sheet.place)
        what = f"{said}; correct it, or is sheet '{sheet.sheet}' to be left out?"
        raise Question(sheet.path, where, what, "columns", [{sheet.sheet: UNUSED}])
    for test, keys in zip(tests, found, strict=True):
        table = replace(test.table, sources=(*test.table.sources, *titles))
        yield _with_entries(replace(test, table=table), stated[keys[0]] if keys else {})


def _with_entries(test: TabulatedTest, extra: Mapping[str, SourceText]) -> TabulatedTest:
    """A test with more that is said of it; HistoryError where it says another value itself."""
    for key in extra.keys() & test.entries.keys():
        if not extra[key].says_the_same(test.entries[key]):
            what = f"'{key}' is {quoted(extra[key].text, 60)}, and {test.entries[key].location} says another one"
            raise HistoryError(f"{extra[key].location}: {what}; correct one of them")
    return replace(test, entries={**test.entries, **extra})


def _stated_for_all(sheet: CellTable, vocabulary: HeaderVocabulary) -> dict[str, SourceText]:
    """Keys with their values, of which a sheet holds nothing else; {} of any other sheet."""
    head, filled = HeadOfTest(sheet, vocabulary.terms()), [[*filter(None, row.cells)] for row in sheet.rows]
    stated = [one for one in filled if 1 < len(one) < 4 and head.known.is_condition(one[0].rstrip(": "))]
    if max(map(len, filled)) > 3 or 2 * len(stated) <= len(filled):
        return {}
    for row in sheet.rows:
        head.read(row)
    return head.entries


SPREADSHEET = SpreadsheetReader("xlsx", "a spreadsheet .xlsx: a test a sheet, or several side by side")
