"""`creepkit reduced-model`: the tables of the reduced-order model of a bulge specimen, from finite elements."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from creepkit.cli.options import parse_numbers


def command(
    to: Annotated[Path, typer.Option(help="File to write, .safetensors.")],
    specimen: Annotated[str, typer.Option(help="A bulge specimen.")] = "bulge",
    geometry: Annotated[
        list[str] | None, typer.Option(metavar="NAME=MM", help="A length of the dimple, such as cavity_radius=6.")
    ] = None,
    picture: Annotated[Path | None, typer.Option(help="Picture of k, kappa and redistribution to write.")] = None,
) -> None:
    """Tabulate the reduced-order model of a dimple.

    k(D, h), kappa(D, h), redistribution, elastic deflection and shapes; some seconds.
    """
    import creepkit as ck
    from creepkit.errors import SolveError
    from creepkit.report.simulation import tables_figure, tables_text
    from creepkit.specimens.bulge.reduced_order.tables import build_tables, write_tables
    from creepkit.specimens.bulge.specimen import Bulge

    specimen_record = ck.specimen(specimen)
    if not isinstance(specimen_record, Bulge):
        raise SolveError(f"--specimen {specimen}: only a bulge has a one-degree-of-freedom model; leave it out")
    specimen_record = specimen_record.replace(**parse_numbers(geometry or [], "--geometry", "cavity_radius=6"))
    model_tables = build_tables(specimen_record, specimen_record.geometry, specimen_record.observation)
    typer.echo(tables_text(model_tables))
    if picture is not None:
        tables_figure(model_tables, picture)
        typer.echo(f"wrote {picture}", err=True)
    typer.echo(f"wrote {write_tables(model_tables, to)}", err=True)
