"""The rows of a table: of a few, of numbers alone, or of up to millions whose text is kept column by column.

A list of rows of cells takes a hundred bytes a cell, for each is an object. The text of a whole column takes no more
than it does in the file, and rows are made of it where they are asked for.
"""

from __future__ import annotations

from array import array
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate, chain, repeat
from typing import NamedTuple, overload

import numpy as np

from creepkit.arrays import Floats, Ints

_BETWEEN_CELLS = "\n"
"""Within the text of a column; no cell of a line holds it."""


_PART_CELLS = 60_000
"""Cells whose text is kept together: some megabytes while they are taken apart."""


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


@dataclass(frozen=True)
class RowsPart:
    """Some rows that follow each other.

    lines : (rows,) of the file. columns : the text of each column; of rows that differ in their number of cells, one
    text of all cells, row by row. counts : (rows,) cells of each row, where they differ.
    """

    lines: Ints
    columns: tuple[str, ...]
    counts: Ints | None = None

    @staticmethod
    def of(lines: Sequence[int], rows: Sequence[Sequence[str]]) -> RowsPart:
        """The part of rows of cells."""
        counts = array("q", map(len, rows))
        numbers = np.array(array("q", lines))
        if min(counts) == max(counts):
            return RowsPart(numbers, tuple(map(_BETWEEN_CELLS.join, zip(*rows, strict=True))))
        return RowsPart(numbers, (_BETWEEN_CELLS.join(chain.from_iterable(rows)),), np.array(counts))

    @property
    def width(self) -> int:
        """Cells of the longest row."""
        return len(self.columns) if self.counts is None else int(self.counts.max())

    def cells(self, column: int) -> list[str]:
        """The cells of one column; "" where a row is shorter."""
        if self.counts is None:
            return self.columns[column].split(_BETWEEN_CELLS)
        return [row.cells[column] if column < len(row.cells) else "" for row in self.rows()]

    def rows(self) -> Iterator[TableRow]:
        """The rows."""
        if self.counts is None:
            cells = zip(*(column.split(_BETWEEN_CELLS) for column in self.columns), strict=True)
            yield from map(TableRow, self.lines.tolist(), cells if self.columns else repeat(()))
            return
        end, all_cells = 0, self.columns[0].split(_BETWEEN_CELLS)
        for line, count in zip(self.lines.tolist(), self.counts.tolist(), strict=True):
            yield TableRow(line, all_cells[end : end + count])
            end += count

    def with_columns(self, kept: Sequence[int]) -> RowsPart:
        """The rows with some of their columns, those of shorter rows excepted that they do not have."""
        if self.counts is None:
            return RowsPart(self.lines, tuple(self.columns[k] for k in kept))
        rows = [[row.cells[k] for k in kept if k < len(row.cells)] for row in self.rows()]
        return RowsPart.of(self.lines.tolist(), rows)

    @property
    def may_hold_empty_rows(self) -> bool:
        """Whether a row may have no cell that holds anything: not where a column is filled throughout."""
        return self.counts is not None or not any(_is_filled(column) for column in self.columns)


def _is_filled(column: str) -> bool:
    between = _BETWEEN_CELLS
    return bool(column) and column[0] != between != column[-1] and 2 * between not in column


class TextRows(Sequence[TableRow]):
    """The rows of a table of texts and numbers, as they stand in the file."""

    def __init__(self, parts: Iterable[RowsPart]) -> None:
        self.parts = tuple(parts)
        self._ends = list(accumulate(part.lines.size for part in self.parts))
        self._taken_apart: tuple[int, list[TableRow]] = (-1, [])

    def __len__(self) -> int:
        return self._ends[-1] if self._ends else 0

    def __iter__(self) -> Iterator[TableRow]:
        for part in self.parts:
            yield from part.rows()

    @overload
    def __getitem__(self, index: int) -> TableRow: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[TableRow]: ...
    def __getitem__(self, index: int | slice) -> TableRow | Sequence[TableRow]:
        if isinstance(index, slice):
            first, last, step = index.indices(len(self))
            return [self[k] for k in range(first, last, step)] if step != 1 else TextRows(self._between(first, last))
        row = range(len(self))[index]
        k = bisect_right(self._ends, row)
        if self._taken_apart[0] != k:
            self._taken_apart = (k, list(self.parts[k].rows()))
        return self._taken_apart[1][row - self._ends[k] + self.parts[k].lines.size]

    def _between(self, first: int, last: int) -> Iterator[RowsPart]:
        for part, end in zip(self.parts, self._ends, strict=True):
            start = end - part.lines.size
            if first <= start and end <= last:
                yield part
            elif max(first, start) < min(end, last):
                rows = list(part.rows())[max(first - start, 0) : last - start]
                yield RowsPart.of(*zip(*rows, strict=True))

    @property
    def lines(self) -> Ints:
        """(rows,) The line of the file in which each row stands."""
        return np.concatenate([part.lines for part in self.parts]) if self.parts else np.zeros(0, int)

    @property
    def has_only(self) -> set[int]:
        """The numbers of cells that rows have; where they differ within a part, also -1."""
        return {part.width if part.counts is None else -1 for part in self.parts}


def packed(rows: Iterable[TableRow]) -> TextRows:
    """Rows whose text is kept column by column."""
    return TextRows(_parts(rows))


def _parts(rows: Iterable[TableRow]) -> Iterator[RowsPart]:
    lines, cells, count = list[int](), list[Sequence[str]](), 0
    for line, row in rows:
        lines.append(line)
        cells.append(row)
        count += len(row)
        if count >= _PART_CELLS:
            yield RowsPart.of(lines, cells)
            lines, cells, count = [], [], 0
    if lines:
        yield RowsPart.of(lines, cells)


def kept_alike(like: Sequence[TableRow], rows: Iterable[TableRow]) -> Sequence[TableRow]:
    """Rows made of other rows, kept in the same way: the cells of a spreadsheet, which are few, as a list."""
    return packed(rows) if isinstance(like, TextRows) else list(rows)


def with_first(first: TableRow, rows: Sequence[TableRow]) -> Sequence[TableRow]:
    """Rows below another one."""
    if isinstance(rows, TextRows):
        return TextRows((RowsPart.of([first.line], [first.cells]), *rows.parts))
    return [first, *rows]


def with_columns(rows: Sequence[TableRow], kept: Sequence[int]) -> Sequence[TableRow]:
    """The rows with some of their columns."""
    if isinstance(rows, NumberRows):
        return NumberRows(rows.numbers[:, list(kept)], rows.lines, rows.decimal)
    if isinstance(rows, TextRows):
        return TextRows(part.with_columns(kept) for part in rows.parts)
    return [TableRow(row.line, [row.cells[k] for k in kept if k < len(row.cells)]) for row in rows]


def without_empty(rows: Sequence[TableRow]) -> Sequence[TableRow]:
    """The rows in which a cell holds something."""
    if not isinstance(rows, TextRows):
        return [row for row in rows if any(row.cells)]
    parts = list[RowsPart]()
    for part in rows.parts:
        parts += _parts(row for row in part.rows() if any(row.cells)) if part.may_hold_empty_rows else [part]
    return TextRows(parts)


def cells_by_part(rows: Sequence[TableRow], column: int) -> Iterator[tuple[Ints, list[str]]]:
    """(rows,) lines and cells of one column, some rows at a time."""
    if isinstance(rows, TextRows):
        yield from ((part.lines, part.cells(column)) for part in rows.parts)
    elif rows:
        yield np.array([row.line for row in rows]), [row.cells[column] for row in rows]


def cells_of(rows: Sequence[TableRow], column: int) -> Iterator[str]:
    """The cells of one column."""
    return chain.from_iterable(cells for _, cells in cells_by_part(rows, column))


def grouped(
    rows: Sequence[TableRow], column: int, check: Callable[[TableRow], object]
) -> dict[str, Sequence[TableRow]]:
    """{cell of a column: the rows that have it}, in the order of the first ones; check : is called for each row."""
    found: dict[str, list[TableRow]] = {}
    parts: dict[str, list[RowsPart]] = {}
    for part in rows.parts if isinstance(rows, TextRows) else [rows]:
        some: dict[str, list[TableRow]] = {}
        for row in part.rows() if isinstance(part, RowsPart) else part:
            check(row)
            some.setdefault(row.cells[column], []).append(row)
        for name, group in some.items():
            if isinstance(rows, TextRows):
                parts.setdefault(name, []).append(RowsPart.of(*zip(*group, strict=True)))
            else:
                found[name] = group
    return {**found, **{name: TextRows(own) for name, own in parts.items()}}
