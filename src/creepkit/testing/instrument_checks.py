"""Checks of instrument formats: whether the declaration can be used."""

from __future__ import annotations

from creepkit.files.time_stamps import DATE_ORDERS
from creepkit.instruments.column_heads import TIME_UNITS, channel_unit
from creepkit.records import InstrumentFormat
from creepkit.testing.reports import finding


@finding("declaration")
def check_declaration(declared: InstrumentFormat) -> str:
    """Units and the order of dates mean something; what else is declared was checked when the format was made."""
    unknown = [unit for unit in declared.units.values() if channel_unit(unit) is None]
    assert not unknown, f"'{unknown[0]}' is no unit of a channel; write one such as barg, psia, C"
    unit, order = declared.time_unit, declared.date_order
    assert unit in ("", *TIME_UNITS), f"'{unit}' is no unit of times; write one of {', '.join(TIME_UNITS)}"
    assert order in ("", *DATE_ORDERS), f"'{order}' is no order of dates; write one of {', '.join(DATE_ORDERS)}"
    return "units of channels and times, and the order of dates, are known"
