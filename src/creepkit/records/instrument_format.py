"""How a data logger writes its records: one declaration, that plugins make as creepkit itself does."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from creepkit.checked_arguments import checked
from creepkit.errors import HistoryError, quoted

PRESSURE_REFERENCES = ("gauge", "absolute")


@checked
@dataclass(frozen=True)
class InstrumentFormat:
    """How one data logger writes its records: a table of text with a line of names and a row for each moment.

    name : short, lower case, unique. title : one line for people.
    required : regular expressions; each matches a whole name of the line of names. Without any, every table is accepted
        that no other format wants.
    time, date : names of their columns; "" finds the usual ones. time_unit : of times that are numbers, "s", "ms",
        "min", "h". date_order : "month first", "day first" or "year first". time_zone : such as "America/Chicago" or
        "+01:00".
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

    def __post_init__(self) -> None:
        if not re.fullmatch(r"[a-z0-9][a-z0-9_-]*", self.name):
            raise HistoryError(
                f"instrument format {quoted(repr(self.name))}: the name must be small letters, digits and hyphens, "
                "such as 'furnace-3'"
            )
        origin = f"instrument format '{self.name}'"
        for pattern in (*self.required, *self.units):
            try:
                re.compile(pattern)
            except re.error as error:
                raise HistoryError(
                    f"{origin}: {quoted(repr(pattern))} is no regular expression ({error}); correct it"
                ) from None
        if self.pressure_reference not in ("", *PRESSURE_REFERENCES):
            raise HistoryError(
                f"{origin}: pressure_reference is {quoted(repr(self.pressure_reference))}; write 'gauge' or "
                "'absolute', or leave it out"
            )
        for pattern in self.channel_patterns.values():
            if pattern.count("{}") != 1:
                raise HistoryError(
                    f"{origin}: the channel pattern {quoted(repr(pattern))} must hold {{}} once, where the name of the "
                    "specimen stands"
                )

    def accepts(self, names: Sequence[str]) -> bool:
        """Whether a line of names is one of this format."""
        return all(any(re.fullmatch(pattern, name) for name in names) for pattern in self.required)

    def unit_of(self, name: str) -> str:
        """The unit that `units` states for a column; "" for none."""
        return next((unit for pattern, unit in self.units.items() if re.fullmatch(pattern, name)), "")
