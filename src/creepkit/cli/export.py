"""`creepkit export`: an identified law, or one with given values, as text for people, programs and solvers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from creepkit.cli.command_options import OutputPath
from creepkit.cli.shared import Law, Values, law_source, merged_values
from creepkit.limits import CELSIUS, GIGAPASCAL, POISSON
from creepkit.options import CELSIUS as IN_CELSIUS
from creepkit.options import GIGAPASCAL as IN_GIGAPASCAL
from creepkit.options import Option
from creepkit.reports.terminal import put, tell, tell_written


def command(
    source: Law,
    *,
    to: Annotated[str, typer.Option("--to", metavar="TARGET", help="latex, python, abaqus ...; or 'list' for all.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="File to write; by default it is printed."), OutputPath()
    ] = None,
    value: Values = None,
    stress_unit: Annotated[str, Option(help="MPa, Pa, kPa, GPa, psi or ksi.")] = "MPa",
    time_unit: Annotated[str, Option(help="s, min, h, day or year.")] = "s",
    temperature: Annotated[
        float | None, Option(help="A number in the place of the temperature.", limits=CELSIUS, **IN_CELSIUS)
    ] = None,
    modulus: Annotated[
        float | None, Option(help="Young's modulus, for targets that state it.", limits=GIGAPASCAL, **IN_GIGAPASCAL)
    ] = None,
    poisson: Annotated[float, Option(help="Poisson's ratio, beside the modulus.", limits=POISSON)] = 0.3,
    name: Annotated[str, Option(help="What the target is to call the law.")] = "",
) -> None:
    """Intervals and the range of validity are written as comments."""
    import creepkit as ck
    from creepkit.registry import default_registry

    if to == "list":
        for target in ck.available("exporters").values():
            tell(f"{target.name:16} {target.suffix:8} {target.title}")
        return
    default_registry().exporter(to)  # a target that is misspelt is said first
    chosen = law_source(source)
    elastic = None if modulus is None else ck.Elastic(E=modulus, nu=poisson)
    text = ck.export(
        ck.law_with_values(chosen, merged_values(chosen, value), elastic=elastic, name=name),
        to,
        units={"stress": stress_unit, "time": time_unit},
        temperature=temperature,
        to=output,
    )
    if output is None:
        put(text.rstrip("\n") + "\n")
    else:
        tell_written(output)
