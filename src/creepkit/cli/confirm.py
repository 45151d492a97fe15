"""`creepkit confirm`: the simulation of an identified law beside each test."""

from __future__ import annotations

import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from creepkit.report.terminal import print_json, print_table

if TYPE_CHECKING:
    from creepkit.inverse.confirmation import Confirmation, ConfirmedOutput


def command(
    fit: Annotated[Path, typer.Argument(metavar="FIT.json", help="An identification that was saved.")],
    tests: Annotated[list[str], typer.Argument(metavar="TESTS...", help="Measured files, folders or patterns.")],
    surrogate: Annotated[
        str | None, typer.Option(metavar="NAME", help="What it was identified through, to say how far that is off.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """Simulate an identified law for each test."""
    from dataclasses import replace

    import creepkit as ck

    identification, histories = ck.load(fit), ck.read_histories(tests)
    if surrogate is not None:
        identification = replace(identification, predictor=ck.surrogate(surrogate))
    confirmation = ck.confirm(identification, histories)
    if as_json:
        print_json(
            {"holds": confirmation.confirmed, "verdict": confirmation.verdict, **_json_value(asdict(confirmation))}
        )
        return
    print_table(
        f"{confirmation.law} by {confirmation.predictor_name}", CONFIRMATION_COLUMNS, confirmation_rows(confirmation)
    )
    typer.echo(confirmation.verdict)


CONFIRMATION_COLUMNS = ("test", "output", "chi-square", "of the fit", "rms", "apart, noise")


def confirmation_rows(confirmation: Confirmation) -> list[tuple[str, ...]]:
    """One row an output of a test."""
    return [_row(test.name, comparison) for test in confirmation.tests for comparison in test.outputs]


def _row(test: str, comparison: ConfirmedOutput) -> tuple[str, ...]:
    fit_chi_square = "" if comparison.fit_errors is None else _number_text(comparison.fit_errors.chi_square)
    rms = _number_text(math.sqrt(comparison.simulation_errors.mean_squared_error))
    return (
        test,
        comparison.output,
        _number_text(comparison.simulation_errors.chi_square),
        fit_chi_square,
        rms,
        _number_text(comparison.rms_difference),
    )


def _number_text(number: float) -> str:
    return "" if math.isnan(number) else f"{number:.3g}"


def _json_value(value: Any) -> Any:
    """The same with null for what JSON cannot hold."""
    if isinstance(value, dict):
        return {name: _json_value(item) for name, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_json_value(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
