"""`creepkit confirm`: the simulation of an identified law beside each test."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from creepkit.reports.terminal import print_json, print_table, tell


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
    from creepkit.reports.confirmation_text import CONFIRMATION_COLUMNS, confirmation_rows, confirmation_to_json

    identification, histories = ck.load(fit), ck.read_histories(tests)
    if surrogate is not None:
        identification = replace(identification, predictor=ck.surrogate(surrogate))
    confirmation = ck.confirm(identification, histories)
    if as_json:
        print_json(confirmation_to_json(confirmation))
        return
    print_table(
        f"{confirmation.law} by {confirmation.predictor_name}", CONFIRMATION_COLUMNS, confirmation_rows(confirmation)
    )
    tell(confirmation.verdict)
