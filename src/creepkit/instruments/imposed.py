"""What an instrument's record says was imposed on one specimen, over the time of its history."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.checked_arguments import checked
from creepkit.errors import HistoryError, nearest, quoted
from creepkit.records import Channel, ClockAlignment, InstrumentRecord, Program
from creepkit.records.presentable import Presentable
from creepkit.records.reading_noise import noise_of_readings
from creepkit.records.recorded_programs import (
    LOAD_RECORD_TOLERANCE,
    TEMPERATURE_RECORD_TOLERANCE,
    recorded_program,
    running_median,
)

REST = 0.02
"""Fraction of its range by which the load leaves its value at rest when the first ramp starts, or LEAST_RISE noises."""


LEAST_RISE = 6.0


MOST_ROWS = 200_000
"""Rows from which a program is made; more are averaged to as many."""


@dataclass(frozen=True, eq=False)
class Imposed(Presentable):
    """What one specimen was under, over the time of its history, which is zero where the first ramp of load starts.

    specimen : its name. channels : of load and temperature. time_zero : s, on the clock of the frames.
    load : MPa (or the load's unit), the difference to the ambient pressure. temperature : K.
    load_error, temperature_error : largest distance of the program from the record's running median of five.
    load_noise, temperature_noise : standard deviations of one reading. alignment : of the clocks.
    notes : one sentence each on what was assumed. temperature_sd : K, standard deviation of the temperature of the
    specimen, where it lies between thermocouples or was seen in the infrared; 0 of one that was measured at it.
    """

    specimen: str
    channels: tuple[str, str]
    time_zero: float
    load: Program
    temperature: Program
    load_error: float
    temperature_error: float
    load_noise: float
    temperature_noise: float
    alignment: ClockAlignment
    notes: tuple[str, ...] = ()
    temperature_sd: float = 0.0

    def lag_error(self, times: Floats, values: Floats) -> Floats:
        """(frames,) standard deviation of an output by what is not known of the lag, over its posterior probability.

        An output D at a time shifted by s is c (P(t + s) - P(t)) + r s away: c is its response to changes of the load P
        between frames by least squares, r the rate of what is left. times : (frames,) s of the history. values :
        (frames,) of the output.
        """
        lags, probability = self.alignment.lags, self.alignment.probability
        if lags.size < 2 or times.size < 2:
            return np.zeros(times.size)
        shifts, loads = lags - probability @ lags, self.load.at(times)
        steps = np.where(np.abs(np.diff(loads)) > REST * np.abs(loads).max(), np.diff(loads), 0.0)
        response = float(steps @ np.diff(values)) / max(float(steps @ steps), 1e-300)
        rate = np.gradient(values - response * loads, times)
        errors = response * (self.load.at(times[:, None] + shifts) - loads[:, None]) + rate[:, None] * shifts
        return np.asarray(np.sqrt(errors**2 @ probability))

    shown_by = "extraction.imposed_text"


@checked
def imposed(
    record: InstrumentRecord,
    specimen: str | tuple[str, str],
    frame_times: ArrayLike,
    alignment: ClockAlignment | None = None,
) -> Imposed:
    """Load and temperature of one specimen on the clock of its frames, as programs of few straight pieces.

    specimen : its name, such as "D1", from which the record's format knows its channels; or the names of the channels
    of load and temperature. frame_times : (frames,) s on the camera's clock, with any zero. alignment : by
    align_clocks; None: both clocks agree, which needs a record and frames with absolute times.

    The programs follow the mean of the record to 0.002 of the largest load and to 0.25 K, or to three standard
    deviations of the noise where these are more.
    """
    times = np.asarray(frame_times, dtype=float)
    if times.ndim != 1 or times.size < 2 or not np.isfinite(times).all() or (np.diff(times) <= 0).any():
        raise HistoryError(f"{record.origin}: the times of the frames must be finite and increase; give at least two")
    if alignment is None:
        if record.start is None or times[0] < 1e8:
            raise HistoryError(
                f"{record.origin}: the clocks of frames and record are not known to agree; give the alignment of "
                "align_clocks(), or ck.ClockAlignment.stated(lag)"
            )
        alignment = ClockAlignment.stated(0.0, zero=record.start)
    names = channel_names(record, specimen) if isinstance(specimen, str) else specimen
    load, temperature = (record.channel(name) for name in names)
    notes = _checked_channels(record, load, temperature)
    _check_overlap(record, alignment, times)
    load_times, loads = _on_camera_clock(record, names[0], alignment, times)
    zero = _start_of_loading(load_times, loads, times)
    size = float(np.abs(loads).max())
    program, load_error = _program(load_times - zero, loads, LOAD_RECORD_TOLERANCE * size)
    warm_times, warm = _on_camera_clock(record, names[1], alignment, times)
    furnace, warm_error = _program(warm_times - zero, warm, TEMPERATURE_RECORD_TOLERANCE)
    return Imposed(
        specimen if isinstance(specimen, str) else "",
        names,
        zero,
        Program(program.times, np.maximum(program.values, 0.0)),
        furnace,
        load_error,
        warm_error,
        noise_of_readings(loads),
        noise_of_readings(warm),
        alignment,
        tuple(notes),
    )


def named_specimens(record: InstrumentRecord, pattern: str = "") -> list[str]:
    """The specimens of which a record has channels of this pattern, by default of the load; [] where it names none."""
    front, _, back = (pattern or record.channel_patterns.get("pressure", "{}")).partition("{}")
    channels = [one for one in record.channels if front + back and one.startswith(front) and one.endswith(back)]
    return [one[len(front) : len(one) - len(back)] for one in channels]


def channel_names(record: InstrumentRecord, specimen: str) -> tuple[str, str]:
    """Channels of load and temperature of a specimen, by the format of the record; HistoryError where there are none.

    >>> channel_names(record, "D1")  # doctest: +SKIP
    ('D1: Press.', 'D1: Temp.')
    """
    patterns = record.channel_patterns
    if not {"pressure", "temperature"} <= {*patterns}:
        raise HistoryError(
            f"{record.origin}: its format does not say which channels belong to '{specimen}'; name them: load, then "
            f"temperature, out of {quoted(', '.join(record.channels), 300)}"
        )
    wanted = (patterns["pressure"].replace("{}", specimen), patterns["temperature"].replace("{}", specimen))
    for name, pattern in zip(wanted, (patterns["pressure"], patterns["temperature"]), strict=True):
        if name not in record.channels:
            known = named_specimens(record, pattern)
            raise HistoryError(
                f"{record.origin}: it has no channel '{name}' of '{specimen}'; {nearest(specimen, known)}"
            )
    return wanted


def _checked_channels(record: InstrumentRecord, load: Channel, temperature: Channel) -> list[str]:
    if temperature.quantity != "temperature":
        raise HistoryError(
            f"{record.origin}: the channel '{temperature.name}' is no temperature"
            f"{f' but in {temperature.written_unit}' if temperature.written_unit else ', for its unit is not stated'}; "
            f"choose another, or state units={{'{temperature.name}': 'C'}} to read_record()"
        )
    if load.quantity == "number":
        raise HistoryError(
            f"{record.origin}: the unit of the channel '{load.name}' is not stated; state "
            f"units={{'{load.name}': 'bar'}} to read_record()"
        )
    if load.quantity == "pressure" and load.reference == "absolute":
        raise HistoryError(
            f"{record.origin}: the channel '{load.name}' holds absolute pressures, and a specimen bulges by the "
            "difference to the ambient pressure; state ambient_pressure=0.1013 (MPa) to read_record()"
        )
    if load.quantity == "pressure" and not load.reference:
        raise HistoryError(
            f"{record.origin}: whether the channel '{load.name}' holds gauge or absolute pressures is not stated; "
            "state pressure_reference='gauge' or 'absolute' to read_record()"
        )
    missing = ((one.missing, one.values.size, one.name) for one in (load, temperature) if one.missing)
    text = "{} of {} readings of '{}' are missing; the program is straight across"
    return [text.format(*one) for one in missing]


def _check_overlap(record: InstrumentRecord, alignment: ClockAlignment, times: Floats) -> None:
    first, last = (float(x) for x in alignment.camera_time(record.times[[0, -1]]))
    slack = 2.0 * float(np.median(np.diff(times))) + record.interval
    if first > times[0] + slack or last < times[-1] - slack:
        raise HistoryError(
            f"{record.origin}: it covers {first:g} to {last:g} s of the camera's clock, the frames {times[0]:g} to "
            f"{times[-1]:g} s; give the whole record, or frames within it"
        )


def _on_camera_clock(
    record: InstrumentRecord, name: str, alignment: ClockAlignment, frame_times: Floats
) -> tuple[Floats, Floats]:
    """(readings,) s on the camera's clock and values, about the frames: from before the first one to the last one."""
    times, values = record.readings(name)
    clock = alignment.camera_time(times)
    span = float(frame_times[-1] - frame_times[0])
    near = (clock >= frame_times[0] - span) & (clock <= frame_times[-1] + 2.0 * float(np.median(np.diff(frame_times))))
    if near.sum() < 2:
        raise HistoryError(f"{record.origin}: channel '{name}' has no readings while there are frames; choose another")
    clock, values = clock[near], values[near]
    if clock.size > MOST_ROWS:
        groups = np.arange(0, clock.size, -(-clock.size // MOST_ROWS))
        counts = np.diff(np.append(groups, clock.size))
        clock, values = np.add.reduceat(clock, groups) / counts, np.add.reduceat(values, groups) / counts
    return clock, values


def _start_of_loading(times: Floats, loads: Floats, frame_times: Floats) -> float:
    """Camera time at which the first ramp starts; that of the first reading where the load is on from the beginning."""
    followed = running_median(loads)
    least = max(REST * float(np.abs(followed).max()), LEAST_RISE * noise_of_readings(loads))
    rest = float(np.median(followed[: max(5, int(0.01 * followed.size))]))
    above = np.flatnonzero(followed > rest + least)
    if rest > 3.0 * least or not above.size:
        return float(max(times[0], min(frame_times[0], times[-1])))
    reached = int(above[0])
    # back along the slope of the ramp to the value at rest
    later = int(np.searchsorted(followed[reached:], rest + 3.0 * least) + reached)
    later = min(max(later, reached + 1), followed.size - 1)
    rise = float(followed[later] - followed[reached])
    slope = rise / float(times[later] - times[reached]) if rise > 0 else np.inf
    start = float(times[reached]) - (float(followed[reached]) - rest) / slope if slope > 0 else float(times[reached])
    quiet = np.flatnonzero(followed[: reached + 1] <= rest + 0.5 * least)
    earliest = float(times[quiet[-1]]) if quiet.size else float(times[0])
    return max(start, earliest)


def _program(times: Floats, values: Floats, tolerance: float) -> tuple[Program, float]:
    """Program from time zero on, and its largest distance from the running median of the readings."""
    later = times >= 0.0
    if later.sum() < 2:
        raise HistoryError("the record ends where the load starts; give a longer one")
    at_zero = float(np.interp(0.0, times, running_median(values)))
    clock, kept = np.append(0.0, times[later & (times > 0.0)]), np.append(at_zero, values[later & (times > 0.0)])
    program = recorded_program(clock, kept, tolerance)
    return program, float(np.abs(program.at(clock) - running_median(kept)).max())
