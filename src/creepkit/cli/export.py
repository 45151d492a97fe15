"""`creepkit export`: an identified law, or one with given values, as text for people, programs and solvers."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from collections.abc import Mapping

    from creepkit.inverse.identification import Identification
    from creepkit.language import CreepLaw
    from creepkit.records import ValuedLaw


def command(
    source: Annotated[
        str, typer.Argument(metavar="RESULT.json|LAW", help="An identification, an exported JSON, or a law's name.")
    ],
    to: Annotated[str, typer.Option("--to", metavar="TARGET", help="latex, python, abaqus ...; or 'list' for all.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="File to write; by default it is printed.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite a file that exists.")] = False,
    value: Annotated[
        list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="A parameter's value, given or changed.")
    ] = None,
    stress_unit: Annotated[str, typer.Option(help="MPa, Pa, kPa, GPa, psi or ksi.")] = "MPa",
    time_unit: Annotated[str, typer.Option(help="s, min, h, day or year.")] = "s",
    temperature_c: Annotated[float | None, typer.Option(help="A number in the place of the temperature, C.")] = None,
    modulus_gpa: Annotated[float | None, typer.Option(help="Young's modulus, GPa, for targets that state it.")] = None,
    poisson: Annotated[float, typer.Option(help="Poisson's ratio, beside the modulus.")] = 0.3,
    name: Annotated[str, typer.Option(help="What the target is to call the law.")] = "",
) -> None:
    """Write a law with its values as text, or for a solver.

    Intervals and the range of validity travel as comments.
    """
    from creepkit import study
    from creepkit.language import Elastic
    from creepkit.records import ZERO_CELSIUS

    if to == "list":
        for target in study.exporters().values():
            typer.echo(f"{target.name:16} {target.suffix:8} {target.title}")
        return
    found = _source(source)
    text = study.export(
        found,
        to,
        _values(found, value),
        units={"stress": stress_unit, "time": time_unit},
        temperature=None if temperature_c is None else temperature_c + ZERO_CELSIUS,
        elastic=None if modulus_gpa is None else Elastic(E=1e3 * modulus_gpa, nu=poisson),
        name=name,
        to=output,
        force=force,
    )
    typer.echo(text.rstrip("\n") if output is None else f"wrote {output}")


def _source(text: str) -> CreepLaw | Identification | ValuedLaw:
    """A file where there is one, or where its name says so; else a law by name."""
    from creepkit import study

    path = Path(text)
    if path.suffix.lower() == ".json" or path.is_file():
        from creepkit.export.document import read_source

        return read_source(path)
    return study.law(text)


def _values(found: CreepLaw | Identification | ValuedLaw, given: list[str] | None) -> dict[str, float] | None:
    """The values of the source with those given in their place; None for a source's own."""
    from creepkit.cli.loads import numbers

    changed = numbers(given or [], "--set", "n=5.2")
    own: Mapping[str, float] | None = getattr(found, "values", None) if hasattr(found, "law") else None
    if own is None:
        return changed
    return {**own, **changed} if changed else None
