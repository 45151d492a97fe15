"""One test in several files: `part 2 of 3` in the head, or R1_part2.csv, becomes one table of frames.

Where the times of each part go on from those of the part before, the frames follow one another. Where the clock begins
anew it is asked whether the parts are one test, `parts` in tests.toml: `joined`, each part begins where the one before
ended, in time and in strain; or `separate`, tests of their own. The same is asked of one file, where the clock begins
anew between two of its rows or blocks.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import datetime
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

from creepkit.errors import HistoryError, quoted
from creepkit.files.delimited_text import float_of, is_number
from creepkit.files.labview import START
from creepkit.readers.questions import Question
from creepkit.readers.standard_names import oldest_first, with_clock_in_seconds
from creepkit.readers.table import CellTable, SourceText, TableRow
from creepkit.readers.table_heads import is_frame
from creepkit.readers.table_layouts import TabulatedTest, tests_in
from creepkit.readers.tests_file import JOINED, SEPARATE, answers_of
from creepkit.readers.text_files import peek_table, read_text_table
from creepkit.readers.vocabulary import HeaderVocabulary, Terms, split_written_name
from creepkit.records.quantities import LENGTH

_IN_HEAD = re.compile(
    r"\b(?:part|teil|partie)\.?\s*(?P<number>\d{1,2})\s*(?:of|von|de|sur|/)\s*(?P<total>\d{1,2})\b", re.IGNORECASE
)
_IN_NAME = re.compile(
    r"(?:(?:^|[ _.-]+|(?<=\d))(?:part|teil|partie)[ _.-]?(?P<number>\d{1,2})"
    r"(?:[ _.-]?(?:of|von|de|sur)[ _.-]?(?P<total>\d{1,2}))?"
    r"|[ _.-]+(?P<one>\d{1,2})(?:of|von|sur)(?P<all>\d{1,2}))$",
    re.IGNORECASE,
)


class Part(NamedTuple):
    """A file that is a part of a test: which, of how many, 0 where that is not said; what its other parts share."""

    number: int
    total: int
    test: tuple[str, str]
    path: Path


def read_tests(path: Path, vocabulary: HeaderVocabulary) -> tuple[Path, list[TabulatedTest]]:
    """The first file of the tests in a file, and these tests: of a part of a test the whole test.

    Question where parts lack, or where it is open whether the parts are one test; HistoryError for what is wrong in
    them.
    """
    parts = parts_beside(path)
    if not parts:
        return path, list(tests_in(read_text_table(path), vocabulary))
    answers = [answers_of(one.path) for one in parts]
    if len({(str({k: v[0] for k, v in a.stated.items()}), str(a.columns), str(a.ended)) for a in answers}) > 1:
        raise HistoryError(f"{path}: tests.toml says other things of other parts of its test; give them one pattern")
    found = [list(tests_in(read_text_table(one.path), vocabulary)) for one in parts]
    if any(len(tests) != 1 for tests in found):
        what = "is a part of several tests, which are not joined; are these tests of their own?"
        raise Question(path, str(path), what, "parts", (SEPARATE,))
    return parts[0].path, [_joined(path, parts, [tests[0] for tests in found], vocabulary)]


def parts_beside(path: Path) -> list[Part]:
    """The parts of the test of which a file is one, in their order; [] of a whole test, and of parts said separate."""
    own = _part(path, path.stat().st_mtime_ns)
    if own is None or answers_of(path).parts == SEPARATE:
        return []
    alike = re.sub(r"\d+", "#", path.stem)
    others = [one for one in path.parent.iterdir() if one.suffix == path.suffix and one.is_file()]
    if own.test[0]:
        others = [one for one in others if re.sub(r"\d+", "#", one.stem) == alike]
    found = [_part(one, one.stat().st_mtime_ns) for one in others]
    parts = sorted(one for one in found if one is not None and one.test == own.test)
    numbers, total = [one.number for one in parts], max(one.total for one in parts)
    if numbers == [1] and total < 2:
        return []
    if lacking := sorted({*range(1, max(total, *numbers, 1) + 1)} - {*numbers}):
        listed = " and ".join(map(str, lacking))
        what = f"is part {own.number} of a test, and part {listed} is not beside it; put it there. Or is this a test?"
        raise Question(path, str(path), what, "parts", (SEPARATE,))
    if twice := [one for one, other in pairwise(parts) if one.number == other.number]:
        what = f"and another file say that they are part {twice[0].number} of one test"
        raise HistoryError(f"{twice[0].path}: this {what}; correct one of them")
    return parts


@lru_cache(4096)
def _part(path: Path, changed: int) -> Part | None:
    """Which part of a test a file is; changed : when it was, for the cache."""
    head, name = _IN_HEAD.search(_head(path)), _IN_NAME.search(path.stem)
    if name:
        number = int(name["number"] or name["one"])
        total = int(name["total"] or name["all"] or (head["total"] if head else 0))
        return Part(number, total, (path.stem[: name.start()], ""), path)
    if not head:
        return None
    number = int(head["number"])
    text = f"{head.string[: head.start()]}{head.string[head.end() :]}"
    numbered = re.fullmatch(rf"(.*?)[ _.-]*0*{number}", path.stem)
    return Part(number, int(head["total"]), (numbered[1] if numbered else "", text), path)


def _head(path: Path) -> str:
    """The line above the frames of a file that says which part of a test it is; "" where none does."""
    table = peek_table(path)
    if table is None:
        return ""
    said = [entry.text for entry in table.header.values()]
    for row in table.rows:
        if is_frame(row, table):
            break
        said.append(" ".join(filter(None, row.cells)))
    return next(filter(_IN_HEAD.search, said), "")


def _joined(
    path: Path, parts: Sequence[Part], tests: Sequence[TabulatedTest], vocabulary: HeaderVocabulary
) -> TabulatedTest:
    """The test of all parts."""
    first, known = tests[0], vocabulary.terms()
    for part, test in zip(parts, tests, strict=True):
        if list(test.table.columns) != list(first.table.columns):
            what = f"has other columns than part 1, {quoted(parts[0].path.name)}; make them the same"
            raise HistoryError(f"{part.path}: {what}")
        for key, entry in _conditions(test, known).items():
            other = _conditions(first, known).get(key, entry)
            if not entry.says_the_same(other):
                what = f"'{key}' is {quoted(entry.text)}, and in part 1 {quoted(other.text)}; parts of a test have one"
                raise HistoryError(f'{entry.location}: {what}; give each its steps, or write parts = "{SEPARATE}"')
    called = parts[0].test[0] or parts[0].path.stem
    return _on_one_clock(tests, known, path, "; ".join(one.path.name for one in parts), called)


def _on_one_clock(
    tests: Sequence[TabulatedTest], known: Terms, path: Path, listed: str, called: str = ""
) -> TabulatedTest:
    """The test of parts with the same columns; Question where their clock begins anew, and no answer says what that is.

    listed : the parts in words. called : the name of a test that has none.
    """
    first, rows, note = tests[0], [row for test in tests for row in test.table.rows], "whose times go on"
    columns = [known.quantity(name) for name in first.table.columns]
    time = columns.index("time") if "time" in columns else None
    if time is not None and _begins_anew(tests, time):
        if answers_of(path).parts != JOINED:
            what = "is a part of a test" if called else "the test goes on here"
            what += ", and its clock begins anew: are the parts one test, each from where the one before ended, in "
            what += "time and strain, or tests of their own?"
            place = str(path) if called else tests[1].table.location(tests[1].table.rows[0].line)
            raise Question(path, place, what, "parts", (JOINED, SEPARATE))
        kinds = known.columns.kinds
        moved = [time, *(k for k, q in enumerate(columns) if q and (q.startswith("strain") or kinds[q] is LENGTH))]
        gaps = [_gap(one, other, time) for one, other in pairwise(tests)]
        note = "with the gaps between them" if any(gaps) else "each from the end of the one before"
        rows = _in_one_clock([test.table for test in tests], moved, gaps)
    entries = {key: entry for test in reversed(tests) for key, entry in test.entries.items()} | dict(first.entries)
    table = replace(first.table, rows=rows).assuming(f"parts joined {note}: {listed}")
    return TabulatedTest(first.name or called or path.stem, entries, table)


# ---- a clock that begins anew within a file --------------------------------------------------------------------------


def with_clocks_joined(found: Sequence[TabulatedTest], path: Path, vocabulary: HeaderVocabulary) -> list[TabulatedTest]:
    """The tests in one file; parts of one whose clock begins anew are joined, or tests of their own, as is said."""
    known, tests = vocabulary.terms(), list[list[TabulatedTest]]()
    for test in (replace(one, table=_in_order(one.table, known)) for one in found):
        parts = [replace(test, table=replace(test.table, rows=rows)) for rows in _between_starts(test.table, known)]
        if tests and _may_go_on(tests[-1][-1], test, known):
            tests[-1] += parts
        else:
            tests.append(parts)
    if answers_of(path).parts == SEPARATE:
        return [replace(one, name=_numbered(one, k, parts)) for parts in tests for k, one in enumerate(parts, 1)]
    rows = ([f"lines {one.table.rows[0].line} to {one.table.rows[-1].line}" for one in parts] for parts in tests)
    listed = map("; ".join, rows)
    return [
        parts[0] if len(parts) == 1 else replace(_on_one_clock(parts, known, path, said), name=parts[0].name)
        for parts, said in zip(tests, listed, strict=True)
    ]


def _numbered(test: TabulatedTest, number: int, parts: Sequence[TabulatedTest]) -> str:
    return f"{test.name or test.table.sheet or test.table.path.stem} ({number})" if len(parts) > 1 else test.name


def _in_order(table: CellTable, known: Terms) -> CellTable:
    """The table with its oldest row first, and with a clock h:mm:ss that begins anew in seconds."""
    time = next((k for k, name in enumerate(table.columns) if known.quantity(name) == "time"), None)
    table = table if time is None else with_clock_in_seconds(table, time, known.vocabulary.synonyms)
    if time is None or not all(is_number(row.cells[time], table.dialect) for row in table.rows):
        return table
    hours = [float_of(row.cells[time]) for row in table.rows]
    is_turned = len(hours) > 2 and hours[-1] < hours[0] and all(b <= a for a, b in pairwise(hours))
    return oldest_first(table) if is_turned else table


_ANEW = 0.1
"""Of the time before, to which a clock that begins anew falls."""


def _between_starts(table: CellTable, known: Terms) -> list[Sequence[TableRow]]:
    """The rows between those at which the clock begins anew, and stays below where it was; a wrong digit falls once."""
    time = next((k for k, name in enumerate(table.columns) if known.quantity(name) == "time"), None)
    if time is None or not all(is_number(row.cells[time], table.dialect) for row in table.rows):
        return [table.rows]
    hours = [float_of(row.cells[time]) for row in table.rows]
    steps = [k for k in range(1, len(hours) - 1) if hours[k] < hours[k - 1] > hours[k + 1] and hours[k - 1] > 0.0]
    starts = [0, *(k for k in steps if hours[k] <= _ANEW * hours[k - 1]), len(hours)]
    return [table.rows[start:end] for start, end in pairwise(starts)]


def _may_go_on(before: TabulatedTest, after: TabulatedTest, known: Terms) -> bool:
    """Whether a test may be a part of the one before: of its name, its columns and its conditions."""
    one, other = (_conditions(test, known) for test in (before, after))
    is_alike = (before.name, before.table.sheet, [*before.table.columns]) == (
        *(after.name, after.table.sheet),
        [*after.table.columns],
    )
    return is_alike and one.keys() == other.keys() and all(one[key].says_the_same(other[key]) for key in one)


def _conditions(test: TabulatedTest, known: Terms) -> dict[str, SourceText]:
    """What a part states of its test, without its labels."""
    stated = {key: one for key, one in test.entries.items() if known.is_condition(key) and not key.startswith("label ")}
    return {one.key: one for one in test.table.sources if one.key != "name"} | stated


def _begins_anew(tests: Sequence[TabulatedTest], time: int) -> bool:
    """Whether the time of a part begins before that of the one before ended, where times are numbers."""
    ends = [(test.table.rows[0].cells[time], test.table.rows[-1].cells[time], test.table.dialect) for test in tests]
    if not all(is_number(one, dialect) for *both, dialect in ends for one in both):
        return False
    for test in tests:
        test.table.numbers(test.table.columns[time])  # or an error with the place in its part
    numbers = [(float_of(one.replace(",", ".")), float_of(other.replace(",", "."))) for one, other, _ in ends]
    return any(start < end for (_, end), (start, _) in pairwise(numbers))


def _gap(before: TabulatedTest, after: TabulatedTest, time: int) -> float:
    """s from the last frame of a part to the first of the next, where both say when they were begun; else 0."""
    begun, ends = list[datetime](), (before.table.rows[-1].cells[time], after.table.rows[0].cells[time])
    with suppress(ValueError, KeyError):
        begun = [datetime.fromisoformat(one.entries[START].text) for one in (before, after)]
    is_in_seconds = split_written_name(before.table.columns[time])[1] == "s"
    if len(begun) < 2 or not is_in_seconds or not all(is_number(one, before.table.dialect) for one in ends):
        return 0.0
    return max((begun[1] - begun[0]).total_seconds() + float_of(ends[1]) - float_of(ends[0]), 0.0)


def _in_one_clock(tables: Sequence[CellTable], moved: Sequence[int], gaps: Sequence[float]) -> list[TableRow]:
    """The frames of all parts; the first of each is the last of the one before, in the columns that are moved.

    gaps : in the first of these, the time, between each part and the next.
    """
    rows = list(tables[0].rows)
    for table, gap in zip(tables[1:], gaps, strict=True):
        sign, dialect = table.dialect.decimal, table.dialect
        if not all(is_number(row.cells[k], dialect) for row in (rows[-1], table.rows[0]) for k in moved):
            what = "a cell of the first row, or of the last of the part before, is no number"
            raise HistoryError(f"{table.location(table.rows[0].line)}: {what}, and parts are joined there; correct it")
        last, first = ([float_of(row.cells[k].replace(sign, ".")) for k in moved] for row in (rows[-1], table.rows[0]))
        last[0] += gap
        for row in table.rows[1:]:
            cells = list(row.cells)
            for k, end, start in zip(moved, last, first, strict=True):
                if is_number(cells[k], dialect):
                    cells[k] = f"{float_of(cells[k].replace(sign, '.')) - start + end:.12g}".replace(".", sign)
            rows.append(TableRow(row.line, cells))
    return rows
