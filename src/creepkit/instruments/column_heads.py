"""Units of channels, what a number in one is in MPa, K, mm or N; names and units are those of the vocabulary."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

from creepkit.errors import HistoryError, quoted
from creepkit.readers.vocabulary import split_written_name, unit_suffix
from creepkit.records.units import UNITS, Unit, spellings

_QUANTITIES = {"stress": "pressure", "temperature": "temperature", "length": "length", "force": "force"}
"""{quantity of a unit: what a channel in it holds}."""


@dataclass(frozen=True)
class ChannelUnit:
    """A unit of a channel: factor * number + offset is in MPa, K, mm or N; reference : of a pressure, where it says."""

    quantity: str
    factor: float = 1.0
    offset: float = 0.0
    reference: str = ""


_REFERRED = re.compile(r"(.*?[^\s(]) ?(?:(g|\(g\)|\(?gau?ge\)?)|(a|\(a\)|\(?abs(?:olute)?\)?))", re.IGNORECASE)
"""A unit of a pressure with what says whether it is a gauge pressure, or an absolute one."""


_REFERENCE_IN_NAME = re.compile(r"(?<![a-z])p?(?:(abs(?:olute)?)|(gauge|gage))(?![a-z])")


_KNOWN = [
    f"{unit}{mark}"
    for unit, symbol in spellings(*(one for one, unit in UNITS.items() if unit.quantity in _QUANTITIES)).items()
    for mark in (("", "g", "a") if UNITS[symbol].quantity == "stress" else ("",))
]


MINUTES_AND_SECONDS = re.compile(r"(?<![a-z:])(?:(?:m|mm|min):(?:s|ss|sec)|d+:h+(?::m+)?)(?![a-z])", re.IGNORECASE)
"""A unit of cells such as 12:30 that makes them 12.5 min, or days and hours, where a clock shows hours and minutes."""


def _unit(text: str) -> Unit | None:
    """A unit as it is written; capitals of a single letter matter, for channels are called A, B, C."""
    is_letter = len(text) == 1 and text not in (*UNITS, "S")
    return None if is_letter else UNITS.get(unit_suffix(text) or "")


def channel_unit(text: str) -> ChannelUnit | None:
    """The unit of a channel that a text names; None where it names none."""
    text, reference = " ".join(text.split()), ""
    unit, referred = _unit(text), _REFERRED.fullmatch(text)
    if referred and (pressure := _unit(referred[1])) is not None and pressure.quantity == "stress":
        unit, reference = pressure, "gauge" if referred[2] else "absolute"
    if unit is None or unit.quantity not in _QUANTITIES:
        return None
    return ChannelUnit(_QUANTITIES[unit.quantity], unit.conversion.factor, unit.conversion.offset, reference)


def time_factor(text: str) -> float | None:
    """s, of a unit of time that a text names; None where it names none."""
    unit = _unit(text)
    return unit.conversion.factor if unit is not None and unit.quantity == "time" else None


KNOWN_UNITS = ("psi", "psig", "psia", "bar", "barg", "MPa", "kPa", "Torr", "C", "F", "K", "mm", "um", "in", "N", "kN")
TIME_UNITS = ("s", "ms", "us", "min", "h", "d")
"""Units of channels and of times, for errors."""


def in_other_capitals(text: str) -> str:
    """The known unit that a text, the last word of which may name one, has in other capitals, as mPa; "" if none."""
    unit = re.split(r"[\s_/,]+", text.strip())[-1]
    is_known = len(unit) < 2 or channel_unit(unit) is not None or time_factor(unit)
    return "" if is_known else next((known for known in _KNOWN if known.lower() == unit.lower()), "")


def reference_in_name(name: str) -> str:
    """What the name of a pressure says of it, as `P abs` and `gauge pressure` do; "" where it says nothing."""
    found = _REFERENCE_IN_NAME.search(name[:200].lower().replace("_", " "))
    return "" if found is None else "absolute" if found[1] else "gauge"


def stated_unit(place: str, head: str, in_name: str, in_row: str) -> str:
    """The unit of a column from its head and the row of units; HistoryError where these contradict each other.

    A text that is no known unit, such as "upper" in brackets, gives way to the other.
    """
    known = [unit for unit in (in_row, in_name) if unit and (time_factor(unit) or channel_unit(unit))]
    if len(known) < 2:
        return (known or [in_row or in_name])[0]
    first, second = (channel_unit(unit) or ChannelUnit("time", time_factor(unit) or 1.0) for unit in known)
    if first == second:
        return in_row
    if not (first.reference and second.reference) and replace(first, reference="") == replace(second, reference=""):
        return in_row if first.reference else in_name
    raise HistoryError(
        f"{place}: '{quoted(head, 60)}' has the unit {in_name}, the row of units says {in_row}; correct one"
    )


def split_head(head: str) -> tuple[str, str]:
    """Name and unit of a column's head, such as "P1 [bar]", "Temp.(C)", "pressure_MPa" or "p / kPa"; unit "" if none.

    In brackets anything is a unit; elsewhere only one of channels or times.
    """
    text = head.strip()
    name, unit = split_written_name(text, lambda unit: channel_unit(unit) or time_factor(unit))
    return (name.rstrip(":"), unit) if unit and len(text) <= 200 else (text, "")
