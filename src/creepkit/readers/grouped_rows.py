"""Tests in the rows of a table: one, or several that a column of names or times that begin anew tell apart.

Conditions and names that stand in the first row of a group hold for the group; columns of remarks become notes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from creepkit.errors import HistoryError
from creepkit.files.delimited_text import is_missing, is_number
from creepkit.files.time_stamps import is_clock_time
from creepkit.readers.column_names import TEST_NAME_COLUMNS, words_of
from creepkit.readers.frames import unknown_text
from creepkit.readers.table import CellTable, NumberRows, SourceText, TableRow, cells_of, grouped, with_columns
from creepkit.readers.vocabulary import Terms


@dataclass(frozen=True)
class TabulatedTest:
    """What a file says of one test: its name, "" where it has none; its conditions; the table of its frames."""

    name: str
    entries: Mapping[str, SourceText]
    table: CellTable


def refuse_twice(entries: Mapping[str, SourceText], header: Mapping[str, SourceText], known: Terms) -> None:
    """HistoryError where what the header states is stated anew."""
    given = {known.condition(key) for key in header}
    for key, entry in entries.items():
        if key in given:
            raise HistoryError(f"{entry.location}: '{key}' was already given; keep one of them")


_REMARKS = frozenset(
    (
        *("note", "notes", "remark", "remarks", "comment", "comments", "bemerkung", "bemerkungen", "kommentar"),
        *("anmerkung", "anmerkungen", "remarque", "remarques", "commentaire", "commentaires", "observation"),
    )
)
"""Names of columns of remarks, in small letters."""


def without_remarks(table: CellTable, notes: dict[str, SourceText]) -> CellTable:
    """The table without columns of remarks, whose texts are added to the notes by line."""
    columns = [k for k, name in enumerate(table.columns) if words_of(name) in _REMARKS]
    if not columns or isinstance(table.rows, NumberRows):
        return table
    for row in table.rows:
        if text := "; ".join(row.cells[k] for k in columns if row.cells[k]):
            notes[f"label line {row.line}"] = SourceText(text, table.location(row.line))
    return table.keeping([k for k in range(len(table.columns)) if k not in columns])


_DATES = frozenset(("date", "datum", "day", "jour", "heure"))
"""Names of columns of days, in small letters, and of the clock times beside them."""


def without_clocks(table: CellTable, known: Terms) -> CellTable:
    """The table without dates and times of a clock, where a column of elapsed times in a unit is beside them."""
    if isinstance(table.rows, NumberRows) or not table.rows:
        return table
    first = table.rows[0].cells
    times = [k for k, name in enumerate(table.columns) if known.quantity(name) == "time"]
    elapsed = [k for k in times if is_number(first[k], table.dialect)]
    dates = [k for k, name in enumerate(table.columns) if words_of(name) in _DATES]
    clocks = [k for k in {*times, *dates} if is_clock_time(first[k])]
    if not elapsed or not clocks:
        return table
    names = " ".join(f"'{table.columns[k]}'" for k in sorted(clocks))
    table = table.assuming(f"{names} not used beside '{table.columns[elapsed[0]]}'")
    return table.keeping([k for k in range(len(table.columns)) if k not in clocks])


_GROUP = "test no"
"""Name of the column that numbers the tests of a table whose times begin anew."""


def with_groups(table: CellTable, known: Terms) -> CellTable:
    """The table with conditions and names of tests in all rows of a group, where they stand in its first row alone.

    A group begins where time falls. Groups that no name tells apart, but a condition does, get numbers.
    """
    if isinstance(table.rows, NumberRows) or len(table.rows) < 2:
        return table
    time = next((k for k, name in enumerate(table.columns) if known.quantity(name) == "time"), None)
    clock = [row.cells[time] for row in table.rows] if time is not None else [""]
    if not all(is_number(cell, table.dialect) for cell in clock):
        return table
    times = [float(cell.replace(",", ".")) for cell in clock]
    starts = {0, *(k for k in range(1, len(times)) if times[k] < times[k - 1])}
    keys = [k for k, name in enumerate(table.columns) if words_of(name) in TEST_NAME_COLUMNS]
    stated = keys + [
        k
        for k, name in enumerate(table.columns)
        if known.quantity(name) in (None, "temperature", *known.number_kinds) and known.is_condition(name)
    ]
    filled = {k: [row for row, cell in enumerate(cells_of(table.rows, k)) if not is_missing(cell)] for k in stated}
    sparse = [
        k
        for k in stated
        if filled[k] and filled[k][0] == 0 and set(filled[k]) <= starts and len(filled[k]) < len(times)
    ]
    rows, above = list[TableRow](), dict[int, str]()
    for row in table.rows:
        above |= {k: row.cells[k] for k in sparse if not is_missing(row.cells[k])}
        rows.append(TableRow(row.line, [above.get(k, cell) for k, cell in enumerate(row.cells)]))
    notes = tuple(f"blank cells of '{table.columns[k]}' hold what stands above them" for k in sparse)
    result = replace(table, rows=rows, assumptions=(*table.assumptions, *notes)) if sparse else table
    if keys or len(starts) < 2 or not sparse:
        return result
    numbers = [str(sum(start <= k for start in starts)) for k in range(len(rows))]
    rows = [TableRow(row.line, [number, *row.cells]) for number, row in zip(numbers, rows, strict=True)]
    places = [0, *(result.positions or range(len(result.columns)))]
    return replace(result, columns=[_GROUP, *result.columns], rows=rows, positions=places)


def rows_by_test(table: CellTable, entries: Mapping[str, SourceText], known: Terms) -> list[TabulatedTest]:
    """The tests of a table in which a column of names tells them apart; columns of words state conditions of a test."""
    foreign = [
        k for k, column in enumerate(table.columns) if column not in known.declared and not known.quantity(column)
    ]
    keys = [k for k in foreign if words_of(table.columns[k]) in TEST_NAME_COLUMNS]
    if not foreign:
        return [TabulatedTest("", entries, table)]

    def check(row: TableRow) -> None:
        if not row.cells[keys[0]]:
            column = table.columns[keys[0]]
            raise HistoryError(f"{table.location(row.line)}: the row names no test; fill the column '{column}'")

    groups = grouped(table.rows, keys[0], check) if keys else {"": table.rows}
    tests = []
    for name, rows in groups.items():
        stated = [k for k in foreign if k not in keys[:1] and _states_condition(table, k, rows, known)]
        own = _entries_of_columns(table, stated, rows[0], known)
        refuse_twice(own, entries, known)
        kept = [k for k in range(len(table.columns)) if k not in (*stated, *keys[:1])]
        cut = with_columns(rows, kept)
        empty = [
            table.columns[k] for k in stated if is_missing(rows[0].cells[k]) and known.is_condition(table.columns[k])
        ]
        assumptions = (*table.assumptions, *map(unknown_text, empty))
        part = replace(table, columns=[table.columns[k] for k in kept], rows=cut, assumptions=assumptions)
        tests.append(TabulatedTest(name, {**entries, **own}, part))
    return tests


def _states_condition(table: CellTable, column: int, rows: Sequence[TableRow], known: Terms) -> bool:
    """Whether a column holds one condition, or one text, in all rows of a test."""
    cells = cells_of(rows, column)
    first = next(cells)
    if any(cell != first for cell in cells):
        return False
    return not is_number(first, table.dialect) or known.is_condition(table.columns[column])


def _entries_of_columns(table: CellTable, columns: Sequence[int], row: TableRow, known: Terms) -> dict[str, SourceText]:
    entries = {}
    for k in columns:
        name = table.columns[k]
        key = known.condition(name) if known.is_condition(name) else f"label {name}"
        if not is_missing(row.cells[k]):
            entries[key] = SourceText(row.cells[k], table.location(row.line), table.dialect.decimal, name)
    return entries
