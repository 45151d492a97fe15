"""Columns of time: seconds, unix times, times of day, dates in any order, zones."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from datetime import UTC, date, datetime, timedelta, timezone, tzinfo

import numpy as np

from creepkit.arrays import Bools, Floats, Ints
from creepkit.errors import HistoryError, quoted

DAY = 86400.0
EPOCH = date(1970, 1, 1).toordinal()
DATE_ORDERS = ("month first", "day first", "year first")


_STAMP = re.compile(
    r"(?:(?P<date>\d{1,4}[-./]\d{1,2}[-./]\d{1,4}|\d{1,2}[- .][A-Za-z]{3,9}\.?[- ]\d{4})(?:[T,\s]\s*|$))?"
    r"(?:(?P<hour>\d{1,4}):(?P<minute>\d{2})(?::(?P<second>\d{2})(?:[.,:](?P<part>\d{1,12}))?)?"
    r"\s*(?P<half>[AaPp]\.?[Mm]\.?)?\s*(?P<zone>Z|UTC|GMT|[+-]\d{2}:?\d{2})?)?",
    re.ASCII,
)


_DATE = re.compile(r"(\d{1,4})([-./ ])(\d{1,2}|[A-Za-z]{3,9})\.?([-./ ])(\d{1,4})", re.ASCII)


DAYS = re.compile(
    r"(\d{1,5})(?:\.(?=\d\d:\d\d:)| ?(?:d|days?|tage?),? ?)(\d{1,2})((?::\d\d){1,2}(?:[.,]\d+)?)", re.IGNORECASE
)
"""An elapsed time of days and hours, as `1.02:30:00` and `1 day, 2:30:00`."""


_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")


@dataclass
class ClockColumn:
    """A column of clock times, as it is read part by part.

    dates : {text: its number}, in the order in which they come. rows : parts of (rows,), of each row the number of its
    date (-1: none). seconds : parts of (rows,) since midnight. offsets : parts of (rows,) s, of the zone that stands in
    the stamps; NaN without one.
    """

    dates: dict[str, int] = field(default_factory=dict)
    rows: list[Ints] = field(default_factory=list)
    seconds: list[Floats] = field(default_factory=list)
    offsets: list[Floats] = field(default_factory=list)

    def add(self, texts: Sequence[str], locations: Sequence[str]) -> None:
        """Read more rows; HistoryError for the first one that is no clock time."""
        numbers, seconds, offsets = [], [], []
        for k, text in enumerate(texts):
            match = _STAMP.fullmatch(text) if len(text) < 60 else None
            parsed = _parsed(match) if match else None
            if match is None or parsed is None:
                raise HistoryError(
                    f"{locations[k]}: time is '{quoted(text)}'; write a time such as 18:51:22.9, 2025-08-18T18:51:22Z, "
                    "8/18/2025 18:51:22, or a number of seconds"
                )
            day = match["date"]
            numbers.append(-1 if day is None else self.dates.setdefault(day, len(self.dates)))
            seconds.append(parsed[0])
            offsets.append(parsed[1])
        self.rows.append(np.array(numbers, dtype=np.int64))
        self.seconds.append(np.array(seconds))
        self.offsets.append(np.array(offsets))


def is_clock_time(text: str) -> bool:
    """Whether a cell is a time of day, a date with one, a date, or an elapsed time with days."""
    match = _STAMP.fullmatch(text) if 0 < len(text) < 60 else None
    is_stamp = match is not None and (match["hour"] is not None or match["date"] is not None)
    return is_stamp or (":" in text and DAYS.fullmatch(text) is not None)


def _parsed(match: re.Match[str]) -> tuple[float, float] | None:
    """Seconds since midnight, and the offset of the zone, s; None where no clock shows that."""
    if match["hour"] is None:
        return (0.0, np.nan) if match["date"] else None
    hour, minute, second = int(match["hour"]), int(match["minute"]), int(match["second"] or 0)
    half = (match["half"] or "")[:1].lower()
    if minute > 59 or second > 60 or (match["date"] and hour > 24) or (half and not 1 <= hour <= 12):
        return None
    if half:
        hour = hour % 12 + (12 if half == "p" else 0)
    part = match["part"]
    total = 3600.0 * hour + 60.0 * minute + second + (int(part) / 10.0 ** len(part) if part else 0.0)
    zone = match["zone"]
    if zone is None:
        return total, np.nan
    if zone[0] not in "+-":
        return total, 0.0
    shift = 3600.0 * int(zone[1:3]) + 60.0 * int(zone[-2:])
    return (total, -shift if zone[0] == "-" else shift) if shift <= 15 * 3600 else None


@dataclass(frozen=True)
class ResolvedTimes:
    """times : (rows,) s from the first row. start : its unix time, None where the zone or the date is not known."""

    times: Floats
    start: float | None
    notes: tuple[str, ...] = ()


def resolve(column: ClockColumn, path: str, lines: Ints, date_order: str, time_zone: str) -> ResolvedTimes:
    """Clock times as seconds from the first row.

    lines : (rows,) line of each row in the file. date_order : one of DATE_ORDERS, or "" to decide by the dates.
    """
    numbers, seconds = np.concatenate(column.rows), np.concatenate(column.seconds)
    offsets = np.concatenate(column.offsets)
    _check_uniform(numbers >= 0, path, lines, "a date", "dates in all rows or in none")
    zoned = ~np.isnan(offsets)
    _check_uniform(zoned, path, lines, "a time zone", "zones in all rows or in none")
    if zoned[0] and time_zone:
        raise HistoryError(f"{path}: its times state their zone; leave time_zone='{time_zone}' away")
    if numbers[0] < 0:
        return _times_of_day(seconds, path, lines, time_zone)
    days, note = _days(column, numbers, seconds, path, lines, date_order)
    local = (days - days[0])[numbers] * DAY + seconds
    base = float(days[0]) * DAY
    notes = [note] if note else []
    if zoned[0]:
        shift = -offsets
    elif time_zone:
        shift, problem = _shift_of_zone(local, base, path, lines, _zone(time_zone))
        notes += [problem] if problem else []
    else:
        notes.append("its time zone is not stated; time_zone='Europe/Berlin', or '+01:00', states it")
        check_increasing(local, path, lines, "; where clocks were put back for winter, state time_zone")
        return ResolvedTimes(local - local[0], None, tuple(notes))
    universal = local + shift
    check_increasing(universal, path, lines, "")
    return ResolvedTimes(universal - universal[0], base + float(universal[0]), tuple(notes))


def _check_uniform(marks: Bools, path: str, lines: Ints, what: str, advice: str) -> None:
    if marks.any() and not marks.all():
        row = int(np.argmax(marks != marks[0]))
        found = "has" if marks[row] else "lacks"
        raise HistoryError(f"{path}:{lines[row]}: this time {found} {what}, unlike those before; write {advice}")


def check_increasing(times: Floats, path: str, lines: Ints, advice: str = "") -> None:
    """HistoryError where one of times (rows,), s, is before that of the line above it; lines : (rows,) of the file."""
    falls = np.diff(times) < 0
    if falls.any():
        row = int(np.argmax(falls)) + 1
        raise HistoryError(
            f"{path}:{lines[row]}: time falls by {times[row - 1] - times[row]:g} s; it must never decrease{advice}"
        )


def through_midnight(seconds: Floats) -> tuple[Floats, Floats]:
    """(rows,) times of the day, s, that go on where seconds (rows,) begin anew, and (rows,) days from 0 on."""
    later = np.concatenate([[0.0], np.cumsum(np.diff(seconds) < -0.5 * DAY)])
    return seconds + DAY * later, later


def _times_of_day(seconds: Floats, path: str, lines: Ints, time_zone: str) -> ResolvedTimes:
    """Times without a date: one that falls by more than half a day belongs to the next day."""
    if time_zone:
        raise HistoryError(f"{path}: its times of day have no date, so that a time_zone says nothing; leave it away")
    times, later = through_midnight(seconds)
    check_increasing(times, path, lines, " (a time of day may begin anew at midnight only)")
    notes = ["its times of day have no date"]
    if later[-1]:
        notes.append(f"its times of day cross midnight {int(later[-1])} time{'s' if later[-1] > 1 else ''}")
    return ResolvedTimes(times - times[0], None, tuple(notes))


def _days(
    column: ClockColumn, numbers: Ints, seconds: Floats, path: str, lines: Ints, date_order: str
) -> tuple[Ints, str]:
    """(dates,) days since 1970 of each text of a date, and a sentence where its order was decided."""
    first = {n: int(k) for n, k in zip(*np.unique(numbers, return_index=True), strict=True)}
    places = [f"{path}:{lines[first[n]]}" for n in range(len(column.dates))]
    orders = [date_order] if date_order else list(DATE_ORDERS)
    possible: dict[str, Ints] = {}
    problem = ""
    for order in orders:
        ordinals = [_ordinal(text, order) for text in column.dates]
        if None in ordinals:
            k = ordinals.index(None)
            found = quoted(list(column.dates)[k], 30)
            problem = f"{places[k]}: '{found}' is no date{f' with the {order}' if date_order else ''}"
        else:
            possible[order] = np.array([day for day in ordinals if day is not None], dtype=np.int64) - EPOCH
    if not possible:
        raise HistoryError(f"{problem}; write dates such as 2025-08-18")
    values = list(possible.values())
    if all(np.array_equal(values[0], other) for other in values[1:]):
        note = "" if date_order or len(possible) > 1 else f"its dates have the {next(iter(possible))}"
        return values[0], note
    gaps = [np.diff((days - days[0])[numbers] * DAY + seconds) for days in values]
    plausible = [bool((gap >= 0).all() and gap.max(initial=0.0) < 7 * DAY) for gap in gaps]
    if sum(plausible) == 1 and len(column.dates) > 1:
        k = plausible.index(True)
        return values[k], f"its dates have the {list(possible)[k]}, for only so its rows follow each other"
    text = next(iter(column.dates))
    raise HistoryError(
        f"{places[0]}: the date '{text}' may have {_either(possible)} first, and no other row tells; state "
        f"date_order, {' or '.join(repr(order) for order in possible)}"
    )


def _either(orders: Iterable[str]) -> str:
    return " or ".join(f"the {order.removesuffix(' first')}" for order in orders)


def _ordinal(text: str, order: str) -> int | None:
    """Day of a date; None where there is no such day."""
    match = _DATE.fullmatch(text)
    if match is None:
        return None
    a, sign, b, _, c = match.groups()
    if len(a) == 4:
        year, month, day = int(a), b, int(c)
    elif order == "year first":  # 25-08-18; what ends with four digits, or has points, is not written so
        if len(c) > 2 or sign == ".":
            return None
        year, month, day = int(a), b, int(c)
    elif b.isdigit() and order == "month first" and sign != ".":
        year, month, day = int(c), a, int(b)
    else:
        year, month, day = int(c), b, int(a)
    number = (
        int(month) if month.isdigit() else _MONTHS.index(month[:3].lower()) + 1 if month[:3].lower() in _MONTHS else 0
    )
    if len(a) < 3 and len(c) < 3:
        year += 2000
    try:
        return date(year, number, day).toordinal() if year >= 1970 else None
    except ValueError:
        return None


def _zone(name: str) -> tzinfo:
    from zoneinfo import ZoneInfo

    if match := re.fullmatch(r"(?:UTC)?([+-])(\d{1,2}):?(\d{2})?", name, re.ASCII):
        shift = timedelta(hours=int(match[2]), minutes=int(match[3] or 0))
        if shift <= timedelta(hours=15):
            return timezone(-shift if match[1] == "-" else shift)
    try:
        return ZoneInfo(name)
    except (KeyError, ValueError, OSError):  # ZoneInfoNotFoundError is a KeyError
        raise HistoryError(
            f"time_zone is '{quoted(name)}'; write the name of a zone such as 'Europe/Berlin', or '+01:00'"
        ) from None


def _shift_of_zone(local: Floats, base: float, path: str, lines: Ints, zone: tzinfo) -> tuple[Floats, str]:
    """(rows,) s to add to local times for universal ones; in the hour that comes twice, the order of rows decides."""
    slots, inverse = np.unique(np.floor(local / 900.0), return_inverse=True)
    shifts = np.empty((2, slots.size))
    for k, slot in enumerate(slots):
        moment = datetime(1970, 1, 1) + timedelta(seconds=base + 900.0 * float(slot))
        for fold in (0, 1):
            aware = moment.replace(tzinfo=zone, fold=fold)
            offset = aware.utcoffset() or timedelta()
            shifts[fold, k] = -offset.total_seconds()
            back = (moment - offset).replace(tzinfo=UTC).astimezone(zone).replace(tzinfo=None)
            if back != moment:
                row = int(np.argmax(inverse == k))
                raise HistoryError(
                    f"{path}:{lines[row]}: there was no {moment:%H:%M} on {moment:%Y-%m-%d} in {zone}, for clocks were "
                    "put forward; choose the time_zone in which the record was written"
                )
    twice = (shifts[0] != shifts[1])[inverse]
    if not twice.any():
        return shifts[0][inverse], ""
    falls = np.concatenate([[False], np.diff(local) < 0])
    second = twice & (np.cumsum(falls) > 0)
    note = "" if second.any() else "some of its times lie in the hour that comes twice; the first one was taken"
    return np.where(second, shifts[1][inverse], shifts[0][inverse]), note
