"""`creepkit base`: the tables of the one-degree-of-freedom model of a dimple, from the finite elements."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from creepkit.cli.loads import numbers


def command(
    to: Annotated[Path, typer.Option(help="File to write, .safetensors.")],
    specimen: Annotated[str, typer.Option(help="A bulge specimen.")] = "bulge",
    geometry: Annotated[
        list[str] | None, typer.Option(metavar="NAME=MM", help="A length of the dimple, such as cavity_radius=6.")
    ] = None,
    picture: Annotated[Path | None, typer.Option(help="Picture of k, kappa and redistribution to write.")] = None,
) -> None:
    """Tabulate the cheap stand-in of a dimple.

    k(D, h), kappa(D, h), redistribution, elastic deflection and shapes; some seconds.
    """
    from creepkit import study
    from creepkit.errors import SolveError
    from creepkit.specimens.bulge import Bulge
    from creepkit.specimens.reduced_files import write_tables
    from creepkit.specimens.reduced_picture import described
    from creepkit.specimens.reduced_picture import picture as draw
    from creepkit.specimens.reduced_tables import tables

    body = study.specimen(specimen)
    if not isinstance(body, Bulge):
        raise SolveError(f"--specimen {specimen}: only a bulge has a one-degree-of-freedom model; leave it out")
    body = body.replace(**numbers(geometry or [], "--geometry", "cavity_radius=6"))
    found = tables(body, body.geometry, body.observation)
    typer.echo(described(found))
    if picture is not None:
        draw(found, picture)
        typer.echo(f"wrote {picture}", err=True)
    typer.echo(f"wrote {write_tables(found, to)}", err=True)
