"""Remarks in a table: columns of them, rows of text amid frames and below them, and texts beside the named columns."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace

from creepkit.errors import HistoryError, quoted
from creepkit.files.delimited_text import Dialect, float_of, is_number
from creepkit.files.time_stamps import is_clock_time
from creepkit.readers.columns_of_tests import is_number_like, only_text
from creepkit.readers.ends_of_tests import end_said_by, kind_of_column
from creepkit.readers.table import CellTable, SourceText, TableRow, cells_of, cells_of_width
from creepkit.readers.vocabulary import Terms, words_of
from creepkit.readers.weak_sources import conditions_in_text


def tests_named(text: str, names: Sequence[str]) -> set[int]:
    """Which of several tests a text names, perhaps by the first word of their names, as `C3` is of `C3 120 MPa`.

    Numbers and single letters are no names in a text.
    """
    firsts = [name.split(" ")[0] for name in names]
    found = set[int]()
    for k, name in enumerate(names):
        is_first = firsts.count(firsts[k]) == 1 and re.search(r"[^\W\d]", firsts[k]) and re.search(r"\d", firsts[k])
        forms = [form for form in (name, *[firsts[k]] * bool(is_first)) if len(form) > 1 and not form.isdigit()]
        found |= {k} if any(re.search(rf"(?<!\w){re.escape(form)}(?!\w)", text) for form in forms) else set()
    return found


def notes_by_name(entries: Sequence[Mapping[str, SourceText]], names: Sequence[str]) -> Iterator[dict[str, SourceText]]:
    """The entries of each test without the titles and notes that name others of the file, and not this one."""
    shared = {key: one for key, one in entries[0].items() if key.startswith("label ")} if len(names) > 1 else {}
    shared = {key: one for key, one in shared.items() if all(own.get(key) == one for own in entries)}
    named = {key: tests_named(one.text, names) for key, one in shared.items()}
    for k, own in enumerate(entries):
        yield {key: one for key, one in own.items() if not named.get(key) or k in named[key]}


def without_remarks(table: CellTable, notes: dict[str, SourceText], labels: Collection[str] = ()) -> CellTable:
    """The table without columns of remarks, whose texts are added to the notes by line.

    labels : columns of words that are remarks where their cells differ.
    """
    cells = {k: set(cells_of(table.rows, k)) for k in range(len(table.columns))}
    words = [k for k, one in cells.items() if len(one) > 1 and not any(is_number(cell, table.dialect) for cell in one)]
    columns = [k for k in cells if kind_of_column(table.columns[k]) == "remark"]
    columns += [k for k in words if table.columns[k] in labels and k not in columns]
    if not columns:
        return table
    for row in table.rows:
        if text := "; ".join(row.cells[k] for k in columns if row.cells[k]):
            notes[f"label line {row.line}"] = SourceText(text, table.location(row.line))
    return table.keeping([k for k in range(len(table.columns)) if k not in columns])


def rows_beside_notes(
    table: CellTable, rows: Sequence[TableRow], used: Collection[int], notes: dict[str, SourceText]
) -> Iterator[TableRow]:
    """The rows, of as many cells as there are columns in use; texts beside them are added to the notes."""
    width = max(used) + 1
    for row in rows:
        cells = cells_of_width(table, row, width, beside=True)
        foreign = [cell for k, cell in enumerate(cells) if cell and k not in used]
        if number := next((cell for cell in foreign if is_number(cell, table.dialect)), ""):
            what = f"'{quoted(number)}' stands in a column without a name"
            raise HistoryError(f"{table.location(row.line)}: {what}; name it or remove it")
        if foreign:
            notes[f"label beside line {row.line}"] = SourceText("; ".join(foreign), table.location(row.line))
        yield TableRow(row.line, cells[:width])


def without_remarks_around(table: CellTable, notes: dict[str, SourceText], known: Terms) -> tuple[CellTable, list[str]]:
    """The table without texts right of its named columns, which become notes, or remarks amid frames; and these."""
    footers, frames = list[str](), list[TableRow]()
    begins_with_text = [row.cells[0][:1].isalpha() and row.cells[0].lower() not in _LOST for row in table.rows]
    is_numbered = any(is_number(row.cells[0], table.dialect) for row in table.rows[1:2])
    last = next((k for k, is_text in reversed([*enumerate(begins_with_text)]) if not is_text), 0)
    is_footer = [is_numbered and k > last for k in range(len(table.rows))]  # "Mean | 0.3"
    for k, row in enumerate(table.rows):
        after = [one for one in table.rows[k + 1 : k + 6] if not _is_remark(one, table)][:1]
        goes_on = _OF_PAUSE.search(" ".join(row.cells)) or not any(
            _begins_again(table.rows[k - 1], one, table) for one in after
        )
        is_remark = _is_remark(row, table) and goes_on
        if k < 2 or not (is_remark or is_footer[k]):
            frames.append(row)
            continue
        text = " ".join(filter(None, row.cells))
        states = bool(conditions_in_text(text, "", known))
        if states or end_said_by(text):
            notes[f"label {'remark ' * (not states)}line {row.line}"] = SourceText(text, table.location(row.line))
        footers.append(f"line {row.line} is a remark ({quoted(text)})".replace(",", ";"))
    rows, width = list[TableRow](), max((k for k, cell in enumerate(table.rows[0].cells, 1) if cell), default=0)
    for row in frames:
        beside = [cell for cell in row.cells[width:] if cell]
        if not beside or any(is_number(cell, table.dialect) for cell in beside):
            rows.append(row)
            continue
        notes[f"label line {row.line}"] = SourceText("; ".join(beside), table.location(row.line))
        if any(row.cells[:width]):
            rows.append(TableRow(row.line, row.cells[:width]))
    return replace(table, rows=rows), footers


def _begins_again(before: TableRow, after: TableRow, table: CellTable) -> bool:
    """Whether frames of another test follow a row of text: a number that falls, or what is neither it nor a clock."""
    cells = before.cells[0], after.cells[0]
    known = [float_of(cell) for cell in cells if is_number(cell, table.dialect)]
    return known[1] < known[0] if known[1:] else not all(map(is_clock_time, cells))


_OF_PAUSE = re.compile(
    r"restart|resum|reload|pause|interrupt|power|unterbr|fortgesetzt|repris|ripres|riavvi|rean", re.IGNORECASE
)
"""Of a row of text behind which the same test goes on, though its clock may begin anew."""


_LOST = {"nan", "inf", "na", "n/a", "-", "--", "none", "null", "-nan", "-inf"}


def _is_remark(row: TableRow, table: CellTable) -> bool:
    """Whether a row holds one cell of several words, none of them first a number, or `End`; `nan` is a lost number."""
    cells = [cell for cell in row.cells if cell]
    if table.dialect.delimiter == " ":
        cells = [" ".join(cells)]
    if len(cells) != 1 or not cells[0].lstrip("(*#- ")[:1].isalpha():
        return False
    words = cells[0].lower().strip(".:*-= ").split()
    count = sum(word in _LOST for word in words)
    return (len(words) > 1 + 3 * count and count < 2) or words in (["end"], ["eof"])


# ---- around tests in rows --------------------------------------------------------------------------------------------


def is_signed(cell: str, signs: Collection[str]) -> bool:
    """Whether a cell is, begins or ends with one of the signs that a note explains; `()` are brackets around it."""
    return any(cell.startswith(one[0]) if one in ("()", ">") else cell.endswith(one) for one in signs)


STATISTIC = re.compile(
    r"(?:arithm\w* )?(?:mean|averages?|avg|median|sd|s d|std|st\w* ?dev\w*|cov|scatter|min(?:imum)?|max(?:imum)?|range"
    r"|mittel(?:wert)?|durchschnitt|standardabw\w*|stabw|streuung|moy(?:enne)?|[ée]cart type)(?: values?| of .*)?"
)
"""Of a row below tests that is no test."""


def is_statistic(row: TableRow, dialect: Dialect) -> bool:
    """Whether the one text in a row of numbers is that of a statistic of the rows above it."""
    texts = [cell for cell in row.cells if cell and not is_number_like(cell, dialect)]
    return len(texts) == 1 and STATISTIC.fullmatch(words_of(texts[0])) is not None


def is_note(row: TableRow, dialect: Dialect, width: int) -> bool:
    """Whether a row below the tests is one of remarks: it holds texts in one or two cells, and no number."""
    filled = [cell for cell in row.cells if cell]
    few = len(filled) <= 2 < width and not any(is_number_like(cell, dialect) for cell in filled)
    return few or bool(only_text(row, dialect))
