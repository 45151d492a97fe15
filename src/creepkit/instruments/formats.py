"""Formats of instruments' records, one declaration each: how the columns are called, and what their heads leave out."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from creepkit.hookspecs import hookimpl


@dataclass(frozen=True)
class InstrumentFormat:
    """How one data logger writes its records: a table of text with a line of names and a row for each moment.

    name : short, lower case, unique. title : one line for people.
    required : regular expressions; each matches a whole name of the line of names. Without any, every table is accepted
        that no other format wants.
    time, date : names of their columns; "" finds the usual ones. time_unit : of times that are numbers, "s", "ms",
        "min", "h". date_order : "month first" or "day first". time_zone : such as "America/Chicago" or "+01:00".
    units : {regular expression: unit} of columns whose heads state none.
    pressure_reference : "gauge" or "absolute", where the units do not say. missing : texts that mean a lost reading,
        beside the usual ones.
    channel_patterns : {quantity: channel of one specimen, {} stands for its name}, as {"pressure": "{}: Press."}.
    """

    name: str
    title: str
    required: tuple[str, ...] = ()
    time: str = ""
    date: str = ""
    time_unit: str = ""
    date_order: str = ""
    time_zone: str = ""
    units: Mapping[str, str] = field(default_factory=dict)
    pressure_reference: str = ""
    missing: tuple[str, ...] = ()
    channel_patterns: Mapping[str, str] = field(default_factory=dict)

    def accepts(self, names: Sequence[str]) -> bool:
        """Whether a line of names is one of this format."""
        return all(any(re.fullmatch(pattern, name) for name in names) for pattern in self.required)


PLATE_OF_DIMPLES = InstrumentFormat(
    name="plate-of-dimples",
    title="pressures (PSIG) and temperatures (C) of the dimples of a plate, below a line of remarks",
    required=("time", r"[A-Z]\d+: Press\.\(PSIG\)", r"[A-Z]\d+: Temp\.\(C\)"),
    time="time",
    date_order="month first",
    channel_patterns={"pressure": "{}: Press.", "temperature": "{}: Temp."},
)
"""Record of the rig that tests all dimples of a plate at once (DABI); its clock is local, without a zone."""


ANY_TABLE = InstrumentFormat(
    name="table", title="a table of text with a column of time and units in the heads, from any data logger"
)


@hookimpl
def creepkit_instruments() -> list[InstrumentFormat]:
    """Return the built-in formats."""
    return [PLATE_OF_DIMPLES, ANY_TABLE]
