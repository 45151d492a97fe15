"""`creepkit plugins`: what is loaded, where it came from, and what is wrong with it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from creepkit.report.terminal import print_json, print_table

if TYPE_CHECKING:
    from creepkit.registry import Plugin


def command(as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False) -> None:
    """List the plugins, what they offer and what is wrong."""
    from creepkit import registry

    plugins, clashes = registry.default_registry().plugins(), registry.default_registry().conflicts()
    if as_json:
        print_json({"plugins": [_plugin_to_json(plugin) for plugin in plugins], "clashes": clashes})
        return
    rows = [(p.provenance.name, p.provenance.origin, _offers_text(p), _status(p)) for p in plugins]
    print_table(f"{len(rows)} plugins", ("plugin", "from", "offers", "status"), rows)
    for sentence in (*(plugin.problem for plugin in plugins if plugin.problem), *clashes):
        typer.echo(sentence)


def _plugin_to_json(plugin: Plugin) -> dict[str, Any]:
    return {
        "name": plugin.provenance.name,
        "from": plugin.provenance.origin,
        "status": _status(plugin),
        "problem": plugin.problem,
        "offers": {word: list(things) for word, things in plugin.contributions.items()},
        "commands": plugin.commands,
    }


def _offers_text(plugin: Plugin) -> str:
    offers = [f"{kind} {name}" for kind, names in plugin.contributions.items() for name in names]
    return ", ".join(offers + ["commands"] * plugin.commands)


def _status(plugin: Plugin) -> str:
    return "broken" if plugin.problem else "ok"
