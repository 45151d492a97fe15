"""Tables of creep tests, one row a test: stress, temperature, minimum creep rate, rupture time, times to strains.

    test,stress_MPa,temperature_C,min creep rate (1/h),t_r (h),heat
    A1,120,750,2.1e-6,8200,X7
    A2,100,750,,>10000,X7

How a test ended is read of marks of its time (`>10000`, `10000+`), of columns of words, codes or yes and no, and of
remarks; what stays open is asked for (`ends_of_tests`). A condition that stands once for a group of rows holds for the
group: in merged cells, above blank ones, or in a row of its own. Times to a strain become frames of strain. Other
columns are labels. All errors of a file come at once.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from functools import partial
from itertools import pairwise
from pathlib import Path

from creepkit.errors import HistoryError, quoted
from creepkit.files.delimited_text import is_missing
from creepkit.readers.assembly import assemble_history, assemble_without_frames
from creepkit.readers.column_names import KnownNames, split_written_name, unit_suffix, words_of
from creepkit.readers.columns_of_tests import (
    NAMES,
    QUANTITIES,
    TEXTS,
    TIME_TO_STRAIN,
    has_frames,
    key_of_column,
    kind_of,
    quantity_of,
    unit_of,
)
from creepkit.readers.condition_texts import with_weak_sources
from creepkit.readers.ends_of_rows import MOST_ASKED, RowEnd, assumed_of_empty, ends_of_rows, with_end
from creepkit.readers.ends_of_tests import LABEL, NO, STOPPED, YES, kind_of_column, marked_time
from creepkit.readers.questions import Question, collected, raise_all
from creepkit.readers.standard_names import in_standard_keys, specimen_named
from creepkit.readers.table import CellTable, SourceText, TableRow
from creepkit.readers.tables_of_tests import (
    SPREADSHEET_SUFFIXES,
    TEXT_SUFFIXES,
    TestRow,
    TestTable,
    grids_of,
    head_in,
    stands_in_columns,
    tables_in,
    with_groups,
)
from creepkit.readers.text_files import peek_table
from creepkit.readers.vocabulary import CONDITION_KINDS, HeaderVocabulary, split_unit
from creepkit.records import History
from creepkit.records.quantities import TIME, QuantityKind

_TITLES = 10
"""Rows of a sheet in which a column of strain makes it one of frames."""


@dataclass(frozen=True)
class RowPerTestReader:
    """Reader of tables of minimum creep rates, rupture times and times to strains, one row a test."""

    name: str
    title: str
    vocabulary: HeaderVocabulary = field(default_factory=HeaderVocabulary)

    def accepts(self, path: Path) -> bool:
        """Say whether `path` is such a table: a rate or a time beside a stress or a temperature, and no strain."""
        suffix = path.suffix.lower()
        if suffix not in (*TEXT_SUFFIXES, *SPREADSHEET_SUFFIXES) or not path.is_file():
            return False
        if suffix in TEXT_SUFFIXES:
            grid = peek_table(path)
            return grid is not None and self._is_table(grid)
        try:
            grids = grids_of(path)
        except HistoryError:
            return False
        framed = any(has_frames(row.cells) for grid in grids for row in grid.rows[:_TITLES])
        return not framed and any(self._is_table(grid) for grid in grids)

    def _is_table(self, grid: CellTable) -> bool:
        return head_in(grid, self.vocabulary) is not None or stands_in_columns(grid, self.vocabulary)

    def read(self, path: Path) -> list[History]:
        """Return one history a row, in the order of the rows; of a spreadsheet those of all its tables of tests."""
        places, histories, errors = dict[str, str](), list[History](), list[HistoryError]()
        for table in tables_in(path, self.vocabulary):
            count = len(errors)
            keys = _keys(table, self.vocabulary, errors)
            if len(errors) > count:
                continue
            table = with_groups(_with_stated(table, self.vocabulary, errors), [*map(quantity_of, keys)], errors)
            if self.vocabulary.ignored:
                table = _without_silent_rows(table, keys)
            ends = ends_of_rows(table, keys, self.vocabulary, errors)
            for row, end in zip(table.rows, ends, strict=True):
                if (end.is_open or row.is_open) and errors:
                    continue
                history = collected(errors, partial(self._history, table, row, keys, end))
                if history is not None and history.name in places:
                    errors.append(
                        HistoryError(
                            f"{table.location(row.line)}: test '{history.name}' already stands in "
                            f"{places[history.name]}; give each row its own name"
                        )
                    )
                elif history is not None:
                    places[history.name] = table.location(row.line)
                    histories.append(history)
        raise_all(errors)
        return histories

    def _history(self, table: TestTable, row: TestRow, keys: Sequence[str], end: RowEnd) -> History:
        """The test of a row."""
        location, grid = table.location(row.line), table.grid
        cells = {
            key: table.entry(row, k, kind_of(quantity_of(key)) is not None)
            for k, key in enumerate(keys)
            if not is_missing(row.cells[k])
        }
        frames, not_reached = _strains_reached(cells, location)
        cells = {key: entry for key, entry in cells.items() if not key.startswith(TIME_TO_STRAIN)}
        entries = {**table.header, **row.stated, **with_end(cells, end, location)}
        entries, of_names = self._with_weak_sources(table, entries)
        empty = [quantity_of(keys[k]) for k, cell in enumerate(row.cells) if is_missing(cell)]
        assumptions = [*table.assumptions, *(assumed_of_empty(one, entries) for one in empty), *end.assumptions]
        assumptions += of_names
        assumptions += [f"{quantity_of(keys[k])} of the row above (empty cell)" for k in row.filled] + not_reached
        if grid.cut is not None and grid.cut.line == row.line:
            assumptions.append(
                f"{grid.cut.text} in line {row.line} is whole (the file ends there without a line end and with fewer "
                "digits than the numbers above have)"
            )
        assumed = ", ".join(filter(None, assumptions))
        if assumed and "label assumed" not in entries:
            entries["label assumed"] = SourceText(assumed, location)
        name, where = f"{grid.sheet or grid.path.stem} {row.line}", f"sheet {grid.sheet}, " if grid.sheet else ""
        source = f"{grid.path} ({where}{cells['name'].text if 'name' in cells else f'line {row.line}'})"
        if not frames:
            return assemble_without_frames(name, entries, self.vocabulary, location=location, source=source)
        measure = _includes_elastic(table.names, keys)
        if measure and "includes_elastic" not in entries:
            entries["includes_elastic"] = SourceText(measure, location)
        marked = [*((time, strain, 1) for time, strain in frames), *_end_without_reading(entries, frames)]
        rows = [TableRow(row.line, (repr(time), repr(strain), str(used))) for time, strain, used in marked]
        text = CellTable(grid.path, rows, grid.sheet, columns=("time_s", "strain_1", "used"), columns_line=row.line)
        return assemble_history(name, entries, text, self.vocabulary, location=location, source=source)

    def _with_weak_sources(
        self, table: TestTable, entries: Mapping[str, SourceText]
    ) -> tuple[dict[str, SourceText], list[str]]:
        """The entries of a row with what titles and the names of sheet and file state beside them."""
        known = KnownNames.of(self.vocabulary, specimen_named(entries, self.vocabulary))
        quantities = {key_of_column(name)[0] for name in table.names}
        sources = tuple(one for one in table.sources if one.key not in quantities)
        text = CellTable(table.grid.path, (), columns_line=table.line, sources=sources)
        return with_weak_sources(in_standard_keys(entries, known), text, known)


TEST_TABLE = RowPerTestReader(
    "test-table", "one row a test: stress, temperature, and minimum creep rate, rupture time or times to strains"
)


# ---- columns -------------------------------------------------------------------------------------------------------


def columns_of_tests(path: Path, vocabulary: HeaderVocabulary) -> list[tuple[Sequence[str], int]]:
    """Names of columns, and number of rows, of each table of tests in a file."""
    return [(table.names, len(table.rows)) for table in tables_in(path, vocabulary)]


def _keys(table: TestTable, vocabulary: HeaderVocabulary, errors: list[HistoryError]) -> list[str]:
    """The key of each column in a history file; units and names that are not understood are errors."""
    location, keys, path = table.location(table.line), list[str](), table.grid.path
    for written in table.names:
        is_label = written in vocabulary.labels
        meant = vocabulary.synonyms.get(written) or vocabulary.synonyms.get(split_written_name(written)[0], written)
        quantity, unit = ("", "") if is_label else key_of_column(meant)
        if quantity == "rupture" and not unit and _says_yes_or_no(table, written):
            quantity = ""
        if kind := kind_of(quantity):
            unit = unit or _unit_of_cells(table, written)
            if unit not in kind.units:
                errors.append(_wrong_unit(table, quantity, unit, written, kind))
            quantity = f"{quantity}_{unit}"
        elif not quantity:
            if meant == written and not is_label:
                collected(errors, partial(_refuse_misspelt, table, written))
                collected(errors, partial(_ask_of_time, table, written))
            quantity = meant if meant.startswith(("label ", "geometry ")) else f"label {meant}"
        first = next((k for k, key in enumerate(keys) if quantity_of(key) == quantity_of(quantity)), None)
        if first is not None:
            names = f"'{quoted(table.names[first], 60)}' and '{quoted(written, 60)}'"
            what = f"{names} mean the same; keep one of them"
            choices = ({written: LABEL}, {table.names[first]: LABEL})
            if written == table.names[first]:
                errors.append(HistoryError(f"{location}: {what}, or put tables side by side below one another"))
            else:
                errors.append(Question(path, location, what, "columns", choices))
        in_header = next((key for key in table.header if quantity_of(key) == quantity_of(quantity)), None)
        if in_header is not None:
            place, names = table.header[in_header].location, f"'{quoted(in_header, 60)}' is also a column"
            errors.append(HistoryError(f"{place}: {names}, '{quoted(written, 60)}'; keep one of them"))
        keys.append(quantity)
    return _named_by_specimen(table, keys)


def _says_yes_or_no(table: TestTable, written: str) -> bool:
    column = table.names.index(written)
    return {row.cells[column].casefold() for row in table.rows} <= {"", "-", *YES, *NO}


def _named_by_specimen(table: TestTable, keys: list[str]) -> list[str]:
    """The keys, with a column of specimens as the tests' names where it tells all of them apart and nothing else does.

    A column of kinds of specimens, such as uniaxial, has the same word in several rows, or words that are registered.
    """
    if "specimen" not in keys or "name" in keys:
        return keys
    column = keys.index("specimen")
    texts = [row.cells[column] for row in table.rows if not is_missing(row.cells[column])]
    kinds = set(HeaderVocabulary().terms("").outputs)
    if len(set(texts)) < len(texts) or {text.casefold() for text in texts} & kinds:
        return keys
    return ["name" if k == column else key for k, key in enumerate(keys)]


def _wrong_unit(table: TestTable, quantity: str, unit: str, written: str, kind: QuantityKind) -> HistoryError:
    found = f"the unit '{quoted(unit)}', which is not understood" if unit else "no unit"
    what = f"column '{quoted(written.strip(), 60)}' has {found}; allowed: {', '.join(kind.units)}"
    if unit:
        return HistoryError(f"{table.location(table.line)}: {what}; convert it")
    own = quantity.replace(" ", "_")
    return Question(
        table.grid.path,
        table.location(table.line),
        what,
        "columns",
        [{written: f"{own}_{one}"} for one in _likely_units(table, written, quantity, kind)],
        is_free=True,
    )


def _unit_of_cells(table: TestTable, written: str) -> str:
    """The unit behind the numbers of a column, as in `600 °C`; "" where not all cells that hold something have it."""
    column = table.names.index(written)
    texts = [row.cells[column] for row in table.rows if not is_missing(row.cells[column])]
    found = {unit_suffix(re.sub(r"^[<>≥]?\s*[\d.,]+(?:[eE][+-]?\d+)?\s*", "", text)) or "" for text in texts}
    return found.pop() if len(found) == 1 else ""


def _likely_units(table: TestTable, written: str, quantity: str, kind: QuantityKind) -> list[str]:
    """Units that a column of a table may be in, the likely one first."""
    if kind is TIME:
        return ["h", "s"]
    if quantity == "temperature":
        column = table.names.index(written)
        numbers = [float(n) for row in table.rows for n in re.findall(r"^\d+", row.cells[column])]
        return ["C", "K", "F"] if min(numbers, default=0) < 900 else ["K", "C", "F"]
    return [unit for unit in ("MPa", "ksi", "1/h", "pct/h", "1/s") if unit in kind.units]


def _refuse_misspelt(table: TestTable, written: str) -> None:
    name = words_of(split_written_name(written)[0])
    known = {one for _, names in QUANTITIES.values() for one in names} | {n for names in TEXTS.values() for n in names}
    near = get_close_matches(name, [one for one in known if len(one) > 3], 1, cutoff=0.8)
    if near and kind_of_column(written) == "":
        unit = unit_suffix(split_written_name(written)[1])
        raise Question(
            table.grid.path,
            table.location(table.line),
            f"column '{quoted(written, 60)}' is not understood; did you mean '{near[0]}'?",
            "columns",
            ({written: f"{near[0]} ({unit})" if unit else near[0]}, {written: LABEL}),
        )


_OF_TREATMENT = re.compile(
    r"anneal|ag(?:e?ing|ed)|temper|heat ?treat|soak|solution|glüh|auslager|anlass|recuit|revenu", re.I
)


def _ask_of_time(table: TestTable, written: str) -> None:
    """Ask of a time that is not understood: `t0.2 (h)` may be one to a strain."""
    name, unit = split_written_name(written)
    if unit_suffix(unit) not in TIME.units or _OF_TREATMENT.search(name):
        return
    number = re.search(r"\d+(?:[.,]\d+)?", name)
    meanings = [f"time to {number[0].replace(',', '.')} % ({unit})"] if number else [f"duration ({unit})"]
    raise Question(
        table.grid.path,
        table.location(table.line),
        f"column '{quoted(written, 60)}' is a time that is not understood; is it a time to a strain?",
        "columns",
        [{written: meaning} for meaning in (*meanings, LABEL)],
        is_free=True,
    )


def _includes_elastic(names: Sequence[str], keys: Sequence[str]) -> str:
    """Whether times are those to a total strain, by the names of their columns; "" where these do not say it."""
    words = " ".join(words_of(n) for n, key in zip(names, keys, strict=True) if key.startswith(TIME_TO_STRAIN))
    total, creep = (
        re.search(r"\btot(?:al\w*)?\b|gesamt", words),
        re.search(r"creep|kriech|plasti|bleibend|fluage", words),
    )
    return "" if bool(total) == bool(creep) else "yes" if total else "no"


def _with_stated(table: TestTable, vocabulary: HeaderVocabulary, errors: list[HistoryError]) -> TestTable:
    """The table with what a file of answers states: of a column of that quantity it fills the empty cells."""
    header, rows = dict(table.header), list(table.rows)
    for key, (text, place) in vocabulary.stated.items():
        quantity, unit = split_unit(key, {**CONDITION_KINDS, **NAMES.kinds}) or (key, "")
        column = next((k for k, name in enumerate(table.names) if key_of_column(name)[0] == quantity), None)
        if column is None:
            header[key] = SourceText(text, place)
        elif key_of_column(table.names[column])[1] != unit:
            name = table.names[column]
            errors.append(HistoryError(f"{place}: '{key}' fills cells of '{quoted(name, 60)}'; state it in that unit"))
        else:
            for k, row in enumerate(rows):
                if is_missing(row.cells[column]):
                    cells = (*row.cells[:column], text, *row.cells[column + 1 :])
                    rows[k] = replace(row, cells=cells)
    return replace(table, header=header, rows=tuple(rows))


# ---- times to strains ----------------------------------------------------------------------------------------------


def _strains_reached(cells: Mapping[str, SourceText], location: str) -> tuple[list[tuple[float, float]], list[str]]:
    """(s, strain) in the order of time, and what is said of strains that were not reached.

    A creep strain that is the only one follows one of zero when the load is put on.
    """
    reached, others = list[tuple[float, float, SourceText]](), list[str]()
    broke = next((key for key in cells if quantity_of(key) == "rupture"), "")
    end = marked_time(cells[broke].text, {}) if broke else None
    lasted = _seconds(end.number, broke, cells[broke]) if end is not None and end.number and not end.said else None
    for key, entry in cells.items():
        if not key.startswith(TIME_TO_STRAIN):
            continue
        strain = float(quantity_of(key).split()[1])
        mark = marked_time(entry.text, {})
        if mark.said == STOPPED:
            if lasted is not None and _seconds(mark.number, key, entry) > (1 + _ROUNDING) * lasted:
                what = f"'{entry.key}' is {quoted(entry.text)}, and '{cells[broke].key}' {quoted(cells[broke].text)}"
                raise HistoryError(
                    f"{location}: {what}; a strain is reached before rupture or not: correct one of them"
                )
            others.append(f"{strain:.3g} of strain not reached by {mark.number} {unit_of(key)}")
        else:
            reached.append((_seconds(mark.number or entry.text, key, entry), strain, entry))
    reached.sort(key=lambda one: one[:2])
    for (_, before, one), (_, strain, other) in pairwise(reached):
        if strain <= before:
            raise HistoryError(
                f"{other.location}: '{one.key}' is {one.text}, and '{other.key}' {other.text}: the larger strain is "
                "reached first; correct one of them"
            )
    frames = [(time, strain) for time, strain, _ in reached]
    return ([(0.0, 0.0), *frames] if len(frames) == 1 else frames), others


_ROUNDING = 0.01
"""Part of a time by which two that are the same may differ."""


def _seconds(number: str, key: str, entry: SourceText) -> float:
    return TIME.convert(replace(entry, text=number).number(entry.key), unit_of(key), entry.location, entry.key)


def _end_without_reading(
    entries: Mapping[str, SourceText], frames: Sequence[tuple[float, float]]
) -> list[tuple[float, float, int]]:
    """The end of a test that did not break, after its last frame: a frame that is not used, with the last strain."""
    key = next((key for key in entries if quantity_of(key) == "end_time"), None)
    if key is None or "ended" not in entries or entries["ended"].text != STOPPED:
        return []
    end = _seconds(entries[key].text, key, entries[key])
    return [(end, frames[-1][1], 0)] if end > frames[-1][0] else []


# ---- rows that say nothing -----------------------------------------------------------------------------------------

_RESULTS = ("minimum_rate", "rupture", "end_time")
"""Of which a test without frames states one or more, if no time to a strain."""


def _without_silent_rows(table: TestTable, keys: Sequence[str]) -> TestTable:
    """The table without rows that state no result once columns are left out, which its assumptions name."""
    says = [k for k, key in enumerate(keys) if quantity_of(key) in _RESULTS or key.startswith(TIME_TO_STRAIN)]
    silent = [row for row in table.rows if all(is_missing(row.cells[k]) for k in says)]
    if not silent:
        return table
    if len(silent) == len(table.rows):
        raise HistoryError(
            f"{table.location(table.line)}: no row states a minimum creep rate or an end of its test once the "
            "ignored columns are left out; keep one of these columns"
        )
    name = keys.index("name") if "name" in keys else None
    called = [f"line {row.line}" if name is None else row.cells[name] for row in silent]
    more = f" and {len(called) - MOST_ASKED} more" if len(called) > MOST_ASKED else ""
    what = f"without {' '.join(called[:MOST_ASKED])}{more} (nothing but ignored columns)"
    rows = tuple(row for row in table.rows if row not in silent)
    return replace(table, rows=rows, assumptions=(*table.assumptions, what))
