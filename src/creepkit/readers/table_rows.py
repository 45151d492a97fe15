"""The rows of a table: as texts, or as numbers where a large table holds numbers alone."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple, overload

from creepkit.arrays import Floats, Ints


class TableRow(NamedTuple):
    """The cells of one line of a table; a tuple, for a table has up to millions."""

    line: int
    cells: Sequence[str]


@dataclass(frozen=True)
class NumberRows(Sequence[TableRow]):
    """The rows of a table of numbers alone, whose text is not kept.

    numbers : (rows, columns). lines : (rows,) of the file. decimal : the sign of the table, in the text of its rows.
    """

    numbers: Floats
    lines: Ints
    decimal: str = "."

    def __len__(self) -> int:
        return len(self.numbers)

    @overload
    def __getitem__(self, index: int) -> TableRow: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[TableRow]: ...
    def __getitem__(self, index: int | slice) -> TableRow | Sequence[TableRow]:
        if isinstance(index, slice):
            return [self[k] for k in range(*index.indices(len(self)))]
        row = range(len(self))[index]
        return TableRow(int(self.lines[row]), [repr(float(x)).replace(".", self.decimal) for x in self.numbers[row]])


def with_columns(rows: Sequence[TableRow], kept: Sequence[int]) -> Sequence[TableRow]:
    """The rows with some of their columns."""
    if isinstance(rows, NumberRows):
        return NumberRows(rows.numbers[:, list(kept)], rows.lines, rows.decimal)
    return [TableRow(row.line, [row.cells[k] for k in kept if k < len(row.cells)]) for row in rows]


def cells_of(rows: Sequence[TableRow], column: int) -> Iterator[str]:
    """The cells of one column."""
    return (row.cells[column] for row in rows)


def grouped(
    rows: Sequence[TableRow], column: int, check: Callable[[TableRow], object]
) -> dict[str, Sequence[TableRow]]:
    """{cell of a column: the rows that have it}, in the order of the first ones; check : is called for each row."""
    found: dict[str, list[TableRow]] = {}
    for row in rows:
        check(row)
        found.setdefault(row.cells[column], []).append(row)
    return dict(found)
