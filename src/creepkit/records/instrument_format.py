"""How a data logger writes its records: one declaration, that plugins make as creepkit itself does."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field


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
