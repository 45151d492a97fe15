"""The readers that come with creepkit."""

from __future__ import annotations

from creepkit.hookspecs import hookimpl
from creepkit.readers.history_csv import HISTORY_CSV
from creepkit.readers.indexed import INDEXED_FILES, INDEXED_TABLE
from creepkit.records import Reader


@hookimpl
def creepkit_readers() -> list[Reader]:
    """Return the built-in readers."""
    return [INDEXED_TABLE, INDEXED_FILES, HISTORY_CSV]
