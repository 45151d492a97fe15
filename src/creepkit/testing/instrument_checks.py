"""Checks of instrument formats: whether the declaration can be used."""

from __future__ import annotations

from collections.abc import Iterator

from creepkit.files.time_stamps import DATE_ORDERS
from creepkit.instruments.column_heads import TIME_UNITS, channel_unit
from creepkit.records import InstrumentFormat
from creepkit.testing.reports import ConformanceCheck


def check_declaration(declared: InstrumentFormat) -> Iterator[ConformanceCheck]:
    """Units and the order of dates mean something; what else is declared was checked when the format was made."""
    unknown = [unit for unit in declared.units.values() if channel_unit(unit) is None]
    detail = f"'{unknown[0]}' is no unit of a channel; write one such as barg, psia, C" if unknown else "known"
    yield ConformanceCheck("units of channels", not unknown, detail)
    time_known = declared.time_unit in ("", *TIME_UNITS)
    yield ConformanceCheck("unit of times", time_known, f"'{declared.time_unit}' of {', '.join(TIME_UNITS)}")
    order_known = declared.date_order in ("", *DATE_ORDERS)
    yield ConformanceCheck("order of dates", order_known, f"'{declared.date_order}' of {', '.join(DATE_ORDERS)}")
