"""`creepkit new-law`: a law plugin to start from, in one file."""

from __future__ import annotations

import re
from pathlib import Path
from string import Template
from typing import Annotated

import typer

TEMPLATE = Template('''\
"""$title: say here in one line what the law describes."""

from creepkit.language import CreepLaw, Param, hookimpl, parameters, stress

A, n = parameters("A n")

$constant = CreepLaw(
    name="$name",
    title="$title",
    terms={"power law": A * stress**n},
    params={
        A: Param("rate coefficient", unit="1/s", bounds=(1e-40, 1e-5), scale="log", off=0.0),
        n: Param("stress exponent", bounds=(1, 8)),
    },
    references=("Author (year), journal volume, page",),
)


@hookimpl
def creepkit_laws():
    return [$constant]
''')


def command(name: Annotated[str, typer.Argument(help="Name of the law, such as 'my-law'.")]) -> None:
    """Write a law plugin of some 20 lines to start from."""
    from creepkit import registry
    from creepkit.errors import LawError

    if not re.fullmatch(r"[a-z][a-z0-9]*(-[a-z0-9]+)*", name):
        raise typer.BadParameter(f"'{name}' is not a law's name: use lower-case words joined by '-', such as my-law")
    if name in registry.default().laws():
        raise LawError(f"there is a law '{name}' already; choose another name, see 'creepkit laws'")
    path = _write(name)
    typer.echo(f"wrote {path}; next: edit its terms and params, then run 'creepkit check {path}'")


def _write(name: str) -> Path:
    """Write the file, which must not exist."""
    stem = name.replace("-", "_")
    path = Path(f"{stem}.py")
    title = name.replace("-", " ").capitalize()
    text = TEMPLATE.substitute(name=name, title=title, constant=stem.upper())
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        from creepkit.errors import PluginError

        raise PluginError(f"{path} exists already; it was left as it is, choose another name or move it") from None
    return path
