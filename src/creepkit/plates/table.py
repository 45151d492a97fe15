"""A plate as text and as CSV."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from creepkit.inverse.writing import write_text_atomically
from creepkit.plates.answer import AlloyResult, mean_chi_square, mean_relative_squared_error

if TYPE_CHECKING:
    from creepkit.plates.plate import Plate

COMPARISON_STRESS = 100.0
"""MPa, at which rates and local exponents of alloys are compared."""
TABLE_COLUMNS = ("alloy", "class", "law", "weight", "rate at 100 MPa, 1/s", "local exponent", "chi-square", "confirmed")


def table_rows(plate: Plate) -> list[tuple[str, ...]]:
    """One row an alloy for people: COLUMNS."""
    return [_table_row(plate, result) for result in plate.results]


def screening_text(plate: Plate) -> str:
    """The table, the share of each law in each class, and what failed."""
    rows = [TABLE_COLUMNS, *table_rows(plate)]
    widths = [max(len(row[k]) for row in rows) for k in range(len(TABLE_COLUMNS))]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    return "\n".join([*lines, "", *summary_lines(plate)])


def summary_lines(plate: Plate) -> list[str]:
    """What the alloys say together, and what is odd, a line each."""
    decisive = sum(result.decisive for result in plate.identified)
    lines = [f"{len(plate.identified)} of {len(plate.results)} alloys identified, {decisive} of them decisively"]
    if plate.compositions is not None:
        for name, law_fractions in plate.law_fractions().items():
            fractions = ", ".join(f"{law} {100 * fraction:.0f} %" for law, fraction in sorted(law_fractions.items(), key=lambda p: -p[1]))
            lines.append(f"{name} ({len(plate.by_class()[name])}): {fractions}")
    lines += [f"failed: {_failure_text(alloy, reason)}" for alloy, reason in plate.failures.items()]
    for answer in plate.identified:
        if answer.confirmation is not None and not answer.confirmation.confirmed:
            lines.append(f"{answer.alloy}: {answer.confirmation.verdict}")
    return [*lines, *(f"note: {note}" for note in plate.notes)]


def write_csv(plate: Plate, path: Path) -> Path:
    """Write the whole table; columns of parameters are those of all laws found, empty where a law has none."""
    rows = [result_columns(plate, result) for result in plate.results]
    columns = list(dict.fromkeys(name for row in rows for name in row))
    columns.sort(key=lambda name: name == "notes")
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return write_text_atomically(text.getvalue(), path)


def result_columns(plate: Plate, result: AlloyResult) -> dict[str, Any]:
    """Everything that the CSV says of one alloy."""
    first_columns: dict[str, Any] = {"alloy": result.alloy, "class": plate.class_of(result.alloy)}
    if not result.identified:
        return {**first_columns, "tests": len(plate.histories[result.alloy]), "notes": result.failure}
    fit = result.best
    columns = {
        **first_columns,
        "tests": len(plate.histories[result.alloy]),
        "law": fit.law.name,
        "weight": _number_text(result.laws[0].weight),
        "decisive": "yes" if result.decisive else "no",
        "not_ruled_out": "; ".join(result.credible_laws[1:]),
        "equivalents": "; ".join(result.equivalents),
        **_interval_columns("rate_100MPa", fit.rate(COMPARISON_STRESS)),
        **_interval_columns("local_exponent_100MPa", fit.local_exponent(COMPARISON_STRESS)),
        "rate_strain": _number_text(fit.reference.strain),
        "rate_time_s": _number_text(fit.reference.time),
        "rate_temperature_K": _number_text(fit.reference.temperature),
        **{f"rse_{name}": _number_text(e.relative_squared_error) for name, e in fit.errors.items()},
        **{f"chi_square_{name}": _number_text(e.chi_square) for name, e in fit.errors.items()},
        "confirmed": confirmation_text(result),
        **_confirmation_columns(result),
        "loss_reduced": _number_text(mean_relative_squared_error(result.reduced_fit)),
        "loss_dense": "" if result.dense_fit is None else _number_text(mean_relative_squared_error(result.dense_fit)),
        **({} if result.sparse_fit is None else {"law_by_penalty": result.sparse_fit.law.name}),
    }
    for e in fit.estimates:
        columns |= {e.name: _number_text(e.value), f"{e.name}_low": _number_text(e.low), f"{e.name}_high": _number_text(e.high)}
    return {**columns, "notes": "; ".join([*result.notes, *(f"{law}: {why}" for law, why in result.failed_laws.items())])}


def _table_row(plate: Plate, result: AlloyResult) -> tuple[str, ...]:
    first_cells = (result.alloy, plate.class_of(result.alloy))
    if not result.identified:
        return (*first_cells, "none", *[""] * (len(TABLE_COLUMNS) - 3))
    fit = result.best
    names = fit.law.name + (f" or {', '.join(result.credible_laws[1:])}" if len(result.credible_laws) > 1 else "")
    return (
        *first_cells, names, f"{result.laws[0].weight:.2f}", _interval_text(fit.rate(COMPARISON_STRESS), 3), _interval_text(fit.local_exponent(COMPARISON_STRESS), 3),
        f"{mean_chi_square(fit):.3g}", confirmation_text(result),
    )  # fmt: skip


def _interval_text(interval: Sequence[Any], digits: int) -> str:
    value, low, high = (float(v) for v in interval)
    return f"{value:.{digits}g} [{low:.{digits}g}, {high:.{digits}g}]"


def _interval_columns(name: str, interval: Sequence[Any]) -> dict[str, str]:
    return {f"{name}{suffix}": _number_text(float(v)) for suffix, v in zip(("", "_low", "_high"), interval, strict=True)}


def confirmation_text(result: AlloyResult) -> str:
    if result.confirmation is None:
        return ""
    return "yes" if result.confirmation.confirmed else "no"


def _confirmation_columns(result: AlloyResult) -> dict[str, str]:
    """{confirmed_chi_square_...}: of the simulation, the mean over tests."""
    chi_squares: dict[str, list[float]] = {}
    for test in result.confirmation.tests if result.confirmation is not None else ():
        for comparison in test.outputs:
            chi_squares.setdefault(f"confirmed_chi_square_{comparison.output}", []).append(comparison.simulation_errors.chi_square)
    return {name: _number_text(sum(values) / len(values)) for name, values in chi_squares.items()}


def _number_text(number: float) -> str:
    return "" if math.isnan(number) else f"{number:.7g}"


def _failure_text(alloy: str, failure: str) -> str:
    """The reason, after the alloy's name where it does not say it itself."""
    return failure if f"'{alloy}'" in failure else f"alloy '{alloy}': {failure}"
