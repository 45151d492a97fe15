"""Tables of creep tests, one row a test: stress, temperature, minimum creep rate, rupture time, times to strains.

    test,stress_MPa,temperature_C,min creep rate (1/h),t_r (h),heat
    A1,120,750,2.1e-6,8200,X7
    A2,100,750,,>10000,X7

How a test ended is read of marks of its time (`>10000`, `10000+`), of columns of words, codes or yes and no, and of
remarks; what stays open is asked for (`ends_of_tests`). Times to a strain become frames of strain. Other columns are
labels. All errors of a file come at once.

Rupture times may stand in a matrix, temperatures by stresses or the other way round:

    Time to rupture (h), heat AAA
    Temperature (°C) / Stress (MPa), 235, 196, 177
    550, 20.3, 132.3, (60000)
    600, -, 11.9, 32.4

A head above it says that its times are those of rupture. A cell in brackets, unless a note says otherwise, or behind
`>` is a run-out; one that is empty or a dash was not tested.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise, zip_longest
from pathlib import Path

from creepkit.errors import HistoryError, quoted
from creepkit.files.delimited_text import float_of, is_missing
from creepkit.readers.assembly import UNSAID_END, assemble_history, assemble_without_frames
from creepkit.readers.columns_of_tests import (
    RATES,
    SAYS_RUPTURE,
    TestColumn,
    column_called,
    head_of_tests,
    is_number_like,
    only_text,
    quantity_of,
    stands_in_columns,
    unit_in,
)
from creepkit.readers.ends_of_tests import (
    FIRM,
    LABEL,
    RUPTURED,
    STOPPED,
    TIME_IN_CELL,
    UNCLEAR,
    EndsOfColumn,
    MarkedTime,
    end_said_by,
    ends_in_column,
    kind_of_column,
    legend_in,
    marked_time,
)
from creepkit.readers.frames import unknown_text
from creepkit.readers.history_csv import TABLE_SUFFIXES, TEXT_SUFFIXES
from creepkit.readers.questions import Question, collected, raise_all
from creepkit.readers.separate_tables import separate_tables
from creepkit.readers.spreadsheets import SPREADSHEET_SUFFIXES, holds_frames, read_sheets
from creepkit.readers.standard_names import in_standard_keys, specimen_named
from creepkit.readers.table import CellTable, SourceText, TableRow
from creepkit.readers.tables_of_tests import MOST_ASKED, TestRow, TestTable
from creepkit.readers.text_files import peek_table, read_text_table
from creepkit.readers.vocabulary import HeaderVocabulary, split_written_name, unit_suffix, words_of
from creepkit.readers.weak_sources import with_weak_sources
from creepkit.records import History
from creepkit.records.quantities import STRESS, TEMPERATURE, TIME, QuantityKind

_ROUNDING = 0.01
"""Part of a time by which two that are the same may differ."""


def tables_of(path: Path, meant: Mapping[str, str]) -> list[CellTable]:
    """The tables in a text file, or in the sheets of a spreadsheet; meant : as of `separate_tables`."""
    is_spreadsheet = path.suffix.lower() in SPREADSHEET_SUFFIXES
    tables = read_sheets(path) if is_spreadsheet else [read_text_table(path)]
    separate = [one for table in tables for one in separate_tables(_turned(table, meant), meant)]
    return [one_row_a_test(one, meant) for one in separate]


def _turned(table: CellTable, meant: Mapping[str, str]) -> CellTable:
    """A table of tests in columns with its columns as rows, which places tell; any other table as it is."""
    if not stands_in_columns(table, meant) or head_of_tests(table, meant):
        return table
    columns = zip_longest(*(row.cells for row in table.rows), fillvalue="")
    sheet = f"{table.sheet} (columns as rows)".strip()
    rows = [TableRow(number, cells) for number, cells in enumerate(columns, 1) if any(cells)]
    return replace(table, rows=rows, sheet=sheet, merged=frozenset()).assuming("each column is a test")


@dataclass(frozen=True)
class RowPerTestReader:
    """Reader of tables of minimum creep rates, rupture times and times to strains, one row a test."""

    name: str
    title: str
    vocabulary: HeaderVocabulary = field(default_factory=HeaderVocabulary)

    def accepts(self, path: Path) -> bool:
        """Say whether `path` is such a table: a rate or a time beside a stress or a temperature, and no strain."""
        suffix = path.suffix.lower()
        is_text = suffix in (*TABLE_SUFFIXES, *TEXT_SUFFIXES)
        if not (is_text or suffix in SPREADSHEET_SUFFIXES) or not path.is_file():
            return False
        if is_text:
            table = peek_table(path)
            return table is not None and self._is_table(table)
        try:
            sheets = read_sheets(path)
        except HistoryError:
            return False
        return any(map(self._is_table, sheets)) and not any(holds_frames(sheet, self.vocabulary) for sheet in sheets)

    def _is_table(self, table: CellTable) -> bool:
        meant = self.vocabulary.synonyms
        first = one_row_a_test(separate_tables(table, meant)[0], meant)
        return head_of_tests(first, meant) is not None or stands_in_columns(first, meant)

    def read(self, path: Path) -> list[History]:
        """Return one history a row, in the order of the rows; of a spreadsheet those of all its tables of tests."""
        errors, places, histories = list[HistoryError](), dict[str, str](), dict[str, History]()
        for table in self.tables(path, errors):
            if not table.is_understood:
                continue
            for row, end, notes in zip(table.rows, ends_of_rows(table), table.notes_of_rows(), strict=True):
                row.stated = {**notes, **row.stated}
                if (end.is_open or row.is_open) and errors:
                    continue
                history = collected(errors, partial(self._history, table, row, end))
                if history is None:
                    continue
                name, place = history.name, table.table.location(row.line)
                whole = _with_rate_of_another(histories[name], history) if name in places else history
                if whole is None:
                    what = f"test '{name}' already stands in {places[name]}"
                    errors.append(HistoryError(f"{place}: {what}; give each row its own name"))
                    continue
                histories[name] = whole
                places.setdefault(name, place)
        raise_all(errors)
        return [*histories.values()]

    def tables(self, path: Path, errors: list[HistoryError]) -> list[TestTable]:
        """The tables of tests in a file; HistoryError where there is none. errors : to which others are added."""
        meant = self.vocabulary.synonyms
        found = [(table, head_of_tests(table, meant)) for table in tables_of(path, meant)]
        if not any(head for _, head in found):
            raise HistoryError(
                f"{path}: no row names the columns of tests; name a stress or temperature, and a rate or a time, such "
                "as stress_MPa,temperature_C,rupture_h"
            )
        others = [table for table, head in found if head is None]
        heads = [(table, head) for table, head in found if head is not None]
        taken = set[str]()
        tables = [TestTable(table, head, self.vocabulary, errors, taken) for table, head in heads]
        for one in tables:
            unused = [other.sheet for other in others if not one.take_labels(other)]
            one.table = one.table.assuming(*(f"sheet '{name}' not read as it is no table of tests" for name in unused))
            one.notes += filter(None, (only_text(row, other.dialect) for other in others for row in other.rows))
        return tables

    def _history(self, table: TestTable, row: TestRow, end: RowEnd) -> History:
        """The test of a row."""
        sheet, location = table.table, table.table.location(row.line)
        cells = {
            column.quantity: Cell(column, table.entry(row, k))
            for k, column in enumerate(table.columns)
            if not is_missing(row.cells[k])
        }
        empty = [column.quantity for column in table.columns if column.quantity not in cells]
        frames, assumptions = _strains_reached(cells, location)
        cells = _with_end({name: one for name, one in cells.items() if one.column.strain is None}, end, location)
        entries = {**sheet.header, **row.stated, **{one.column.key: one.entry for one in cells.values()}}
        known = self.vocabulary.terms(specimen_named(entries, self.vocabulary))
        quantities = {column_called(name).quantity for name in table.names}
        sources = tuple(one for one in sheet.sources if one.key not in quantities)
        entries, of_names = with_weak_sources(
            in_standard_keys(entries, known), CellTable(sheet.path, (), sources=sources), known
        )
        stated = {*map(quantity_of, entries)}
        assumptions = [
            *sheet.assumptions,
            *(_unknown(quantity, stated, cells) for quantity in empty),
            *(*end.assumptions, *of_names, *row.assumed, *assumptions),
        ]
        if assumed := ", ".join(filter(None, assumptions)):
            entries.setdefault("label assumed", SourceText(assumed, location))
        name, where = row.name, f"sheet {sheet.sheet}, " if sheet.sheet else ""
        source = f"{sheet.path} ({where}{cells['name'].entry.text if 'name' in cells else f'line {row.line}'})"
        if not frames:
            return assemble_without_frames(name, entries, self.vocabulary, location=location, source=source)
        if measure := _includes_elastic(table):
            entries.setdefault("includes_elastic", SourceText(measure, location))
        rows = [TableRow(row.line, (repr(time), repr(strain), "1")) for time, strain in frames]
        if "end_time" in cells and "ended" not in entries:
            what = f"'{cells['end_time'].entry.key}' {UNSAID_END}"
            raise sheet.question(what, "ended", RUPTURED, STOPPED, line=row.line)
        if "end_time" in cells and entries["ended"].text == STOPPED:  # after the last frame, with its strain
            last = cells["end_time"].seconds()
            rows += [TableRow(row.line, (repr(last), repr(frames[-1][1]), "0"))] * (last > frames[-1][0])
        columns = ("time_s", "strain_1", "used")
        text = CellTable(sheet.path, rows, sheet.sheet, columns=columns, columns_line=row.line)
        return assemble_history(name, entries, text, self.vocabulary, location=location, source=source)


def _with_rate_of_another(one: History, other: History) -> History | None:
    """A test whose minimum rate and whose curve or end stand in two tables; None where both state one of them."""
    rates = [test for test in (one, other) if test.minimum_rate is not None and not (test.outputs or test.end_known)]
    if len(rates) != 1 or one.condition != other.condition:
        return None
    (rest,) = (test for test in (one, other) if test is not rates[0])
    stated = {"minimum_rate": rates[0].minimum_rate, "minimum_rate_sd": rates[0].minimum_rate_sd}
    return rest.replace(**stated, labels={**rates[0].labels, **rest.labels}) if rest.minimum_rate is None else None


TEST_TABLE = RowPerTestReader(
    "test-table", "one row a test: stress, temperature, and minimum creep rate, rupture time or times to strains"
)


@dataclass(frozen=True)
class Cell:
    """What a cell of a row states."""

    column: TestColumn
    entry: SourceText

    def seconds(self, number: str = "") -> float:
        """Its time, s; number : where a mark stands beside it."""
        entry = replace(self.entry, text=number or self.entry.text)
        return TIME.convert(entry.number(entry.key), self.column.unit, entry.location, entry.key)

    def as_quantity(self, quantity: str, text: str) -> Cell:
        """The same as another quantity, of this text."""
        return Cell(replace(self.column, quantity=quantity), replace(self.entry, text=text))


def _unknown(quantity: str, stated: set[str], cells: Mapping[str, Cell]) -> str:
    """What an empty cell leaves unknown; "" where the rest of the row says it, or where it would be a label."""
    is_stopped = "ended" in cells and cells["ended"].entry.text == STOPPED
    said = {"rupture": is_stopped, "end_time": "rupture" in stated}.get(quantity, quantity in (*stated, "name"))
    is_result = TestColumn(quantity).strain is None and not quantity.startswith("label ")
    return unknown_text(quantity) if is_result and not said and quantity not in stated else ""


# ---- times to strains ----------------------------------------------------------------------------------------------


def _strains_reached(cells: Mapping[str, Cell], location: str) -> tuple[list[tuple[float, float]], list[str]]:
    """(s, strain) in the order of time, and what is said of strains that were not reached.

    A creep strain that is the only one follows one of zero when the load is put on.
    """
    reached, others, lasted = list[tuple[float, float, SourceText]](), list[str](), None
    if broke := cells.get("rupture"):
        mark = marked_time(broke.entry.text, {})
        lasted = broke.seconds(mark.number) if mark.number and not mark.said else None
    for cell in cells.values():
        if (strain := cell.column.strain) is None:
            continue
        entry, mark = cell.entry, marked_time(cell.entry.text, {})
        if mark.said != STOPPED:
            reached.append((cell.seconds(mark.number), strain, entry))
            continue
        if broke and lasted is not None and cell.seconds(mark.number) > (1 + _ROUNDING) * lasted:
            what = f"'{entry.key}' is {quoted(entry.text)}, and '{broke.entry.key}' {quoted(broke.entry.text)}"
            raise HistoryError(f"{location}: {what}; a strain is reached before rupture or not: correct one of them")
        others.append(f"{strain:.3g} of strain not reached by {mark.number} {cell.column.unit}")
    reached.sort(key=lambda one: one[:2])
    for (_, before, one), (_, strain, other) in pairwise(reached):
        if strain <= before:
            raise HistoryError(
                f"{other.location}: '{one.key}' is {one.text}, and '{other.key}' {other.text}: the larger strain is "
                "reached first; correct one of them"
            )
    frames = [(time, strain) for time, strain, _ in reached]
    return ([(0.0, 0.0), *frames] if len(frames) == 1 else frames), others


def _includes_elastic(table: TestTable) -> str:
    """Whether times are those to a total strain, by the names of their columns; "" where these do not say it."""
    named = zip(table.names, table.columns, strict=True)
    words = " ".join(words_of(name) for name, column in named if column.strain is not None)
    is_total = re.search(r"\btot(?:al\w*)?\b|gesamt", words) is not None
    is_creep = re.search(r"creep|kriech|plasti|bleibend|fluage", words) is not None
    return "" if is_total == is_creep else "yes" if is_total else "no"


# ---- how the tests ended -------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class RowEnd:
    """How the test of a row ended, by its columns, "" where none says it, and by the mark of its time.

    is_open : whether that is asked for.
    """

    stated: str
    mark: MarkedTime
    assumptions: tuple[str, ...] = ()
    is_open: bool = False


_OF_ORIGIN = ("heat", "laboratory", "group", "assumed")
_SAYS_NO_END = ("name", "alloy", "control", "specimen", *(f"label {one}" for one in _OF_ORIGIN))


def ends_of_rows(table: TestTable) -> list[RowEnd]:
    """How the test of each row ended; what its columns leave open is an error that asks for it."""
    legend = {sign: end for note in (*table.notes, *table.names) for sign, end in legend_in(note).items()}
    answers = legend | {text.casefold(): end for text, end in table.vocabulary.end_of_test_terms.items()}
    time, duration = table.position("rupture"), table.position("end_time")
    marks = [
        MarkedTime("", "")
        if time is None or is_missing(row.cells[time])
        else marked_time(table.entry(row, time).text, answers)
        for row in table.rows
    ]
    named = [answers.get(name.casefold(), "") for name in table.names_of_tests()]
    kinds = [kind_of_column(name) for name in table.names]
    columns = [
        k
        for k, column in enumerate(table.columns)
        if column.kind is None
        and column.quantity not in _SAYS_NO_END
        and (
            table.names[k] not in table.vocabulary.labels
            or any(row.cells[k].casefold() in answers for row in table.rows)
        )
        and (kinds[k] or not split_written_name(table.names[k])[1])  # one with a unit is a quantity
    ]
    decided = [mark.said == STOPPED for mark in marks]
    found = dict[int, EndsOfColumn]()
    for k in sorted(columns, key=lambda k: kinds[k] not in FIRM):
        found[k] = ends_in_column(table.names[k], [row.cells[k] for row in table.rows], answers, decided)
        if kinds[k] in FIRM and any(found[k].ends):
            decided = [True] * len(decided)
    if time is None and duration is None:
        found = {k: one for k, one in found.items() if kinds[k] in FIRM}
    ends = list[RowEnd]()
    for r, (row, mark) in enumerate(zip(table.rows, marks, strict=True)):
        stated = {k: one.ends[r] for k, one in found.items() if one.ends[r] in (RUPTURED, STOPPED)}
        firm = {k: end for k, end in stated.items() if not found[k].is_remark}
        said = {named[r]} if named[r] in (RUPTURED, STOPPED) else set(firm.values())
        if not said and mark.said not in (RUPTURED, STOPPED):
            group = row.stated.get("label group")
            said = set(stated.values()) | ({end_said_by(group.text) if group else ""} & {STOPPED, RUPTURED})
        if len(said) > 1:
            named_cells = (
                (quoted(table.names[k]), quoted(row.cells[k], 40), end) for k, end in (firm or stated).items()
            )
            each = " and ".join(f"'{name}' is '{cell}' and says {end}" for name, cell, end in named_cells)
            table.errors.append(HistoryError(f"{table.table.location(row.line)}: {each}; correct one of them"))
        is_unsaid = any(kinds[k] == "status" and one.ends[r] == "" for k, one in found.items())
        notes = list[str]()
        if is_unsaid and not said and mark.said != STOPPED:
            known = "ruptured" if time is not None and mark.said in ("", RUPTURED) and mark.number else "unknown"
            notes.append(f"ended {known} (empty cell)")
        if STOPPED in said and mark.said != STOPPED and not firm and named[r] == "":
            notes.append("stopped before rupture by its remark")
        is_asked = len(said) != 1 and UNCLEAR in (mark.said, *(one.ends[r] for one in found.values()))
        ends.append(RowEnd("".join(said) if len(said) == 1 else "", mark, tuple(notes), is_asked))
    if time is not None and not any(STOPPED in (end.stated, end.mark.said) for end in ends):
        table.errors += _asked_of_notes(table, answers)
    if time is not None or duration is not None:
        table.errors += [_asked_of_column(table, k, one, time) for k, one in found.items() if one.asked]
    if time is not None:
        open_rows = [r for r, end in enumerate(ends) if end.mark.said == UNCLEAR and end.stated == ""]
        table.errors += _asked_of_marks(table, time, {marks[r].mark: table.rows[r] for r in reversed(open_rows)})
    return ends


def _asked_of_notes(table: TestTable, answers: Mapping[str, str]) -> list[HistoryError]:
    """Questions of notes that speak of tests which did not break, while the table has none."""
    names = table.names_of_tests()
    if any(name.casefold() in answers for name in names if name):
        return []
    return [
        table.table.question(
            f"the note '{quoted(note, 80)}' may speak of tests that did not break; which are they?",
            *("ended", {names[-1] or "NAME OF A TEST": STOPPED}, {note: LABEL}),
        )
        for note in table.notes
        if end_said_by(note) not in ("", RUPTURED) and not legend_in(note) and note.casefold() not in answers
    ]


def _asked_of_column(table: TestTable, k: int, column: EndsOfColumn, time: int | None) -> Question:
    """The question of what the texts of a column say of the end."""
    first = column.ends.index(UNCLEAR)
    texts = list(column.asked[:MOST_ASKED])
    more = f" and {len(column.asked) - len(texts)} more" if len(column.asked) > len(texts) else ""
    listed = " and ".join(f"'{quoted(text, 60)}'" if text else "an empty cell" for text in texts)
    flags = [text for text in texts if text]
    choices = [dict.fromkeys(texts, end) for end in (STOPPED, RUPTURED)]
    if len(flags) == 2 and len(column.values) == 2 and not column.is_remark:
        likely = _likely_unbroken(table, k, flags, time)
        other = next(text for text in flags if text != likely)
        choices = [{likely: STOPPED, other: RUPTURED}, {likely: RUPTURED, other: STOPPED}]
    what = f"'{quoted(table.names[k], 60)}' says {listed}{more}: did these tests break, were they stopped before, or"
    choices.append(dict.fromkeys(texts, LABEL))
    return table.table.question(
        f"{what} does it say nothing of their end?", "ended", *choices, line=table.rows[first].line
    )


def _likely_unbroken(table: TestTable, column: int, texts: Sequence[str], time: int | None) -> str:
    """Which of two values tests have that did not break: those that share one time, else those that lasted longer."""

    def rank(text: str) -> tuple[bool, float]:
        rows = [row for row in table.rows if row.cells[column].casefold() == text.casefold()]
        cells = [TIME_IN_CELL.fullmatch(row.cells[time]) for row in rows] if time is not None else []
        times = [float_of(one["number"]) for one in cells if one and one["number"].count(".") < 2]
        return len(times) > 1 and len(set(times)) == 1, sum(times) / max(len(times), 1)

    return max(texts, key=rank)


def _asked_of_marks(table: TestTable, time: int, marked: Mapping[str, TestRow]) -> list[HistoryError]:
    """Questions of what marks of times mean, one for each; `<` says nothing that could be used."""
    errors = list[HistoryError]()
    for mark, row in sorted(marked.items(), key=lambda one: one[1].line):
        what = f"'{quoted(table.names[time], 60)}' is '{quoted(row.cells[time])}'"
        if mark[:1] in "<≤~≈" or not re.sub(r"[^\w()*+†‡#^/\[\]§¹²³-]", "", mark):
            place = table.table.location(row.line)
            errors.append(HistoryError(f"{place}: {what}; write a number of {table.names[time]}, >1000 for a run-out"))
            continue
        choices = ({mark.casefold(): end} for end in (STOPPED, RUPTURED))
        errors.append(table.table.question(f"{what}: did this test break then?", "ended", *choices, line=row.line))
    return errors


def _with_end(cells: Mapping[str, Cell], end: RowEnd, location: str) -> dict[str, Cell]:
    """The cells of a row, its run-out as the time at which it was stopped, and with `ended` where that is known."""
    cells, stated, mark = dict(cells), end.stated, end.mark
    taken, time = cells.get("end_time"), cells.pop("rupture", None)
    if taken is not None and (lasted := marked_time(taken.entry.text, {})).number:
        taken = cells["end_time"] = taken.as_quantity("end_time", lasted.number)
        stated = stated or (STOPPED if lasted.said == STOPPED and time is None else "")
    if time is not None:
        if mark.said == STOPPED and stated == RUPTURED and mark.number:
            what = f"'{time.entry.text}' is a time without rupture, and the test ruptured"
            raise HistoryError(f"{location}: {what}; keep one")
        if mark.number and STOPPED in (mark.said, stated):
            stated = STOPPED
            if taken is not None and taken.entry.text != mark.number:
                what = f"it was stopped at '{time.entry.text}' and at '{taken.entry.text}'"
                raise HistoryError(f"{location}: {what}; keep one")
            cells.setdefault("end_time", time.as_quantity("end_time", mark.number))
        elif mark.number:
            cells["rupture"] = time.as_quantity("rupture", mark.number)
        else:  # a word stands in the place of the time
            stated = stated or mark.said
    if stated == RUPTURED and "rupture" not in cells:
        if "end_time" in cells:  # a column of durations says when it broke
            broke = cells.pop("end_time")
            cells["rupture"] = broke.as_quantity("rupture", broke.entry.text)
        elif "minimum_rate" in cells:
            cells.setdefault("label ended", Cell(TestColumn("label ended"), SourceText(RUPTURED, location)))
            return cells
    elif "rupture" in cells:
        _check_duration(cells["rupture"], cells.pop("end_time", None))
    if stated or "rupture" in cells:  # said here, whatever a remark says
        said = STOPPED if stated == STOPPED else RUPTURED
        cells["ended"] = Cell(TestColumn("ended"), SourceText(said, location))
    return cells


def _check_duration(rupture: Cell, duration: Cell | None) -> None:
    """Refuse a duration of a test that is not its rupture time."""
    if duration is not None and abs(duration.seconds() - rupture.seconds()) > _ROUNDING * rupture.seconds():
        one, other = rupture.entry, duration.entry
        raise HistoryError(
            f"{one.location}: '{one.key}' is {quoted(one.text)}, and '{other.key}' is {quoted(other.text)}; a test "
            "that ruptured lasted until then; correct one of them"
        )


# ---- a matrix of rupture times -------------------------------------------------------------------------------------


_HEAT = re.compile(
    r"(?i:heat|cast|charge|schmelze|coulée|batch)(?: no\.?)?[ _:=#-]*((?=[A-Z\d])(?!Treat)[\w-]+?)(?:_|\b)"
)
_WITH_UNIT = re.compile(r"(\d+(?:[.,]\d+)?)?\s*(\S*)")
_DEEPEST, _SEARCHED = 4, 60
"""Rows of a head; and within which the matrix must begin."""


def one_row_a_test(table: CellTable, meant: Mapping[str, str]) -> CellTable:
    """A matrix of rupture times as a table with one row a test; any other table as it is."""
    rows, dialect = table.rows, table.dialect
    for at, row in enumerate(() if head_of_tests(table, meant) else rows[:_SEARCHED]):
        above = [cell for one in rows[max(0, at - _DEEPEST) : at] for cell in one.cells if cell]
        is_named = not is_number_like(row.cells[0], dialect)  # the row of an axis; a test begins with a number
        is_axis = any(len(_axis(row.cells[1:], kind)[0]) > 1 for kind in _AXES.values())
        if is_named and is_axis and at + 1 < len(rows):
            said = [*above, row.cells[0], table.sheet, table.path.stem]
            first = [one.cells[0] for one in rows[max(0, at - _DEEPEST) : at + 1] if one.cells[0]]
            if any(map(SAYS_RUPTURE.search, said)) and not any(map(RATES.search, map(str.casefold, said))):
                return _unfolded(table, at, said, first) or table
    return table


_AXES: Mapping[str, QuantityKind] = {"stress": STRESS, "temperature": TEMPERATURE}
"""{quantity of an axis of a matrix: its kind}."""


def _named_axes(texts: Iterable[str]) -> list[TestColumn]:
    """The axes that texts such as `Temperature (°C) / Stress (MPa)` name."""
    columns = (column_called(part) for text in texts for part in re.split(r"\s+[\\/|]\s+|\\", text))
    return [one for one in columns if one.quantity in _AXES]


def _unfolded(table: CellTable, at: int, said: Sequence[str], first: Sequence[str]) -> CellTable | None:
    """The rows of tests of a matrix, of which units or the name nearest to its corner say what stands down the rows.

    None where they do not. said : texts of its head. first : those of its first column.
    """
    dialect = table.dialect
    body = [row for row in table.rows[at + 1 :] if not only_text(row, dialect)]
    cells = table.rows[at].cells[1:], [row.cells[0] for row in body]
    by_unit = [next((name for name, kind in _AXES.items() if _axis(one, kind)[1]), "") for one in cells]
    named = [one.quantity for one in _named_axes(reversed(first))]
    down = by_unit[1] or next((name for name in _AXES if by_unit[0] not in ("", name)), "") or "".join(named[:1])
    across = next((name for name in _AXES if name != down), "")
    if not down or by_unit[0] not in ("", across):
        return None
    (values, unit), (levels, units) = (_axis(one, _AXES[name]) for one, name in zip(cells, (across, down), strict=True))
    of_axis = {across: unit, down: units}
    for one in _named_axes(reversed(said)):
        of_axis[one.quantity] = of_axis[one.quantity] or one.unit
    is_stress = of_axis["stress"] or any(
        re.search(r"stress|spannung|contrainte|sforzo|tensi[oó]n|esfuerzo|σ|MPa", text) for text in said
    )
    is_whole = "" not in levels and len(levels) == len(body)
    if not (is_stress and is_whole and of_axis["temperature"]):
        return None
    of_rupture = [text for text in said if SAYS_RUPTURE.search(text)]
    times, loads = (
        known or next(filter(None, (unit_in(text, kind) for text in texts)), "")
        for known, texts, kind in (("", of_rupture, TIME), (of_axis["stress"], said, STRESS))
    )
    heat = next((found[1] for text in said if (found := _HEAT.search(text)) and found[1]), "")
    names = [("Temperature", of_axis["temperature"]), ("Stress", loads), ("Rupture time", times)]
    head = ["Test", *(f"{name} ({unit})" if unit else name for name, unit in names), *["Heat"] * bool(heat)]
    notes = [row for row in table.rows if only_text(row, dialect) and row.line > table.rows[at].line]
    texts = [only_text(row, dialect).replace("( )", "()") for row in notes]
    legend = {sign: end for text in texts for sign, end in legend_in(text).items()}
    tests, count = list[TableRow](), Counter[str]()
    for row, level in zip(body, levels, strict=True):
        for value, cell in zip(values, row.cells[1:], strict=False):
            if is_missing(cell) or cell in ("\N{MINUS SIGN}", "...", "…"):
                continue
            if not value or not is_number_like(cell, dialect):
                return None
            temperature, stress = (level, value) if down == "temperature" else (value, level)
            if cell[0] in "([" and legend.get("()") != RUPTURED:
                cell = f">{cell.strip('()[] ')}"
            name = f"{heat or table.sheet or table.path.stem} {temperature} {stress}"
            count[name] += 1
            name = f"{name} ({count[name]})" if count[name] > 1 else name
            tests.append(TableRow(row.line, [name, temperature, stress, cell, *[heat] * bool(heat)]))
    titles = [row for row in table.rows[:at] if only_text(row, dialect) and row.cells[0]]
    titles = [row for row in titles if not column_called(row.cells[0]).quantity]  # "Rupture time (h)"
    whole = [*titles, TableRow(table.rows[at].line, head), *tests, *notes]
    return replace(table, rows=whole, merged=frozenset()).assuming("a test a cell of a matrix of rupture times")


def _axis(cells: Iterable[str], kind: QuantityKind) -> tuple[list[str], str]:
    """The numbers of conditions in cells, "" for none, and the unit that stands beside them; [] where some are none."""
    found = [_WITH_UNIT.fullmatch(cell) for cell in cells]
    units = {unit_suffix(one[2]) if one and one[2] else "" for one in found} - {""}
    if None in found or not units <= {*kind.units} or len(units) > 1:
        return [], ""
    values = [one[1] or "" for one in found if one]
    while values and not values[-1]:
        values.pop()
    return values, "".join(map(str, units))
