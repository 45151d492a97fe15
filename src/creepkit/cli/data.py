"""`creepkit data`: what a data set holds."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from creepkit.report.terminal import print_json


def command(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A data set that 'creepkit generate' wrote.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
    plots: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="Draw inputs and a random handful of histories there.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Which handful.")] = 0,
) -> None:
    """Describe a data set: counts, reasons, ranges."""
    import creepkit as ck
    from creepkit.dataset.dataset import summary

    data = ck.read_dataset(file)
    if as_json:
        print_json(summary(data))
    else:
        typer.echo(str(data))
    if plots is not None:
        from creepkit.report.dataset import write_dataset_figures

        for path in write_dataset_figures(data, plots, seed):
            typer.echo(f"wrote {path}", err=as_json)
