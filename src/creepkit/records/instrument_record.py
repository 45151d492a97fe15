"""What instruments recorded during a test: channels of pressure, temperature and others over one clock."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from creepkit.arrays import Floats, frozen, set_fields
from creepkit.checked_arguments import checked
from creepkit.errors import HistoryError, refuse_unknown
from creepkit.records.loading import Program
from creepkit.records.presentable import Plotted, Presentable
from creepkit.records.recorded_programs import recorded_program

GAP_FACTOR = 5.0
"""A gap is an interval between two rows that is longer than so many median intervals."""


@checked
@dataclass(frozen=True, eq=False)
class Channel:
    """One column of an instrument's record.

    name : as in the file, without its unit. quantity : "pressure", "temperature", "length", "force" or "number".
    values : (rows,) MPa, K, mm, N or as written; NaN where nothing was measured.
    reference : of a pressure, "gauge" (its difference to the ambient pressure), "absolute", or "" where that is not
        stated. written_unit : in the file, such as "PSIG".
    """

    name: str
    quantity: str
    values: Floats
    reference: str = ""
    written_unit: str = ""

    def __post_init__(self) -> None:
        values = frozen(self.values)
        if values.ndim != 1 or np.isinf(values).any():
            raise HistoryError(f"channel '{self.name}': its values must be one row of finite numbers, NaN where lost")
        object.__setattr__(self, "values", values)

    @property
    def missing(self) -> int:
        """How many readings are missing."""
        return int(np.isnan(self.values).sum())


@checked
@dataclass(frozen=True, eq=False)
class InstrumentRecord(Presentable, Plotted):
    """Channels that one instrument recorded over one clock.

    times : (rows,) s, strictly increasing, from the record's own zero. channels : {name: channel}.
    start : unix time of time zero, s; None where the file does not say, or not in which time zone.
    channel_patterns : {quantity: name of the channel of a specimen, with {} for the specimen's own name}, such as
        {"pressure": "{}: Press."}.
    notes : one sentence each on what was assumed, lost or left out on reading. source : the file.
    """

    name: str
    times: Floats
    channels: Mapping[str, Channel]
    start: float | None = None
    channel_patterns: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    source: str = ""

    def __post_init__(self) -> None:
        times = frozen(self.times)
        if times.ndim != 1 or not times.size or not np.isfinite(times).all():
            raise HistoryError(f"{self.origin}: a record needs at least one row, and finite times")
        if (np.diff(times) <= 0).any():
            row = int(np.argmax(np.diff(times) <= 0)) + 1
            raise HistoryError(
                f"{self.origin}: time does not increase at row {row + 1} ({times[row]:g} s after {times[row - 1]:g} s)"
            )
        for name, channel in self.channels.items():
            if channel.values.shape != times.shape:
                raise HistoryError(f"{self.origin}: channel '{name}' has {channel.values.size} of {times.size} values")
        channels, patterns = MappingProxyType(dict(self.channels)), MappingProxyType(dict(self.channel_patterns))
        set_fields(self, times=times, channels=channels, channel_patterns=patterns)

    @property
    def origin(self) -> str:
        """The file it was read from, or its name, as errors begin."""
        return self.source or f"record '{self.name}'"

    @property
    def interval(self) -> float:
        """Median interval between rows, s; 0 of a single row."""
        return float(np.median(np.diff(self.times))) if self.times.size > 1 else 0.0

    @property
    def gaps(self) -> Floats:
        """(gaps, 2) s, start and end of each interval without rows, longer than GAP_FACTOR median intervals."""
        first = np.flatnonzero(np.diff(self.times) > GAP_FACTOR * self.interval)
        return np.stack([self.times[first], self.times[first + 1]], axis=1)

    def channel(self, name: str) -> Channel:
        """The channel of a name; HistoryError with the nearest one where there is none."""
        refuse_unknown(name, self.channels, HistoryError, f"{self.origin}: there is no channel '{name}'")
        return self.channels[name]

    def readings(self, name: str) -> tuple[Floats, Floats]:
        """(readings,) s and (readings,) values of a channel, those that are missing left out."""
        values = self.channel(name).values
        measured = ~np.isnan(values)
        if not measured.any():
            raise HistoryError(f"{self.origin}: channel '{name}' holds no reading; choose another one")
        return self.times[measured], values[measured]

    def program(self, channel: str, tolerance: float) -> Program:
        """A channel as a program of few straight pieces over the record's own clock, from its time zero on.

        tolerance : MPa, K or mm by which the program may be off; where three standard deviations of the noise are
            more, that is taken, and the program follows the mean of the noise (see recorded_program). Missing readings
            and gaps are passed by a straight line.
        """
        times, values = self.readings(channel)
        later = times >= 0.0
        if not later.any():
            raise HistoryError(f"{self.origin}: channel '{channel}' holds no reading after time zero")
        return recorded_program(times[later], values[later], tolerance)

    drawn_by = "extraction.record_figure", "extraction.draw_record"

    shown_by = "extraction.record_text"
