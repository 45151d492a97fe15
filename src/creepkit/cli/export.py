"""`creepkit export`: an identified law, or one with given values, as text for people, programs and solvers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from creepkit.cli.command_options import OutputPath
from creepkit.cli.shared import Law, Values, law_source, merged_values
from creepkit.exporters.exporting import ExportOptions
from creepkit.reports.terminal import put, tell, tell_written


def command(
    source: Law,
    *,
    to: Annotated[str, typer.Option("--to", metavar="TARGET", help="latex, python, abaqus ...; or 'list' for all.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="File to write; by default it is printed."), OutputPath()
    ] = None,
    value: Values = None,
    options: Annotated[dict[str, Any], ExportOptions],
) -> None:
    """Intervals and the range of validity are written as comments."""
    import creepkit as ck
    from creepkit.registry import default_registry, kinds

    if to == "list":
        for target in ck.available("exporters").values():
            tell(f"{target.name:16} {target.suffix:8} {target.title}")
        return
    default_registry().one(kinds.EXPORTERS, to)  # a target that is misspelt is said first
    chosen = law_source(source)
    text = ExportOptions().changed(options).text(chosen, to, merged_values(chosen, value), output)
    if output is None:
        put(text.rstrip("\n") + "\n")
    else:
        tell_written(output)
