"""`creepkit list`: laws, specimens, targets of exports, readers and plugins that are known, or one of them in full."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from creepkit.cli.shared import Json
from creepkit.errors import PluginError, nearest
from creepkit.reports import catalogue
from creepkit.reports.terminal import print_json

KINDS = dict.fromkeys(
    ("laws", "specimens", "targets", "readers", "cameras", "instruments", "temperature-forms", "plugins")
)


def command(
    kind: Annotated[str, typer.Argument(metavar="KIND", help=f"{', '.join(KINDS)}; laws by default.")] = "laws",
    name: Annotated[str | None, typer.Argument(metavar="[NAME]", help="Show this law or specimen in full.")] = None,
    *,
    as_json: Json = False,
) -> None:
    """What plugins that are installed or named by --plugin offer is listed as well."""
    from creepkit.registry import default_registry

    registry = default_registry()
    chosen = kind.lower() if kind.lower() in KINDS else f"{kind.lower()}s"
    if chosen not in KINDS:
        raise PluginError(f"there is no list of '{kind}'; {nearest(kind, KINDS)}")
    if name is not None and chosen not in ("laws", "specimens"):
        raise PluginError(f"only a law or a specimen is shown in full; leave '{name}' out")
    if chosen == "plugins":
        plugins, conflicts = registry.plugins(), registry.conflicts()
        if as_json:
            print_json({"plugins": [*map(catalogue.plugin_to_json, plugins)], "clashes": conflicts})
        else:
            catalogue.print_plugins(plugins, conflicts)
        return
    found = getattr(registry, "exporters" if chosen == "targets" else chosen.replace("-", "_"))()
    single = None
    if name is not None:  # which says what is wrong with it
        single = found[(registry.law(name) if chosen == "laws" else registry.specimen(name)).name]
    if as_json:
        written = {"laws": catalogue.law_to_json, "specimens": catalogue.specimen_to_json}
        document: Any = written.get(chosen, catalogue.registered_to_json)
        print_json([*map(document, found.values())] if single is None else document(single))
    elif single is not None:
        (catalogue.print_law if chosen == "laws" else catalogue.print_specimen)(single)
    else:
        catalogue.print_registered(chosen, found, registry.conflicts() if chosen == "laws" else ())
