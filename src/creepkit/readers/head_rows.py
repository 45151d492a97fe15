"""Conditions in rows of cells above the names of the columns: key and value, or a key and one value a test."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from creepkit.errors import HistoryError, quoted
from creepkit.files.delimited_text import is_number
from creepkit.readers.cell_grids import CellGrid
from creepkit.readers.column_names import KnownNames, split_written_name, unit_suffix
from creepkit.readers.table_rows import TableRow
from creepkit.readers.text_tables import SourceText


@dataclass
class BlockConditions:
    """What stands above the columns of one test, while it is collected: its entries, and what was assumed of them."""

    entries: dict[str, SourceText] = field(default_factory=dict)
    assumptions: tuple[str, ...] = ()


def entries_of_blocks(
    grid: CellGrid, head: Sequence[TableRow], blocks: Sequence[Sequence[int]], key_columns: set[int], known: KnownNames
) -> list[BlockConditions]:
    """What the rows above the names say of each test.

    blocks : positions of the columns of each test. key_columns : positions before those of the first test, in which
    keys stand. A row holds a key and one value a test, pairs of key and value, or the names of the tests.
    """
    results = [BlockConditions() for _ in blocks]
    own = [sorted(set(block) - key_columns) for block in blocks]
    for row in head:
        place = grid.location(row.line)
        filled = {k: cell for k, cell in enumerate(row.cells) if cell}
        first = min(filled)
        key = filled[first] if known.is_condition(filled[first].rstrip(": ")) else ""
        measured = {k: conditions_in(cell, known) for k, cell in filled.items() if not key}
        if measured and all(measured.values()):
            for result, columns in zip(results, own, strict=True):
                k = next((k for k in range(columns[0], columns[-1] + 1) if k in measured), None)
                for quantity, text in () if k is None else measured[k]:
                    put_entry(result.entries, quantity, text, place, grid, known)
            continue
        if len(set(filled.values())) == 1 and not key:
            for result in results:
                put_entry(result.entries, f"label line {row.line}", filled[first], place, grid, known)
            continue
        one_for_all = len(filled) == 2 and bool(key) and len(blocks) > 1
        for result, columns in zip(results, own, strict=True):
            values = [(k, filled[k]) for k in range(columns[0], columns[-1] + 1) if k in filled]
            if one_for_all:
                text = next(cell for k, cell in filled.items() if k != first)
                put_entry(result.entries, key, text, place, grid, known)
                result.assumptions += (f"{key} in line {row.line} holds for all tests",)
                continue
            if len(values) > 1 and known.is_condition(values[0][1].rstrip(": ")):
                put_entry(result.entries, values[0][1], values[1][1], place, grid, known)
                continue
            values = [(k, cell) for k, cell in values if k != first or not key][:1]
            if values and not key and (first in key_columns or is_number(values[0][1], grid.dialect)):
                raise HistoryError(
                    f"{place}: '{quoted(values[0][1])}' stands above the names of the columns, and "
                    f"'{quoted(filled[first])}' "
                    "is no condition that is known; write one such as 'Stress (MPa)' before it"
                )
            if values:
                put_entry(result.entries, key or "name", values[0][1], place, grid, known)
    return results


def conditions_in(cell: str, known: KnownNames) -> list[tuple[str, str]]:
    """Load and temperature of a head such as `120 MPa`, or `120 MPa / 650 °C`; [] where a part of it is neither.

    A load is a stress, where the file names no specimen that takes another one.
    """
    loads, kinds = known.terms.own_loads or ("stress",), known.terms.condition_kinds
    found: list[tuple[str, str]] = []
    for part in re.split(r"\s*[/;|]\s*|,\s+", cell.strip()):
        value = _VALUE_WITH_UNIT.fullmatch(part)
        unit = unit_suffix(value[1]) if value else None
        names = (name for name in ("temperature", *loads) if name in kinds and unit and unit in kinds[name].units)
        found.append((next(names, ""), part))
    quantities = [quantity for quantity, _ in found]
    return found if all(quantities) and len(set(quantities)) == len(quantities) else []


_VALUE_WITH_UNIT = re.compile(r"[+-]?[\d.,]+(?:[eE][+-]?\d+)?\s*([^\d\s.,;:+-][^;:]{0,10})", re.ASCII)


def entries_above(grid: CellGrid, head: Sequence[TableRow], known: KnownNames) -> dict[str, SourceText]:
    """What rows above the names say of one test: keys, each with its value and perhaps a unit behind it."""
    entries: dict[str, SourceText] = {}
    for row in head:
        place, cells = grid.location(row.line), [cell for cell in row.cells if cell]
        if grid.dialect.delimiter == " ":
            cells = [" ".join(cells)]
        if len(cells) == 1 and ":" in cells[0]:
            cells = [part.strip() for part in cells[0].split(":", 1)]
        while cells:
            key, *rest = cells
            if is_number(key, grid.dialect):
                raise HistoryError(
                    f"{place}: the number {quoted(key)} stands above the names of the columns, and is that of a column "
                    "without a name, or has no key before it; name every column of the table, or the condition"
                )
            if not rest:
                if known.is_condition(key):
                    raise HistoryError(
                        f"{place}: '{quoted(key)}' stands above the names of the columns without a value"
                    )
                put_entry(entries, f"label line {row.line}", key, place, grid, known)
                break
            value, cells = rest[0], rest[1:]
            if cells and is_number(value, grid.dialect) and unit_suffix(cells[0]):
                key, cells = _with_unit(key, cells[0], place), cells[1:]
            put_entry(entries, key, value, place, grid, known)
    return entries


def _with_unit(key: str, unit: str, place: str) -> str:
    """A key with the unit that stands behind its value; HistoryError where the key has another one."""
    _, stated = split_written_name(key.rstrip(": "))
    if stated and unit_suffix(stated) != unit_suffix(unit):
        raise HistoryError(
            f"{place}: '{quoted(key, 60)}' has the unit '{quoted(unit, 20)}' behind its value; keep one of the two "
            "units"
        )
    return key if stated else f"{key} ({unit})"


def put_entry(
    entries: dict[str, SourceText], key: str, text: str, place: str, grid: CellGrid, known: KnownNames
) -> None:
    """Add an entry under creepkit's name of its key; HistoryError where it is there already."""
    written = key.rstrip(": ")
    key = known.condition(written)
    if key in entries:
        raise HistoryError(f"{place}: '{quoted(written, 60)}' was already given; keep one of them")
    entries[key] = SourceText(text, place, grid.dialect.decimal, written)
