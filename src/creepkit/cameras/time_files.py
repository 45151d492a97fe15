"""Times of frames from a file of their own: a column of seconds, or of milliseconds, beside or without others."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import HistoryError, quoted
from creepkit.files.delimited_text import is_number
from creepkit.readers.names import NAMES_OF
from creepkit.readers.table import TableRow, named_columns
from creepkit.readers.text_files import read_text_table
from creepkit.records.camera_format import TIME_UNITS, TIMES_ALLOWED, ColumnName

FIRST_UNIX_MILLISECONDS = 1e11
"""Numbers from here on, without a unit, are milliseconds since 1970; in seconds they would be of the year 5138."""


def read_frame_times(path: str | Path) -> Floats:
    """(frames,) s, from the column of times of a table, one row a frame.

    The column is called time, t, timestamp or unix, with its unit, as "time [ms]"; seconds by default, milliseconds
    where numbers are so large that they count from 1970. A single column needs no name.
    """
    table = read_text_table(Path(path).expanduser())
    head, rows = table.rows[0], table.rows[1:]
    if table.dialect.delimiter == " " and all(len(row.cells) == 1 for row in rows):
        head = TableRow(head.line, [" ".join(head.cells)])  # the blanks are those of a name such as "time [ms]"
    if len(head.cells) == 1 and is_number(head.cells[0], table.dialect):
        head, rows = TableRow(head.line, ["time"]), table.rows
    table = named_columns(replace(table, rows=[head, *rows]))
    found = [ColumnName.of(name) for name in table.columns]
    names = ("time", "t", *NAMES_OF["time"])
    of_time = [k for k, one in enumerate(found) if one.name.casefold() in names or len(found) == 1]
    place = table.location(head.line)
    if len(of_time) != 1:
        listed = ", ".join(f"'{quoted(cell)}'" for cell in table.columns[:6])
        raise HistoryError(f"{place}: which of {listed} is the time of a frame is not clear; call one column time")
    name = found[of_time[0]]
    if name.unit and name.unit not in TIME_UNITS:
        raise HistoryError(f"{place}: times in '{quoted(name.unit)}'; write them in {TIMES_ALLOWED}")
    values = table.numbers(table.columns[of_time[0]])
    since_1970 = not name.unit and values.size > 0 and float(values.min()) > FIRST_UNIX_MILLISECONDS
    return np.asarray(values * (1e-3 if since_1970 else TIME_UNITS[name.unit or "s"]))
