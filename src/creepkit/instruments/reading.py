"""An instrument's record from its file: the format that accepts it, its channels in MPa, K, mm, its clock."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.errors import HistoryError, nearest, quoted
from creepkit.files.time_stamps import DAY, ResolvedTimes, resolve
from creepkit.instruments.column_heads import (
    KNOWN_UNITS,
    MINUTES_AND_SECONDS,
    TIME_UNITS,
    ChannelUnit,
    channel_unit,
    near_unit,
    near_unit_of_name,
    reference_in_name,
    split_head,
    stated_unit,
)
from creepkit.instruments.reading_options import RecordOptions
from creepkit.instruments.record_tables import (
    MISSING,
    KeptColumns,
    TableHead,
    block_means,
    ends_with_line_end,
    find_head,
    numbered_lines,
)
from creepkit.limits import HOTTEST
from creepkit.records import Channel, InstrumentFormat, InstrumentRecord
from creepkit.records.plugin_calls import call_on_file

TIME_NAMES = (
    *("time", "timestamp", "time stamp", "datetime", "date time", "date/time", "date and time", "t", "clock", "zeit"),
    *("elapsed", "elapsed time", "unix", "unix time", "epoch", "epoch time", "uhrzeit", "zeitstempel", "test time"),
)
DATE_NAMES = ("date", "datum", "day")
UNIX_SCALES = ((1e17, 1e-9), (1e14, 1e-6), (1e11, 1e-3), (1e8, 1.0))
"""Numbers above the first are unix times in units of the second, s; below 1e8 they are none."""


EARLIEST_UNIX_TIME = 315532800.0
"""s, the beginning of 1980; unix times from then to the next day are believed."""


LARGEST_PRESSURE, TEMPERATURES = 1e5, (0.0, HOTTEST)
"""MPa and K beyond which a reading is a fault of the instrument."""


def read_record(
    path: str | Path, formats: Sequence[InstrumentFormat], format: str | None, options: Mapping[str, Any]
) -> InstrumentRecord:
    """The record in a file, read part by part; the public function with this name says what the options are."""
    given = RecordOptions().changed(options)
    if not isinstance(path, (str, Path)):
        raise HistoryError(f"read_record() takes the path of a file, found {quoted(repr(path))}")
    if format is not None and not isinstance(format, str):
        raise HistoryError(f"format is {quoted(repr(format))}; give the name of an instrument format")
    file = Path(path).expanduser()
    return call_on_file(lambda: _record(file, formats, format, given), f"{file}: read_record()")


def _record(
    path: Path, formats: Sequence[InstrumentFormat], format: str | None, given: RecordOptions
) -> InstrumentRecord:
    parts = numbered_lines(path)
    ahead = next(parts, [])
    head = find_head(path, ahead)
    chosen = _format_of(path, head, formats, format)
    layout = _Layout.of(path, head, chosen, given)
    kept = KeptColumns(path, head, layout.columns, layout.times, given.every, layout.missing)
    for part in parts:
        kept.add(ahead, last=False)
        ahead = part
    kept.add(ahead, last=True)
    return layout.record(kept)


def _format_of(path: Path, head: TableHead, formats: Sequence[InstrumentFormat], name: str | None) -> InstrumentFormat:
    if name is not None:
        known = {one.name: one for one in formats}
        if name not in known:
            raise HistoryError(f"no instrument format is called '{name}'; {nearest(name, known)}")
        if not known[name].accepts(head.names):
            raise HistoryError(
                f"{path}:{head.names_line}: the format '{name}' wants columns named {', '.join(known[name].required)}"
            )
        return known[name]
    accepting = [one for one in formats if one.required and one.accepts(head.names)]
    if len(accepting) > 1:
        raise HistoryError(
            f"{path}: the formats {' and '.join(one.name for one in accepting)} both accept it; say which, format='...'"
        )
    general = [one for one in formats if not one.required]
    if not accepting and not general:
        raise HistoryError(f"{path}: no instrument format accepts it; known are {', '.join(o.name for o in formats)}")
    return (accepting or general)[0]


@dataclass(frozen=True)
class _Layout:
    """Which column is what.

    columns, names, written : positions, names and units of the channels that are kept. times : positions of date
    and time, or of time alone.
    time_unit : of the head or the options, "" where neither says.
    """

    path: Path
    head: TableHead
    format: InstrumentFormat
    options: RecordOptions
    columns: tuple[int, ...]
    names: tuple[str, ...]
    written: tuple[str, ...]
    times: tuple[int, ...]
    time_unit: str

    @classmethod
    def of(cls, path: Path, head: TableHead, chosen: InstrumentFormat, options: RecordOptions) -> _Layout:
        place = f"{path}:{head.names_line}"
        split = [split_head(text) for text in head.names]
        names = [name for name, _ in split]
        written = [stated_unit(place, head.names[k], unit, head.units[k]) for k, (_, unit) in enumerate(split)]
        plain = ["" if channel_unit(unit) else name for name, unit in zip(names, written, strict=True)]
        clock = _named(place, options.time or chosen.time, head.names, names)
        day = _named(place, options.date or chosen.date, head.names, names)
        times = _time_columns(place, head.names, plain, clock, day)
        unit = written[times[-1]]
        seconds = unit if unit in TIME_UNITS else options.time_unit or chosen.time_unit
        channels = [k for k in range(len(names)) if k not in times]
        _check_names(place, [names[k] or f"column {k + 1}" for k in channels])
        units = dict(options.units)
        for name in units:
            if name not in names:
                raise HistoryError(f"{place}: units of '{name}', which is no channel; {nearest(name, names)}")
        for k in channels:
            declared = chosen.unit_of(head.names[k])
            if names[k] in units and written[k] not in ("", units[names[k]]):
                raise HistoryError(
                    f"{place}: the head of '{names[k]}' states {written[k]}, units= says {units[names[k]]}; keep one"
                )
            written[k] = written[k] or units.get(names[k], declared)
            if names[k] in units and channel_unit(units[names[k]]) is None:
                raise HistoryError(
                    f"the unit '{units[names[k]]}' of '{names[k]}' is not known; {', '.join(KNOWN_UNITS)}"
                )
        if options.channels is not None:
            channels = [_position(place, name, head.names, names, channels) for name in options.channels]
        return cls(
            path,
            head,
            chosen,
            options,
            tuple(channels),
            tuple(names[k] or f"column {k + 1}" for k in channels),
            tuple(written[k] for k in channels),
            times,
            seconds,
        )

    @property
    def missing(self) -> frozenset[str]:
        """Texts in the place of a reading."""
        return MISSING | {*self.format.missing, *self.options.missing}

    def record(self, kept: KeptColumns) -> InstrumentRecord:
        """The record of the rows that were read."""
        if not kept.lines:
            raise HistoryError(f"{self.path}:{self.head.names_line}: no rows below the names; a record needs some")
        lines = np.concatenate(kept.lines)
        resolved = self._times(kept, lines)
        notes = [*resolved.notes]
        if kept.incomplete:
            notes.append(f"its last line, {kept.incomplete}, is cut off and was left out")
        elif not ends_with_line_end(self.path):
            notes.append(f"its last line, {lines[-1]}, has no end; it may be cut off amid a number")
        times = block_means(resolved.times, self.options.every)
        if self.options.every > 1:
            notes.append(f"each row is the mean of {self.options.every} rows of the file")
        first = np.flatnonzero(np.concatenate([[True], np.diff(times) > 0]))
        if first.size < times.size:
            notes.append(f"{times.size - first.size} rows with the time of the row before were averaged with it")
        channels: dict[str, Channel] = {}
        for name, written, parts in zip(self.names, self.written, kept.values, strict=True):
            values = np.concatenate(parts)
            if first.size < times.size:
                values = _merged(values, first)
            channels[name], remarks = self._channel(name, written, values)
            notes += remarks
        shift = times[0] if resolved.start is not None else 0.0
        return InstrumentRecord(
            self.path.stem,
            times[first] - shift,
            channels,
            None if resolved.start is None else resolved.start + shift,
            self.format.channel_patterns,
            tuple(notes),
            str(self.path),
        )

    def _times(self, kept: KeptColumns, lines: Ints) -> ResolvedTimes:
        """Seconds; those of a column of numbers keep its zero, unless they are unix times."""
        order = self.options.date_order or self.format.date_order
        zone = self.options.time_zone or self.format.time_zone
        if kept.clock is not None:
            self._check_clock_unit()
            return resolve(kept.clock, str(self.path), lines, order, zone)
        numbers = np.concatenate(kept.numbers)
        factor = TIME_UNITS.get(self.time_unit)
        if factor is None:
            factor = next((scale for limit, scale in UNIX_SCALES if numbers[0] > limit), None)
        if factor is None:
            raise HistoryError(
                f"{self.path}:{self.head.names_line}: the unit of '{self.head.names[self.times[-1]]}' is not stated; "
                "write it into its name, such as time_s, or state time_unit='s', 'ms', 'min' or 'h'"
            )
        falls = np.diff(numbers) < 0
        if falls.any():
            row = int(np.argmax(falls)) + 1
            raise HistoryError(
                f"{self.path}:{lines[row]}: time falls from {numbers[row - 1]:g} to {numbers[row]:g}; it must never "
                "decrease"
            )
        if numbers[0] * factor <= UNIX_SCALES[-1][0]:
            return ResolvedTimes(numbers * factor, None)
        start = float(numbers[0] * factor)
        if factor > 1.0 or not EARLIEST_UNIX_TIME <= start <= time.time() + DAY:
            raise HistoryError(
                f"{self.path}:{lines[0]}: time begins at {numbers[0]:.15g} {self.time_unit or 's'}, which is no time "
                "since the start of a record and no unix time (s, ms, us or ns since 1970, from 1980 to today), as "
                "where days are counted from 1900 or seconds from 1904; write dates, or times from the first row on"
            )
        return ResolvedTimes((numbers - numbers[0]) * factor, start)

    def _check_clock_unit(self) -> None:
        """HistoryError where the head gives a unit to cells that are times of a clock, hours and minutes."""
        column = self.times[-1]
        head = self.head.names[column]
        unit = split_head(head)[1]
        stated = [text for text in (unit, self.head.units[column]) if text in TIME_UNITS]
        stated += MINUTES_AND_SECONDS.findall(f"{head[:200]} {self.head.units[column][:40]}")
        if stated:
            raise HistoryError(
                f"{self.path}:{self.head.names_line}: '{quoted(head, 60)}' is in {stated[0]}, and its first cell is "
                "a time of "
                "a clock, hours:minutes; write numbers, or all times as h:mm:ss and the name without a unit"
            )

    def _channel(self, name: str, written: str, numbers: Floats) -> tuple[Channel, list[str]]:
        """A channel in creepkit's unit, and what was found about it."""
        unit = channel_unit(written) if written else None
        notes = [] if unit else self._unknown_unit(name, written)
        unit = unit or ChannelUnit("number")
        values = unit.factor * numbers + unit.offset
        reference = unit.reference
        if unit.quantity == "pressure":
            named, stated = reference_in_name(name), self.options.pressure_reference
            if named and (reference or stated or named) != named:
                other = f"its unit {written}" if reference else "pressure_reference"
                raise HistoryError(
                    f"{self.path}:{self.head.names_line}: '{quoted(name, 60)}' is called {named}, while {other} says "
                    f"{reference or stated}; keep one"
                )
            reference = reference or named or stated or self.format.pressure_reference or ""
            if reference == "absolute" and self.options.ambient_pressure is not None:
                values, reference = values - self.options.ambient_pressure, "gauge"
                notes.append(
                    f"{name}: absolute; {self.options.ambient_pressure:g} MPa of ambient pressure were taken off"
                )
        low, high = {"pressure": (-LARGEST_PRESSURE, LARGEST_PRESSURE), "temperature": TEMPERATURES}.get(
            unit.quantity, (-np.inf, np.inf)
        )
        with np.errstate(invalid="ignore"):
            faults = (values <= low) | (values >= high)
        if faults.any():
            values = np.where(faults, np.nan, values)
            notes.append(f"{name}: {int(faults.sum())} impossible readings are marked as missing")
        lost = int(np.isnan(values).sum() - faults.sum())
        if lost:
            notes.append(f"{name}: {lost} of {values.size} readings are missing")
        return Channel(name, unit.quantity, values, reference, written), notes

    def _unknown_unit(self, name: str, written: str) -> list[str]:
        """What is to be said of a channel without a known unit; HistoryError where capitals decide, as in mPa."""
        found, meant = (written, near_unit(written)) if written else near_unit_of_name(name)
        if found.lower() == meant.lower() and len(meant) > 1:
            advice = "" if written else f", or state units={{'{quoted(name, 60)}': '{meant}'}}"
            raise HistoryError(
                f"{self.path}:{self.head.names_line}: '{found}' in the head of '{quoted(name, 60)}' is no unit; "
                f"write {meant} "
                f"into the head if that is meant{advice}"
            )
        if meant:
            return [
                f"{name}: taken for numbers without a unit; if '{found}' means {meant}, write {meant} into the head"
            ]
        return [f"{name}: numbers in '{written}', which is not converted"] if written else []


def _named(place: str, wanted: str, heads: Sequence[str], names: Sequence[str]) -> int | None:
    """Position of the column that is called so; None where no name is given."""
    if not wanted:
        return None
    for known in (heads, names):
        if wanted in known:
            return list(known).index(wanted)
    raise HistoryError(f"{place}: there is no column '{wanted}'; {nearest(wanted, heads)}")


def _time_columns(
    place: str, heads: Sequence[str], names: Sequence[str], clock: int | None, day: int | None
) -> tuple[int, ...]:
    """Position of the column of time, with that of the date in front where there is one.

    names : of columns that may be one of them, "" for the others. clock, day : where they are known.
    """
    plain = [name if name == "T" else name.lower().replace("_", " ").strip() for name in names]
    if clock is None:
        clock = next((plain.index(one) for one in TIME_NAMES if one in plain), None)
    if day is None:
        day = next((plain.index(one) for one in DATE_NAMES if one in plain), None)
    found = tuple(dict.fromkeys(k for k in (day, clock) if k is not None))
    if not found:
        raise HistoryError(
            f"{place}: no column of time among {quoted(', '.join(heads), 200)}; name one time, or state time='its name'"
        )
    for k in found:
        if list(heads).count(heads[k]) > 1:
            raise HistoryError(f"{place}: the column '{quoted(heads[k], 60)}' stands there twice; rename one of them")
    return found


def _position(place: str, wanted: str, heads: Sequence[str], names: Sequence[str], channels: Sequence[int]) -> int:
    for known in (names, heads):
        for k in channels:
            if known[k] == wanted:
                return k
    raise HistoryError(f"{place}: there is no channel '{wanted}'; {nearest(str(wanted), [names[k] for k in channels])}")


def _check_names(place: str, names: Sequence[str]) -> None:
    seen: set[str] = set()
    for name in names:
        if name in seen:
            raise HistoryError(f"{place}: the channel '{quoted(name, 60)}' stands there twice; rename one of them")
        seen.add(name)


def _merged(values: Floats, first: Ints) -> Floats:
    """Means of the rows of equal time."""
    seen = ~np.isnan(values)
    counts = np.add.reduceat(seen.astype(float), first)
    sums = np.add.reduceat(np.where(seen, values, 0.0), first)
    return np.asarray(np.divide(sums, counts, out=np.full(counts.size, np.nan), where=counts > 0))
