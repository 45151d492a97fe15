"""Times of frames from a file of their own: a column of seconds, or of milliseconds, beside or without others."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import HistoryError, quoted
from creepkit.files.delimited_text import decode_text, detect_dialect, is_number, parse_numbers, split_line, text_lines
from creepkit.files.reading import FileKind, read_bytes
from creepkit.records.camera_format import TIME_UNITS, TIMES_ALLOWED, ColumnName

TIME_FILE = FileKind(
    "a table of the times of frames", HistoryError, "name a table of numbers", maximum_bytes=50_000_000
)


TIME_NAMES = ("time", "t", "timestamp", "time stamp", "unix", "unix time", "zeit")


FIRST_UNIX_MILLISECONDS = 1e11
"""Numbers from here on, without a unit, are milliseconds since 1970; in seconds they would be of the year 5138."""


def read_frame_times(path: str | Path) -> Floats:
    """(frames,) s, from the column of times of a table, one row a frame.

    The column is called time, t, timestamp or unix, with its unit, as "time [ms]"; seconds by default, milliseconds
    where numbers are so large that they count from 1970. A single column needs no name.
    """
    file = Path(path).expanduser()
    lines = text_lines(decode_text(read_bytes(file, TIME_FILE), file))
    rows = [
        (number, line) for number, line in enumerate(lines, 1) if line.strip() and not line.lstrip().startswith("#")
    ]
    if not rows:
        raise HistoryError(f"{file}: is empty; write the time of each frame, one a line")
    dialect = detect_dialect([line for _, line in rows], str(file))
    if dialect.delimiter == " " and not any(len(line.split()) > 1 for _, line in rows[1:]):
        table = [[line.strip()] for _, line in rows]  # the blanks are those of a name such as "time [ms]"
    else:
        table = [split_line(line, dialect, f"{file}:{number}") for number, line in rows]
    has_head = not all(is_number(cell, dialect) for cell in table[0])
    column = _column_of_times(file, rows[0][0], table[0]) if has_head else _only_column(file, table[0])
    body, places = table[has_head:], [number for number, _ in rows[has_head:]]
    for cells, number in zip(body, places, strict=True):
        if len(cells) != len(table[0]):
            raise HistoryError(f"{file}:{number}: {len(cells)} cells in a table of {len(table[0])} columns")
    name = ColumnName.of(table[0][column]) if has_head else ColumnName("time", "")
    values = parse_numbers([cells[column] for cells in body], dialect, lambda k: f"{file}:{places[k]}", name.name)
    if name.unit and name.unit not in TIME_UNITS:
        raise HistoryError(f"{file}:{rows[0][0]}: times in '{quoted(name.unit)}'; write them in {TIMES_ALLOWED}")
    since_1970 = not name.unit and values.size > 0 and float(values.min()) > FIRST_UNIX_MILLISECONDS
    return np.asarray(values * (1e-3 if since_1970 else TIME_UNITS[name.unit or "s"]))


def _column_of_times(file: Path, number: int, head: list[str]) -> int:
    found = [k for k, cell in enumerate(head) if ColumnName.of(cell).name.casefold() in TIME_NAMES]
    if len(found) == 1:
        return found[0]
    if not found and len(head) == 1:
        return 0
    names = ", ".join(f"'{quoted(cell)}'" for cell in head[:6])
    raise HistoryError(f"{file}:{number}: which of {names} is the time of a frame is not clear; call one column time")


def _only_column(file: Path, cells: list[str]) -> int:
    if len(cells) > 1:
        raise HistoryError(f"{file}: {len(cells)} columns without names; call the one of times time")
    return 0
