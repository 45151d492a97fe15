"""Texts and plots of instruments' records, of the alignment of clocks, and of what was imposed."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import TYPE_CHECKING

import numpy as np

from creepkit.instruments.clock_alignment import UNIX_TIME
from creepkit.records.units import ZERO_CELSIUS, celsius_text
from creepkit.reports.figures import Course, Panels, draw_over_time, over_time

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.instruments.imposed import Imposed
    from creepkit.records import Channel, ClockAlignment, InstrumentRecord

UNITS = {"pressure": "MPa", "temperature": "C", "length": "mm", "force": "N"}


def record_text(record: InstrumentRecord) -> str:
    """Rows, clock, gaps, one line for each channel, and notes."""
    clock = "of unknown date or zone"
    if record.start is not None:
        clock = f"{datetime.fromtimestamp(record.start, UTC):%Y-%m-%d %H:%M:%S} UTC"
    gaps = record.gaps
    lines = [
        f"record '{record.name}': {record.times.size} rows every {record.interval:.6g} s over "
        f"{float(np.ptp(record.times)):.6g} s, time zero {clock}"
    ]
    if gaps.size:
        widest = float(np.diff(gaps, axis=1).max())
        lines.append(f"  {len(gaps)} gap{'s' if len(gaps) > 1 else ''} between rows, the longest of {widest:g} s")
    width = max((len(name) for name in record.channels), default=0)
    lines += [f"  {name:{width}}  {_channel_text(channel)}" for name, channel in record.channels.items()]
    return "\n".join([*lines, *(f"  note: {note}" for note in record.notes)])


def _channel_text(channel: Channel) -> str:
    unit = UNITS.get(channel.quantity, channel.written_unit)
    shift = ZERO_CELSIUS if channel.quantity == "temperature" else 0.0
    what = " ".join(text for text in (channel.reference, channel.quantity) if text)
    if channel.missing == channel.values.size:
        return f"{what}, no reading"
    low, high = float(np.nanmin(channel.values)) - shift, float(np.nanmax(channel.values)) - shift
    lost = f", {channel.missing} readings missing" if channel.missing else ""
    written = f" (written in {channel.written_unit})" if channel.written_unit not in ("", unit) else ""
    return f"{what}, {low:.4g} to {high:.4g} {unit}".rstrip() + written + lost


RECORD_TIME = "time of the record, s"


def record_figure(record: InstrumentRecord) -> Figure:
    """Every channel over time, one panel for each quantity."""
    return over_time(_channels(record), RECORD_TIME)


def draw_record(axes: Axes, record: InstrumentRecord) -> None:
    """The channels of the first quantity over time."""
    draw_over_time(axes, _channels(record), RECORD_TIME)


def _channels(record: InstrumentRecord) -> Panels:
    panels: dict[str, list[Course]] = {}
    for name, channel in record.channels.items():
        shift = ZERO_CELSIUS if channel.quantity == "temperature" else 0.0
        label = ", ".join(filter(None, (channel.quantity, UNITS.get(channel.quantity, ""))))
        panels.setdefault(label, []).append(Course(name, record.times, channel.values - shift))
    return panels or {"": []}


def alignment_text(alignment: ClockAlignment) -> str:
    """The lag with its interval."""
    if not alignment.lags.size:
        return f"clock of the record ahead by {alignment.lag:g} s (stated)"
    low, high = alignment.lag_interval
    return (
        f"clock of the record ahead by {alignment.lag:.4g} s ({low:.4g} to {high:.4g} s, 95 %), from "
        f"{alignment.frames} frames and channel '{alignment.channel}'"
    )


def _camera_time_text(time: float) -> str:
    """A time on the camera's clock, in words; a unix time as a date."""
    if time > UNIX_TIME:
        return f"{datetime.fromtimestamp(time, UTC):%Y-%m-%d %H:%M:%S.%f} UTC of the camera"
    return f"{time:.6g} s of the camera"


def imposed_text(imposed: Imposed) -> str:
    """What was imposed, and how well the programs follow the record."""
    load, warm = imposed.load, imposed.temperature
    lines = [
        f"imposed on {imposed.specimen or 'the specimen'}: '{imposed.channels[0]}' up to {load.values.max():.4g} MPa, "
        f"'{imposed.channels[1]}' {celsius_text(warm.values.min(), warm.values.max())}; the first ramp starts at "
        f"{_camera_time_text(imposed.time_zero)}",
        f"  load: {load.times.size} points, off its record by {imposed.load_error:.2g} MPa at most, noise "
        f"{imposed.load_noise:.2g} MPa",
        f"  temperature: {warm.times.size} points, off its record by {imposed.temperature_error:.2g} K at most, noise "
        f"{imposed.temperature_noise:.2g} K"
        + (f"; at the specimen known to {imposed.temperature_sd:.2g} K" if imposed.temperature_sd else ""),
    ]
    return "\n".join([*lines, *(f"  note: {note}" for note in imposed.notes)])
