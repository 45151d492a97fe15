"""`creepkit plugins`: what is loaded, where it came from, and what is wrong with it."""

from __future__ import annotations

from typing import Annotated

import typer

from creepkit.reports.catalogue import print_plugins


def command(as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False) -> None:
    """List the plugins, what they offer and what is wrong."""
    from creepkit.registry import default_registry

    registry = default_registry()
    print_plugins(registry.plugins(), registry.conflicts(), as_json)
