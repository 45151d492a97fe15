"""Samples of the readers of instrument records."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from file_samples.samples import ReaderSample

import creepkit as ck
from creepkit.records import InstrumentRecord
from helpers.instrument_samples import samples as contents

TABLES = ("elapsed.csv", "iso.csv", "unix.csv", "us_dates.csv", "dropouts.csv")
"""Samples with commas whose first line names the columns."""


def read(path: Path) -> InstrumentRecord:
    """The record in a file."""
    return ck.read_record(path)


def difference(first: InstrumentRecord, second: InstrumentRecord) -> str:
    """What distinguishes two records; a reading that is lost, or a channel without a unit, is no silent change."""
    if not np.array_equal(first.times, second.times):
        return "other times"
    if list(first.channels) != list(second.channels):
        return f"channels {', '.join(first.channels)} and {', '.join(second.channels)}"
    for name, one in first.channels.items():
        other = second.channels[name]
        both = ~np.isnan(one.values) & ~np.isnan(other.values)
        if other.quantity == "number":
            continue
        if (one.quantity, one.reference) != (other.quantity, other.reference):
            return f"{name} is another quantity"
        if not np.array_equal(one.values[both], other.values[both]):
            return f"other values of {name}"
    return ""


def decided(record: InstrumentRecord) -> str:
    """What the reader says that it assumed or left out."""
    return "; ".join(record.notes)


def samples() -> Iterator[ReaderSample]:
    """Each of the records."""
    for name, content in contents().items():
        yield ReaderSample(
            f"instrument {name}",
            {name: content},
            name,
            read,
            difference,
            decided,
            delimiter="," if name in TABLES else "",
            without_unit=(("pressure_bar", "pressure"),) if name == "elapsed.csv" else (),
            reader="instrument plate-of-dimples" if name == "plate.csv" else "instrument table",
        )
