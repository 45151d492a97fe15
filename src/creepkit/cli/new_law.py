"""`creepkit new-law`: a law plugin to start from, as an installable package or as one file."""

from __future__ import annotations

from typing import Annotated

import typer

from creepkit.cli.new_package import PackageKind, write_plugin
from creepkit.errors import LawError

LAW = PackageKind(
    "law",
    LawError,
    edit="its terms and params",
    check="creepkit check $file",
    use="creepkit laws $name\ncreepkit check $name",
    module='''\
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
''',
    test="""\
import creepkit as ck


def test_it_keeps_what_every_law_promises() -> None:
    report = ck.check_law(ck.law("$name"))
    assert report.passed, str(report)
""",
)


def command(
    name: Annotated[str, typer.Argument(help="Name of the law, such as 'my-law'.")],
    file: Annotated[bool, typer.Option("--file", help="One file, for --plugin and CREEPKIT_PLUGINS.")] = False,
) -> None:
    """Write a law of some 20 lines to start from, as a package."""
    from creepkit.registry import default_registry

    write_plugin(LAW, name, default_registry().laws(), one_file=file)
