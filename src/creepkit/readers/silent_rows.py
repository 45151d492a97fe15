"""Rows of a table of tests that say nothing of creep once columns are left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from creepkit.errors import HistoryError
from creepkit.readers.text_tables import TextTable

RESULTS = ("minimum_rate", "rupture", "end_time", "ended")
"""Quantities of which a test without frames states one or more."""

MOST_NAMED = 6
"""Rows left out that the label of assumptions names."""


def without_silent_rows(table: TextTable, quantities: Sequence[str]) -> TextTable:
    """The table without rows that state none of RESULTS, which its assumptions name; HistoryError where none is left.

    quantities : of its columns, such as minimum_rate, "name" for that of the tests' names.
    """
    says = [name for name, quantity in zip(table.columns, quantities, strict=True) if quantity in RESULTS]
    silent = [row for row in table.rows if not any(name in table.entries(row) for name in says)]
    if not silent:
        return table
    if len(silent) == len(table.rows):
        raise HistoryError(
            f"{table.location(table.columns_line)}: no row states a minimum creep rate or an end of its test once the "
            "ignored columns are left out; keep one of these columns"
        )
    names = [name for name, quantity in zip(table.columns, quantities, strict=True) if quantity == "name"]
    called = [
        table.entries(row)[names[0]].text if names and names[0] in table.entries(row) else f"line {row.line}"
        for row in silent
    ]
    more = f" and {len(called) - MOST_NAMED} more" if len(called) > MOST_NAMED else ""
    kept = tuple(row for row in table.rows if row not in silent)
    what = f"without {' '.join(called[:MOST_NAMED])}{more} (nothing but ignored columns)"
    return replace(table, rows=kept, assumptions=(*table.assumptions, what))
