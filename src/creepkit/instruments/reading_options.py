"""What a caller says about an instrument's record that the file does not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, TypedDict

from creepkit.errors import HistoryError, nearest, quoted
from creepkit.files.time_stamps import DATE_ORDERS
from creepkit.instruments.column_heads import TIME_UNITS


class RecordOptions(TypedDict, total=False):
    """Keywords of read_record(), which are the fields of ReadingOptions."""

    time: str
    date: str
    time_unit: str
    date_order: str
    time_zone: str
    channels: Sequence[str] | None
    every: int
    units: Mapping[str, str]
    pressure_reference: str
    ambient_pressure: float | None
    missing: Sequence[str]


@dataclass(frozen=True)
class ReadingOptions:
    """What a caller says about a record.

    time, date : names of their columns. time_unit : "s", "ms", "min", "h" of times without a unit. date_order : "month
    first", "day first" or, of years of two digits, "year first". time_zone : such as "America/Chicago" or "+01:00".
    channels : names of those that are kept; None keeps all. every : rows that are averaged to one. units : {channel:
    unit} of heads without one. pressure_reference : "gauge" or "absolute", of pressures whose unit does not say.
    ambient_pressure : MPa, that turns absolute pressures into gauge pressures. missing : texts that mean a lost
    reading, beside the usual ones.
    """

    time: str = ""
    date: str = ""
    time_unit: str = ""
    date_order: str = ""
    time_zone: str = ""
    channels: Sequence[str] | None = None
    every: int = 1
    units: Mapping[str, str] = field(default_factory=dict)
    pressure_reference: str = ""
    ambient_pressure: float | None = None
    missing: Sequence[str] = ()

    def __post_init__(self) -> None:
        self._check_types()
        if isinstance(self.every, bool) or not isinstance(self.every, int) or not 1 <= self.every <= 100_000:
            raise HistoryError(f"every={quoted(repr(self.every))}; give a number of rows from 1 to 100000")
        if self.pressure_reference not in ("", "gauge", "absolute"):
            raise HistoryError(f"pressure_reference is '{self.pressure_reference}'; write 'gauge' or 'absolute'")
        if self.ambient_pressure is not None and not 0.0 <= self.ambient_pressure <= 10.0:
            raise HistoryError(f"ambient_pressure is {self.ambient_pressure} MPa; give 0 to 10, such as 0.1013")
        if self.time_unit and self.time_unit not in TIME_UNITS:
            raise HistoryError(f"time_unit is '{self.time_unit}'; {nearest(self.time_unit, TIME_UNITS)}")
        if isinstance(self.channels, str):
            raise HistoryError(
                f"channels is '{quoted(self.channels)}'; give a list of names: channels=['{quoted(self.channels)}']"
            )

    def _check_types(self) -> None:
        for name in ("time", "date", "time_unit", "date_order", "time_zone", "pressure_reference"):
            if not isinstance(getattr(self, name), str):
                raise HistoryError(f"{name} is {quoted(repr(getattr(self, name)))}; give a text")
        if not isinstance(self.units, Mapping) or not all(isinstance(unit, str) for unit in self.units.values()):
            raise HistoryError(f"units is {quoted(repr(self.units))}; give {{channel: unit}}, such as {{'P1': 'bar'}}")
        if isinstance(self.missing, str) or not isinstance(self.missing, Sequence):
            raise HistoryError(f"missing is {quoted(repr(self.missing))}; give a list of texts, such as ['n.a.']")
        if not all(isinstance(text, str) for text in self.missing):
            raise HistoryError(f"missing is {quoted(repr(self.missing))}; give a list of texts, such as ['n.a.']")
        if self.channels is not None and not isinstance(self.channels, Sequence):
            raise HistoryError(f"channels is {quoted(repr(self.channels))}; give a list of names")
        ambient = self.ambient_pressure
        if ambient is not None and (isinstance(ambient, bool) or not isinstance(ambient, (int, float))):
            raise HistoryError(f"ambient_pressure is {quoted(repr(ambient))}; give a number of MPa, such as 0.1013")
        if self.date_order and self.date_order not in DATE_ORDERS:
            raise HistoryError(
                f"date_order is '{quoted(self.date_order)}'; write {' or '.join(map(repr, DATE_ORDERS))}"
            )

    @classmethod
    def of(cls, options: Mapping[str, Any]) -> ReadingOptions:
        """Options by name; HistoryError for one that there is not."""
        known = [one.name for one in fields(cls)]
        for name in options:
            if name not in known:
                raise HistoryError(f"read_record() has no option '{name}'; {nearest(name, known)}")
        return cls(**options)
