"""LabVIEW measurement files (.lvm) as tables of text: line for line, so that what is said of a line is of the file's.

Two heads end in `***End_of_Header***`: of the file and of each of its segments. Then come the names of the channels and
their rows, each with its X_Value, that of every channel, or none where X0 and Delta_X tell it. Units stand in the line
Y_Unit_Label. What is no name and no row becomes a remark.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime

import numpy as np

from creepkit.arrays import Floats

END_OF_HEADER = "***End_of_Header***"


START = "label start"
"""Key of the entry that says when the file was begun."""


_KEPT = {"Operator": "label operator", "Project": "label project", "Description": "label description"}
"""Lines of the head that say something of the test, and keys of the entries that they become."""


def is_labview(text: str) -> bool:
    """Whether a text is a LabVIEW measurement."""
    return text.lstrip("\ufeff \t").startswith("LabVIEW Measurement")


@dataclass
class _Segment:
    """A part of a file with a head of its own.

    head : {key: cells}. names_at : the line of the names. rows : {line: cells}.
    """

    head: dict[str, list[str]] = field(default_factory=dict)
    names_at: int = -1
    names: list[str] = field(default_factory=list)
    rows: dict[int, list[str]] = field(default_factory=dict)


def table_of_labview(text: str) -> str:
    """The table of a LabVIEW measurement, of as many lines, with time in s as its first column.

    text : with line feeds alone.
    """
    lines = text.split("\n")
    file_head = dict(_key_and_value(line) for line in lines[: _end_of_header(lines)])
    delimiter = "," if file_head.get("Separator", "Tab").casefold() == "comma" else "\t"
    comma = file_head.get("Decimal_Separator", ".").strip() == ","
    segments = list(_segments(lines, delimiter))
    result = [f"# {line.strip().replace(':', '.')}" if line.strip() else "" for line in lines]
    for number, line in enumerate(lines[: _end_of_header(lines)]):
        key, value = _key_and_value(line)
        if key in _KEPT and value:
            result[number] = f"# {_KEPT[key]}: {value}"
    result[0] = "# label format: LabVIEW measurement"
    if not segments:
        return "\n".join(result)
    names, start = _names(segments[0]), _start_of(segments[0])
    result[1] = f"# {START}: {start.isoformat(' ')}" if start and segments[0].names_at > 1 else result[1]
    result[segments[0].names_at] = delimiter.join(["time (s)", *names])
    for segment in segments:
        offset = (later - start).total_seconds() if start and (later := _start_of(segment)) else 0.0
        for number, cells in _rows(segment, len(names), offset, file_head.get("Time_Pref", "")):
            line = delimiter.join(cells)
            result[number] = line.replace(".", ",") if comma and delimiter != "," else line
    return "\n".join(result)


def _key_and_value(line: str) -> tuple[str, str]:
    key, _, value = line.replace(",", "\t", 1).partition("\t") if "\t" not in line else line.partition("\t")
    return key.strip(), value.strip()


def _end_of_header(lines: Sequence[str]) -> int:
    return next((k for k, line in enumerate(lines) if line.strip().startswith(END_OF_HEADER)), len(lines))


def _segments(lines: Sequence[str], delimiter: str) -> Iterator[_Segment]:
    """The segments behind the head of the file; one whose head is lacking goes on with that before."""
    segment = _Segment()
    in_head = True
    for number, line in enumerate(lines[_end_of_header(lines) + 1 :], _end_of_header(lines) + 1):
        cells = [cell.strip() for cell in line.rstrip("\n").split(delimiter)]
        if line.strip().startswith(END_OF_HEADER):
            in_head = False
        elif not any(cells):
            continue
        elif cells[0] == "Channels" and segment.names_at >= 0:
            yield segment
            segment, in_head = _Segment({"Channels": cells[1:]}), True
        elif in_head and cells[0] != "X_Value":
            segment.head[cells[0]] = cells[1:]
        elif cells[0] == "X_Value" or segment.names_at < 0:
            in_head, segment.names_at, segment.names = False, number, cells
        else:
            segment.rows[number] = cells
    if segment.names_at >= 0:
        yield segment


def _channels(segment: _Segment) -> list[int]:
    """Columns of the channels: neither their X_Value nor the comments behind them."""
    return [k for k, name in enumerate(segment.names) if name and name not in ("X_Value", "Comment")]


def _names(segment: _Segment) -> list[str]:
    """Names of the channels with their units, where these do not stand in them."""
    units = segment.head.get("Y_Unit_Label", [])
    written = [segment.names[k] for k in _channels(segment)]
    units = [*units, *[""] * len(written)][: len(written)]
    return [f"{n} ({unit})" if unit and n[-1] not in ")]" else n for n, unit in zip(written, units, strict=True)]


def _start_of(segment: _Segment) -> datetime | None:
    """When the first channel of a segment began."""
    days, times = segment.head.get("Date", [""]), segment.head.get("Time", [""])
    try:
        return datetime.fromisoformat(f"{days[0].replace('/', '-')} {times[0][:15]}")
    except (ValueError, IndexError):
        return None


def _number(text: str) -> float:
    try:
        return float(text.replace(",", "."))
    except ValueError:
        return float("nan")


def _rows(segment: _Segment, count: int, offset: float, preference: str) -> Iterator[tuple[int, list[str]]]:
    """Line, and time and readings, of each row of a segment.

    Channels with times of their own are interpolated to those of the first, unless they are the same.
    """
    channels = _channels(segment)[:count]
    clocks = [k for k, name in enumerate(segment.names) if name == "X_Value"] or [0]
    rows = {number: [*cells, *[""] * len(segment.names)] for number, cells in segment.rows.items()}
    if not rows:
        return
    times = {k: np.array([_number(cells[k]) for cells in rows.values()]) for k in clocks}
    first = times[clocks[0]]
    if np.isnan(first).all():
        origin, step = (_number(segment.head.get(key, ["0"])[0]) for key in ("X0", "Delta_X"))
        first = origin + step * np.arange(len(rows))
    base = first[0] if preference.casefold() == "absolute" else 0.0
    other: Mapping[int, list[str]] = {}
    if len(clocks) > 1:
        other = {k: _interpolated(rows, k, times[max(c for c in clocks if c < k)], first) for k in channels}
    for row, (number, cells) in enumerate(rows.items()):
        if np.isfinite(first[row]):
            values = [other[k][row] if other else cells[k].replace(",", ".") for k in channels]
            yield number, [repr(float(first[row] - base + offset)), *values]


def _interpolated(rows: Mapping[int, Sequence[str]], channel: int, own: Floats, times: Floats) -> list[str]:
    """The readings of a channel, as they stand where its times are the wanted ones, else between them.

    own, times : (rows,) s.
    """
    cells = [row[channel].replace(",", ".") for row in rows.values()]
    if np.array_equal(own, times, equal_nan=True):
        return cells
    values = np.array([_number(cell) for cell in cells])
    known = np.isfinite(values) & np.isfinite(own)
    return [repr(float(value)) for value in np.interp(times, own[known], values[known])]
