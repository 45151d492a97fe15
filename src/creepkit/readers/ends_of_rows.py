"""How the tests of a table with one row a test ended: marks of their times, columns, remarks; what is open is asked."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from creepkit.errors import HistoryError, quoted
from creepkit.files.delimited_text import is_missing
from creepkit.readers.column_names import split_written_name
from creepkit.readers.columns_of_tests import TIME_TO_STRAIN, kind_of, quantity_of, unit_of
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
from creepkit.readers.questions import Question
from creepkit.readers.table import SourceText
from creepkit.readers.tables_of_tests import TestRow, TestTable
from creepkit.readers.vocabulary import HeaderVocabulary
from creepkit.records.quantities import TIME


@dataclass(frozen=True)
class RowEnd:
    """How the test of a row ended, by its columns, "" where none says it, and by the mark of its time.

    is_open : whether that is asked for.
    """

    stated: str
    mark: MarkedTime
    assumptions: tuple[str, ...] = ()
    is_open: bool = False


_SAYS_NO_END = (
    "name",
    "alloy",
    "control",
    "specimen",
    "label heat",
    "label laboratory",
    "label group",
    "label assumed",
)


def ends_of_rows(
    table: TestTable, keys: Sequence[str], vocabulary: HeaderVocabulary, errors: list[HistoryError]
) -> list[RowEnd]:
    """How the test of each row ended; what its columns leave open is an error that asks for it."""
    answers = {text.casefold(): end for text, end in vocabulary.end_of_test_terms.items()}
    legend = {sign: end for note in (*table.notes, *table.names) for sign, end in legend_in(note).items()}
    answers = {**legend, **answers}
    time = next((k for k, key in enumerate(keys) if quantity_of(key) == "rupture"), None)
    duration = next((k for k, key in enumerate(keys) if quantity_of(key) == "end_time"), None)
    marks = [_mark_of(table, row, time, answers) for row in table.rows]
    name = keys.index("name") if "name" in keys else None
    named = ["" if name is None else answers.get(row.cells[name].casefold(), "") for row in table.rows]
    columns = [k for k, key in enumerate(keys) if kind_of(quantity_of(key)) is None and key not in _SAYS_NO_END]
    columns = [k for k in columns if table.names[k] not in vocabulary.labels]
    columns.sort(key=lambda k: kind_of_column(table.names[k]) not in FIRM)
    decided = any(mark.said == STOPPED for mark in marks)
    found = dict[int, EndsOfColumn]()
    for k in columns:
        if split_written_name(table.names[k])[1] and kind_of_column(table.names[k]) == "":
            continue  # a quantity
        cells = [row.cells[k] for row in table.rows]
        found[k] = ends_in_column(table.names[k], cells, answers, decided)
        decided |= kind_of_column(table.names[k]) in FIRM and any(found[k].ends)
    if time is None and duration is None:
        found = {k: one for k, one in found.items() if kind_of_column(table.names[k]) in FIRM}
    ends = list[RowEnd]()
    for r, (row, mark) in enumerate(zip(table.rows, marks, strict=True)):
        stated = {table.names[k]: one.ends[r] for k, one in found.items() if one.ends[r] in (RUPTURED, STOPPED)}
        remarks = {table.names[k] for k, one in found.items() if one.is_remark}
        firm = {column: end for column, end in stated.items() if column not in remarks}
        said = {named[r]} if named[r] in (RUPTURED, STOPPED) else set(firm.values())
        if not said and mark.said not in (RUPTURED, STOPPED):
            group = row.stated.get("label group")
            said = set(stated.values()) | ({end_said_by(group.text) if group else ""} & {STOPPED, RUPTURED})
        if len(said) > 1:
            errors.append(_contradiction(table, row, firm or stated))
        status = [k for k, one in found.items() if kind_of_column(table.names[k]) == "status" and one.ends[r] == ""]
        known = "ruptured" if time is not None and mark.said in ("", RUPTURED) and mark.number else "unknown"
        is_open = bool(status) and not said and mark.said != STOPPED
        notes = [f"ended {known} (empty cell)"] * is_open
        if STOPPED in said and mark.said != STOPPED and not firm and named[r] == "":
            notes.append("stopped before rupture by its remark")
        is_asked = len(said) != 1 and UNCLEAR in (mark.said, *(one.ends[r] for one in found.values()))
        ends.append(RowEnd("".join(said) if len(said) == 1 else "", mark, tuple(notes), is_asked))
    if time is not None and not any(STOPPED in (end.stated, end.mark.said) for end in ends):
        errors += _asked_of_notes(table, keys, answers)
    if time is not None or duration is not None:
        errors += [_asked_of_column(table, k, one, time) for k, one in found.items() if one.asked]
    if time is not None and (doubtful := [r for r, mark in enumerate(marks) if mark.said == UNCLEAR]):
        errors += _asked_of_marks(table, time, marks, [r for r in doubtful if ends[r].stated == ""])
    return ends


def _mark_of(table: TestTable, row: TestRow, time: int | None, answers: Mapping[str, str]) -> MarkedTime:
    if time is None or is_missing(row.cells[time]):
        return MarkedTime("", "")
    return marked_time(table.entry(row, time).text, answers)


def _asked_of_notes(table: TestTable, keys: Sequence[str], answers: Mapping[str, str]) -> list[HistoryError]:
    """Questions of notes that speak of tests which did not break, while the table has none."""
    doubtful = [n for n in table.notes if end_said_by(n) not in ("", RUPTURED) and not legend_in(n)]
    last = table.rows[-1].cells[keys.index("name")] if "name" in keys else ""
    return [
        Question(
            table.grid.path,
            table.location(table.line),
            f"the note '{quoted(note, 80)}' may speak of tests that did not break; which are they?",
            "ended",
            ({last or "NAME OF A TEST": STOPPED}, {note: LABEL}),
        )
        for note in doubtful
        if note.casefold() not in answers and not any(cell.casefold() in answers for cell in _names(table, keys))
    ]


def _names(table: TestTable, keys: Sequence[str]) -> list[str]:
    return [row.cells[keys.index("name")] for row in table.rows] if "name" in keys else []


def _contradiction(table: TestTable, row: TestRow, stated: Mapping[str, str]) -> HistoryError:
    said = " and ".join(f"'{quoted(name)}' says {end}" for name, end in stated.items())
    return HistoryError(f"{table.location(row.line)}: {said}; correct one of them")


MOST_ASKED = 6
"""Texts that a question names."""


def _asked_of_column(table: TestTable, k: int, column: EndsOfColumn, time: int | None) -> Question:
    """The question of what the texts of a column say of the end."""
    rows = [r for r, end in enumerate(column.ends) if end == UNCLEAR]
    texts = list(column.asked[:MOST_ASKED])
    more = f" and {len(column.asked) - len(texts)} more" if len(column.asked) > len(texts) else ""
    listed = " and ".join(f"'{quoted(text, 60)}'" if text else "an empty cell" for text in column.asked[:MOST_ASKED])
    flags = [text for text in texts if text]
    if len(flags) == 2 and len(column.values) == 2 and not column.is_remark:
        likely = _likely_unbroken(table, k, flags, time)
        other = next(text for text in flags if text != likely)
        choices = [{likely: STOPPED, other: RUPTURED}, {likely: RUPTURED, other: STOPPED}]
    else:
        choices = [dict.fromkeys(texts, end) for end in (STOPPED, RUPTURED)]
    choices.append(dict.fromkeys(texts, LABEL))
    return Question(
        table.grid.path,
        table.location(table.rows[rows[0]].line),
        f"'{quoted(table.names[k], 60)}' says {listed}{more}: did these tests break, were they stopped before, or does "
        "it say nothing of their end?",
        "ended",
        choices,
    )


def _likely_unbroken(table: TestTable, column: int, texts: Sequence[str], time: int | None) -> str:
    """Which of two values tests have that did not break: those that share one time, else those that lasted longer."""

    def times(text: str) -> list[float]:
        rows = [row for row in table.rows if row.cells[column].casefold() == text.casefold()]
        cells = [TIME_IN_CELL.fullmatch(row.cells[time]) for row in rows] if time is not None else []
        return [float(one["number"].replace(",", ".")) for one in cells if one and one["number"].count(".") < 2]

    def rank(text: str) -> tuple[bool, float]:
        found = times(text)
        return len(found) > 1 and len(set(found)) == 1, sum(found) / max(len(found), 1)

    return max(texts, key=rank)


def _asked_of_marks(
    table: TestTable, time: int, marks: Sequence[MarkedTime], rows: Sequence[int]
) -> list[HistoryError]:
    """Questions of what marks of times mean, one for each; `<` says nothing that could be used."""
    errors, asked = list[HistoryError](), set[str]()
    for r in rows:
        place, cell, mark = table.location(table.rows[r].line), table.rows[r].cells[time], marks[r].mark
        if mark in asked:
            continue
        asked.add(mark)
        column = f"'{quoted(table.names[time], 60)}' is '{quoted(cell)}'"
        if mark[:1] in "<≤~≈" or not re.sub(r"[^\w()*+†‡#^/\[\]§¹²³-]", "", mark):
            errors.append(
                HistoryError(f"{place}: {column}; write a number of {table.names[time]}, >1000 for a run-out")
            )
            continue
        choices = [{mark.casefold(): STOPPED}, {mark.casefold(): RUPTURED}]
        errors.append(Question(table.grid.path, place, f"{column}: did this test break then?", "ended", choices))
    return errors


def with_end(cells: Mapping[str, SourceText], end: RowEnd, location: str) -> dict[str, SourceText]:
    """The entries of a row, its run-out as the time at which it was stopped."""
    entries, stated, mark = dict(cells), end.stated, end.mark
    key = next((key for key in entries if quantity_of(key) == "rupture"), None)
    taken = next((key for key in entries if quantity_of(key) == "end_time"), None)
    if taken is not None and (lasted := marked_time(entries[taken].text, {})).number:
        entries[taken] = replace(entries[taken], text=lasted.number)
        stated = stated or (STOPPED if lasted.said == STOPPED and key is None else "")
    if key is not None:
        time = entries.pop(key)
        if mark.said == STOPPED and stated == RUPTURED and mark.number:
            raise HistoryError(f"{location}: '{time.text}' is a time without rupture, and the test ruptured; keep one")
        if mark.number and STOPPED in (mark.said, stated):
            stated = STOPPED
            if taken is not None and entries[taken].text != mark.number:
                raise HistoryError(
                    f"{location}: it was stopped at '{time.text}' and at '{entries[taken].text}'; keep one"
                )
            if taken is None:
                entries[f"end_time_{unit_of(key)}"] = replace(time, text=mark.number)
        elif mark.number:
            entries[key] = replace(time, text=mark.number)
        else:  # a word stands in the place of the time
            stated = stated or mark.said
    ruptures = key is not None and key in entries
    if stated == RUPTURED and not ruptures:
        if taken is not None:  # a column of durations says when it broke
            entries[f"rupture_{unit_of(taken)}"] = entries.pop(taken)
        elif any(quantity_of(other) == "minimum_rate" for other in entries):
            entries.setdefault("label ended", SourceText(RUPTURED, location))
            return entries
    elif ruptures:
        _check_duration(entries)
        entries = {key: entry for key, entry in entries.items() if quantity_of(key) != "end_time"}
    if stated or ruptures:  # said here, whatever a remark says
        entries["ended"] = SourceText(STOPPED if stated == STOPPED else RUPTURED, location)
    return entries


def assumed_of_empty(quantity: str, entries: Mapping[str, SourceText]) -> str:
    """What an empty cell leaves unknown; "" where the rest of the row says it, or where it would be a label."""
    known = {quantity_of(key) for key in entries}
    is_stopped = "ended" in entries and entries["ended"].text == STOPPED
    said = {"rupture": is_stopped, "end_time": "rupture" in known}.get(quantity, False)
    if quantity in known or said or quantity == "name" or quantity.startswith(("label ", TIME_TO_STRAIN)):
        return ""
    return unknown_text(quantity)


_ROUNDING = 0.01
"""Part of a rupture time by which the duration of the same test may differ."""


def _check_duration(entries: Mapping[str, SourceText]) -> None:
    """Refuse a duration of a test that is not its rupture time."""
    times = {
        quantity: (key, TIME.convert(entry.number(entry.key or key), unit_of(key), entry.location, entry.key or key))
        for key, entry in entries.items()
        if (quantity := quantity_of(key)) in ("rupture", "end_time")
    }
    if "end_time" not in times:
        return
    (rupture, broken), (end, ended) = times["rupture"], times["end_time"]
    if abs(ended - broken) > _ROUNDING * broken:
        one, other = entries[rupture], entries[end]
        raise HistoryError(
            f"{one.location}: '{one.key or rupture}' is {quoted(one.text)}, and '{other.key or end}' is "
            f"{quoted(other.text)}; a test that ruptured lasted until then; correct one of them"
        )
