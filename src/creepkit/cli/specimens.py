"""`creepkit specimens`: what can be simulated and identified from, with its outputs."""

from __future__ import annotations

from typing import Annotated

import typer

from creepkit.report.catalogue import print_specimens


def command(as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False) -> None:
    """List the specimens, and what is observed of each."""
    from creepkit.registry import default_registry

    print_specimens(default_registry().specimens(), as_json)
