"""The built-in instrument formats, one declaration each; plugins declare others."""

from __future__ import annotations

from creepkit.hookspecs import hookimpl
from creepkit.records import InstrumentFormat

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
