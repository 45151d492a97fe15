"""Columns of time that hold no numbers: elapsed times `1:02:30`, and time stamps, as seconds.

An elapsed time counts from the beginning of the test. Of time stamps and times of day the first row is time zero, which
is recorded in the label "assumed". `18:51:22` may be either: the name of the column decides, `Elapsed time (h:mm:ss)`
or `Time of day`, or the values: elapsed are times that begin below one hour or pass 24 hours.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import HistoryError, quoted
from creepkit.files.time_stamps import DATE_ORDERS, DAY, ClockColumn, is_clock_time, resolve
from creepkit.readers.column_names import split_unit, words_of
from creepkit.readers.table import CellTable, NumberRows, SourceText, TableRow, cells_of
from creepkit.readers.vocabulary import Terms

_ELAPSED = re.compile(r"(\d{1,6}):([0-5]\d):([0-5]\d(?:[.,]\d{1,9})?)", re.ASCII)


_ELAPSED_NAME = re.compile(r"elapsed|test time|creep time|laufzeit|h:mm|\[h|hh:mm|h:m", re.IGNORECASE)


_OF_DAY = ("time of day", "clock", "clock time", "uhrzeit")


def with_elapsed_times(stated: dict[str, SourceText], table: CellTable, known: Terms) -> CellTable:
    """The table with its times as numbers; takes `date_order` and `time_zone` from what is stated."""
    order, zone = stated.pop("date_order", None), stated.pop("time_zone", None)
    if order is not None and order.text not in DATE_ORDERS:
        raise HistoryError(f"{order.location}: date_order is '{quoted(order.text)}'; allowed: {', '.join(DATE_ORDERS)}")
    times = [k for k, name in enumerate(table.columns) if known.quantity(name) == "time"]
    if len(times) != 1 or isinstance(table.rows, NumberRows) or not is_clock_time(table.rows[0].cells[times[0]]):
        if order is not None or zone is not None:
            key, entry = ("date_order", order) if order is not None else ("time_zone", zone)
            assert entry is not None
            raise HistoryError(f"{entry.location}: {key} says nothing here, for no times are dates; leave it out")
        return table
    clock = times[0]
    cells = list(cells_of(table.rows, clock))
    elapsed = [_ELAPSED.fullmatch(cell) for cell in cells]
    if elapsed[0]:
        hours, assumption = _times_of(elapsed, table, clock)
    else:
        hours, assumption = _since_first_row(cells, table, order.text if order else "", zone.text if zone else "")
    written = table.as_written(clock)
    columns = list(table.columns)
    suffix = (split_unit(columns[clock], known.columns.kinds) or ("", ""))[1]
    if suffix in known.columns.kinds["time"].units and suffix:
        place = table.location(table.columns_line, clock)
        raise HistoryError(
            f"{place}: '{written}' is in {suffix}, and its first cell is '{quoted(cells[0])}', a time of a clock; "
            "leave "
            "the unit out of the name, or write numbers"
        )
    columns[clock] = "time_s"
    rows = list(_with_times(table, clock, hours))
    assumptions = (*table.assumptions, *([assumption] if assumption else []))
    return replace(table, columns=columns, rows=rows, written=table.written or table.columns, assumptions=assumptions)


def _with_times(table: CellTable, clock: int, times: Floats) -> Iterator[TableRow]:
    """The rows with other times, s."""
    for row, time in zip(table.rows, times, strict=True):
        changed = list(row.cells)
        changed[clock] = repr(float(time)).replace(".", table.dialect.decimal)
        yield TableRow(row.line, changed)


def _times_of(elapsed: Sequence[re.Match[str] | None], table: CellTable, clock: int) -> tuple[Floats, str]:
    """(rows,) s of times h:mm:ss, elapsed or of the day, and what was assumed of them."""
    seconds, name = [], table.as_written(clock)
    for row, match in zip(table.rows, elapsed, strict=True):
        if match is None:
            place = table.location(row.line, clock)
            raise HistoryError(
                f"{place}: '{name}' is '{quoted(row.cells[clock])}'; write h:mm:ss as in the rows before"
            )
        seconds.append(3600.0 * int(match[1]) + 60.0 * int(match[2]) + float(match[3].replace(",", ".")))
    times = np.array(seconds)
    if words_of(name) in _OF_DAY:
        later = np.concatenate([[0.0], np.cumsum(np.diff(times) < -0.5 * DAY)])
        times = times + DAY * later
        return times - times[0], f"time since the first row at {table.rows[0].cells[clock]}"
    if _ELAPSED_NAME.search(name):
        return times, ""
    if times[0] < 3600.0 or times.max() >= DAY:
        return times, f"times such as {table.rows[-1].cells[clock]} elapsed"
    place = table.location(table.columns_line, clock)
    raise HistoryError(
        f"{place}: '{name}' begins at {table.rows[0].cells[clock]}, which may be elapsed or of the day; name the "
        "column 'Elapsed time (h:mm:ss)' or 'Time of day'"
    )


def _since_first_row(cells: Sequence[str], table: CellTable, order: str, zone: str) -> tuple[Floats, str]:
    """(rows,) s of time stamps since that of the first row, and what was assumed of them."""
    column = ClockColumn()
    column.add(cells, [table.location(row.line) for row in table.rows])
    if -1 in column.rows[0]:
        k = int(np.argmax(column.rows[0] == -1))
        place = table.location(table.rows[k].line)
        raise HistoryError(f"{place}: time is '{quoted(cells[k])}'; write h:mm:ss, a date with a time, or a number")
    place = f"{table.path}, sheet '{table.sheet}', row" if table.sheet else str(table.path)
    times = resolve(column, place, table.lines, order, zone)
    notes = [note.removeprefix("its ") for note in times.notes if note.startswith("its dates")]
    return times.times, "; ".join([f"time since the first row at {cells[0]}", *notes]).replace(",", " -")
