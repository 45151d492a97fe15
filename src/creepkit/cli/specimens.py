"""`creepkit specimens`: what can be simulated and identified from, with its outputs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from creepkit.report.terminal import print_json, print_table

if TYPE_CHECKING:
    from creepkit.records import Specimen
    from creepkit.registry import Registered


def command(as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False) -> None:
    """List the specimens, and what is observed of each."""
    from creepkit import registry

    registered = registry.default_registry().specimens()
    if as_json:
        print_json([_specimen_to_json(entry) for entry in registered.values()])
        return
    rows = [
        (specimen.name, specimen.title, " ".join(specimen.outputs))
        for specimen in (found.value for found in registered.values())
    ]
    print_table(f"{len(rows)} specimens", ("name", "title", "outputs"), rows)


def _specimen_to_json(entry: Registered[Specimen]) -> dict[str, Any]:
    specimen = entry.value
    return {
        "name": specimen.name,
        "title": specimen.title,
        "outputs": list(specimen.outputs),
        "nuisances": list(getattr(specimen, "nuisances", ())),
        "provenance": str(entry.provenance),
    }
