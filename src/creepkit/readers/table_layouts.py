"""Tests in a grid of cells: one test, one column a test beside a shared time, pairs of columns, or one column of names.

Rows above the names of the columns state conditions, for all tests (`Stress (MPa) | 120`) or one value a test.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from itertools import pairwise

from creepkit.errors import HistoryError, quoted
from creepkit.files.delimited_text import is_missing, is_number
from creepkit.readers.cell_grids import CellGrid, table_of, without_ignored
from creepkit.readers.column_names import TEST_NAME_COLUMNS, KnownNames, split_written_name, unit_suffix, words_of
from creepkit.readers.head_rows import entries_above, entries_of_blocks
from creepkit.readers.table_rows import NumberRows, TableRow, cells_of, grouped, kept_alike, with_columns, with_first
from creepkit.readers.text_tables import SourceText, TextTable, check_columns, unknown_text
from creepkit.readers.vocabulary import HeaderVocabulary


@dataclass(frozen=True)
class TabulatedTest:
    """What a file says of one test: its name, "" where it has none; its conditions; the table of its frames."""

    name: str
    entries: Mapping[str, SourceText]
    table: TextTable


@dataclass(frozen=True)
class TestColumns:
    """The columns of one test: its name, "" where the columns do not tell it, and {position: name of the column}."""

    test: str
    columns: Mapping[int, str]


_MAXIMUM_HEAD_ROWS = 60
"""Rows among which the names of the columns are looked for."""


_NOT_TESTS = frozenset(
    (
        *("plastic", "elastic", "total", "creep", "true", "engineering", "logarithmic", "inelastic", "thermal"),
        *("primary", "axial", "diametral", "lateral", "hoop", "radial", "transverse", "local", "global", "mean"),
        *("average", "max", "min", "maximum", "minimum", "rate", "sd", "corrected", "raw", "left", "right", "front"),
        *("clock", "start", "end", "cycle", "date", "loading", "hold", "ramp", "step", "rupture", "test", "no", "of"),
        *("back", "lvdt", "extensometer", "channel", "sensor", "upper", "lower", "top", "bottom"),
    )
)
"""Words beside a quantity that tell another quantity or another sensor, not another test."""


def tests_in(grid: CellGrid, vocabulary: HeaderVocabulary) -> list[TabulatedTest]:
    """The tests of a grid; HistoryError, in one sentence, where it cannot be told how it is laid out."""
    stated = grid.header.get("specimen")
    known = KnownNames.of(vocabulary, stated.text if stated else "")
    names_at = _row_of_names(grid, known)
    names_line, conditions = grid.rows[names_at].line, grid.rows[:names_at]
    grid = without_ignored(_with_comments(grid, names_line, known), names_at, vocabulary.ignored)
    names_at = next((k for k, row in enumerate(grid.rows) if row.line == names_line), -1)
    if names_at < 0:
        raise HistoryError(f"{grid.location(names_line)}: every column is left out by ignore; keep those of the test")
    head, names = grid.rows[:names_at], grid.rows[names_at]
    cells, tests_below, body_at = _joined_names(grid, names_at)
    below = replace(grid, rows=with_first(TableRow(names.line, cells), grid.rows[body_at:]))
    times = [k for k, cell in enumerate(cells) if _is_time(cell, known)]
    if len(times) > 1 and not _one_time_in_two_units(cells, times):
        return _tests_of_blocks(below, head, _pairs(below, times, known), set(range(times[0])), known)
    if len(times) == 1 and (tests_below or _is_wide(cells, times[0], known, bool(head))):
        blocks = _columns_beside(below, head, times[0], tests_below, known)
        return _tests_of_blocks(below, head, blocks, set(range(times[0] + 1)), known)
    below, footers = _without_footers(below)
    entries = entries_above(grid, conditions, known)  # they stand above columns that are left out, too
    _refuse_twice(entries, grid.header, known)
    return _rows_by_test(replace(table_of(below), assumptions=footers), {**grid.header, **entries}, known)


def names_time(grid: CellGrid, vocabulary: HeaderVocabulary) -> bool:
    """Whether some row of a grid names a time, as that above frames does."""
    known = KnownNames.of(vocabulary)
    row = grid.rows[_row_of_names(grid, known)]
    return any(_is_time(cell, known) for cell in row.cells)


def _is_time(cell: str, known: KnownNames) -> bool:
    """Whether a name of a column is a time, perhaps that of a test, as in `Time A1 (h)`."""
    return known.quantity(_test_and_column(cell, known)[1]) == "time"


def _with_comments(grid: CellGrid, names_line: int, known: KnownNames) -> CellGrid:
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


def _refuse_twice(entries: Mapping[str, SourceText], header: Mapping[str, SourceText], known: KnownNames) -> None:
    given = {known.condition(key) for key in header}
    for key, entry in entries.items():
        if key in given:
            raise HistoryError(f"{entry.location}: '{key}' was already given; keep one of them")


def _row_of_names(grid: CellGrid, known: KnownNames) -> int:
    """The first row that names a time among texts alone; the first of all where there is none."""
    for k, row in enumerate(grid.rows[:_MAXIMUM_HEAD_ROWS]):
        cells = [cell for cell in row.cells if cell]
        if any(is_number(cell, grid.dialect) for cell in cells):
            continue
        if any(_is_time(cell, known) for cell in cells) and (len(cells) > 1 or k == 0):
            return k
    return 0


def _joined_names(grid: CellGrid, names_at: int) -> tuple[list[str], dict[int, str], int]:
    """Names with the units of the row below them; names of tests below them by column; the row where frames begin."""
    cells = list(grid.rows[names_at].cells)
    nothing: tuple[list[str], dict[int, str], int] = cells, {}, names_at + 1
    if grid.numbers is not None or names_at + 1 >= len(grid.rows):
        return nothing
    below = list(grid.rows[names_at + 1].cells)
    texts = [cell for cell in below if cell]
    units = [unit_suffix(cell) for cell in texts]
    if all(units) and any(cell != "1" for cell in texts):
        return [f"{c} ({u.strip('()[] ')})" if u and c else c for c, u in _padded(cells, below)], {}, names_at + 2
    if any(is_number(cell, grid.dialect) for cell in texts) or len(set(texts)) < max(2, len(texts)) or any(units):
        return nothing
    tests, filled, joined = dict[int, str](), "", list[str]()
    for k, (cell, test) in enumerate(_padded(cells, below)):
        filled = cell or filled
        joined.append(filled if test else cell)
        if test:
            tests[k] = test
    return (joined, tests, names_at + 2) if len(tests) == len(list(filter(None, joined))) - 1 else nothing


def _padded(cells: Sequence[str], below: Sequence[str]) -> Iterator[tuple[str, str]]:
    width = max(len(cells), len(below))
    yield from zip([*cells, *[""] * (width - len(cells))], [*below, *[""] * (width - len(below))], strict=True)


def _one_time_in_two_units(cells: Sequence[str], times: Sequence[int]) -> bool:
    """Whether columns of time have no other column between them, as in `time_s,time_h,strain_pct`."""
    return any(b - a == 1 for a, b in pairwise(times)) or times[-1] == len(cells) - 1


def _is_wide(cells: Sequence[str], time: int, known: KnownNames, has_head: bool) -> bool:
    """Whether the columns beside a time are one a test."""
    others = [cell for k, cell in enumerate(cells) if k != time and cell]
    if len(others) < 2 or known.declared.intersection(others):
        return False
    named = [_test_and_column(cell, known) for cell in others]
    if all(test for test, _ in named):
        return len({known.quantity(column) for _, column in named}) < len(named)
    if any(known.quantity(cell) for cell in others):
        return has_head and len(set(others)) == 1
    if any(words_of(cell) in TEST_NAME_COLUMNS or known.is_condition(cell) for cell in others):
        return False
    spelled = {words_of(name) for name in known.columns.kinds}
    return not any(get_close_matches(words_of(split_written_name(cell)[0]), spelled, 1, cutoff=0.75) for cell in others)


def _test_and_column(cell: str, known: KnownNames) -> tuple[str, str]:
    """Name of the test and of the column in `A1 strain (%)` or `Strain A1 (%)`; ("", cell) where there are not both."""
    if known.quantity(cell) or known.is_condition(cell):
        return "", cell
    written, unit = split_written_name(cell)
    words = written.replace(":", " ").replace("_", " ").split()
    for size in range(min(len(words) - 1, 3), 0, -1):
        for first, rest in ((words[:size], words[size:]), (words[-size:], words[:-size])):
            name, column = " ".join(rest).strip("-–, "), " ".join(first)
            if name and known.quantity(column) and not _NOT_TESTS.intersection(name.lower().split()):
                return name, f"{column} ({unit})" if unit else column
    return "", cell


def _columns_beside(
    grid: CellGrid, head: Sequence[TableRow], time: int, tests_below: Mapping[int, str], known: KnownNames
) -> list[TestColumns]:
    """One column a test, beside one time."""
    names, stated = grid.rows[0], grid.header.get("columns")
    place = grid.location(names.line)
    blocks: list[TestColumns] = []
    for k, cell in enumerate(names.cells):
        if k == time or not cell:
            continue
        test, column = (tests_below[k], cell) if k in tests_below else _test_and_column(cell, known)
        if not known.quantity(column):
            if stated is None:
                raise HistoryError(
                    f"{place}: the column '{quoted(cell)}' does not say what it holds; write '# columns: strain_pct' "
                    "above, or names such as 'A1 strain (%)'"
                )
            test, column = cell, stated.text
        blocks.append(TestColumns(test, {time: names.cells[time], k: column}))
    if not head and all(block.test.isdigit() for block in blocks):
        raise HistoryError(
            f"{place}: several columns of one quantity, and no conditions above them, may be tests or sensors of one "
            "test; name the tests, such as 'A1 strain (%)', or keep one column, with '# ignore: NAME' for the others"
        )
    return blocks


def _pairs(grid: CellGrid, times: Sequence[int], known: KnownNames) -> list[TestColumns]:
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
        named = {k: _test_and_column(names.cells[k], known) for k in range(start, end) if names.cells[k]}
        tests = sorted({test for test, _ in named.values() if test})
        if len(tests) > 1:
            raise HistoryError(
                f"{place}: the columns beside one time name the tests '{quoted(tests[0])}' and '{quoted(tests[1])}'; "
                "begin the "
                "columns of each test with time"
            )
        blocks.append(TestColumns("".join(tests), {k: column for k, (_, column) in named.items()}))
    return blocks


def _tests_of_blocks(
    grid: CellGrid, head: Sequence[TableRow], blocks: Sequence[TestColumns], key_columns: set[int], known: KnownNames
) -> list[TabulatedTest]:
    """The tests of blocks of columns, with what the rows above say of each."""
    header = {key: entry for key, entry in grid.header.items() if key != "columns"}
    used = {k for block in blocks for k in block.columns}
    rows: Sequence[TableRow] = grid.rows[1:] if grid.numbers is None else grid.numbers
    if grid.numbers is None:
        rows = kept_alike(rows, _checked_cells(grid, rows, used))
    else:
        list(_checked_cells(grid, grid.numbers[:1], used))  # every row has the same columns
    place = grid.location(grid.rows[0].line)
    tests: dict[str, TabulatedTest] = {}
    above = entries_of_blocks(grid, head, [list(block.columns) for block in blocks], key_columns, known)
    for number, (block, stated) in enumerate(zip(blocks, above, strict=True), 1):
        entries = dict(stated.entries)
        _refuse_twice(entries, header, known)
        written = entries.pop("name", None)
        name = block.test or (written.text if written else str(number))
        if name in tests:
            raise HistoryError(f"{place}: two tests are called '{quoted(name)}'; give each its own name")
        check_columns(f"{place}, test '{quoted(name)}'", list(block.columns.values()))
        table = replace(_table_of_block(grid, rows, name, block.columns), assumptions=stated.assumptions)
        tests[name] = TabulatedTest(name, {**header, **entries}, table)
    return list(tests.values())


def _checked_cells(grid: CellGrid, rows: Sequence[TableRow], used: set[int]) -> Iterator[TableRow]:
    """The rows, of as many cells as there are columns in use."""
    width = max(used) + 1
    for row in rows:
        if len(row.cells) < width and not grid.sheet:  # a cell lost within a line of text moves those behind it
            raise HistoryError(
                f"{grid.location(row.line)}: number of cells {len(row.cells)}, of columns {width}; write one cell a "
                "column, empty ones too"
            )
        foreign = next((cell for k, cell in enumerate(row.cells) if cell and k not in used), "")
        if foreign:
            raise HistoryError(
                f"{grid.location(row.line)}: '{quoted(foreign)}' stands in a column without a name; name it or "
                "remove it"
            )
        yield TableRow(row.line, [*row.cells[:width], *[""] * (width - len(row.cells))])


def _table_of_block(grid: CellGrid, rows: Sequence[TableRow], name: str, columns: Mapping[int, str]) -> TextTable:
    """The frames of one test: the rows in which a column of its own holds something, its time in pairs among them."""
    positions, line = list(columns), grid.rows[0].line
    own = with_columns(rows, positions)
    cut = (
        own
        if isinstance(own, NumberRows)
        else kept_alike(own, (row for row in own if not all(map(is_missing, row.cells[1:]))))
    )
    if not cut:
        raise HistoryError(
            f"{grid.location(line)}: test '{quoted(name)}' has no rows below the names of its columns; remove it or "
            "fill it"
        )
    places = [grid.positions[k] if grid.positions else k for k in positions]
    return TextTable(grid.path, {}, list(columns.values()), line, cut, grid.dialect, grid.sheet, places)


def _without_footers(grid: CellGrid) -> tuple[CellGrid, tuple[str, ...]]:
    """The grid without remarks below its frames, which hold words alone, and what says so."""
    count, footers = len(grid.rows), list[str]()
    while count > 2 and _is_remark(row := grid.rows[count - 1], grid):
        count -= 1
        text = " ".join(filter(None, row.cells))
        footers.append(f"line {row.line} is a remark ({quoted(text)})".replace(",", ";"))
    return (replace(grid, rows=grid.rows[:count]), tuple(reversed(footers))) if footers else (grid, ())


def _is_remark(row: TableRow, grid: CellGrid) -> bool:
    """Whether a row holds one cell of several words, or `End`, and no digit; `nan` and the like are lost numbers."""
    cells = [cell for cell in row.cells if cell]
    if grid.dialect.delimiter == " ":
        cells = [" ".join(cells)]
    if len(cells) != 1 or any(character.isdigit() for character in cells[0]):
        return False
    words = cells[0].lower().strip(".:*-= ").split()
    lost = {"nan", "inf", "na", "n/a", "-", "--", "none", "null", "-nan", "-inf"}
    return (len(words) > 1 and not lost.intersection(words)) or words in (["end"], ["eof"])


def _rows_by_test(table: TextTable, entries: Mapping[str, SourceText], known: KnownNames) -> list[TabulatedTest]:
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
        _refuse_twice(own, entries, known)
        kept = [k for k in range(len(table.columns)) if k not in (*stated, *keys[:1])]
        cut = with_columns(rows, kept)
        empty = [
            table.columns[k] for k in stated if is_missing(rows[0].cells[k]) and known.is_condition(table.columns[k])
        ]
        assumptions = (*table.assumptions, *map(unknown_text, empty))
        part = replace(table, columns=[table.columns[k] for k in kept], rows=cut, assumptions=assumptions)
        tests.append(TabulatedTest(name, {**entries, **own}, part))
    return tests


def _states_condition(table: TextTable, column: int, rows: Sequence[TableRow], known: KnownNames) -> bool:
    """Whether a column holds one condition, or one text, in all rows of a test."""
    cells = cells_of(rows, column)
    first = next(cells)
    if any(cell != first for cell in cells):
        return False
    return not is_number(first, table.dialect) or known.is_condition(table.columns[column])


def _entries_of_columns(
    table: TextTable, columns: Sequence[int], row: TableRow, known: KnownNames
) -> dict[str, SourceText]:
    entries = {}
    for k in columns:
        name = table.columns[k]
        key = known.condition(name) if known.is_condition(name) else f"label {name}"
        if not is_missing(row.cells[k]):
            entries[key] = SourceText(row.cells[k], table.location(row.line), table.dialect.decimal, name)
    return entries
