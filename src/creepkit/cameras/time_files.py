"""Times of frames from a file of their own: a column of seconds, or of milliseconds, beside or without others."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import HistoryError, quoted
from creepkit.files.delimited_text import is_number, parse_numbers
from creepkit.readers.text_files import read_text_table
from creepkit.readers.vocabulary import NAMES_OF
from creepkit.records.camera_format import TIME_UNITS, TIMES_ALLOWED, ColumnName

FIRST_UNIX_MILLISECONDS = 1e11
"""Numbers from here on, without a unit, are milliseconds since 1970; in seconds they would be of the year 5138."""


def read_frame_times(path: str | Path) -> Floats:
    """(frames,) s, from the column of times of a table, one row a frame.

    The column is called time, t, timestamp or unix, with its unit, as "time [ms]"; seconds by default, milliseconds
    where numbers are so large that they count from 1970. A single column needs no name.
    """
    table = read_text_table(Path(path).expanduser())
    rows, dialect = table.rows, table.dialect
    head = rows[0].cells
    if dialect.delimiter == " " and all(len(row.cells) == 1 for row in rows[1:]):
        head = [" ".join(head)]  # the blanks are those of a name such as "time [ms]"
    place, body = table.location(rows[0].line), rows
    found = [ColumnName("time", "")] * len(head)
    if not all(is_number(cell, dialect) for cell in head):
        found, body = [ColumnName.of(cell) for cell in head], rows[1:]
    of_time = [
        k for k, one in enumerate(found) if one.name.casefold() in ("time", "t", *NAMES_OF["time"]) or len(found) == 1
    ]
    if len(of_time) != 1:
        names = ", ".join(f"'{quoted(cell)}'" for cell in head[:6])
        raise HistoryError(f"{place}: which of {names} is the time of a frame is not clear; call one column time")
    name = found[of_time[0]]
    if name.unit and name.unit not in TIME_UNITS:
        raise HistoryError(f"{place}: times in '{quoted(name.unit)}'; write them in {TIMES_ALLOWED}")
    if uneven := next((row for row in body if len(row.cells) != len(head)), None):
        cells = f"{len(uneven.cells)} cells in a table of {len(head)} columns"
        raise HistoryError(f"{table.location(uneven.line)}: {cells}")
    texts = [row.cells[of_time[0]] for row in body]
    values = parse_numbers(texts, dialect, lambda k: table.location(body[k].line), name.name)
    since_1970 = not name.unit and values.size > 0 and float(values.min()) > FIRST_UNIX_MILLISECONDS
    return np.asarray(values * (1e-3 if since_1970 else TIME_UNITS[name.unit or "s"]))
