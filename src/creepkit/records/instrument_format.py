"""How a data logger writes its records: one declaration, that plugins make as creepkit itself does."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from creepkit.errors import HistoryError

PRESSURE_REFERENCES = ("gauge", "absolute")


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
        if not (isinstance(self.name, str) and re.fullmatch(r"[a-z0-9][a-z0-9_-]*", self.name)):
            raise HistoryError(
                f"instrument format {self.name!r:.40}: the name must be small letters, digits and hyphens, such as "
                "'furnace-3'"
            )
        for pattern in (*self.required, *self.units):
            try:
                re.compile(pattern)
            except (re.error, TypeError) as error:
                raise HistoryError(
                    f"instrument format '{self.name}': {pattern!r:.40} is no regular expression ({error}); correct it"
                ) from None
        if self.pressure_reference not in ("", *PRESSURE_REFERENCES):
            raise HistoryError(
                f"instrument format '{self.name}': pressure_reference is {self.pressure_reference!r:.40}; write "
                "'gauge' or 'absolute', or leave it out"
            )
        for pattern in self.channel_patterns.values():
            if not (isinstance(pattern, str) and pattern.count("{}") == 1):
                raise HistoryError(
                    f"instrument format '{self.name}': the channel pattern {pattern!r:.40} must hold {{}} once, where "
                    "the name of the specimen stands"
                )

    def accepts(self, names: Sequence[str]) -> bool:
        """Whether a line of names is one of this format."""
        return all(any(re.fullmatch(pattern, name) for name in names) for pattern in self.required)
