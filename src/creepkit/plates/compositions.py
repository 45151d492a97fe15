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
from creepkit.plates.elements import ATOMIC_WEIGHTS
from creepkit.readers.tables import SourceText, TextTable, read_table

EQUIMOLAR_MARGIN = 5.0
"""at.% between the two largest elements of an alloy below which it is near-equimolar."""
NEAR_EQUIMOLAR, UNKNOWN_CLASS = "near-equimolar", "unknown"
COMPOSITION_UNITS = ("wt.%", "at.%")
ALLOWED_TOTAL = (98.0, 102.0)
"""Per cent that the elements of an alloy must add up to; they are scaled to 100."""


@dataclass(frozen=True)
class Compositions:
    """What alloys are made of: {alloy: {element: at.%}}, and where that was written."""

    atomic: Mapping[str, Mapping[str, float]]
    source: str = ""

    def class_of(self, alloy: str) -> str:
        """Such as "Fe-rich", or "near-equimolar"; "unknown" for an alloy that the table lacks."""
        if alloy not in self.atomic:
            return UNKNOWN_CLASS
        contents = sorted(self.atomic[alloy].items(), key=lambda pair: -pair[1])
        if len(contents) > 1 and contents[0][1] - contents[1][1] < EQUIMOLAR_MARGIN:
            return NEAR_EQUIMOLAR
        return f"{contents[0][0]}-rich"

    def missing(self, alloys: list[str]) -> tuple[str, ...]:
        """One sentence for each alloy that is not in the table."""
        return tuple(
            f"{self.source or 'the compositions'}: no alloy '{name}', whose class stays unknown; "
            f"{nearest(name, self.atomic)}"
            for name in alloys if name not in self.atomic
        )  # fmt: skip


def atomic_percent(weights: Mapping[str, float]) -> dict[str, float]:
    """{element: at.%} from {element: wt.%}: x_i = (w_i / M_i) / sum (w_j / M_j)."""
    moles = {element: weight / ATOMIC_WEIGHTS[element] for element, weight in weights.items()}
    return {element: 100.0 * n / sum(moles.values()) for element, n in moles.items()}


def resolve_compositions(compositions: Compositions | str | Path | None) -> Compositions | None:
    """The compositions themselves, or those of a table."""
    return read_compositions(compositions) if isinstance(compositions, (str, Path)) else compositions


def read_compositions(path: str | Path) -> Compositions:
    """Read a table of compositions; HistoryError, with file and line, says what is wrong with another."""
    table = read_table(Path(path))
    unit = _composition_unit(table)
    elements = _element_columns(table)
    compositions: dict[str, Mapping[str, float]] = {}
    for row in table.rows:
        place, name = table.location(row.line), row.cells[table.column("alloy")]
        if not name or name in compositions:
            raise HistoryError(f"{place}: alloy '{name}' stands there twice or has no name; give each its own")
        contents = {e: SourceText(row.cells[table.column(e)] or "0", place).number(e) for e in elements}
        contents = {element: value for element, value in _scaled_to_100(contents, place, name).items() if value > 0}
        compositions[name] = atomic_percent(contents) if unit == "wt.%" else contents
    return Compositions(compositions, str(path))


def _composition_unit(table: TextTable) -> str:
    entry = table.header.get("unit")
    if entry is None or entry.text not in COMPOSITION_UNITS:
        problem = "no line '# unit: ...'" if entry is None else f"unit '{entry.text}'"
        place = table.path if entry is None else entry.location
        raise HistoryError(f"{place}: {problem}; write '# unit: wt.%' or '# unit: at.%' above the columns")
    return entry.text


def _element_columns(table: TextTable) -> list[str]:
    table.column("alloy")
    elements = [name for name in table.columns if name != "alloy"]
    for name in elements:
        if name not in ATOMIC_WEIGHTS:
            place = table.location(table.columns_line)
            raise HistoryError(f"{place}: column '{name}' is no element that is known; {nearest(name, ATOMIC_WEIGHTS)}")
    return elements


def _scaled_to_100(contents: Mapping[str, float], place: str, alloy: str) -> dict[str, float]:
    """The same scaled to 100 %."""
    total = sum(contents.values())
    if min(contents.values(), default=0.0) < 0:
        raise HistoryError(f"{place}: alloy '{alloy}' has a negative content; write contents from zero on")
    if not ALLOWED_TOTAL[0] <= total <= ALLOWED_TOTAL[1]:
        raise HistoryError(
            f"{place}: the elements of alloy '{alloy}' add up to {total:g} %; they must make 100 (98 to 102 are "
            "scaled), so add what is missing"
        )
    return {element: 100.0 * value / total for element, value in contents.items()}
