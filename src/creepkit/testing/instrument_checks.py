"""Checks of formats of instruments' records: whether the declaration can be used."""

from __future__ import annotations

import re
from collections.abc import Iterator

from creepkit.files.time_stamps import DATE_ORDERS
from creepkit.instruments.column_heads import TIME_UNITS, channel_unit
from creepkit.records import InstrumentFormat
from creepkit.testing.reports import ConformanceCheck


def check_declaration(declared: InstrumentFormat) -> Iterator[ConformanceCheck]:
    """Regular expressions, units, order of dates and patterns of channels mean something."""
    for what, patterns in {"required": declared.required, "units": tuple(declared.units)}.items():
        try:
            for pattern in patterns:
                re.compile(pattern)
        except re.error as error:
            yield ConformanceCheck(what, False, f"'{pattern}' is no regular expression ({error}); correct it")
            return
        yield ConformanceCheck(what, True, f"{len(patterns)} regular expressions")
    unknown = [unit for unit in declared.units.values() if channel_unit(unit) is None]
    detail = f"'{unknown[0]}' is no unit of a channel; write one such as barg, psia, C" if unknown else "known"
    yield ConformanceCheck("units of channels", not unknown, detail)
    time_known = declared.time_unit in ("", *TIME_UNITS)
    yield ConformanceCheck("unit of times", time_known, f"'{declared.time_unit}' of {', '.join(TIME_UNITS)}")
    order_known = declared.date_order in ("", *DATE_ORDERS)
    yield ConformanceCheck("order of dates", order_known, f"'{declared.date_order}' of {', '.join(DATE_ORDERS)}")
    bad = [text for text in declared.channel_patterns.values() if text.count("{}") != 1]
    detail = f"'{bad[0]}' must hold {{}} once, for the name of the specimen" if bad else "each holds {} once"
    yield ConformanceCheck("patterns of channels", not bad, detail)
