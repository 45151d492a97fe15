"""How the tests were made: what was held, what the strain is, heat, dimensions, temperature."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from creepkit.reports.html.elements import Table, number, printable
from creepkit.reports.load_programs import temperature_text

if TYPE_CHECKING:
    from creepkit.records import History

NOT_STATED = "not stated"


HEAT_LABELS = ("heat", "batch", "cast")


CONTROLS = {"load": "load held", "stress": "true stress held"}


def table_of_details(histories: Sequence[History], more: str) -> Table:
    """A row for each test. more : what the caption says of tests that are not listed."""
    rows = [
        (
            printable(h.name, 120),
            printable(h.specimen, 80),
            CONTROLS.get(str(getattr(h.loading, "control", "")), f"{h.loading.quantity} imposed"),
            temperature_text(h),
            *_strain(h),
            _heat(h),
            _dimensions(h),
        )
        for h in histories
    ]
    columns = ("test", "specimen", "control", "temperature", "strain", "elastic strain", "heat", "dimensions, mm")
    return Table(f"How the tests were made{more}", columns, rows)


def _strain(history: History) -> tuple[str, str]:
    if "strain" not in history.outputs:
        return "none measured", "–"
    return history.strain_measure, "included" if history.includes_elastic else "not included"


def _heat(history: History) -> str:
    known = [history.labels[label] for label in HEAT_LABELS if history.labels.get(label)]
    return printable(known[0], 80) if known else NOT_STATED


def _dimensions(history: History) -> str:
    stated = [f"{name.replace('_', ' ')} {number(float(value))}" for name, value in history.geometry.items()]
    return printable(", ".join(stated), 200) or NOT_STATED
