"""`creepkit reduced-model`: train the reduced-order model of a specimen, and say how far it errs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from creepkit.cli.declared_options import OutputPath
from creepkit.cli.options import PAPER_SPECIMEN, parse_numbers
from creepkit.reports.terminal import tell, tell_written

if TYPE_CHECKING:
    from creepkit.records import SupportsTraining


def command(
    specimen: Annotated[str, typer.Option(help="A specimen in finite elements.")] = PAPER_SPECIMEN,
    geometry: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=MM", help="A length of the test piece, such as apex_thickness=0.45."),
    ] = None,
    picture: Annotated[Path | None, typer.Option(help="Picture of its points to write."), OutputPath("picture")] = None,
) -> None:
    """Train the reduced-order model of a test piece.

    Searches begin in it. It is kept in the cache folder, so that the first identification of such a test piece finds
    it there; some seconds.
    """
    import creepkit as ck
    from creepkit.errors import SolveError
    from creepkit.records import outputs_of
    from creepkit.reports.simulation import cubature_figure

    predictor = trainable_model(ck.specimen(specimen), geometry or [])
    tell(predictor.train())
    units = {str(output): output.unit for output in outputs_of(predictor)}
    errors = ", ".join(f"{name} {value:.2g} {units.get(name, '')}".rstrip() for name, value in predictor.error.items())
    tell(f"error against its finite elements, one standard deviation over runs it was not trained on: {errors}")
    if picture is not None:
        if not hasattr(predictor, "cubature_model"):
            raise SolveError(f"--picture: the reduced-order model of '{specimen}' has no points to draw; leave it out")
        cubature_figure(predictor.cubature_model(), picture)
        tell_written(picture, err=True)


def trainable_model(specimen: Any, geometry: list[str]) -> SupportsTraining:
    """The reduced-order model of a specimen with other lengths; SolveError where it has none that is trained."""
    from creepkit.errors import SolveError
    from creepkit.records import SupportsReducedOrderModel, SupportsTraining, known_specimens

    predictor = specimen.reduced_order_model() if isinstance(specimen, SupportsReducedOrderModel) else None
    if not isinstance(predictor, SupportsTraining):
        others = [
            name
            for name, each in known_specimens().items()
            if isinstance(each, SupportsReducedOrderModel) and isinstance(each.reduced_order_model(), SupportsTraining)
        ]
        raise SolveError(
            f"--specimen {specimen.name}: it has no reduced-order model that is trained; "
            f"name one of those that have one: {', '.join(others)}"
        )
    lengths = parse_numbers(geometry, "--geometry", "apex_thickness=0.45")
    if not lengths:
        return predictor
    changed = specimen.replace(**lengths).reduced_order_model()
    assert isinstance(changed, SupportsTraining)
    return changed
