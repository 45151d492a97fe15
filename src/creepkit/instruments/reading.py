"""An instrument's record from its file: the format that accepts it, its channels in MPa, K, mm, its clock."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.errors import HistoryError, nearest, quoted, refuse_unknown
from creepkit.files.time_stamps import DAY, ClockColumn, ResolvedTimes, check_increasing, is_clock_time, resolve
from creepkit.instruments.column_heads import (
    KNOWN_UNITS,
    MINUTES_AND_SECONDS,
    ChannelUnit,
    channel_unit,
    in_other_capitals,
    reference_in_name,
    split_head,
    stated_unit,
    time_factor,
)
from creepkit.instruments.reading_options import RecordOptions
from creepkit.instruments.record_tables import MISSING, RowReader, Rows, TableHead, find_head, means
from creepkit.limits import HOTTEST
from creepkit.readers.names import NAMES_OF
from creepkit.readers.vocabulary import words_of
from creepkit.records import Channel, InstrumentFormat, InstrumentRecord
from creepkit.records.plugin_calls import call_on_file, named_one, only_one

UNIX_SCALES = ((1e17, 1e-9), (1e14, 1e-6), (1e11, 1e-3), (1e8, 1.0))
"""Numbers above the first are unix times in units of the second, s; below 1e8 they are none."""


EARLIEST_UNIX_TIME = 315532800.0
"""s, the beginning of 1980; unix times from then to the next day are believed."""


MOST_VALUES = 60_000_000
"""Readings that are kept: half a gigabyte."""


LIMITS = {"pressure": (-1e5, 1e5), "temperature": (0.0, HOTTEST)}
"""MPa and K beyond which a reading is a fault of the instrument."""


def read_record(
    path: str | Path, formats: Sequence[InstrumentFormat], format: str | None, options: Mapping[str, Any]
) -> InstrumentRecord:
    """The record in a file, read part by part; the public function with this name says what the options are."""
    given, file = RecordOptions().changed(options), Path(path).expanduser()
    return call_on_file(lambda: _record(file, formats, format, given), f"{file}: read_record()")


def _record(
    path: Path, formats: Sequence[InstrumentFormat], format: str | None, given: RecordOptions
) -> InstrumentRecord:
    head = find_head(path)
    chosen = _format_of(head, formats, format)
    columns = _Columns.of(head, chosen, given)
    reader, times, values, lines = RowReader(head), _Times(columns), [], list[Ints]()
    missing, count = MISSING | {*chosen.missing}, 0
    for rows in reader.parts():
        count += len(columns.channels) * rows.lines.size
        if count > MOST_VALUES:
            raise HistoryError(f"{path}: more than {MOST_VALUES} readings; ask for channels=[...]")
        lines.append(rows.lines)
        times.add(rows)
        values.append([rows.readings(one.position, missing) for one in columns.channels])
    if not lines:
        raise HistoryError(f"{head.place}: no rows below the names; a record needs some")
    numbers = np.concatenate(lines)
    resolved = times.resolved(numbers)
    notes = [*resolved.notes]
    if reader.cut:
        notes.append(f"its last line, {reader.cut}, is cut off and was left out")
    elif not reader.has_end:
        notes.append(f"its last line, {numbers[-1]}, has no end; it may be cut off amid a number")
    clock = resolved.times
    first = np.flatnonzero(np.concatenate([[True], np.diff(clock) > 0]))
    if first.size < clock.size:
        notes.append(f"{clock.size - first.size} rows with the time of the row before were averaged with it")
    channels: dict[str, Channel] = {}
    for one, parts in zip(columns.channels, zip(*values, strict=True), strict=True):
        channels[one.name], remarks = one.channel(means(np.concatenate(parts), first), head, chosen, given)
        notes += remarks
    shift = clock[0] if resolved.start is not None else 0.0
    start = None if resolved.start is None else resolved.start + shift
    return InstrumentRecord(
        path.stem, clock[first] - shift, channels, start, chosen.channel_patterns, tuple(notes), str(path)
    )


def _format_of(head: TableHead, formats: Sequence[InstrumentFormat], name: str | None) -> InstrumentFormat:
    if name is not None:
        named = named_one("instrument format", name, formats)
        if not named.accepts(head.names):
            raise HistoryError(f"{head.place}: the format '{name}' wants columns named {', '.join(named.required)}")
        return named
    accepting = [one for one in formats if one.required and one.accepts(head.names)]
    accepting = accepting or [one for one in formats if not one.required][:1]
    if not accepting:
        known_names = ", ".join(one.name for one in formats)
        raise HistoryError(f"{head.path}: no instrument format accepts it; known are {known_names}")
    return only_one("instrument format", head.path, accepting, "format")


@dataclass(frozen=True)
class _Column:
    """A channel's column: its position, its name, and the unit that is written or stated, "" for none."""

    position: int
    name: str
    unit: str

    def channel(
        self, numbers: Floats, head: TableHead, format: InstrumentFormat, options: RecordOptions
    ) -> tuple[Channel, list[str]]:
        """The channel in creepkit's unit, and what was found about it."""
        name, unit = self.name, channel_unit(self.unit) if self.unit else None
        notes = [] if unit else self._unknown_unit(head)
        unit = unit or ChannelUnit("number")
        values = unit.factor * numbers + unit.offset
        reference = unit.reference
        if unit.quantity == "pressure":
            named, stated = reference_in_name(name), options.pressure_reference
            if named and (reference or stated or named) != named:
                other = f"its unit {self.unit}" if reference else "pressure_reference"
                raise HistoryError(
                    f"{head.place}: '{quoted(name, 60)}' is called {named}, while {other} says "
                    f"{reference or stated}; keep one"
                )
            reference = reference or named or stated or format.pressure_reference or ""
            if reference == "absolute" and options.ambient_pressure is not None:
                values, reference = values - options.ambient_pressure, "gauge"
                notes.append(f"{name}: absolute; {options.ambient_pressure:g} MPa of ambient pressure were taken off")
        low, high = LIMITS.get(unit.quantity, (-np.inf, np.inf))
        faults = (values <= low) | (values >= high)
        if faults.any():
            values = np.where(faults, np.nan, values)
            notes.append(f"{name}: {int(faults.sum())} impossible readings are marked as missing")
        if lost := int(np.isnan(values).sum() - faults.sum()):
            notes.append(f"{name}: {lost} of {values.size} readings are missing")
        return Channel(name, unit.quantity, values, reference, self.unit), notes

    def _unknown_unit(self, head: TableHead) -> list[str]:
        """What is to be said of a channel without a known unit; HistoryError where capitals decide, as in mPa."""
        if meant := in_other_capitals(self.unit or self.name):
            what = f"the unit of '{quoted(self.name, 60)}' is {meant} in other capitals; write {meant} into the head"
            raise HistoryError(f"{head.place}: {what} if that is meant")
        return [f"{self.name}: numbers in '{self.unit}', which is not converted"] if self.unit else []


@dataclass(frozen=True)
class _Columns:
    """Which column is what.

    channels : that are kept. times : positions of date and time, or of time alone. time_unit : as it is written or
    stated, "" for none. date_order, time_zone : as they are stated.
    """

    head: TableHead
    channels: tuple[_Column, ...]
    times: tuple[int, ...]
    time_unit: str
    date_order: str
    time_zone: str

    @classmethod
    def of(cls, head: TableHead, format: InstrumentFormat, options: RecordOptions) -> _Columns:
        place, heads = head.place, head.names
        split = [split_head(text) for text in heads]
        names = [name for name, _ in split]
        written = [stated_unit(place, heads[k], unit, head.units[k]) for k, (_, unit) in enumerate(split)]
        plain = ["" if channel_unit(unit) else name for name, unit in zip(names, written, strict=True)]
        stated = [
            _called(place, name, heads, names) for name in (options.date or format.date, options.time or format.time)
        ]
        times = _time_columns(place, heads, plain, stated)
        units = dict(options.units)
        for name, unit in units.items():
            refuse_unknown(name, names, HistoryError, f"{place}: units of '{name}', which is no channel")
            if channel_unit(unit) is None:
                raise HistoryError(f"the unit '{unit}' of '{name}' is not known; {', '.join(KNOWN_UNITS)}")
        channels: list[_Column] = []
        for k in (k for k in range(len(names)) if k not in times):
            name, unit = names[k] or f"column {k + 1}", units.get(names[k], "")
            if unit and written[k] not in ("", unit):
                raise HistoryError(f"{place}: the head of '{name}' states {written[k]}, units= says {unit}; keep one")
            if name in [one.name for one in channels]:
                raise HistoryError(f"{place}: the channel '{quoted(name, 60)}' stands there twice; rename one of them")
            channels.append(_Column(k, name, written[k] or unit or format.unit_of(heads[k])))
        if options.channels is not None:
            by_name = {heads[one.position]: one for one in channels} | {one.name: one for one in channels}
            for name in options.channels:
                if name not in by_name:
                    known = nearest(name, [one.name for one in channels])
                    raise HistoryError(f"{place}: there is no channel '{name}'; {known}")
            channels = [by_name[name] for name in options.channels]
        unit = written[times[-1]]
        return cls(
            head,
            tuple(channels),
            times,
            unit if time_factor(unit) else options.time_unit or format.time_unit,
            options.date_order or format.date_order,
            options.time_zone or format.time_zone,
        )


def _called(place: str, wanted: str, heads: Sequence[str], names: Sequence[str]) -> int | None:
    """Position of the column that is called so; None where no name is given."""
    if not wanted:
        return None
    for known in (heads, names):
        if wanted in known:
            return list(known).index(wanted)
    raise HistoryError(f"{place}: there is no column '{wanted}'; {nearest(wanted, heads)}")


def _time_columns(
    place: str, heads: Sequence[str], names: Sequence[str], stated: Sequence[int | None]
) -> tuple[int, ...]:
    """Position of the column of time, with that of the date in front where there is one.

    names : of columns that may be one of them, "" for the others. stated : of date and time, where they are known.
    """
    plain = [name if name == "T" else words_of(name) for name in names]
    called = (NAMES_OF["date"], ("time", "t", *NAMES_OF["time"]))
    usual = [next((plain.index(one) for one in known if one in plain), None) for known in called]
    both = [by_name if position is None else position for position, by_name in zip(stated, usual, strict=True)]
    found = tuple(dict.fromkeys(k for k in both if k is not None))
    if not found:
        raise HistoryError(
            f"{place}: no column of time among {quoted(', '.join(heads), 200)}; name one time, or state time='its name'"
        )
    for k in found:
        if list(heads).count(heads[k]) > 1:
            raise HistoryError(f"{place}: the column '{quoted(heads[k], 60)}' stands there twice; rename one of them")
    return found


class _Times:
    """The times of a record, part by part: those of a clock where its first cell is one, else numbers."""

    def __init__(self, columns: _Columns) -> None:
        self.columns, self.numbers = columns, list[Floats]()
        self.clock: ClockColumn | None = None

    def add(self, rows: Rows) -> None:
        """Read more rows."""
        times = self.columns.times
        if not self.numbers and (self.clock or is_clock_time(" ".join(rows.texts(k)[0] for k in times))):
            self.clock = self.clock or ClockColumn()
            rows.add_to(self.clock, times)
        else:
            self.numbers.append(rows.numbers(times[-1]))

    def resolved(self, lines: Ints) -> ResolvedTimes:
        """Seconds; those of a column of numbers keep its zero, unless they are unix times."""
        columns, path, place = self.columns, self.columns.head.path, self.columns.head.place
        column = columns.times[-1]
        if self.clock is not None:
            self._check_clock_unit(column)
            return resolve(self.clock, str(path), lines, columns.date_order, columns.time_zone)
        numbers = np.concatenate(self.numbers)
        unix = next((scale for limit, scale in UNIX_SCALES if numbers[0] > limit), None)
        factor = time_factor(columns.time_unit) or unix
        if factor is None:
            raise HistoryError(
                f"{place}: the unit of '{columns.head.names[column]}' is not stated; "
                "write it into its name, such as time_s, or state time_unit='s', 'ms', 'min' or 'h'"
            )
        check_increasing(numbers * factor, str(path), lines)
        start = float(numbers[0] * factor)
        if start <= UNIX_SCALES[-1][0]:
            return ResolvedTimes(numbers * factor, None)
        if factor > 1.0 or not EARLIEST_UNIX_TIME <= start <= time.time() + DAY:
            raise HistoryError(
                f"{path}:{lines[0]}: time begins at {numbers[0]:.15g} {columns.time_unit or 's'}, which is no time "
                "since the start of a record and no unix time (s, ms, us or ns since 1970, from 1980 to today), as "
                "where days are counted from 1900 or seconds from 1904; write dates, or times from the first row on"
            )
        return ResolvedTimes((numbers - numbers[0]) * factor, start)

    def _check_clock_unit(self, column: int) -> None:
        """HistoryError where the head gives a unit to cells that are times of a clock, hours and minutes."""
        head, units = self.columns.head.names[column], self.columns.head.units[column]
        stated = [text for text in (split_head(head)[1], units) if time_factor(text)]
        stated += MINUTES_AND_SECONDS.findall(f"{head[:200]} {units[:40]}")
        if stated:
            raise HistoryError(
                f"{self.columns.head.place}: '{quoted(head, 60)}' is in {stated[0]}, and its first cell is a time of a "
                "clock, hours:minutes; write numbers, or all times as h:mm:ss and the name without a unit"
            )
