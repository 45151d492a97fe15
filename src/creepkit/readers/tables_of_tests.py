"""Tables with one row a test: their columns, their rows, and what stands above, between, beside and below them.

What is not understood of a column is asked for. A condition that stands once for a group of rows holds for the group:
in merged cells, above blank ones, or in a row of its own.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from functools import partial
from itertools import pairwise

from creepkit.errors import HistoryError, quoted
from creepkit.files.delimited_text import Dialect, float_of, is_missing, is_number, without_uncertainty
from creepkit.readers.columns_of_tests import (
    NAMES,
    QUANTITIES,
    RATES,
    TEXTS,
    TestColumn,
    TestTableHead,
    column_called,
    is_bare_rate,
    is_number_like,
    is_unit_of_rate,
    only_text,
    quantity_of,
    unit_in,
)
from creepkit.readers.ends_of_tests import (
    LABEL,
    NO,
    UNCLEAR,
    YES,
    end_said_by,
    invalidity_said_by,
    kind_of_column,
    legend_in,
    plain_words,
)
from creepkit.readers.questions import ANSWERS_FILE, Answer, Question, collected
from creepkit.readers.remarks import STATISTIC, is_note, is_signed, is_statistic, rows_beside_notes, tests_named
from creepkit.readers.table import (
    POINT_OF_THOUSANDS,
    CellTable,
    SourceText,
    TableRow,
    with_commas_of_remarks,
    without_ignored,
)
from creepkit.readers.table_heads import HeadOfTest, with_entries_of_comments
from creepkit.readers.tests_file import EXCLUDE, answers_of
from creepkit.readers.vocabulary import (
    CONDITION_KINDS,
    HeaderVocabulary,
    Terms,
    in_unit,
    plain_name,
    split_unit,
    split_written_name,
    unit_behind,
    unit_suffix,
    words_of,
)
from creepkit.readers.weak_sources import conditions_in_text, sources_of_names
from creepkit.records.quantities import RATE, STRESS, TIME

MOST_ASKED = 6
"""Texts that a question or a note names."""


@dataclass
class TestRow:
    """The row of one test.

    name : of the test. stated : what a row above says of its group. assumed : what was assumed of its cells. is_open :
    whether one is asked for.
    """

    line: int
    cells: list[str]
    name: str = field(default="", kw_only=True)
    stated: Mapping[str, SourceText] = field(default_factory=dict)
    assumed: list[str] = field(default_factory=list)
    is_open: bool = False


_SEARCHED = 20
"""Rows of another sheet within which its names are looked for."""


_GROUPED = re.compile(r"\d{1,3}(?:\.\d{3})+,\d+|\d{1,3}(?:,\d{3})+\.\d+|\d{1,3}(?:[\s'’]\d{3})+(?:[.,]\d+)?(?![\d.,])")
"""A number with separators between thousands that cannot be a decimal sign."""


def plain_number(text: str, decimal: str) -> tuple[str, str]:
    """A text with a number without separators between thousands, and the decimal sign of that: a point if it may be."""

    def plain(found: re.Match[str]) -> str:
        sign = max(".,", key=found[0].rfind)
        whole, _, part = found[0].rpartition(sign) if found[0].count(sign) == 1 else (found[0], "", "")
        return re.sub(r"[.,\s'’]", "", whole) + (f".{part}" if part else "")

    changed, count = _GROUPED.subn(plain, text)
    if not count and decimal == "," and re.fullmatch(r"\D*\d*,\d+(?:[eEdD][+-]?\d+)?\D*", text):
        changed, count = text.replace(",", "."), 1
    return changed, "." if count else decimal


_GROUP_SIZE = 1.5
"""Rows of a group, on average, above which empty cells below a filled one are a way of writing, and no lost values."""


_DITTO = frozenset(('"', "''", "″", "〃", "”", "ditto", "idem", "do.", "dto", "dto.", "s.o.", "id."))
"""Marks that repeat the cell above, in small letters."""


class TestTable:
    """A table with one row a test.

    table : with the names of its columns, as written and with their units. columns : what they mean. notes : titles and
    remarks around the table. errors : to which what is wrong is added. taken : names of tests of other tables, to which
    those of this one are added.
    """

    def __init__(
        self,
        sheet: CellTable,
        head: TestTableHead,
        vocabulary: HeaderVocabulary,
        errors: list[HistoryError],
        taken: set[str],
    ) -> None:
        self.vocabulary, self.errors = vocabulary, errors
        self.table: CellTable = sheet
        self.notes: list[str] = []
        self.rows: list[TestRow] = []
        self._read(sheet, head)
        count = len(errors)
        self.columns = list(self._understood_columns())
        self.is_understood = len(errors) == count
        if self.is_understood:
            self._name_tests(_title_above(sheet, head) if sheet.positions else None, taken)
            self._fill_stated()
            self._take_answers()
            self._leave_out_silent_rows()
            self._fill_groups()

    @property
    def place(self) -> str:
        """Where the names of the columns stand."""
        return self.table.location(self.table.columns_line)

    @property
    def names(self) -> Sequence[str]:
        """Of the columns, as they are written."""
        return self.table.columns

    def position(self, quantity: str) -> int | None:
        """The column of a quantity or text, None where there is none."""
        return next((k for k, one in enumerate(self.columns) if one.quantity == quantity), None)

    def names_of_tests(self) -> list[str]:
        """Of the rows; "" where no column has them."""
        k = self.position("name")
        return ["" if k is None else row.cells[k] for row in self.rows]

    def _name_tests(self, title: str | None, taken: set[str]) -> None:
        """Name the tests by their cells; else by the sheet or the file and the line.

        title : of one of several tables of a sheet, in which title, temperature and stress tell a test better.
        """
        sheet, told, above = self.table.sheet or self.table.path.stem, list[int](), dict[int, str]()
        if title is not None:
            stated = {one.key for one in conditions_in_text(title, "", self.vocabulary.terms())}
            positions = (self.position(one) for one in ("temperature", "stress") if one not in stated)
            told = [k for k in positions if k is not None]
        for row, written in zip(self.rows, self.names_of_tests(), strict=True):
            above |= {k: self.entry(row, k).text for k in told if re.search(r"\d", row.cells[k])}
            units = [f"{above.get(k, '')} {split_written_name(self.names[k])[1]}" for k in told]
            plain = f"{sheet} {row.line}" if title is None else " ".join([title or sheet, *units])
            numbered = (f"{plain} ({n})" for n in range(2, len(taken) + 3))
            row.name = written or next(one for one in (plain, *numbered) if one not in taken)
            taken.add(row.name)

    def take_labels(self, other: CellTable) -> bool:
        """Take the columns of another sheet, such as compositions, by test, heat or alloy; whether a row has them."""
        for at, head in enumerate(other.rows[:_SEARCHED] if self.is_understood else ()):
            keys = {column_called(cell).quantity or cell: k for k, cell in enumerate(head.cells) if cell}
            shared = [(keys[one], self.position(one)) for one in ("name", "label heat", "alloy") if one in keys]
            k, column = next(((k, own) for k, own in shared if own is not None), (0, None))
            if column is None or len(keys) < 2:
                continue
            below = {row.cells[k]: row for row in other.rows[at + 1 :] if row.cells[k : k + 1] and row.cells[k]}
            matching = [(row, below[row.cells[column]]) for row in self.rows if row.cells[column] in below]
            for row, said in matching:
                cells = zip(head.cells, said.cells, strict=False)
                stated = {
                    name: cell for n, (name, cell) in enumerate(cells) if n != k and name and not is_missing(cell)
                }
                labels = {f"label {name}": cell for name, cell in stated.items() if name not in self.names}
                place = other.location(said.line)
                row.stated = {**row.stated, **{one: SourceText(cell, place) for one, cell in labels.items()}}
            if matching:
                self.table = self.table.assuming(f"sheet '{other.sheet}' by its column '{head.cells[k]}'")
                return True
        return False

    def notes_of_rows(self) -> list[dict[str, SourceText]]:
        """The notes of each row as labels: those that name tests, or say that one does not count, are not of all."""
        names, found = [row.name for row in self.rows], [dict[str, SourceText]() for _ in self.rows]
        for key, entry in self._footnotes.items():
            of = entry.text.rpartition(" (of ")[2].rstrip(")").split("; ")
            rows = {k for k, row in enumerate(self.rows) if {*of} & {*row.cells}}
            for k in rows or range(len(self.rows)):
                found[k][key] = entry
        sentences = (one for note in self.notes for one in re.split(r"(?<=[.;]) (?=[^\W\d_])", note))
        for number, note in enumerate(sentences):
            rows, sign = tests_named(note, names), re.match(r"\W{1,3}(?=\s|$)", note)
            if not rows and (signs := legend_in(note)):
                cells = [[cell.casefold() for cell in row.cells] for row in self.rows]
                rows = {k for k, one in enumerate(cells) if any(is_signed(cell, signs) for cell in one)}
            elif not rows and invalidity_said_by(note):
                cells = [row.cells for row in self.rows] if sign else []
                rows = {k for k, row in enumerate(cells) if sign and any(c.endswith(sign[0].strip()) for c in row)}
            elif not rows:
                rows = set(range(len(self.rows)))
            for k in rows:
                found[k][f"label note {number + 1}"] = SourceText(note, self.place)
        return found

    def entry(self, row: TestRow, k: int) -> SourceText:
        """A cell of a row; of a number without separators between thousands, with a decimal point."""
        text, decimal = row.cells[k], self.table.dialect.decimal
        if self.columns[k].kind or re.fullmatch(r"[+-]?\d*,\d+", text):
            text, decimal = plain_number(text, decimal)
        if self.columns[k].factor != 1.0 and is_number(text, Dialect(decimal=decimal)):
            text, decimal = f"{self.columns[k].factor * float_of(text):.12g}", "."
        return SourceText(text, self.table.location(row.line), decimal, self.names[k])

    # ---- what stands where

    def _read(self, sheet: CellTable, head: TestTableHead) -> None:
        """Take apart names, rows, groups, margin, titles and notes."""
        known, line, dialect = self.vocabulary.terms(), sheet.rows[head.line].line, sheet.dialect
        heading = {tuple(row.cells) for row in sheet.rows[head.first : head.body]}
        by_title = {name.removeprefix("rupture ") for name in head.names} & {cell for row in heading for cell in row}
        by_title -= {*head.names}
        sheet = sheet.assuming(*(f"'{quoted(name, 60)}' is that to rupture by the title" for name in sorted(by_title)))
        body = [row for row in sheet.rows[head.body :] if tuple(row.cells) not in heading]
        body = with_commas_of_remarks(sheet, body, head.names)
        below = replace(sheet, rows=[TableRow(line, list(head.names)), *body])
        below = without_ignored(below, 0, self.vocabulary.ignored)
        sheet = with_entries_of_comments(replace(sheet, header=below.header), line, known)
        around = self._around(sheet, sheet.rows[: head.first], known)
        names, body = below.rows[0].cells, list(below.rows[1:])
        if statistics := [row for row in body if is_statistic(row, dialect)]:
            body = [row for row in body if row not in statistics]
            called = " and ".join(
                cell for row in statistics for cell in row.cells if STATISTIC.fullmatch(words_of(cell))
            )
            sheet = sheet.assuming(f"rows of {called} are no tests")
        while body and is_note(body[-1], dialect, len(names)):
            self.notes.append(re.sub("([:：]);", r"\1", "; ".join(dict.fromkeys(filter(None, body.pop().cells)))))
        named = [k for k, name in enumerate(names) if name]
        stated, beside = dict[str, SourceText](), dict[str, SourceText]()
        for row in body:
            if text := only_text(row, dialect):
                place = sheet.location(row.line)
                found = {one.key: SourceText(one.text, place) for one in conditions_in_text(text, place, known)}
                stated = found or {"label group": SourceText(text, place)}
                continue
            (row,) = rows_beside_notes(sheet, [row], named, beside)
            if any(row.cells[k] for k in named):
                self.rows.append(TestRow(row.line, [row.cells[k] for k in named], stated))
        for test in self.rows if beside else ():
            test.cells.append(beside.get(f"label beside line {test.line}", SourceText("", "")).text)
        columns = [*(names[k] for k in named), *["note"] * bool(beside)]
        positions = [below.positions[k] if below.positions else k for k in named] + [named[-1] + 1] * bool(beside)
        sources = [*around.sources, *sources_of_names(sheet, self.vocabulary)]
        self._footnotes = {key: one for key, one in around.entries.items() if key.startswith("label footnote ")}
        header = {key: one for key, one in around.entries.items() if key not in self._footnotes}
        self.table = replace(sheet, rows=(), columns=columns, columns_line=line, header=header)
        self.table = replace(self.table, positions=positions, sources=tuple(sources))

    def _around(self, sheet: CellTable, above: Sequence[TableRow], known: Terms) -> HeadOfTest:
        """What lines above a table state of all its tests; all else is a note."""
        head = HeadOfTest(sheet, known, dict(sheet.header))
        for row in above:
            if text := only_text(row, sheet.dialect):
                head.add_title(text, row)
            else:
                head.read(row)
        for key in [key for key in head.entries if key.startswith("label ") and key not in {*sheet.header, *TEXTS}]:
            entry = head.entries.pop(key)
            self.notes.append(entry.text if key.startswith("label line ") else f"{key[6:]} {entry.text}")
        self.notes += [f"{key}: {entry.text}" if key else entry.text for _, key, entry in sheet.comments]
        return head

    # ---- columns

    def _understood_columns(self) -> Iterator[TestColumn]:
        """What each column means; units and names that are not understood are errors."""
        synonyms, found = self.vocabulary.synonyms, list[TestColumn]()
        stated = [TestColumn(quantity_of(key)) for key in self.table.header]
        for k, written in enumerate(self.names):
            is_label = written in self.vocabulary.labels
            meant = synonyms.get(written) or synonyms.get(split_written_name(written)[0], written)
            column, cells = TestColumn() if is_label else column_called(meant), [row.cells[k] for row in self.rows]
            if column.kind and (certain := [*map(without_uncertainty, cells)]) != cells:
                self.table = self.table.assuming(f"uncertainties of '{quoted(written, 60)}' not used")
                for row, cell in zip(self.rows, certain, strict=True):
                    row.cells[k] = cell
                cells = certain
            if column == TestColumn("rupture") and {cell.casefold() for cell in cells} <= {"", "-", *YES, *NO}:
                column = TestColumn()
            if column.kind is TIME:
                collected(self.errors, partial(self._ask_of_points, written, cells))
            if kind := column.kind:
                units = (unit_behind(cell, kind) for cell in cells)
                column = replace(column, unit=column.unit or next(filter(None, units), ""))
                collected(self.errors, partial(self._convert_cells, k, column, written))
                if kind is TIME and not column.unit and (unit := unit_in(" | ".join(self.notes), TIME, _BEFORE_UNIT)):
                    self.table = self.table.assuming(f"'{quoted(written, 60)}' in {unit} by the title")
                    column = replace(column, unit=unit)
                if column.unit not in kind.units:
                    self.errors.append(self._wrong_unit(column, written, cells))
                elif (
                    column.quantity == "minimum_rate"
                    and meant == written
                    and is_bare_rate(split_written_name(written)[0])
                ):
                    self.table = self.table.assuming(f"'{quoted(written, 60)}' is the minimum creep rate")
            elif self._tells_tests_apart(k, column, cells):
                column = TestColumn("name")
            elif not column.quantity:
                if meant == written and not is_label:
                    collected(self.errors, partial(self._refuse_misspelt, written))
                    collected(self.errors, partial(self._ask_of_quantity, written))
                column = TestColumn(meant if meant.startswith(("label ", "geometry ")) else f"label {meant}")
            quantities = [one.quantity for one in found]
            if column.quantity in quantities:
                self.errors.append(self._twice(written, self.names[quantities.index(column.quantity)]))
            if column.factor != 1.0:
                self.table = self.table.assuming(f"numbers of '{quoted(written, 60)}' times {column.factor:g}")
            for key, one in zip(self.table.header, stated, strict=True):
                if one.quantity == column.quantity:
                    what = f"'{quoted(key, 60)}' is also a column, '{quoted(written, 60)}'; keep one of them"
                    self.errors.append(HistoryError(f"{self.table.header[key].location}: {what}"))
            found.append(column)
            yield column

    def _convert_cells(self, k: int, column: TestColumn, written: str) -> None:
        """Convert cells with another unit than that of their column, `3 days` beside `1020 h`.

        Question where other cells have none, and the name of the column neither.
        """
        kind, sign = column.kind, self.table.dialect.decimal
        assert kind is not None
        bare = [row for row in self.rows if re.search(r"\d", row.cells[k]) and not unit_behind(row.cells[k], kind)]
        is_unsaid = self.vocabulary.synonyms.get(written, written) == written and not column_called(written).unit
        if is_unsaid and bare and len(bare) < len(self.rows) and column.unit:
            what = (
                f"'{quoted(written, 60)}' is '{quoted(bare[0].cells[k], 40)}' without the unit of others; which is it?"
            )
            choice: Answer = {written: f"{column.quantity.replace(' ', '_')}_{column.unit}"}
            raise self.table.question(what, "columns", choice, line=bare[0].line, is_free=True)
        for row in self.rows:
            cell = row.cells[k]
            if unit_behind(cell, kind) not in ("", column.unit) and (text := in_unit(cell, kind, column.unit, sign)):
                row.cells[k] = text
                row.assumed.append(f"{cell} is {text} {column.unit}".replace(",", "."))

    def _tells_tests_apart(self, k: int, column: TestColumn, cells: Sequence[str]) -> bool:
        """Whether a column of specimens, or a first one of words, holds the names of the tests, and no other does.

        A column of kinds of specimens, such as uniaxial, has the same word in several rows, or words that are
        registered.
        """
        texts, name = [cell for cell in cells if not is_missing(cell)], self.names[k]
        words = k == 0 and not column.quantity and not any(is_number_like(one, self.table.dialect) for one in texts)
        may_name = column.quantity == "specimen" or (words and not kind_of_column(name) and len(texts) == len(cells))
        kinds = set(HeaderVocabulary().terms("").outputs)
        is_named = any(column_called(name).quantity == "name" for name in self.names) or name in self.vocabulary.labels
        is_told = len(set(texts)) == len(texts) and not {text.casefold() for text in texts} & kinds
        return may_name and is_told and not is_named

    def _ask_of_points(self, written: str, cells: Sequence[str]) -> None:
        """Ask of 12.345 and 23.456 beside whole numbers alone, where nothing states the decimal sign."""
        points = [cell for cell in cells if "." in cell]
        are_doubtful = len(points) > 1 and all(map(POINT_OF_THOUSANDS.fullmatch, points))
        if are_doubtful and len(points) < sum(map(bool, cells)) and not answers_of(self.table.path).decimal:
            readings = f"'{points[0]}' in '{quoted(written, 60)}' may be {points[0]} or {points[0].replace('.', '')}"
            raise self.table.question(readings, "decimal", "comma", "point")

    def _twice(self, written: str, other: str) -> HistoryError:
        what = f"'{quoted(other, 60)}' and '{quoted(written, 60)}' mean the same; keep one of them"
        if written == other:
            return HistoryError(f"{self.place}: {what}, or name what each holds")
        return self.table.question(what, "columns", {written: LABEL}, {other: LABEL})

    def _wrong_unit(self, column: TestColumn, written: str, cells: Sequence[str]) -> HistoryError:
        assert column.kind is not None
        found = f"the unit '{quoted(column.unit)}', which is not understood" if column.unit else "no unit"
        what = f"column '{quoted(written.strip(), 60)}' has {found}; allowed: {', '.join(column.kind.units)}"
        if column.unit:
            return HistoryError(f"{self.place}: {what}; convert it")
        likely = [unit for unit in ("MPa", "ksi", "1/h", "pct/h", "1/s") if unit in column.kind.units]
        if column.kind is TIME:
            likely = ["h", "s"]
        elif column.quantity == "temperature":
            numbers = [float(number) for cell in cells for number in re.findall(r"^\d+", cell)]
            likely = ["C", "K", "F"] if min(numbers, default=0) < 900 else ["K", "C", "F"]
        name = column.quantity.replace(" ", "_")
        return self.table.question(what, "columns", *({written: f"{name}_{unit}"} for unit in likely), is_free=True)

    def _refuse_misspelt(self, written: str) -> None:
        name, unit = split_written_name(written)
        known = [one for one in (*QUANTITIES, *NAMES.synonyms) if len(one) > 3]
        near = get_close_matches(words_of(name), known, 1, cutoff=0.8)
        is_another = (
            near and {*near[0].split()} & {*words_of(name).split()} and self._has(column_called(near[0]).quantity)
        )
        if near and kind_of_column(written) == "" and not is_another:
            meant = f"{near[0]} ({unit_suffix(unit)})" if unit_suffix(unit) else near[0]
            what = f"column '{quoted(written, 60)}' is not understood; did you mean '{near[0]}'?"
            raise self.table.question(what, "columns", {written: meant}, {written: LABEL})

    def _ask_of_quantity(self, written: str) -> None:
        """Ask of a time or a rate that is not understood: `t0.2 (h)` may be one to a strain."""
        name, unit = split_written_name(written)
        is_rate = RATES.search(plain_words(name)) and (not unit or unit_suffix(unit) in (*RATE.units, "pct"))
        if is_rate or is_unit_of_rate(unit):
            meaning, what = f"minimum rate ({unit})" if unit else "minimum rate", "rate that is not understood; is it a"
            what = f"column '{quoted(written, 60)}' is a {what} minimum creep rate?"
        elif unit_suffix(unit) in TIME.units and not _OF_TREATMENT.search(name):
            number = re.search(r"\d+(?:[.,]\d+)?", name)
            meaning = f"time to {number[0].replace(',', '.')} % ({unit})" if number else f"duration ({unit})"
            what = f"column '{quoted(written, 60)}' is a time that is not understood; is it a time to a strain?"
        elif unit_suffix(unit) in STRESS.units and not self._has("stress"):
            meaning, what = f"stress ({unit})", f"column '{quoted(written, 60)}' is not understood; is it the stress?"
        else:
            return
        raise self.table.question(what, "columns", {written: meaning}, {written: LABEL}, is_free=True)

    def _has(self, quantity: str) -> bool:
        """Whether some column is called as one of a quantity."""
        return any(column_called(self.vocabulary.synonyms.get(n, n)).quantity == quantity for n in self.names)

    # ---- cells that stand elsewhere

    def _fill_stated(self) -> None:
        """Take what a file of answers states: of a column of that quantity it fills the empty cells."""
        header = dict(self.table.header)
        for key, (text, place) in self.vocabulary.stated.items():
            quantity, unit = split_unit(key, {**CONDITION_KINDS, **NAMES.kinds}) or (key, "")
            k = self.position(quantity)
            if k is None:
                header[key] = SourceText(text, place)
            elif self.columns[k].unit != unit:
                what = f"'{key}' fills cells of '{quoted(self.names[k], 60)}'; state it in that unit"
                self.errors.append(HistoryError(f"{place}: {what}"))
            else:
                for row in self.rows:
                    row.cells[k] = text if is_missing(row.cells[k]) else row.cells[k]
        self.table = replace(self.table, header=header)

    def _fill_groups(self) -> None:
        """Give all rows of a group the conditions that stand once for it; a lost value is an error.

        Empty cells below a filled one are those of its group where no value is written twice below itself, and groups
        have more than one row; in merged cells they are in any case.
        """
        for k, one in enumerate(self.columns):
            if one.quantity not in ("stress", "temperature", "label heat", "alloy", "label laboratory"):
                continue
            cells = [row.cells[k] for row in self.rows]
            gaps = [r for r, cell in enumerate(cells) if is_missing(cell) or cell.casefold() in _DITTO]
            if not gaps or len(gaps) == len(cells):
                continue
            is_repeated = any(a == b and not is_missing(a) for a, b in pairwise(cells))
            is_grouped = not is_repeated and len(cells) > _GROUP_SIZE * (len(cells) - len(gaps)) and gaps[0] > 0
            for r in gaps:
                row = self.rows[r]
                is_merged = (row.line, self.table.positions[k]) in self.table.merged
                if r > 0 and (is_grouped or cells[r].casefold() in _DITTO or is_merged):
                    row.cells[k] = self.rows[r - 1].cells[k]
                    row.assumed.append(f"{one.quantity} of the row above (empty cell)")
            missing = [r for r in gaps if is_missing(self.rows[r].cells[k])]
            if missing and one.quantity in ("stress", "temperature"):
                stated = [*self.table.header, *self.rows[missing[0]].stated]
                if not any(plain_name(name).startswith(one.quantity) for name in stated):
                    self.errors.append(self._empty_cell(k, missing))

    def _empty_cell(self, k: int, missing: Sequence[int]) -> Question:
        """The question of conditions that lack in some rows of a column."""
        for r in missing:
            self.rows[r].is_open = True
        name, quantity = self.names[k], self.columns[k].quantity
        others = f", and {len(missing) - 1} more" if len(missing) > 1 else ""
        unit = split_written_name(name)[1].replace("°", "").strip() or ("C" if quantity == "temperature" else "MPa")
        above = [row.cells[k] for row in self.rows[: missing[0]] if not is_missing(row.cells[k])]
        likely = above[-1] if above else next(row.cells[k] for row in self.rows if not is_missing(row.cells[k]))
        plain = likely.replace(",", ".")
        number = float(plain) if is_number(plain, Dialect()) else likely
        what = f"the cell of '{quoted(name, 60)}' is empty{others}; which {quantity} is it?"
        line = self.rows[missing[0]].line
        return self.table.question(what, f"{quantity}_{unit}", number, line=line, is_free=True)

    def _take_answers(self) -> None:
        """Take what a file of answers states of single tests, in the place of cells; leave out those it excludes."""
        of_tests, excluded = self.vocabulary.of_tests, dict[str, str]()
        for row in self.rows:
            for key, (text, place) in of_tests.get(row.name, {}).items():
                quantity, unit = split_unit(key, {**CONDITION_KINDS, **NAMES.kinds}) or (key, "")
                k = self.position(quantity)
                if key == EXCLUDE:
                    excluded[row.name] = text
                elif k is not None and self.columns[k].unit == unit:
                    row.cells[k] = text
                    row.assumed.append(f"{key} {text} of {ANSWERS_FILE}")
                elif k is not None:
                    what = f"'{key}' takes the place of a cell of '{quoted(self.names[k], 60)}'; state it in that unit"
                    self.errors.append(HistoryError(f"{place}: {what}"))
                else:
                    row.stated = {**row.stated, key: SourceText(text, place)}
        self._leave_out([row for row in self.rows if row.name in excluded], lambda row: excluded[row.name])

    def _leave_out(self, rows: Sequence[TestRow], reason: Callable[[TestRow], str]) -> None:
        """Leave out rows; the assumptions name them with their reasons."""
        by_reason = dict[str, list[str]]()
        for row in rows:
            by_reason.setdefault(reason(row), []).append(row.name)
        for why, names in by_reason.items():
            more = f" and {len(names) - MOST_ASKED} more" if len(names) > MOST_ASKED else ""
            listed = f"{' '.join(names[:MOST_ASKED])}{more}"
            self.table = self.table.assuming(f"without {listed} ({why})".replace(",", ";"))
        self.rows = [row for row in self.rows if all(row is not one for one in rows)]

    def _leave_out_silent_rows(self) -> None:
        """Leave out rows with a word in the place of a stress or of all results, such as `n.d.`, that tells no end.

        Rows of a table of which most are so are left for their errors.
        """
        results = ("minimum_rate", "rupture", "end_time")
        of_tests = [k for k, one in enumerate(self.columns) if one.quantity in ("stress", "temperature")]
        says = [k for k, one in enumerate(self.columns) if one.quantity in results or one.strain is not None]
        silent = list[TestRow]()
        for row in self.rows:
            words = [row.cells[k] for k in says if not is_missing(row.cells[k])]
            is_told = any(re.search(r"\d", word) or end_said_by(word) not in ("", UNCLEAR) for word in words)
            is_lost = any(_is_word(row.cells[k]) for k in of_tests)
            is_empty = not any(_is_word(row.cells[k]) for k in says)
            silent += [row] * (is_lost or not (is_told or (is_empty and not self.vocabulary.ignored)))
        if self.vocabulary.ignored and self.rows and len(silent) == len(self.rows):
            raise HistoryError(
                f"{self.place}: no row states a minimum creep rate or an end of its test once the ignored columns are "
                "left out; keep one of these columns"
            )
        if self.vocabulary.ignored or 2 * len(silent) < len(self.rows):
            self._leave_out(silent, lambda row: self._words_of(row, [*of_tests, *says]))

    def _words_of(self, row: TestRow, columns: Sequence[int]) -> str:
        """What stands in a row in the place of numbers."""
        found = [
            f"'{quoted(row.cells[k], 40)}' in '{quoted(self.names[k], 40)}'" for k in columns if _is_word(row.cells[k])
        ]
        return " and ".join(found) or ("nothing but ignored columns" if self.vocabulary.ignored else "no result")


_BEFORE_UNIT = r"(?:(?:in|en) |(?=\w+ (?:to|until|bis|pour)\b))"
"""Before the unit of times in a title, `Times in hours` and `Hours to 1 %`."""


_LONGEST_TITLE = 40
"""Characters of a title that is part of the names of tests."""


def _title_above(sheet: CellTable, head: TestTableHead) -> str:
    """The title directly above the names of a table, "" where there is none or a long one."""
    above, names = sheet.rows[max(0, head.first - 1)], sheet.rows[head.first]
    title = only_text(above, sheet.dialect) if names.line - above.line == 1 else ""
    return title if len(title) <= _LONGEST_TITLE else ""


def _is_word(cell: str) -> bool:
    """Whether a cell holds text in the place of a number, marks of lost values included; dashes are none."""
    return re.search(r"[^\W\d_]", cell) is not None and not re.search(r"\d", cell) and cell.casefold() not in _DITTO


_OF_TREATMENT = re.compile(
    r"anneal|ag(?:e?ing|ed)|temper|heat ?treat|soak|solution|glüh|auslager|anlass|recuit|revenu", re.I
)
