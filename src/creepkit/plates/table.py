"""A plate as text and as CSV."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from creepkit.inverse.writing import write_text
from creepkit.plates.answer import AlloyAnswer, chi_square, loss

if TYPE_CHECKING:
    from creepkit.plates.plate import Plate

STRESS = 100.0
"""MPa, at which rates and local exponents of alloys are compared."""
COLUMNS = ("alloy", "class", "law", "weight", "rate at 100 MPa, 1/s", "local exponent", "chi-square", "confirmed")


def rows_of(plate: Plate) -> list[tuple[str, ...]]:
    """One row an alloy for people: COLUMNS."""
    return [_row(plate, answer) for answer in plate.answers]


def text_of(plate: Plate) -> str:
    """The table, the share of each law in each class, and what failed."""
    rows = [COLUMNS, *rows_of(plate)]
    widths = [max(len(row[k]) for row in rows) for k in range(len(COLUMNS))]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    return "\n".join([*lines, "", *summary(plate)])


def summary(plate: Plate) -> list[str]:
    """What the alloys say together, and what is odd, a line each."""
    decisive = sum(answer.decisive for answer in plate.identified)
    lines = [f"{len(plate.identified)} of {len(plate.answers)} alloys identified, {decisive} of them decisively"]
    if plate.compositions is not None:
        for name, shares in plate.shares().items():
            told = ", ".join(f"{law} {100 * share:.0f} %" for law, share in sorted(shares.items(), key=lambda p: -p[1]))
            lines.append(f"{name} ({len(plate.classes()[name])}): {told}")
    lines += [f"failed: {_beginning(alloy, reason)}" for alloy, reason in plate.failed.items()]
    for answer in plate.identified:
        if answer.confirmation is not None and not answer.confirmation.holds:
            lines.append(f"{answer.alloy}: {answer.confirmation.verdict}")
    return [*lines, *(f"note: {note}" for note in plate.notes)]


def write_csv(plate: Plate, path: Path) -> Path:
    """Write the whole table; columns of parameters are those of all laws found, empty where a law has none."""
    told = [record_of(plate, answer) for answer in plate.answers]
    columns = list(dict.fromkeys(name for record in told for name in record))
    columns.sort(key=lambda name: name == "notes")
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(told)
    return write_text(text.getvalue(), path)


def record_of(plate: Plate, answer: AlloyAnswer) -> dict[str, Any]:
    """Everything that the CSV says of one alloy."""
    start: dict[str, Any] = {"alloy": answer.alloy, "class": plate.class_of(answer.alloy)}
    if not answer.identified:
        return {**start, "tests": len(plate.histories[answer.alloy]), "notes": answer.reason}
    fit = answer.best
    told = {
        **start,
        "tests": len(plate.histories[answer.alloy]),
        "law": fit.law.name,
        "weight": _digits(answer.laws[0].weight),
        "decisive": "yes" if answer.decisive else "no",
        "not_ruled_out": "; ".join(answer.remaining[1:]),
        "equivalents": "; ".join(answer.equivalents),
        **_band("rate_100MPa", fit.rate(STRESS)),
        **_band("local_exponent_100MPa", fit.local_exponent(STRESS)),
        "rate_strain": _digits(fit.reference.strain),
        "rate_time_s": _digits(fit.reference.time),
        "rate_temperature_K": _digits(fit.reference.temperature),
        **{f"rse_{name}": _digits(e.rse) for name, e in fit.errors.items()},
        **{f"chi_square_{name}": _digits(e.chi_square) for name, e in fit.errors.items()},
        "confirmed": _confirmed(answer),
        **_confirmed_misfits(answer),
        "loss_reduced": _digits(loss(answer.reduced)),
        "loss_dense": "" if answer.dense is None else _digits(loss(answer.dense)),
        **({} if answer.sparse is None else {"law_by_penalty": answer.sparse.law.name}),
    }
    for e in fit.estimates:
        told |= {e.name: _digits(e.value), f"{e.name}_low": _digits(e.low), f"{e.name}_high": _digits(e.high)}
    return {**told, "notes": "; ".join([*answer.notes, *(f"{law}: {why}" for law, why in answer.failed.items())])}


def _row(plate: Plate, answer: AlloyAnswer) -> tuple[str, ...]:
    start = (answer.alloy, plate.class_of(answer.alloy))
    if not answer.identified:
        return (*start, "none", *[""] * (len(COLUMNS) - 3))
    fit = answer.best
    names = fit.law.name + (f" or {', '.join(answer.remaining[1:])}" if len(answer.remaining) > 1 else "")
    return (
        *start, names, f"{answer.laws[0].weight:.2f}", _ends(fit.rate(STRESS), 3), _ends(fit.local_exponent(STRESS), 3),
        f"{chi_square(fit):.3g}", _confirmed(answer),
    )  # fmt: skip


def _ends(band: Sequence[Any], digits: int) -> str:
    value, low, high = (float(v) for v in band)
    return f"{value:.{digits}g} [{low:.{digits}g}, {high:.{digits}g}]"


def _band(name: str, band: Sequence[Any]) -> dict[str, str]:
    return {f"{name}{end}": _digits(float(v)) for end, v in zip(("", "_low", "_high"), band, strict=True)}


def _confirmed(answer: AlloyAnswer) -> str:
    if answer.confirmation is None:
        return ""
    return "yes" if answer.confirmation.holds else "no"


def _confirmed_misfits(answer: AlloyAnswer) -> dict[str, str]:
    """{confirmed_chi_square_...}: of the simulation, the mean over tests."""
    found: dict[str, list[float]] = {}
    for test in answer.confirmation.tests if answer.confirmation is not None else ():
        for one in test.outputs:
            found.setdefault(f"confirmed_chi_square_{one.output}", []).append(one.simulated.chi_square)
    return {name: _digits(sum(values) / len(values)) for name, values in found.items()}


def _digits(number: float) -> str:
    return "" if math.isnan(number) else f"{number:.7g}"


def _beginning(alloy: str, reason: str) -> str:
    """The reason, after the alloy's name where it does not say it itself."""
    return reason if f"'{alloy}'" in reason else f"alloy '{alloy}': {reason}"
