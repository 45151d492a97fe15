"""`creepkit confirm`: the simulation of an identified law beside each test."""

from __future__ import annotations

import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from creepkit.cli.printing import print_json, print_table

if TYPE_CHECKING:
    from creepkit.inverse.confirm import Confirmation, ConfirmedOutput


def command(
    fit: Annotated[Path, typer.Argument(metavar="FIT.json", help="An identification that was saved.")],
    tests: Annotated[list[str], typer.Argument(metavar="TESTS...", help="Measured files, folders or patterns.")],
    surrogate: Annotated[
        str | None, typer.Option(metavar="NAME", help="What it was identified through, to tell how far that is off.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the answer as JSON.")] = False,
) -> None:
    """Simulate an identified law for each test."""
    from dataclasses import replace

    from creepkit import study

    found, histories = study.load(fit), study.read_histories(tests)
    if surrogate is not None:
        found = replace(found, using=study.surrogate(surrogate))
    told = study.confirm(found, histories)
    if as_json:
        print_json({"holds": told.holds, "verdict": told.verdict, **_finite(asdict(told))})
        return
    print_table(f"{told.law} by {told.using}", COLUMNS, rows_of(told))
    typer.echo(told.verdict)


COLUMNS = ("test", "output", "chi-square", "of the fit", "rms", "apart, noise")


def rows_of(told: Confirmation) -> list[tuple[str, ...]]:
    """One row an output of a test."""
    return [_row(test.name, one) for test in told.tests for one in test.outputs]


def _row(test: str, one: ConfirmedOutput) -> tuple[str, ...]:
    own = "" if one.fitted is None else _digits(one.fitted.chi_square)
    rms = _digits(math.sqrt(one.simulated.mse))
    return test, one.output, _digits(one.simulated.chi_square), own, rms, _digits(one.difference)


def _digits(number: float) -> str:
    return "" if math.isnan(number) else f"{number:.3g}"


def _finite(value: Any) -> Any:
    """The same with null for what JSON cannot hold."""
    if isinstance(value, dict):
        return {name: _finite(one) for name, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
