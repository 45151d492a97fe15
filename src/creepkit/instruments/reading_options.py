"""What a caller says about an instrument's record that the file does not."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from creepkit.checked_arguments import checked
from creepkit.errors import HistoryError, nearest
from creepkit.instruments.column_heads import TIME_UNITS, time_factor
from creepkit.limits import Limits
from creepkit.options import Options, option


@checked
@dataclass(frozen=True)
class RecordOptions(Options, title="options of a record"):
    """What a caller says about a record.

    channels : names of those that are kept; None keeps all. units : {channel:
    unit} of heads without one. pressure_reference : of pressures whose unit does not say. ambient_pressure : MPa, that
    turns absolute pressures into gauge pressures.
    """

    time: str = option("", "Name of the record's column of time.", flag="record-time")
    date: str = option("", "Name of its column of dates.", flag="record-date")
    time_unit: str = option("", "Of its times without a unit: s, ms, min, h.")
    date_order: Literal["month first", "day first", "year first"] | None = option(None, "Of its dates.")
    time_zone: str = option("", "Of its times, as America/Chicago or +01:00.")
    channels: tuple[str, ...] | None = option(None, "Channels that are kept.", python_only=True)
    units: Mapping[str, str] = option(
        dict, "Units of channels whose heads have none.", flag="record-units", example="P1=bar"
    )
    pressure_reference: Literal["gauge", "absolute"] | None = option(None, "Of its pressures.")
    ambient_pressure: float | None = option(
        None, "Taken off absolute pressures.", Limits(0.0, 10.0, whole=False), unit="MPa"
    )

    def __post_init__(self) -> None:
        if self.time_unit and not time_factor(self.time_unit):
            raise HistoryError(f"time_unit is '{self.time_unit}'; {nearest(self.time_unit, TIME_UNITS)}")
