"""`creepkit specimens`: what can be simulated and identified from, with its outputs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from creepkit.cli.printing import print_json, print_table

if TYPE_CHECKING:
    from creepkit.records import Specimen
    from creepkit.registry import Registered


def command(as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False) -> None:
    """List the specimens, and what is observed of each."""
    from creepkit import registry

    known = registry.default().specimens()
    if as_json:
        print_json([_record(found) for found in known.values()])
        return
    rows = [(one.name, one.title, " ".join(one.outputs)) for one in (found.value for found in known.values())]
    print_table(f"{len(rows)} specimens", ("name", "title", "outputs"), rows)


def _record(found: Registered[Specimen]) -> dict[str, Any]:
    one = found.value
    return {
        "name": one.name,
        "title": one.title,
        "outputs": list(one.outputs),
        "nuisances": list(getattr(one, "effects", ())),
        "provenance": str(found.provenance),
    }
