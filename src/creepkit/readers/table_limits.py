"""How large a table may be: its columns, lines, cells and keys; what is larger is refused before it costs time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from creepkit.errors import HistoryError
from creepkit.files.limits import how_to_raise, raised

MAXIMUM_COLUMNS, MAXIMUM_LINE, MAXIMUM_KEYS = 2000, 1_000_000, 1000
"""Columns of a table, characters of a line, and `# key: value` lines; no table of tests comes near them."""

MAXIMUM_CELL, MAXIMUM_TEXTS = 10_000, 40_000_000
"""Characters of a cell, for units are looked for in it; cells of a table that holds not numbers alone."""

MAXIMUM_SKIPPED_LINES = 100_000
"""Lines without a cell that holds something, above the table, and in it beyond the number of its rows."""


def refuse_many_skipped(path: Path, skipped: int, rows: int) -> None:
    """Refuse a text that is empty lines and comments for the most part, before all of them are looked at."""
    if skipped > MAXIMUM_SKIPPED_LINES + rows and skipped > (most := raised(MAXIMUM_SKIPPED_LINES)) + rows:
        where = f"beside {rows} rows" if rows else "above the first row of a table"
        raise HistoryError(
            f"{path}: more than {most} empty lines and comments {where}; remove them, or "
            f"{how_to_raise(max(skipped - rows, 2 * most), most)}"
        )


def refuse_long_lines(text: str, path: Path) -> None:
    """Refuse a line that no table of tests has, before it is split into cells."""
    start, most = 0, raised(MAXIMUM_LINE)
    while len(text) - start > most:
        end = text.rfind("\n", start, start + most + 1)
        if end < 0:
            line = text.count("\n", 0, start) + 1
            raise HistoryError(
                f"{path}:{line}: the line has more than {most} characters; write shorter rows, or "
                f"{how_to_raise(2 * most, most)}"
            )
        start = end + 1


def refuse_many(location: str, columns: int, keys: int) -> None:
    """Refuse more columns or keys than a table has."""
    for noun, found, usual, advice in (
        ("columns", columns, MAXIMUM_COLUMNS, "write the tests to several files"),
        ("keys above the table", keys, MAXIMUM_KEYS, "write only those that count"),
    ):
        if found > usual and found > (most := raised(usual)):
            raise HistoryError(
                f"{location}: number of {noun} {found}, more than {most}; {advice}, or {how_to_raise(found, most)}"
            )


def refuse_many_texts(path: Path, count: int) -> None:
    """Refuse a table that is not of numbers alone and has more cells than memory holds as texts."""
    if count > (most := raised(MAXIMUM_TEXTS)):
        raise HistoryError(
            f"{path}: a table of {count} cells or more that are not all numbers, more than {most}; keep its numbers "
            f"alone, or {how_to_raise(count, most)}"
        )


def refuse_long_cells(location: str, line: str, cells: Sequence[str]) -> None:
    """Refuse a cell that is no name, number or remark."""
    if len(line) > MAXIMUM_CELL and len(longest := max(cells, key=len)) > MAXIMUM_CELL:
        raise HistoryError(
            f"{location}: a cell of {len(longest)} characters, more than {MAXIMUM_CELL}; is a quote or a line missing?"
        )
