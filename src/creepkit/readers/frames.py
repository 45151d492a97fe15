"""The frames of a test: columns as arrays in creepkit's units, in increasing time."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.errors import HistoryError, nearest
from creepkit.readers.tables import TextTable
from creepkit.readers.units import QuantityKind, split_unit
from creepkit.readers.words import HeaderVocabulary


@dataclass(frozen=True)
class Frames:
    """The frames of one test.

    values : {quantity: (frames,)} in MPa, mm, s, K; "time" is among them and increases strictly.
    lines : (frames,) the line of the file in which each frame stands.
    merged : number of frames that were merged into another one of the same time.
    """

    path: Path
    values: Mapping[str, Floats]
    lines: Ints
    merged_count: int = 0

    @property
    def times(self) -> Floats:
        """(frames,) s."""
        return self.values["time"]

    def location(self, frame: int) -> str:
        """Where a frame stands, 'file:line'."""
        return f"{self.path}:{self.lines[frame]}"


def read_frames(table: TextTable, vocabulary: HeaderVocabulary, skipped_columns: Collection[str] = ()) -> Frames:
    """Read the frames in a table, except the columns in `skip` and those that are averaged to labels."""
    kinds = vocabulary.column_kinds
    ignored = {*skipped_columns, *(name for names in vocabulary.averaged_columns.values() for name in names)}
    values: dict[str, Floats] = {}
    for name in table.columns:
        if name not in ignored:
            quantity, suffix = _parsed_column(table, vocabulary.synonyms.get(name, name), kinds)
            if quantity in values:
                raise HistoryError(f"{table.location(table.columns_line)}: two columns hold the {quantity}; keep one")
            values[quantity] = _converted_column(table, name, kinds[quantity], suffix)
    if "time" not in values:
        place, result = table.location(table.columns_line), ", ".join(table.columns)
        raise HistoryError(f"{place}: missing column: no time among {result}; name one time_s, time_min or time_h")
    return _strictly_increasing(Frames(table.path, values, np.array([row.line for row in table.rows])))


def column_means(table: TextTable, vocabulary: HeaderVocabulary) -> dict[str, str]:
    """The labels that are means over all frames of some columns, with two decimals."""
    return {label: f"{np.mean([table.numbers(name) for name in names]):.2f}" for label, names in vocabulary.averaged_columns.items()}


def _parsed_column(table: TextTable, name: str, kinds: Mapping[str, QuantityKind]) -> tuple[str, str]:
    """Quantity and unit suffix of a column."""
    location = table.location(table.columns_line)
    result = split_unit(name, kinds)
    if result is None:
        raise HistoryError(f"{location}: column '{name}' is not understood; {nearest(name, kinds)}")
    quantity, suffix = result
    kinds[quantity].unit(suffix, location, name)
    return result


def _converted_column(table: TextTable, name: str, kind: QuantityKind, suffix: str) -> Floats:
    """One column in creepkit's unit."""
    locations = (table.location(row.line) for row in table.rows)
    return np.array(
        [kind.convert(x, suffix, place, name) for x, place in zip(table.numbers(name), locations, strict=True)]
    )


def _strictly_increasing(frames: Frames) -> Frames:
    """Refuse a time that falls; merge frames of equal time into their mean.

    A clock that is coarser than the recording, or a last reading at rupture, gives several frames one time. Their
    mean favours none of them; how many were merged is kept.
    """
    time_differences = np.diff(frames.times)
    if (time_differences < 0).any():
        k = int(np.argmax(time_differences < 0)) + 1
        before, after = frames.times[k - 1], frames.times[k]
        raise HistoryError(f"{frames.location(k)}: time falls from {before:g} s to {after:g} s; it must never decrease")
    first = np.flatnonzero(np.concatenate(([True], time_differences > 0)))
    counts = np.diff(np.append(first, frames.times.size))
    values = {name: np.add.reduceat(column, first) / counts for name, column in frames.values.items()}
    if first.size < 2:
        raise HistoryError(f"{frames.location(0)}: only one frame in time; at least two are needed to identify a law")
    return Frames(frames.path, values, frames.lines[first], frames.times.size - first.size)
