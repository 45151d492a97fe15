"""`creepkit list`: laws, specimens, materials, targets of exports and plugins that are known, or one in full."""

from __future__ import annotations

from typing import Annotated

import typer

from creepkit.cli.shared import Json
from creepkit.errors import PluginError
from creepkit.registry import Registered, default_registry, kinds
from creepkit.reports import catalogue
from creepkit.reports.terminal import print_json

KINDS = f"{', '.join(kinds.LISTED)} or plugins; laws by default."


def command(
    kind: Annotated[str, typer.Argument(metavar="KIND", help=KINDS)] = "laws",
    name: Annotated[
        str | None, typer.Argument(metavar="[NAME]", help="This law, specimen or material in full.")
    ] = None,
    *,
    as_json: Json = False,
) -> None:
    """What plugins that are installed or named by --plugin offer is listed as well."""
    registry = default_registry()
    chosen = None if kind.lower() in ("plugin", "plugins") else kinds.kind(kind)
    if name is not None and chosen not in catalogue.IN_FULL:
        raise PluginError(f"only a law, a specimen or a material is shown in full; leave '{name}' out")
    if chosen is None:
        plugins, conflicts = registry.plugins(), registry.conflicts()
        if as_json:
            print_json({"plugins": plugins, "clashes": conflicts})
        else:
            catalogue.print_plugins(plugins, conflicts)
        return
    if name is None:
        found = registry.all(chosen)
    elif chosen is kinds.LAWS:  # of several, such as a sum, the first that has brought one
        law = registry.law(name)
        found = {name: Registered(law, registry.plugins_of(law)[0])}
    else:
        found = {name: registry.all(chosen)[registry.one(chosen, name).name]}
    if as_json:
        print_json([*found.values()] if name is None else found[name])
    elif name is None:
        catalogue.print_registered(chosen, found, registry.conflicts(chosen))
    else:
        catalogue.IN_FULL[chosen](found[name])
