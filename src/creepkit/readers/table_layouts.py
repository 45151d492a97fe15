"""Tests in a table: one test, one column a test beside a shared time, pairs of columns, or one column of names.

LAYOUTS lists them, each with an example. Whatever else stands in the head of a table (table_heads.py) holds for the
test above whose columns it stands, else for all.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from itertools import pairwise
from typing import NamedTuple

from creepkit.errors import HistoryError, quoted
from creepkit.files.delimited_text import Dialect, float_of, is_missing, is_number
from creepkit.files.time_stamps import is_clock_time
from creepkit.readers.frames import OF_UNIT, column_question, head_question, unknown_text
from creepkit.readers.names import NAMES_OF
from creepkit.readers.remarks import rows_beside_notes, without_remarks, without_remarks_around
from creepkit.readers.table import (
    CellTable,
    SourceText,
    TableRow,
    cells_of,
    check_columns,
    grouped,
    named_columns,
    with_columns,
    without_page_heads,
)
from creepkit.readers.table_heads import (
    HeadedTable,
    HeadOfTest,
    headed_table,
    heads_of_tests,
    is_frame,
    is_time,
    named_values,
    test_and_column,
)
from creepkit.readers.vocabulary import HeaderVocabulary, Terms, names_tests, split_written_name, unit_suffix, words_of
from creepkit.readers.weak_sources import conditions_in_text, conditions_of_head
from creepkit.records.quantities import STRAIN

# ---- tests in rows ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class TabulatedTest:
    """What a file says of one test: its name, "" where it has none; its conditions; the table of its frames."""

    name: str
    entries: Mapping[str, SourceText]
    table: CellTable


def refuse_twice(entries: dict[str, SourceText], header: Mapping[str, SourceText], known: Terms) -> None:
    """HistoryError where what the header states is stated anew; the mark of a test piece is a label."""
    given = {known.condition(key) for key in header}
    if "specimen" in given and "specimen" in entries and entries["specimen"].text.casefold() not in known.outputs:
        entries["label specimen"] = entries.pop("specimen")
    for key, entry in entries.items():
        if key in given:
            raise HistoryError(f"{entry.location}: '{key}' was already given; keep one of them")


_CLOCK = re.compile(r"^(\d{1,2})(?:[:h]|\.(?=.*uhr))(\d{2})(?: ?(?:uhr|h))?$", re.IGNORECASE)
"""A time of day, `9h25`, `9.25 Uhr`."""


def with_one_clock(table: CellTable, known: Terms) -> CellTable:
    """The table with dates before the times of day beside them, or without both beside elapsed times in a unit.

    Without them readings of every day would lie in one.
    """
    first = table.rows[0].cells
    times = [k for k, name in enumerate(table.columns) if known.quantity(name) == "time"]
    days = [k for k, name in enumerate(table.columns) if words_of(name) in NAMES_OF["date"]]
    elapsed = [k for k in times if is_number(first[k], table.dialect)]
    clocks = sorted(k for k in {*times, *days} if is_clock_time(first[k]))
    if elapsed and clocks:
        names = " ".join(f"'{table.columns[k]}'" for k in clocks)
        table = table.assuming(f"{names} not used beside '{table.columns[elapsed[0]]}'")
        return table.keeping([k for k in range(len(table.columns)) if k not in clocks])
    if len(days) != 1 or len(times) != 1 or days == times:
        return table
    (day,), (clock,) = days, times
    written = [row.cells[day].removesuffix(" 00:00:00") for row in table.rows]
    dates = list[str]()
    for date in written:  # once a day in many a logbook
        dates.append(date or (dates[-1] if dates else ""))
    joined = [
        " ".join([date, _CLOCK.sub(r"\1:\2", row.cells[clock])]) for date, row in zip(dates, table.rows, strict=True)
    ]
    if not all(map(is_clock_time, joined)) or any(is_number(date, Dialect()) for date in dates):
        return table
    table = table.assuming(f"'{table.columns[day]}' and '{table.columns[clock]}' are one time")
    return table.with_cells(clock, "timestamp", joined).keeping([k for k in range(len(table.columns)) if k != day])


_PART = re.compile(r"part(?:ie)?|teil|segment|run|lauf|section|abschnitt|phase", re.IGNORECASE)
_GROUP = "test no"
"""Name of the column that numbers the tests of a table whose times begin anew."""


def with_names(table: CellTable, known: Terms) -> CellTable:
    """The table with the column that names tests called so: as its name or its answer says, else as its cells do.

    They do where a column of no known quantity has another text wherever time falls, and nowhere else: tubes, joints
    or bars below one another. Kinds of specimens are no names.
    """
    answers, columns = known.vocabulary.synonyms, {k: set(cells_of(table.rows, k)) for k in range(len(table.columns))}
    meant = {k: answers.get(table.columns[k], table.columns[k]) for k in columns}
    specimens = [k for k, one in meant.items() if words_of(one) == "specimen" and len(columns[k] - {""}) > 1]
    keys = [k for k, one in meant.items() if names_tests(one) or (one == "name" and table.columns[k] in answers)]
    keys += [k for k in specimens if not {cell.casefold() for cell in columns[k]} & known.outputs.keys()]
    time = next((list(cells_of(table.rows, k)) for k, one in meant.items() if known.quantity(one) == "time"), [])
    if not keys and time and all(is_number(cell, table.dialect) for cell in time):
        hours = list(map(float_of, time))
        starts = [0, *(k for k in range(1, len(hours)) if hours[k] < hours[k - 1]), len(hours)]
        unknown = [k for k, one in meant.items() if not (known.quantity(one) or known.is_condition(one))]
        unknown = [
            k for k in unknown if not split_written_name(meant[k])[1] and meant[k] not in known.vocabulary.labels
        ]
        for k in unknown if len(starts) > 2 else ():
            texts = [{row.cells[k] for row in table.rows[a:b]} - {""} for a, b in pairwise(starts)]
            if {*map(len, texts)} == {1} and len(set.union(*texts)) == len(texts):
                if _PART.fullmatch(name := table.columns[k]):
                    what = (
                        f"'{name}' numbers parts whose clock begins anew; are they tests of their own? If not, let the"
                    )
                    raise column_question(table, f"{what} time go on", {name: "test"})
                keys.append(k)
    return replace(table, columns=[_GROUP if k in keys[:1] else one for k, one in enumerate(table.columns)])


def with_groups(table: CellTable, known: Terms) -> CellTable:
    """The table with conditions and names of tests in all rows of a group, where they stand in its first row alone.

    A group begins where time falls. Groups that no name tells apart, but a condition does, get numbers.
    """
    keys = [k for k, name in enumerate(table.columns) if names_tests(name)]
    stated = keys + [k for k, name in enumerate(table.columns) if known.may_state(name) and known.is_condition(name)]
    filled = {k: [row for row, cell in enumerate(cells_of(table.rows, k)) if not is_missing(cell)] for k in stated}
    sparse = [k for k, rows in filled.items() if rows and rows[0] == 0 and len(rows) < len(table.rows)]
    time = next((k for k, name in enumerate(table.columns) if known.quantity(name) == "time"), None)
    if not sparse or time is None or not all(is_number(cell, table.dialect) for cell in cells_of(table.rows, time)):
        return table
    times = list(map(float_of, cells_of(table.rows, time)))
    starts = {0, *(k for k in range(1, len(times)) if times[k] < times[k - 1])}
    sparse = [k for k in sparse if starts.issuperset(filled[k])]
    if not sparse:
        return table
    rows, above = list[TableRow](), dict[int, str]()
    for row in table.rows:
        above |= {k: row.cells[k] for k in sparse if not is_missing(row.cells[k])}
        rows.append(TableRow(row.line, [above.get(k, cell) for k, cell in enumerate(row.cells)]))
    notes = (f"blank cells of '{table.columns[k]}' hold what stands above them" for k in sparse)
    result = replace(table, rows=rows).assuming(*notes)
    if keys or len(starts) < 2:
        return result
    numbers = [str(sum(start <= k for start in starts)) for k in range(len(rows))]
    rows = [TableRow(row.line, [number, *row.cells]) for number, row in zip(numbers, rows, strict=True)]
    places = [0, *(result.positions or range(len(result.columns)))]
    return replace(result, columns=[_GROUP, *result.columns], rows=rows, positions=places)


def rows_by_test(table: CellTable, entries: Mapping[str, SourceText], known: Terms) -> list[TabulatedTest]:
    """The tests of a table in which a column of names tells them apart; columns of words state conditions of a test."""
    foreign = [
        k
        for k, column in enumerate(table.columns)
        if column not in known.vocabulary.synonyms and known.quantity(column) in (None, *known.length_kinds)
    ]
    keys = [k for k in foreign if names_tests(table.columns[k])]
    if not foreign:
        return [TabulatedTest("", entries, table)]

    groups = grouped(table.rows, keys[0]) if keys else {"": [*table.rows]}
    if keys and "" in groups:
        what = f"the row names no test; fill the column '{table.columns[keys[0]]}'"
        raise HistoryError(f"{table.location(groups[''][0].line)}: {what}")
    tests = []
    of_rows = {f"label line {row.line}" for row in (table.rows if len(groups) > 1 else ())}
    for name, rows in groups.items():
        others = of_rows - {f"label line {row.line}" for row in rows} if of_rows else of_rows
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
        notes = {key: entry for key, entry in entries.items() if key not in others}
        tests.append(TabulatedTest(name, {**notes, **own}, part))
    return tests


def _states_condition(table: CellTable, column: int, rows: Sequence[TableRow], known: Terms) -> bool:
    """Whether a column holds one condition, or one text, in all rows of a test."""
    cells = cells_of(rows, column)
    first = next(cells)
    if any(cell != first for cell in cells):
        return False
    name = table.columns[column]
    return not is_number(first, table.dialect) or (known.is_condition(name) and not _is_sensor(name, table, known))


def _is_sensor(name: str, table: CellTable, known: Terms) -> bool:
    """Whether a name such as `Temperature 1` is that of a sensor: a first level without a second one."""
    level = re.match(r"(.+)_1(?:_|$)", known.condition(name))
    second = f"{level[1]}_2_" if level else ""
    return level is not None and not any(f"{known.condition(other)}_".startswith(second) for other in table.columns)


def _entries_of_columns(table: CellTable, columns: Sequence[int], row: TableRow, known: Terms) -> dict[str, SourceText]:
    entries = {}
    for k in columns:
        name = table.columns[k]
        key = known.condition(name) if known.is_condition(name) else f"label {name}"
        if not is_missing(row.cells[k]):
            entries[key] = SourceText(row.cells[k], table.location(row.line), table.dialect.decimal, name)
    return entries


# ---- layouts ---------------------------------------------------------------------------------------------------------


class TestColumns(NamedTuple):
    """The columns of one test: its name, "" where the columns do not tell it, and {position: name of the column}."""

    test: str
    columns: Mapping[int, str]


@dataclass(frozen=True)
class Layout:
    """How tests may stand in a table. example : a text in this layout. match, tests : of a table with its head."""

    name: str
    example: str
    match: Callable[[HeadedTable], bool]
    tests: Callable[[HeadedTable], list[TabulatedTest]]


def tests_in(table: CellTable, vocabulary: HeaderVocabulary) -> list[TabulatedTest]:
    """The tests of a table; HistoryError, in one sentence, where it cannot be told how it is laid out."""
    table = without_page_heads(table)
    blocks = _blocks(table, vocabulary.terms())
    if not blocks:
        headed = headed_table(table, vocabulary)
        return next(layout for layout in LAYOUTS if layout.match(headed)).tests(headed)
    found = [one for block in blocks for one in tests_in(block, vocabulary)]
    names = [one.name or _name_in_titles(block) for block, one in zip(blocks, found, strict=False)]
    if len(found) != len(blocks) or len(set(names)) < len(names):
        return found
    return [replace(one, name=name) for one, name in zip(found, names, strict=True)]


# ---- blocks below one another ----------------------------------------------------------------------------------------


_TITLE_OF_TEST = re.compile(
    r"(?:creep )?(?:test|specimen|sample|probe|versuch|essai|[ée]prouvette|provino|prova|probeta|ensayo|bar)"
    r"[ -]?(?:piece|no|nr|n°|id|name)?[.: #=]*"
    r"(\S.*)",
    re.IGNORECASE,
)


def _blocks(table: CellTable, known: Terms) -> list[CellTable]:
    """The tables below one another that each begin with titles and names of columns; [] of a single one.

    One whose head says nothing new is the same test on a new page, or behind a pause.
    """
    starts, head, last, blocks = [0], -1, -1, list[list[TableRow]]()
    for k, row in enumerate(table.rows):
        if is_frame(row, table):
            last = k
        elif (head < 0 or last > head) and sum(map(bool, row.cells)) > 1 and any(is_time(c, known) for c in row.cells):
            end = last + 1
            while end < k and re.match(r"\W*(?:end|ende|fin)\b", " ".join(table.rows[end].cells), re.IGNORECASE):
                end += 1
            starts += [end] if head >= 0 else []
            head = k
    for start, end in pairwise([*starts, len(table.rows)] if len(starts) > 1 else ()):
        part = list(table.rows[start:end])
        body = next((k for k, row in enumerate(part) if is_frame(row, table)), len(part))
        said = {cell for row in blocks[-1] for cell in row.cells} if blocks else set()
        is_new = any(cell not in said for row in part[:body] for cell in row.cells)
        if is_new:
            blocks.append(part)
        else:
            blocks[-1] += part[body:]
    return [replace(table, rows=rows) for rows in blocks]


def _name_in_titles(block: CellTable) -> str:
    """The name of the test in the titles above a block, `Specimen A`; "" where none has it."""
    texts = [" ".join(filter(None, row.cells)) for row in block.rows[:8]]
    found = [match[1] for text in texts if (match := _TITLE_OF_TEST.fullmatch(text))]
    return (found[0].split(" ")[0] if block.dialect.delimiter == " " else found[0]) if found else ""


# ---- columns of each test side by side -----------------------------------------------------------------------------


def _are_pairs(headed: HeadedTable) -> bool:
    """Whether each of several times has columns of its own; `time_s,time_h,strain_pct` is one in two units."""
    times = headed.times
    one_in_two_units = any(b - a == 1 for a, b in pairwise(times)) or len(headed.names) - 1 in times
    return len(times) > 1 and not one_in_two_units


def _tests_of_pairs(headed: HeadedTable) -> list[TabulatedTest]:
    names, times = headed.names, headed.times
    if first := next(filter(None, names[: times[0]]), ""):
        what = f"the column '{quoted(first)}' stands before the first time; begin the columns of each test with time"
        raise HistoryError(f"{headed.place}: {what}")
    tests = []
    for start, end in zip(times, [*times[1:], len(names)], strict=True):
        named = {k: test_and_column(names[k], headed.known) for k in range(start, end) if names[k]}
        called = sorted({test for test, _ in named.values() if test})
        if len(called) > 1:
            what = f"the columns beside one time name the tests '{quoted(called[0])}' and '{quoted(called[1])}'"
            raise HistoryError(f"{headed.place}: {what}; begin the columns of each test with time")
        tests.append(TestColumns("".join(called), {k: column for k, (_, column) in named.items()}))
    return _tests_of_blocks(headed, tests, range(times[0]))


# ---- one column a test ---------------------------------------------------------------------------------------------


def _columns_of_tests(headed: HeadedTable) -> list[int]:
    """Positions of the columns beside a time but for the one temperature of a furnace that several tests share."""
    others = [k for k, cell in enumerate(headed.names) if k not in headed.times and cell]
    furnace = [k for k in others if headed.known.quantity(headed.names[k]) == "temperature"]
    return [k for k in others if k not in furnace or len(furnace) > 1 or len(others) < 3]


def _are_columns(headed: HeadedTable) -> bool:
    """Whether the columns beside one time are one a test."""
    known = headed.known
    others = [headed.names[k] for k in _columns_of_tests(headed)]
    if len(headed.times) != 1 or len(others) < 2 or known.vocabulary.synonyms.keys() & {*others}:
        return False
    named = [test_and_column(cell, known) for cell in others]
    if all(test for test, _ in named):
        return len({known.quantity(column) for _, column in named}) < len(named)
    if any(known.quantity(cell) for cell in others):
        return bool(headed.rows) and len(set(others)) == 1
    if _are_conditions(headed):
        return True
    if any(names_tests(cell) or known.is_condition(cell) for cell in others):
        return False
    if len({kind for cell in others for kind in _kinds_of_unit(cell)}) > 1:
        return False
    spelled = {words_of(name) for name in known.column_kinds}
    return not any(get_close_matches(words_of(split_written_name(cell)[0]), spelled, 1, cutoff=0.75) for cell in others)


def _kinds_of_unit(cell: str) -> list[str]:
    """What the unit of a column is one of."""
    suffix = unit_suffix(split_written_name(cell)[1])
    return [name for name, kind in OF_UNIT.items() if suffix and suffix in kind.units]


def _are_conditions(headed: HeadedTable) -> bool:
    """Whether the columns beside a time are named by a load or a temperature, as `120 MPa`."""
    return all(conditions_of_head(headed.written[k], headed.known) for k in _columns_of_tests(headed))


def _tests_of_columns(headed: HeadedTable) -> list[TabulatedTest]:
    own = _columns_of_tests(headed)
    shared = {k: cell for k, cell in enumerate(headed.names) if cell and k not in own}
    tests, first = list[TestColumns](), own[0]
    for k in own:
        test, column = _test_and_strain(headed, k)
        same = next((n for n, one in enumerate(tests) if test and one.test == test), None)
        if same is None or column in tests[same].columns.values():
            tests.append(TestColumns(test, {**shared, k: column}))
        else:
            tests[same] = TestColumns(test, {**tests[same].columns, k: column})
    beside = [[cell for k, cell in enumerate(row.cells) if cell and k >= first] for row in headed.rows]
    if all(one.test.isdigit() for one in tests) and not any(len(set(cells)) > 1 for cells in beside):
        what = "several columns of one quantity, and no conditions above each, may be tests or sensors of one; name"
        advice = "the tests, such as 'A1 strain (%)', or keep one column, with '# ignore: NAME' for the others"
        raise HistoryError(f"{headed.place}: {what} {advice}")
    return _tests_of_blocks(headed, tests, {*range(first), *shared})


def _test_and_strain(headed: HeadedTable, k: int) -> tuple[str, str]:
    """Name of the test and of the column of one column; one that names a test alone holds what the head says."""
    cell, written, stated = headed.names[k], headed.written[k], headed.table.header.get("columns")
    test, column = test_and_column(cell, headed.known)
    if headed.known.quantity(column):
        return test, column
    name, unit = split_written_name(cell)
    if stated is None and unit_suffix(unit) in STRAIN.units and headed.rows:
        return name, f"strain ({unit})"
    if stated is None and not _are_conditions(headed):
        what = f"the column '{quoted(cell)}' does not say what it holds; write '# columns: strain_pct' above, or names"
        raise HistoryError(f"{headed.place}: {what} such as 'A1 strain (%)'")
    return written, stated.text if stated else f"strain{cell.removeprefix(written)}"


# ---- blocks of columns ---------------------------------------------------------------------------------------------


def _tests_of_blocks(
    headed: HeadedTable, tests: Sequence[TestColumns], key_columns: Collection[int]
) -> list[TabulatedTest]:
    """The tests of several columns each, with what the rows above say of each."""
    table, known, place = headed.table, headed.known, headed.place
    header = {key: entry for key, entry in table.header.items() if key != "columns"}
    used, rows, notes = {k for test in tests for k in test.columns}, table.rows[1:], dict[str, SourceText]()
    rows = list(rows_beside_notes(table, rows, used, notes))
    results: dict[str, TabulatedTest] = {}
    heads = heads_of_tests(headed, [test.columns for test in tests], key_columns)
    for number, (test, head) in enumerate(zip(tests, heads, strict=True), 1):
        entries, columns = dict(head.entries), list(test.columns.values())
        for quantity, text in conditions_of_head(test.test, known):
            entries[quantity] = SourceText(text, place, table.dialect.decimal, test.test)
        refuse_twice(entries, header, known)
        written = entries.pop("name", None)
        measured = [entry.text for entry in entries.values() if entry.key in known.conditions.kinds]
        name = test.test or (written.text if written else " ".join(measured) or str(number))
        name = f"{name} ({number})" if name in results and not (test.test or written) else name
        if name in results:
            raise HistoryError(f"{place}: two tests are called '{quoted(name)}'; give each its own name")
        check_columns(f"{place}, test '{quoted(name)}'", columns)
        # A time goes on where another test does, and the temperature of a furnace, too.
        others = [k for k, one in enumerate(columns) if known.quantity(one) not in ("time", "temperature")]
        own_rows = with_columns(rows, list(test.columns))
        cut = [row for row in own_rows if not all(is_missing(row.cells[k]) for k in others or range(1, len(columns)))]
        for row in own_rows[own_rows.index(cut[-1]) + 1 :] if cut else ():
            if row.cells[0][:1].isalpha():  # "rupture", below its last reading
                entries[f"label line {row.line}"] = SourceText(row.cells[0], table.location(row.line))
        if not cut:
            raise HistoryError(f"{place}: test '{quoted(name)}' has no rows below its names; remove it or fill it")
        own = replace(
            table.assuming(*head.assumptions),
            rows=cut,
            header={},
            columns=columns,
            columns_line=table.rows[0].line,
            positions=[table.positions[k] if table.positions else k for k in test.columns],
            sources=(*conditions_in_text(test.test, place, known), *head.sources),
        )
        results[name] = TabulatedTest(name, {**notes, **header, **entries}, own)
    return list(results.values())


# ---- one test, or tests by rows ------------------------------------------------------------------------------------


def _tests_of_rows(headed: HeadedTable) -> list[TabulatedTest]:
    heads = [dict.fromkeys(filter(None, row.cells)) for row in (*headed.whole, *headed.table.rows[:3])]
    if not headed.times and (axes := [one for one in heads if {*map(str.casefold, one)} == {"x", "y"}]):
        choices = [dict(zip(axes[0], (f"time_{unit}", "strain_pct"), strict=True)) for unit in ("h", "s")]
        what = f"{' and '.join(map(repr, axes[0]))} are columns of a plot; what are they?"
        raise column_question(headed.table, what, *choices)
    if not headed.times:
        raise head_question(replace(headed.table, columns_line=headed.table.rows[0].line), headed.names)
    head = HeadOfTest(headed.table, headed.known)
    for row in named_values(headed.whole, headed.table, headed.known):
        head.read(row)
    refuse_twice(head.entries, headed.table.header, headed.known)
    table, footers = without_remarks_around(headed.table, head.entries, headed.known)
    table = with_one_clock(named_columns(table), headed.known)
    table = replace(table.assuming(*head.assumptions, *footers), sources=tuple(head.sources))
    table = without_remarks(table, head.entries, headed.known.vocabulary.labels)
    table = with_groups(with_names(table, headed.known), headed.known)
    return rows_by_test(table, {**table.header, **head.entries}, headed.known)


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
