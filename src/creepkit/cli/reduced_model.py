"""`creepkit reduced-model`: train the reduced-order model of a bulge specimen, and say how far it errs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from creepkit.cli.options import parse_numbers

UNITS = {"amplitude": " mm", "width": " mm"}
"""Of outputs that have one."""


def command(
    specimen: Annotated[str, typer.Option(help="A bulge specimen.")] = "bulge",
    geometry: Annotated[
        list[str] | None, typer.Option(metavar="NAME=MM", help="A length of the dimple, such as apex_thickness=0.45.")
    ] = None,
    picture: Annotated[Path | None, typer.Option(help="Picture of its points to write.")] = None,
) -> None:
    """Train the reduced-order model of a dimple.

    Searches begin in it. It is kept in the cache folder, so that the first identification of such a dimple finds it
    there; some seconds.
    """
    import creepkit as ck
    from creepkit.errors import SolveError
    from creepkit.report.simulation import cubature_figure
    from creepkit.specimens.bulge.reduced_order_model import BulgeReducedOrderModel
    from creepkit.specimens.bulge.specimen import Bulge

    specimen_record = ck.specimen(specimen)
    if not isinstance(specimen_record, Bulge):
        raise SolveError(f"--specimen {specimen}: only a bulge has a reduced-order model; leave it out")
    specimen_record = specimen_record.replace(**parse_numbers(geometry or [], "--geometry", "apex_thickness=0.45"))
    predictor = BulgeReducedOrderModel(specimen_record)
    model = predictor.reduced_model_of(predictor.own_setup())
    typer.echo(f"{len(model.basis.modes)} modes, {len(model.basis.points)} of {model.model.weights.size} points")
    errors = ", ".join(f"{name} {value:.2g}{UNITS.get(name, '')}" for name, value in predictor.error.items())
    typer.echo(f"error against its finite elements, one standard deviation over runs it was not trained on: {errors}")
    if picture is not None:
        cubature_figure(model, picture)
        typer.echo(f"wrote {picture}", err=True)
