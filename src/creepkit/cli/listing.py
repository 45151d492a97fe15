"""`creepkit list`: laws, specimens, targets of exports, readers and plugins that are known, or one of them in full."""

from __future__ import annotations

from typing import Annotated

import typer

from creepkit.cli.shared import Json
from creepkit.errors import PluginError, nearest
from creepkit.reports.catalogue import print_law, print_laws, print_plugins, print_specimen, print_specimens
from creepkit.reports.terminal import print_json, print_table

KINDS = {"laws": "law", "specimens": "specimen", "targets": "", "readers": "", "cameras": "", "plugins": ""}


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
    if name is not None and not KINDS[chosen]:
        raise PluginError(f"only a law or a specimen is shown in full; leave '{name}' out")
    if chosen == "plugins":
        print_plugins(registry.plugins(), registry.conflicts(), as_json)
    elif chosen == "laws" and name is None:
        print_laws(registry.laws(), registry.conflicts(), as_json)
    elif chosen == "laws":
        law = registry.law(name or "")
        print_law(law, registry.laws()[law.name], as_json)
    elif chosen == "specimens" and name is None:
        print_specimens(registry.specimens(), as_json)
    elif chosen == "specimens":
        registry.specimen(name or "")  # which says what is wrong with a name
        print_specimen(registry.specimens()[name or ""], as_json)
    else:
        found = getattr(registry, "exporters" if chosen == "targets" else chosen)()
        rows = [(key, getattr(entry.value, "title", ""), str(entry.provenance)) for key, entry in found.items()]
        if as_json:
            print_json([{"name": key, "title": title, "provenance": source} for key, title, source in rows])
        else:
            print_table("", ("name", "what it is", "from"), rows)
