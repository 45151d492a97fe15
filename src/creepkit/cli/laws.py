"""`creepkit laws`: the laws that are known, or one of them in full."""

from __future__ import annotations

from typing import Annotated

import typer

from creepkit.reports.catalogue import print_law, print_laws


def command(
    name: Annotated[str | None, typer.Argument(help="Show this law in full.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """List the laws that are known, or show one in full."""
    from creepkit.registry import default_registry

    registry = default_registry()
    registered = registry.laws()
    if name is None:
        print_laws(registered, registry.conflicts(), as_json)
    else:
        law = registry.law(name)
        print_law(law, registered[name], as_json)
