"""`creepkit export`: an identified law, or one with given values, as text for people, programs and solvers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from creepkit import limits
from creepkit.cli.declared_options import OutputPath
from creepkit.cli.law_sources import law_source, merged_values
from creepkit.reports.terminal import put, tell, tell_written


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
    chosen = law_source(source)
    elastic = None if modulus_gpa is None else ck.Elastic(E=1e3 * modulus_gpa, nu=poisson)
    text = ck.export(
        ck.law_with_values(chosen, merged_values(chosen, value), elastic=elastic, name=name),
        to,
        units={"stress": stress_unit, "time": time_unit},
        temperature=None if temperature_c is None else temperature_c + ZERO_CELSIUS,
        to=output,
    )
    if output is None:
        put(text.rstrip("\n") + "\n")
    else:
        tell_written(output)
