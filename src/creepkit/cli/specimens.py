"""`creepkit specimens`: what can be simulated and identified from, with its outputs, loads and lengths."""

from __future__ import annotations

from typing import Annotated

import typer

from creepkit.reports.catalogue import print_specimen, print_specimens


def command(
    name: Annotated[str | None, typer.Argument(metavar="[NAME]", help="A specimen to show in full.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """List the specimens, or show one in full."""
    from creepkit.registry import default_registry

    if name is None:
        print_specimens(default_registry().specimens(), as_json)
    else:
        default_registry().specimen(name)  # which says what is wrong with a name
        print_specimen(default_registry().specimens()[name], as_json)
