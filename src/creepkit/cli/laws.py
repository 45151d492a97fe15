"""`creepkit laws`: the laws that are known, or one of them in full."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from creepkit.report.terminal import print_json, print_table

if TYPE_CHECKING:
    from creepkit.language import CreepLaw
    from creepkit.registry import Registered


def command(
    name: Annotated[str | None, typer.Argument(help="Show this law in full.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """List the laws that are known, or show one in full."""
    from creepkit import registry

    registered = registry.default_registry().laws()
    if name is not None:
        law = registry.default_registry().law(name)
        _print_law(law, registered[name], as_json)
    elif as_json:
        print_json([_law_to_json(entry) for entry in registered.values()])
    else:
        rows = [(law.name, law.title, " ".join(law.names)) for law in (found.value for found in registered.values())]
        print_table(f"{len(rows)} laws", ("name", "title", "parameters"), rows)
        for sentence in registry.default_registry().conflicts():
            typer.echo(f"left out: {sentence}", err=True)


def _print_law(law: CreepLaw, entry: Registered[CreepLaw], as_json: bool) -> None:
    if as_json:
        print_json(_law_to_json(entry))
    else:
        typer.echo(f"{law}\n  from {entry.provenance}\n  LaTeX: {law.latex()}")


def _law_to_json(entry: Registered[CreepLaw]) -> dict[str, Any]:
    """Return all that a law says, as JSON types; the text of a term is for reading, never to be parsed."""
    law = entry.value
    table = law.table.items()
    return {
        "name": law.name,
        "title": law.title,
        "provenance": str(entry.provenance),
        "fingerprint": law.fingerprint,
        "terms": {label: str(term) for label, term in law.terms.items()},
        "parameters": {
            name: {
                "meaning": p.meaning,
                "unit": p.unit,
                "bounds": p.bounds,
                "scale": p.scale,
                "off": p.off,
                "limits": None if p.limits is None else [x if abs(x) < float("inf") else None for x in p.limits],
            }
            for name, p in table
        },
        "states": {
            symbol.name: {
                "meaning": s.meaning,
                "unit": s.unit,
                "rate": str(s.rate),
                "initial": s.initial,
                "limit": s.limit,
            }
            for symbol, s in law.states.items()
        },
        "constraints": [str(relation) for relation in law.constraints],
        "references": list(law.references),
        "latex": law.latex(),
    }
