"""`creepkit export`: an identified law, or one with given values, as text for people, programs and solvers."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from creepkit import limits
from creepkit.cli.declared_options import OutputPath
from creepkit.cli.options import is_file_name
from creepkit.reports.terminal import put, tell, tell_written

if TYPE_CHECKING:
    from collections.abc import Mapping

    from creepkit.inverse.identification import Identification
    from creepkit.language import CreepLaw
    from creepkit.records import LawWithValues


def command(
    source: Annotated[
        str, typer.Argument(metavar="RESULT.json|LAW", help="An identification, an exported JSON, or a law's name.")
    ],
    to: Annotated[str, typer.Option("--to", metavar="TARGET", help="latex, python, abaqus ...; or 'list' for all.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="File to write; by default it is printed."), OutputPath()
    ] = None,
    value: Annotated[
        list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="A parameter's value, given or changed.")
    ] = None,
    stress_unit: Annotated[str, typer.Option(help="MPa, Pa, kPa, GPa, psi or ksi.")] = "MPa",
    time_unit: Annotated[str, typer.Option(help="s, min, h, day or year.")] = "s",
    temperature_c: Annotated[
        float | None, typer.Option(help="A number in the place of the temperature, C."), limits.CELSIUS
    ] = None,
    modulus_gpa: Annotated[
        float | None, typer.Option(help="Young's modulus, GPa, for targets that state it."), limits.GIGAPASCAL
    ] = None,
    poisson: Annotated[float, typer.Option(help="Poisson's ratio, beside the modulus."), limits.POISSON] = 0.3,
    name: Annotated[str, typer.Option(help="What the target is to call the law.")] = "",
) -> None:
    """Write a law with its values as text, or for a solver.

    Intervals and the range of validity are written as comments.
    """
    import creepkit as ck
    from creepkit.records import ZERO_CELSIUS
    from creepkit.registry import default_registry

    if to == "list":
        for target in ck.available("exporters").values():
            tell(f"{target.name:16} {target.suffix:8} {target.title}")
        return
    default_registry().exporter(to)  # a target that is misspelt is said first
    law_source = _resolve_source(source)
    elastic = None if modulus_gpa is None else ck.Elastic(E=1e3 * modulus_gpa, nu=poisson)
    text = ck.export(
        ck.law_with_values(law_source, _merged_values(law_source, value), elastic=elastic, name=name),
        to,
        units={"stress": stress_unit, "time": time_unit},
        temperature=None if temperature_c is None else temperature_c + ZERO_CELSIUS,
        to=output,
    )
    if output is None:
        put(text.rstrip("\n") + "\n")
    else:
        tell_written(output)


def _resolve_source(text: str) -> CreepLaw | Identification | LawWithValues:
    """A law by name, or what a file holds."""
    import creepkit as ck

    if is_file_name(text):
        from creepkit.exporters.law_files import read_law_file

        return read_law_file(text)
    return ck.law(text)


def _merged_values(
    law_source: CreepLaw | Identification | LawWithValues, assignments: list[str] | None
) -> dict[str, float] | None:
    """The values of the source with those given in their place; None for a source's own."""
    from creepkit.cli.options import parse_numbers

    given_values = parse_numbers(assignments or [], "--set", "n=5.2")
    source_values: Mapping[str, float] | None = (
        getattr(law_source, "values", None) if hasattr(law_source, "law") else None
    )
    if source_values is None:
        return given_values
    return {**source_values, **given_values} if given_values else None
