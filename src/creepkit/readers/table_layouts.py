"""Tests in a grid of cells: one test, one column a test beside a shared time, pairs of columns, or one column of names.

LAYOUTS lists them, each with an example. Whatever else stands in the head of a table (table_heads.py) holds for the
test above whose columns it stands, else for all.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from itertools import pairwise

from creepkit.errors import HistoryError, quoted
from creepkit.files.delimited_text import is_missing, is_number
from creepkit.readers.column_names import TEST_NAME_COLUMNS, split_written_name, unit_suffix, words_of
from creepkit.readers.condition_texts import conditions_in_text, conditions_of_head
from creepkit.readers.grouped_rows import (
    TabulatedTest,
    refuse_twice,
    rows_by_test,
    with_groups,
    without_clocks,
    without_remarks,
)
from creepkit.readers.table import (
    CellTable,
    NumberRows,
    SourceText,
    TableRow,
    cells_of_width,
    check_columns,
    joined,
    named_columns,
    some_of,
    with_columns,
    without_ignored,
)
from creepkit.readers.table_heads import (
    MAXIMUM_ROWS_BELOW,
    Head,
    head_of,
    head_of_one_test,
    heads_of_tests,
    is_time,
    row_of_names,
    test_and_column,
)
from creepkit.readers.vocabulary import HeaderVocabulary, Terms
from creepkit.records.quantities import STRAIN


@dataclass(frozen=True)
class TestColumns:
    """The columns of one test: its name, "" where the columns do not tell it, and {position: name of the column}."""

    test: str
    columns: Mapping[int, str]


@dataclass(frozen=True)
class HeadedGrid:
    """A grid from the names of its columns on, and its head.

    times : positions of the columns of time. whole : the rows of the head, columns that are left out included.
    """

    grid: CellTable
    head: Head
    times: Sequence[int]
    known: Terms
    whole: Sequence[TableRow]


@dataclass(frozen=True)
class Layout:
    """How tests may stand in a table. example : a text in this layout. match, tests : of a headed grid."""

    name: str
    example: str
    match: Callable[[HeadedGrid], bool]
    tests: Callable[[HeadedGrid], list[TabulatedTest]]


def tests_in(grid: CellTable, vocabulary: HeaderVocabulary) -> list[TabulatedTest]:
    """The tests of a grid; HistoryError, in one sentence, where it cannot be told how it is laid out."""
    for key, (text, place) in vocabulary.stated.items():
        if key in grid.header and grid.header[key].text != text:
            raise HistoryError(f"{place}: {key} is '{quoted(text)}', and {grid.header[key].location} says another one")
    grid = replace(grid, header={**grid.header, **{key: SourceText(*one) for key, one in vocabulary.stated.items()}})
    stated = grid.header.get("specimen")
    known = vocabulary.terms(stated.text if stated else "")
    names_at = row_of_names(grid, known)
    names_line, all_rows = grid.rows[names_at].line, list(grid.rows[: names_at + MAXIMUM_ROWS_BELOW])
    grid = without_ignored(_with_comments(grid, names_line, known), names_at, vocabulary.ignored)
    if not any(row.line == names_line for row in grid.rows):
        raise HistoryError(f"{grid.location(names_line)}: every column is left out by ignore; keep those of the test")
    head = head_of(grid, known)
    below = replace(grid, rows=joined([TableRow(head.line, head.names)], grid.rows[head.body :]))
    times = [k for k, cell in enumerate(head.names) if cell and is_time(cell, known)]
    lines = {row.line for row in head.rows}
    whole = [row for k, row in enumerate(all_rows) if k < names_at or row.line in lines]
    headed = HeadedGrid(below, head, times, known, whole)
    return next(layout for layout in LAYOUTS if layout.match(headed)).tests(headed)


def names_time(grid: CellTable, vocabulary: HeaderVocabulary) -> bool:
    """Whether some row of a grid names a time, as that above frames does."""
    known = vocabulary.terms()
    row = grid.rows[row_of_names(grid, known)]
    return any(is_time(cell, known) for cell in row.cells)


def _are_pairs(headed: HeadedGrid) -> bool:
    return len(headed.times) > 1 and not _one_time_in_two_units(headed.head.names, headed.times)


def _tests_of_pairs(headed: HeadedGrid) -> list[TabulatedTest]:
    tests = _pairs(headed.grid, headed.times, headed.known)
    return _tests_of_blocks(headed, tests, set(range(headed.times[0])))


def _are_columns(headed: HeadedGrid) -> bool:
    return len(headed.times) == 1 and _is_wide(headed)


def _tests_of_columns(headed: HeadedGrid) -> list[TabulatedTest]:
    time = headed.times[0]
    return _tests_of_blocks(headed, _columns_beside(headed, time), set(range(time + 1)))


def _tests_of_rows(headed: HeadedGrid) -> list[TabulatedTest]:
    grid, footers = _without_footers(headed.grid)
    if not headed.times:
        place, names = grid.location(headed.head.line), some_of(list(filter(None, headed.head.names)))
        raise HistoryError(
            f"{place}: missing column: no time among {names}; name one time_s, time_min or time_h in that row, behind "
            "its '#' where it has one"
        )
    head = head_of_one_test(grid, headed.whole, headed.known)
    refuse_twice(head.entries, grid.header, headed.known)
    table = without_clocks(named_columns(_without_margin(grid, head.entries)), headed.known)
    table = replace(table, assumptions=(*table.assumptions, *head.assumptions, *footers), sources=tuple(head.sources))
    table = with_groups(without_remarks(table, head.entries), headed.known)
    return rows_by_test(table, {**grid.header, **head.entries}, headed.known)


LAYOUTS: Sequence[Layout] = (
    Layout(
        "columns of each test side by side, each with its time",
        "140 MPa;;160 MPa;\ntime;strain;time;strain\nh;%;h;%\n0;0;0;0\n1;0.02;1;0.03\n",
        _are_pairs,
        _tests_of_pairs,
    ),
    Layout(
        "one column a test beside one time",
        "Stress (MPa);140;160\nTime (h);A1 strain (%);A2 strain (%)\n0;0;0\n1;0.02;0.03\n",
        _are_columns,
        _tests_of_columns,
    ),
    Layout(
        "one test, or a column that names the test of each row",
        "Test;Stress (MPa);Time (h);Strain (%)\nA1;140;0;0\nA1;140;1;0.02\nA2;160;0;0\nA2;160;1;0.03\n",
        lambda headed: True,
        _tests_of_rows,
    ),
)
"""The first that matches is the layout of a table."""


def _with_comments(grid: CellTable, names_line: int, known: Terms) -> CellTable:
    """The grid with the entries of comments between its first row and its names.

    A condition in a comment below the names is refused, for it must not go unread; remarks may stand anywhere.
    """
    header = dict(grid.header)
    for line, key, entry in grid.comments:
        if line > names_line and known.is_condition(key):
            raise HistoryError(f"{entry.location}: '{key}' stands below the names of the columns; move it above them")
        if line < names_line and key in header:
            raise HistoryError(f"{entry.location}: '{quoted(key, 60)}' was already given; keep one of them")
        if line < names_line:
            header[key] = entry
    return replace(grid, header=header)


def _one_time_in_two_units(cells: Sequence[str], times: Sequence[int]) -> bool:
    """Whether columns of time have no other column between them, as in `time_s,time_h,strain_pct`."""
    return any(b - a == 1 for a, b in pairwise(times)) or times[-1] == len(cells) - 1


def _is_wide(headed: HeadedGrid) -> bool:
    """Whether the columns beside a time are one a test."""
    cells, time, known = headed.head.names, headed.times[0], headed.known
    others = [cell for k, cell in enumerate(cells) if k != time and cell]
    if len(others) < 2 or known.declared.intersection(others):
        return False
    named = [test_and_column(cell, known) for cell in others]
    if all(test for test, _ in named):
        return len({known.quantity(column) for _, column in named}) < len(named)
    if any(known.quantity(cell) for cell in others):
        return bool(headed.head.rows) and len(set(others)) == 1
    if _are_conditions(headed):
        return True
    if any(words_of(cell) in TEST_NAME_COLUMNS or known.is_condition(cell) for cell in others):
        return False
    spelled = {words_of(name) for name in known.columns.kinds}
    return not any(get_close_matches(words_of(split_written_name(cell)[0]), spelled, 1, cutoff=0.75) for cell in others)


def _are_conditions(headed: HeadedGrid) -> bool:
    """Whether the columns beside a time are named by a load or a temperature, as `120 MPa`."""
    written = [cell for k, cell in enumerate(headed.head.written) if cell and k not in headed.times]
    return all(conditions_of_head(cell, headed.known) for cell in written)


def _columns_beside(headed: HeadedGrid, time: int) -> list[TestColumns]:
    """One column a test, beside one time."""
    names, grid, known = headed.head.names, headed.grid, headed.known
    stated, place = grid.header.get("columns"), grid.location(headed.head.line)
    of_conditions = _are_conditions(headed)
    results: list[TestColumns] = []
    for k, cell in enumerate(names):
        if k == time or not cell:
            continue
        test, column = test_and_column(cell, known)
        if not known.quantity(column):
            strain_unit = split_written_name(cell)[1]
            if stated is None and unit_suffix(strain_unit) in STRAIN.units and headed.head.rows:
                results.append(
                    TestColumns(split_written_name(cell)[0], {time: names[time], k: f"strain ({strain_unit})"})
                )
                continue
            if stated is None and not of_conditions:
                raise HistoryError(
                    f"{place}: the column '{quoted(cell)}' does not say what it holds; write '# columns: strain_pct' "
                    "above, or names such as 'A1 strain (%)'"
                )
            written = headed.head.written[k]
            test, column = written, stated.text if stated else f"strain{cell.removeprefix(written)}"
        results.append(TestColumns(test, {time: names[time], k: column}))
    beside = [[cell for k, cell in enumerate(row.cells) if cell and k > time] for row in headed.head.rows]
    if all(one.test.isdigit() for one in results) and not any(len(set(cells)) > 1 for cells in beside):
        raise HistoryError(
            f"{place}: several columns of one quantity, and no conditions above each, may be tests or sensors of one "
            "test; name the tests, such as 'A1 strain (%)', or keep one column, with '# ignore: NAME' for the others"
        )
    return results


def _pairs(grid: CellTable, times: Sequence[int], known: Terms) -> list[TestColumns]:
    """Columns of each test side by side, each beginning with its time."""
    names = grid.rows[0]
    place = grid.location(names.line)
    if any(names.cells[: times[0]]):
        first = next(filter(None, names.cells))
        raise HistoryError(
            f"{place}: the column '{quoted(first)}' stands before the first time; begin the columns of each test "
            "with time"
        )
    blocks = []
    for start, end in zip(times, [*times[1:], len(names.cells)], strict=True):
        named = {k: test_and_column(names.cells[k], known) for k in range(start, end) if names.cells[k]}
        tests = sorted({test for test, _ in named.values() if test})
        if len(tests) > 1:
            raise HistoryError(
                f"{place}: the columns beside one time name the tests '{quoted(tests[0])}' and '{quoted(tests[1])}'; "
                "begin the "
                "columns of each test with time"
            )
        blocks.append(TestColumns("".join(tests), {k: column for k, (_, column) in named.items()}))
    return blocks


def _tests_of_blocks(headed: HeadedGrid, tests: Sequence[TestColumns], key_columns: set[int]) -> list[TabulatedTest]:
    """The tests of several columns each, with what the rows above say of each."""
    grid, known = headed.grid, headed.known
    header = {key: entry for key, entry in grid.header.items() if key != "columns"}
    used = {k for test in tests for k in test.columns}
    notes: dict[str, SourceText] = {}
    rows = grid.rows[1:]
    if isinstance(rows, NumberRows):
        list(_checked_cells(grid, rows[:1], used, notes))  # every row has the same columns
    else:
        rows = list(_checked_cells(grid, rows, used, notes))
    place = grid.location(headed.head.line)
    results: dict[str, TabulatedTest] = {}
    heads = heads_of_tests(grid, headed.head.rows, [list(test.columns) for test in tests], key_columns, known)
    for number, (test, head) in enumerate(zip(tests, heads, strict=True), 1):
        entries = dict(head.entries)
        for quantity, text in conditions_of_head(test.test, known):
            entries[quantity] = SourceText(text, place, grid.dialect.decimal, test.test)
        refuse_twice(entries, header, known)
        written = entries.pop("name", None)
        measured = [entry.text for key, entry in entries.items() if entry.key in known.conditions.kinds]
        name = test.test or (written.text if written else " ".join(measured) or str(number))
        name = f"{name} ({number})" if name in results and not (test.test or written) else name
        if name in results:
            raise HistoryError(f"{place}: two tests are called '{quoted(name)}'; give each its own name")
        check_columns(f"{place}, test '{quoted(name)}'", list(test.columns.values()))
        sources = (*conditions_in_text(test.test, place, known), *head.sources)
        table = _table_of_block(grid, rows, name, test.columns)
        table = replace(table.assuming(*head.assumptions), sources=sources)
        results[name] = TabulatedTest(name, {**notes, **header, **entries}, table)
    return list(results.values())


def _checked_cells(
    grid: CellTable, rows: Sequence[TableRow], used: set[int], notes: dict[str, SourceText]
) -> Iterator[TableRow]:
    """The rows, of as many cells as there are columns in use; texts beside them are added to the notes."""
    width = max(used) + 1
    for row in rows:
        for foreign in (cell for k, cell in enumerate(row.cells) if cell and k not in used):
            _add_note(grid, row, foreign, notes)
        yield TableRow(row.line, cells_of_width(grid, row, width, beside=True)[:width])


def _add_note(grid: CellTable, row: TableRow, text: str, notes: dict[str, SourceText]) -> None:
    """Keep a text that stands in a column without a name; HistoryError for a number."""
    place, key = grid.location(row.line), f"label line {row.line}"
    if is_number(text, grid.dialect):
        raise HistoryError(f"{place}: '{quoted(text)}' stands in a column without a name; name it or remove it")
    earlier = f"{notes[key].text}; " if key in notes else ""
    notes[key] = SourceText(earlier + text, place)


def _without_margin(grid: CellTable, notes: dict[str, SourceText]) -> CellTable:
    """The grid without texts right of its named columns, which become notes; other cells are told by who reads them."""
    width = max((k for k, cell in enumerate(grid.rows[0].cells, 1) if cell), default=0)
    if isinstance(grid.rows, NumberRows) or not any(any(row.cells[width:]) for row in grid.rows):
        return grid

    def rows() -> Iterator[TableRow]:
        for row in grid.rows:
            beside = [cell for cell in row.cells[width:] if cell]
            if any(is_number(cell, grid.dialect) for cell in beside):
                yield row
                continue
            for cell in beside:
                _add_note(grid, row, cell, notes)
            if any(row.cells[:width]):
                yield TableRow(row.line, row.cells[:width])

    return replace(grid, rows=list(rows()))


def _table_of_block(grid: CellTable, rows: Sequence[TableRow], name: str, columns: Mapping[int, str]) -> CellTable:
    """The frames of one test: the rows in which a column of its own holds something, its time in pairs among them."""
    positions, line = list(columns), grid.rows[0].line
    own = with_columns(rows, positions)
    cut = own if isinstance(own, NumberRows) else [row for row in own if not all(map(is_missing, row.cells[1:]))]
    if not cut:
        raise HistoryError(
            f"{grid.location(line)}: test '{quoted(name)}' has no rows below the names of its columns; remove it or "
            "fill it"
        )
    places = [grid.positions[k] if grid.positions else k for k in positions]
    names = list(columns.values())
    return replace(grid, rows=cut, header={}, columns=names, columns_line=line, positions=places)


def _without_footers(grid: CellTable) -> tuple[CellTable, tuple[str, ...]]:
    """The grid without remarks below its frames, which hold words alone, and what says so."""
    count, footers = len(grid.rows), list[str]()
    while count > 2 and _is_remark(row := grid.rows[count - 1], grid):
        count -= 1
        text = " ".join(filter(None, row.cells))
        footers.append(f"line {row.line} is a remark ({quoted(text)})".replace(",", ";"))
    return (replace(grid, rows=grid.rows[:count]), tuple(reversed(footers))) if footers else (grid, ())


def _is_remark(row: TableRow, grid: CellTable) -> bool:
    """Whether a row holds one cell of several words, none of them first a number, or `End`; `nan` is a lost number."""
    cells = [cell for cell in row.cells if cell]
    if grid.dialect.delimiter == " ":
        cells = [" ".join(cells)]
    if len(cells) != 1 or not cells[0].lstrip("(*#- ")[:1].isalpha():
        return False
    words = cells[0].lower().strip(".:*-= ").split()
    lost = {"nan", "inf", "na", "n/a", "-", "--", "none", "null", "-nan", "-inf"}
    return (len(words) > 1 and not lost.intersection(words)) or words in (["end"], ["eof"])
