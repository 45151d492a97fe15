"""How the tests were made: what was held, what the strain is, heat, dimensions, temperature."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from creepkit.reports.html.elements import Block, Paragraph, Table, number, printable, sentence
from creepkit.reports.load_programs import temperature_text

if TYPE_CHECKING:
    from creepkit.records import History

NOT_STATED = "not stated"


HEAT_LABELS = ("heat", "batch", "cast")


CONTROLS = {"load": "load held", "stress": "true stress held"}


def details_of_tests(histories: Sequence[History], more: str) -> list[Block]:
    """What tests have in common in a sentence, and a row for each of what differs.

    more : what the caption says of tests that are not listed.
    """
    columns = ("specimen", "control", "temperature", "strain", "elastic strain", "heat", "dimensions, mm")
    rows = [
        (
            printable(h.specimen, 80),
            CONTROLS.get(str(getattr(h.loading, "control", "")), f"{h.loading.quantity} imposed"),
            temperature_text(h),
            *_strain(h),
            _heat(h),
            _dimensions(h),
        )
        for h in histories
    ]
    differing = [k for k in range(len(columns)) if len({row[k] for row in rows}) > 1]
    shared = [f"{name} {rows[0][k]}" for k, name in enumerate(columns) if k not in differing]
    blocks: list[Block] = [Paragraph(sentence(f"all tests: {', '.join(shared)}"))] if shared else []
    if differing:
        named = [(printable(h.name, 120), *(row[k] for k in differing)) for h, row in zip(histories, rows, strict=True)]
        blocks.append(Table(f"How the tests were made{more}", ("test", *(columns[k] for k in differing)), named))
    return blocks


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
