"""Several tables of tests in one sheet: below one another, and side by side with a blank column between or without.

    Alloy X, heat H4
    Minimum creep rate             |        | Rupture 650 °C           | Rupture 700 °C           |
    T (°C) | Stress (MPa) | rate (%/h) |    | Stress (MPa) | t_r (h)   | Stress (MPa) | t_r (h)   |

Each has the titles above its own columns, and those that stand alone above or below all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

from creepkit.readers.columns_of_tests import (
    SEARCHED,
    TEXTS,
    column_called,
    head_of_tests,
    is_measured,
    is_number_like,
    is_test_table,
    only_text,
)
from creepkit.readers.table import CellTable, TableRow, with_columns


def separate_tables(table: CellTable, meant: Mapping[str, str]) -> list[CellTable]:
    """The tables of tests in a table, whose `positions` are those of their columns; else the table alone.

    meant : {name as written: what it is} of columns that were named otherwise.
    """
    return [part for section in _below_one_another(table, meant) for part in _side_by_side(section, meant)]


def _below_one_another(table: CellTable, meant: Mapping[str, str]) -> list[CellTable]:
    """The tables with other names of columns below one another, each from the titles directly above its names on."""
    rows, starts, seen, has_tests = table.rows, [0], set[tuple[str, ...]](), False
    for k, row in enumerate(rows):
        if _holds_numbers(row, table):
            has_tests |= bool(seen)
        elif is_test_table([meant.get(cell, cell) for cell in row.cells], rows[k + 1 : k + SEARCHED]):
            start = k
            while rows[start].line - rows[start - 1].line == 1 and not _holds_numbers(rows[start - 1], table):
                start -= 1
            starts += [start] if has_tests and tuple(row.cells) not in seen else []
            seen.add(tuple(row.cells))
            has_tests = False
    ends = pairwise([*starts, len(rows)])
    return [replace(table, rows=rows[start:end]) for start, end in ends] if len(starts) > 1 else [table]


def _holds_numbers(row: TableRow, table: CellTable) -> bool:
    return any(is_number_like(cell, table.dialect) for cell in row.cells if cell)


def _side_by_side(table: CellTable, meant: Mapping[str, str]) -> list[CellTable]:
    """The tables of tests beside one another in a table; else the table alone."""
    width = max(len(row.cells) for row in table.rows)
    starts = _starts_of_tables(table, meant, width)
    ends = pairwise([*starts, width]) if len(starts) > 1 else ()
    whole = [start for start, end in ends if _head_line(table, range(start, end), meant)]
    parts = [range(*ends) for ends in pairwise([0, *whole[1:], width])]
    lines = [_head_line(table, part, meant) for part in parts] if len(parts) > 1 else [0]
    return [_part(table, part, _rows_of_all(table, lines)) for part in parts] if all(lines) else [table]


def _head_line(table: CellTable, part: range, meant: Mapping[str, str]) -> int:
    """The line in which the head of a table of tests in some columns begins; 0 where they are none."""
    own = _part(table, part, ())
    head = head_of_tests(own, meant)
    return own.rows[head.first].line if head else 0


def _part(table: CellTable, part: range, shared: Sequence[TableRow]) -> CellTable:
    """Some columns of a table, and the rows that it shares with the others."""
    own = {row.line: row for row in with_columns(table.rows, part) if any(row.cells)}
    lines = {**{row.line: row for row in shared}, **own}
    return replace(table, rows=[lines[line] for line in sorted(lines)], positions=part)


def _rows_of_all(table: CellTable, lines: Sequence[int]) -> list[TableRow]:
    """What stands alone in a row above all tables, or below their numbers; lines : in which their heads begin.

    A title directly above the names of the first is of that alone where the names of others stand in other rows.
    """
    first = min(k for row in table.rows for k, cell in enumerate(row.cells) if cell)
    alone = [row for row in table.rows if any(row.cells[: first + 1]) and only_text(row, table.dialect)]
    last = max(row.line for row in table.rows if _holds_numbers(row, table))
    is_level = len(set(lines)) == 1
    above = [row for row in alone if row.line < min(lines) and (is_level or row.line != lines[0] - 1)]
    return above + [row for row in alone if row.line > last]


def _starts_of_tables(table: CellTable, meant: Mapping[str, str], width: int) -> list[int]:
    """Columns with which tables side by side may begin: behind a blank one, or where a quantity comes again.

    Names, stresses or temperatures between a result and what comes again begin the next table, if the one before has
    others.
    """
    quantities = [_quantity_of_column(table, k, meant) for k in range(width)]
    blank, starts = [_is_blank(table.rows, k) for k in range(width)], [0]
    for k in range(1, width):
        seen, start = quantities[starts[-1] : k], k
        if blank[k - 1] and not blank[k]:
            starts.append(k)
        elif quantities[k] and quantities[k] in seen:
            while quantities[start - 1] in ("name", *_CONDITIONS) and {*seen[: start - k - 1]} & _CONDITIONS:
                start -= 1
            starts.append(start)
    return starts


_CONDITIONS = frozenset(("stress", "temperature"))


def _is_blank(rows: Sequence[TableRow], k: int) -> bool:
    """Whether a column holds nothing but what merged cells of titles reach into it."""
    return not any(row.cells[k] and row.cells[k] != "".join(row.cells[k - 1 : k]) for row in rows if k < len(row.cells))


def _quantity_of_column(table: CellTable, k: int, meant: Mapping[str, str]) -> str:
    """The quantity that the text nearest above the first number of a column names; of a column of texts its name."""
    found = list[str]()
    for row in table.rows[:SEARCHED]:
        cell = row.cells[k] if k < len(row.cells) else ""
        if found and cell and is_measured(cell, table.dialect):
            return found[-1]
        found += [one] if cell and (one := column_called(meant.get(cell, cell)).quantity) else []
    return next((one for one in found if one in TEXTS), "".join(found[:1]))
