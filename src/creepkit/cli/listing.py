"""`creepkit list`: laws, specimens, targets of exports, readers and plugins that are known, or one of them in full."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from creepkit.cli.shared import Json
from creepkit.errors import PluginError
from creepkit.registry import Registered, default_registry, kinds
from creepkit.reports import catalogue
from creepkit.reports.terminal import print_json

KINDS = f"{', '.join(kinds.LISTED)} or plugins; laws by default."


def command(
    kind: Annotated[str, typer.Argument(metavar="KIND", help=KINDS)] = "laws",
    name: Annotated[str | None, typer.Argument(metavar="[NAME]", help="Show this law or specimen in full.")] = None,
    *,
    as_json: Json = False,
) -> None:
    """What plugins that are installed or named by --plugin offer is listed as well."""
    registry = default_registry()
    chosen = None if kind.lower() in ("plugin", "plugins") else kinds.kind(kind)
    if name is not None and chosen not in (kinds.LAWS, kinds.SPECIMENS):
        raise PluginError(f"only a law or a specimen is shown in full; leave '{name}' out")
    if chosen is None:
        plugins, conflicts = registry.plugins(), registry.conflicts()
        if as_json:
            print_json({"plugins": [*map(catalogue.plugin_to_json, plugins)], "clashes": conflicts})
        else:
            catalogue.print_plugins(plugins, conflicts)
        return
    if name is None:
        found = registry.all(chosen)
    elif chosen is kinds.LAWS:  # of several, such as a sum, the first that has brought one
        law = registry.law(name)
        found = {name: Registered(law, registry.plugins_of(law)[0])}
    else:
        found = {name: registry.all(chosen)[registry.specimen(name).name]}
    if as_json:
        written: Any = {kinds.LAWS: catalogue.law_to_json, kinds.SPECIMENS: catalogue.specimen_to_json}
        documents = [*map(written.get(chosen, catalogue.registered_to_json), found.values())]
        print_json(documents if name is None else documents[0])
    elif name is None:
        catalogue.print_registered(chosen, found, registry.conflicts(chosen))
    else:
        (catalogue.print_law if chosen is kinds.LAWS else catalogue.print_specimen)(found[name])
