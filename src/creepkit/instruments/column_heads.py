"""Heads of columns: name and unit of a channel, and what a number in that unit is in MPa, K, mm or N."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from difflib import get_close_matches

from creepkit.errors import HistoryError, quoted
from creepkit.records.units import UNITS, spelled_factors, spellings


@dataclass(frozen=True)
class ChannelUnit:
    """A unit of a channel: factor * number + offset is in MPa, K, mm or N; reference : of a pressure, where it says."""

    quantity: str
    factor: float = 1.0
    offset: float = 0.0
    reference: str = ""


_PRESSURES = spellings("psi", "ksi", "bar", "mbar", "Pa", "hPa", "kPa", "MPa", "atm", "Torr")


_OTHERS = spellings("K", "C", "F", "mm", "m", "cm", "um", "in", "N", "kN", "lbf")


_REFERENCES = {
    "": "",
    **dict.fromkeys(("g", "(g)", " g", " gauge", " gage", "(gauge)"), "gauge"),
    **dict.fromkeys(("a", "(a)", " a", " abs", " absolute", "(abs)"), "absolute"),
}


_REFERENCE_IN_NAME = re.compile(r"(?<![a-z])p?(?:(abs(?:olute)?)|(gauge|gage))(?![a-z])")


def _channel(symbol: str, reference: str = "") -> ChannelUnit:
    unit = UNITS[symbol]
    quantity = "pressure" if unit.quantity == "stress" else unit.quantity
    return ChannelUnit(quantity, unit.conversion.factor, unit.conversion.offset, reference)


_UNITS: dict[str, ChannelUnit] = {
    **{
        f"{unit}{suffix}": _channel(symbol, reference)
        for unit, symbol in _PRESSURES.items()
        for suffix, reference in _REFERENCES.items()
    },
    **{unit: _channel(symbol) for unit, symbol in _OTHERS.items()},
}


_ANY_CASE = {unit.lower(): found for unit, found in _UNITS.items() if len(unit) > 1}
"""Units of several letters, which no capitals tell apart; mPa and Mbar would be, and are refused."""


TIME_UNITS = {
    **spelled_factors("s", "ms", "us", "ns", "min", "h", "d"),
    # In tables of tests Std is a standard deviation, and S none of time.
    **dict.fromkeys(("S", "Sec"), 1.0),
    "Std": 3600.0,
}
"""{unit: s}."""


MINUTES_AND_SECONDS = re.compile(r"(?<![a-z:])(?:m|mm|min):(?:s|ss|sec)(?![a-z])", re.IGNORECASE)
"""A unit of cells such as 12:30 that makes them 12.5 min, where a clock shows hours and minutes."""


_BRACKETED = re.compile(r"(?P<name>[^()\[\]]*[^()\[\]\s])\s*[(\[](?P<unit>[^\[\]]{1,30}?)[)\]]")


_BEHIND = re.compile(r"(?P<name>.*[^\s/,_])(?:\s*[/,]\s*|\s+|_)(?P<unit>[^\s_/,]{1,12})")


def channel_unit(text: str) -> ChannelUnit | None:
    """The unit of a channel that a text names; None where it names none."""
    unit = " ".join(text.split())
    if unit in _UNITS:
        return _UNITS[unit]
    return None if unit[:3] in ("mPa", "Mba") else _ANY_CASE.get(unit.lower())


KNOWN_UNITS = ("psi", "psig", "psia", "bar", "barg", "MPa", "kPa", "Torr", "C", "F", "K", "mm", "um", "in", "N", "kN")
"""Units of channels, for errors."""


def near_unit(text: str) -> str:
    """The known unit that a text may mean but does not say, such as "MPa" for "mPa" or "C" for "c"; "" if none."""
    unit = " ".join(text.split())
    if not unit or channel_unit(unit) is not None or unit in TIME_UNITS:
        return ""
    alike = [known for known in _UNITS if known.lower() == unit.lower()]
    return next(iter(alike or (get_close_matches(unit, _UNITS, 1, 0.74) if len(unit) > 2 else ())), "")


def near_unit_of_name(name: str) -> tuple[str, str]:
    """The last word of a channel's name and the unit that it may mean, such as ("mPa", "MPa") of "P_mPa"; else ""."""
    words = re.split(r"[\s_/,]+", name.strip())
    unit = near_unit(words[-1]) if len(words) > 1 else ""
    return (words[-1], unit) if unit else ("", "")


def reference_in_name(name: str) -> str:
    """What the name of a pressure says of it, as `P abs` and `gauge pressure` do; "" where it says nothing."""
    found = _REFERENCE_IN_NAME.search(name[:200].lower().replace("_", " "))
    return "" if found is None else "absolute" if found[1] else "gauge"


def stated_unit(place: str, head: str, in_name: str, in_row: str) -> str:
    """The unit of a column from its head and the row of units; HistoryError where these contradict each other.

    A text that is no known unit, such as "upper" in brackets, gives way to the other.
    """
    known = [unit for unit in (in_row, in_name) if unit and (unit in TIME_UNITS or channel_unit(unit))]
    if len(known) < 2:
        return (known or [in_row or in_name])[0]
    first, second = (TIME_UNITS.get(unit) or channel_unit(unit) for unit in known)
    if first == second:
        return in_row
    if (
        isinstance(first, ChannelUnit)
        and isinstance(second, ChannelUnit)
        and not (first.reference and second.reference)
        and replace(first, reference="") == replace(second, reference="")
    ):
        return in_row if first.reference else in_name
    raise HistoryError(
        f"{place}: '{quoted(head, 60)}' has the unit {in_name}, the row of units says {in_row}; correct one"
    )


def split_head(head: str) -> tuple[str, str]:
    """Name and unit of a column's head, such as "P1 [bar]", "Temp.(C)", "pressure_MPa" or "p / kPa"; unit "" if none.

    In brackets anything is a unit; behind a blank, a comma, a slash or `_` only a unit that is known.
    """
    text = head.strip()
    if len(text) > 200:
        return text, ""
    if match := _BRACKETED.fullmatch(text):
        return match["name"], match["unit"].strip()
    if (match := _BEHIND.fullmatch(text)) and (channel_unit(match["unit"]) or match["unit"] in TIME_UNITS):
        return match["name"].rstrip(":"), match["unit"]
    return text, ""
