"""Rupture times as a matrix, temperatures by stresses, as one row a test.

    Time to rupture (h), heat AAA
    Temperature (°C) / Stress (MPa), 235, 196, 177
    550, 20.3, 132.3, (60000)
    600, -, 11.9, 32.4

A head above it says that its times are those of rupture. A cell in brackets, unless a note says otherwise, or behind
`>` is a run-out; one that is empty or a dash was not tested.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

from creepkit.files.delimited_text import is_missing
from creepkit.readers.columns_of_tests import RATES, column_called, is_number_like, only_text
from creepkit.readers.ends_of_tests import RUPTURED, legend_in
from creepkit.readers.table import CellTable, TableRow
from creepkit.readers.vocabulary import unit_suffix
from creepkit.records.quantities import STRESS, TEMPERATURE, TIME, QuantityKind

_OF_RUPTURE = re.compile(r"rupture|zeitstand|bruchzeit|standzeit|time to failure", re.IGNORECASE)
_HEAT = re.compile(
    r"(?i:heat|cast|charge|schmelze|coulée|batch)(?: no\.?)?[ _:=#-]*((?=[A-Z\d])(?!Treat)[\w-]+?)(?:_|\b)"
)
_UNITS = re.compile(r"[(\[]([^()\[\]]+)[)\]]|(?:\bin|,|_)\s*([^\s,_]+)")
_NUMBER = re.compile(r"\d+(?:[.,]\d+)?")
_WITH_UNIT = re.compile(r"([\d.,]+)\s*(\S+)")
_DEEPEST, _SEARCHED = 4, 60
"""Rows of a head; and within which the matrix must begin."""


class _Axis(NamedTuple):
    """The values of a row or column of conditions, "" for none, with their unit."""

    values: list[str]
    unit: str


def one_row_a_test(table: CellTable) -> CellTable:
    """A matrix of rupture times as a table with one row a test; any other table as it is."""
    rows, dialect = table.rows, table.dialect
    for at, row in enumerate(rows[:_SEARCHED]):
        above = [cell for one in rows[max(0, at - _DEEPEST) : at] for cell in one.cells if cell]
        is_named = not is_number_like(row.cells[0], dialect)  # the row of stresses; a test begins with a temperature
        if is_named and len(_axis(row.cells[1:], STRESS).values) > 1 and at + 1 < len(rows):
            said = [*above, row.cells[0], table.sheet, table.path.stem]
            first = [one.cells[0] for one in rows[max(0, at - _DEEPEST) : at + 1] if one.cells[0]]
            if any(map(_OF_RUPTURE.search, said)) and not any(map(RATES.search, map(str.casefold, said))):
                return _unfolded(table, at, said, first) or table
    return table


def _unfolded(table: CellTable, at: int, said: Sequence[str], first: Sequence[str]) -> CellTable | None:
    """The rows of tests of a matrix whose stresses stand in a row; None where the rows below are no temperatures.

    said : texts of its head. first : those of its first column.
    """
    dialect = table.dialect
    stresses = _axis(table.rows[at].cells[1:], STRESS)
    corners = [part for text in reversed(first) for part in re.split(r"\s+[\\/|]\s+|\\", text)]
    columns = [column_called(part) for part in corners]
    unit = next((one.unit for one in columns if one.quantity == "temperature"), None)
    body = [row for row in table.rows[at + 1 :] if not only_text(row, dialect)]
    temperatures = _axis([row.cells[0] for row in body], TEMPERATURE)
    is_stress = stresses.unit or any(re.search(r"stress|spannung|contrainte|σ|MPa", text) for text in said)
    is_whole = "" not in temperatures.values and len(temperatures.values) == len(body)
    if not (is_stress and is_whole) or (unit is None and not temperatures.unit):
        return None
    of_rupture = [text for text in said if _OF_RUPTURE.search(text)]
    times, loads = _unit_in(of_rupture, TIME), stresses.unit or _unit_in(said, STRESS)
    heat = next((found[1] for text in said if (found := _HEAT.search(text)) and found[1]), "")
    names = [("Temperature", temperatures.unit or unit), ("Stress", loads), ("Rupture time", times)]
    head = ["Test", *(f"{name} ({unit})" if unit else name for name, unit in names), *["Heat"] * bool(heat)]
    notes = [row for row in table.rows if only_text(row, dialect) and row.line > table.rows[at].line]
    texts = [only_text(row, dialect).replace("( )", "()") for row in notes]
    legend = {sign: end for text in texts for sign, end in legend_in(text).items()}
    tests, count = list[TableRow](), Counter[str]()
    for row, temperature in zip(body, temperatures.values, strict=True):
        for stress, cell in zip(stresses.values, row.cells[1:], strict=False):
            if is_missing(cell) or cell in ("\N{MINUS SIGN}", "...", "…"):
                continue
            if not stress or not is_number_like(cell, dialect):
                return None
            if cell[0] in "([" and legend.get("()") != RUPTURED:
                cell = f">{cell.strip('()[] ')}"
            name = f"{heat or table.sheet or table.path.stem} {temperature} {stress}"
            count[name] += 1
            name = f"{name} ({count[name]})" if count[name] > 1 else name
            tests.append(TableRow(row.line, [name, temperature, stress, cell, *[heat] * bool(heat)]))
    titles = [row for row in table.rows[:at] if only_text(row, dialect) and row.cells[0]]
    whole = [*titles, TableRow(table.rows[at].line, head), *tests, *notes]
    return replace(table, rows=whole, merged=frozenset()).assuming("a test a cell of a matrix of rupture times")


def _axis(cells: Iterable[str], kind: QuantityKind) -> _Axis:
    """The numbers of conditions in cells, and the unit that stands beside them; none where some are no numbers."""
    values, units = list[str](), list[str]()
    for cell in cells:
        with_unit = _WITH_UNIT.fullmatch(cell)
        unit = unit_suffix(with_unit[2]) if with_unit else None
        if with_unit and unit in kind.units:
            cell = with_unit[1]
            units.append(str(unit))
        if cell and not _NUMBER.fullmatch(cell):
            return _Axis([], "")
        values.append(cell)
    while values and not values[-1]:
        values.pop()
    return _Axis(values, units[0] if units else "")


def _unit_in(texts: Iterable[str], kind: QuantityKind) -> str:
    """The first unit of a kind in brackets, or behind `in`, a comma or `_`, in some texts; "" for none."""
    found = (unit_suffix(match[1] or match[2]) for text in texts for match in _UNITS.finditer(text))
    return next((unit for unit in found if unit and unit in kind.units), "")
