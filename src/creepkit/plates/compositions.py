"""Compositions of alloys: a table in weight or atomic per cent, and the class of each alloy.

    # unit: wt.%
    alloy,Ni,Cr,Mo,Fe
    IN625,65.5,21.5,9,4

An alloy is "Ni-rich", after its principal element in atomic per cent, unless the second element comes within 5 at.% of
it: then it is "near-equimolar". (The paper's classes go by the largest weight fraction, and it names near-equimolar
alloys without a rule; this one is ours.)
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from creepkit.errors import HistoryError, nearest
from creepkit.plates.elements import MASSES
from creepkit.readers.tables import Entry, Table, read_table

NEAR = 5.0
"""at.% between the two largest elements of an alloy below which it is near-equimolar."""
NEAR_EQUIMOLAR, UNKNOWN = "near-equimolar", "unknown"
UNITS = ("wt.%", "at.%")
SUM = (98.0, 102.0)
"""Per cent that the elements of an alloy must add up to; they are scaled to 100."""


@dataclass(frozen=True)
class Compositions:
    """What alloys are made of: {alloy: {element: at.%}}, and where that was written."""

    atomic: Mapping[str, Mapping[str, float]]
    source: str = ""

    def class_of(self, alloy: str) -> str:
        """Such as "Fe-rich", or "near-equimolar"; "unknown" for an alloy that the table lacks."""
        if alloy not in self.atomic:
            return UNKNOWN
        ordered = sorted(self.atomic[alloy].items(), key=lambda pair: -pair[1])
        if len(ordered) > 1 and ordered[0][1] - ordered[1][1] < NEAR:
            return NEAR_EQUIMOLAR
        return f"{ordered[0][0]}-rich"

    def lacking(self, alloys: list[str]) -> tuple[str, ...]:
        """One sentence for each alloy that is not in the table."""
        return tuple(
            f"{self.source or 'the compositions'}: no alloy '{name}', whose class stays unknown; "
            f"{nearest(name, self.atomic)}"
            for name in alloys if name not in self.atomic
        )  # fmt: skip


def atomic_percent(weights: Mapping[str, float]) -> dict[str, float]:
    """{element: at.%} from {element: wt.%}: x_i = (w_i / M_i) / sum (w_j / M_j)."""
    moles = {element: weight / MASSES[element] for element, weight in weights.items()}
    return {element: 100.0 * n / sum(moles.values()) for element, n in moles.items()}


def compositions_given(given: Compositions | str | Path | None) -> Compositions | None:
    """The compositions themselves, or those of a table."""
    return read_compositions(given) if isinstance(given, (str, Path)) else given


def read_compositions(path: str | Path) -> Compositions:
    """Read a table of compositions; HistoryError, with file and line, says what is wrong with another."""
    table = read_table(Path(path))
    unit = _unit(table)
    elements = _elements(table)
    found: dict[str, Mapping[str, float]] = {}
    for row in table.rows:
        place, name = table.place(row.line), row.cells[table.column("alloy")]
        if not name or name in found:
            raise HistoryError(f"{place}: alloy '{name}' stands there twice or has no name; give each its own")
        given = {e: Entry(row.cells[table.column(e)] or "0", place).number(e) for e in elements}
        given = {element: value for element, value in _whole(given, place, name).items() if value > 0}
        found[name] = atomic_percent(given) if unit == "wt.%" else given
    return Compositions(found, str(path))


def _unit(table: Table) -> str:
    entry = table.head.get("unit")
    if entry is None or entry.text not in UNITS:
        told = "no line '# unit: ...'" if entry is None else f"unit '{entry.text}'"
        place = table.path if entry is None else entry.place
        raise HistoryError(f"{place}: {told}; write '# unit: wt.%' or '# unit: at.%' above the columns")
    return entry.text


def _elements(table: Table) -> list[str]:
    table.column("alloy")
    elements = [name for name in table.columns if name != "alloy"]
    for name in elements:
        if name not in MASSES:
            place = table.place(table.columns_line)
            raise HistoryError(f"{place}: column '{name}' is no element that is known; {nearest(name, MASSES)}")
    return elements


def _whole(given: Mapping[str, float], place: str, alloy: str) -> dict[str, float]:
    """The same scaled to 100 %."""
    total = sum(given.values())
    if min(given.values(), default=0.0) < 0:
        raise HistoryError(f"{place}: alloy '{alloy}' has a negative content; write contents from zero on")
    if not SUM[0] <= total <= SUM[1]:
        raise HistoryError(
            f"{place}: the elements of alloy '{alloy}' add up to {total:g} %; they must make 100 (98 to 102 are "
            "scaled), so add what is missing"
        )
    return {element: 100.0 * value / total for element, value in given.items()}
