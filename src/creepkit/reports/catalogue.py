"""What is registered, for people and as JSON: laws, specimens and plugins."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from creepkit.registry import kinds
from creepkit.reports.blocks import Block, Paragraph, Table, as_text
from creepkit.reports.json_values import fields_to_json
from creepkit.reports.terminal import print_table, tell

if TYPE_CHECKING:
    from creepkit.language import CreepLaw
    from creepkit.records import Specimen
    from creepkit.registry import Plugin, Registered


DETAILS = {kinds.LAWS: ("parameters", "names"), kinds.SPECIMENS: ("outputs", "outputs")}
"""{kind: what a list of it names of each, and where that stands}."""


def print_registered(
    kind: kinds.PluginKind[Any], found: Mapping[str, Registered[Any]], conflicts: Sequence[str]
) -> None:
    """Print one row each, and on stderr what was left out because two plugins offer it."""
    head, parts = DETAILS.get(kind, ("from", ""))
    rows = [
        (name, getattr(one.value, "title", ""), " ".join(getattr(one.value, parts)) if parts else str(one.provenance))
        for name, one in found.items()
    ]
    print_table(f"{len(rows)} {kind.listed or kind.plural}", ("name", "title", head), rows)
    for sentence in conflicts:
        tell(f"left out: {sentence}", err=True)


def registered_to_json(entry: Registered[Any]) -> dict[str, Any]:
    """What is known of an exporter, a reader or a camera format."""
    value = entry.value
    return {
        "name": getattr(value, "name", None) or value.__name__,
        "title": getattr(value, "title", ""),
        "provenance": str(entry.provenance),
    }


def print_law(entry: Registered[CreepLaw]) -> None:
    """Print one law in full: its equation, parameters, who registered it, and LaTeX."""
    tell(f"{entry.value}\n  from {entry.provenance}\n  LaTeX: {entry.value.latex()}")


def law_to_json(entry: Registered[CreepLaw]) -> dict[str, Any]:
    """All that a law says, as JSON types; the text of a term is for reading, never to be parsed."""
    law = entry.value
    return {
        **fields_to_json(law, "name title fingerprint references"),
        "provenance": str(entry.provenance),
        "terms": {label: str(term) for label, term in law.terms.items()},
        "parameters": {n: fields_to_json(p, "meaning unit bounds scale off limits") for n, p in law.table.items()},
        "states": {
            symbol.name: {**fields_to_json(s, "meaning unit initial limit"), "rate": str(s.rate)}
            for symbol, s in law.states.items()
        },
        "constraints": [str(relation) for relation in law.constraints],
        "latex": law.latex(),
    }


def print_specimen(entry: Registered[Specimen]) -> None:
    """Print all that a specimen says of itself."""
    tell(as_text([*specimen_blocks(entry.value), Paragraph(f"from {entry.provenance}")]))


def specimen_blocks(specimen: Specimen) -> list[Block]:
    """All that a specimen says of itself; loads and lengths with their options of the command line."""
    from creepkit.records import dimensions_of, loads_of, outputs_of  # heavy, and a list of laws needs none of it

    outputs = [(o, o.unit, o.long_name, "" if o.noise is None else f"{o.noise:g}") for o in outputs_of(specimen)]
    loads = [(load.name, load.unit, load.long_name, _option(load.name)) for load in loads_of(specimen)]
    lengths = [
        (d.name, f"{d.default:g}", f"{100 * d.tolerance:g} %" if d.tolerance else "", d.long_name, _option(d.name))
        for d in dimensions_of(specimen)
    ]
    tables = [
        Table("outputs", ("name", "unit", "what it is", "noise"), outputs),
        Table("loads", ("name", "unit", "what it is", "option"), loads),
        Table("lengths, mm", ("name", "default", "tolerance", "what it is", "option"), lengths),
    ]
    nuisances = Paragraph(f"nuisance parameters: {', '.join(specimen.nuisances)}")
    return [Paragraph(f"{specimen.name}: {specimen.title}", "lead"), *(t for t in tables if t.rows), nuisances]


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def specimen_to_json(entry: Registered[Specimen]) -> dict[str, Any]:
    """All that a specimen says of itself."""
    from creepkit.records import dimensions_of, loads_of, outputs_of

    specimen = entry.value
    return {
        **fields_to_json(specimen, "name title outputs"),
        "units": {o: o.unit for o in outputs_of(specimen)},
        "loads": {load.name: load.unit for load in loads_of(specimen)},
        "lengths_mm": {d.name: d.default for d in dimensions_of(specimen)},
        "nuisances": list(specimen.nuisances),
        "provenance": str(entry.provenance),
    }


def print_plugins(plugins: Sequence[Plugin], conflicts: Sequence[str]) -> None:
    """Print one row a plugin, what it offers and what is wrong with it."""
    rows = []
    for one in plugins:
        offers = [f"{kind} {name}" for kind, names in one.contributions.items() for name in names]
        offered = ", ".join(offers)
        rows.append((one.provenance.name, one.provenance.origin, offered, "broken" if one.problem else "ok"))
    print_table(f"{len(rows)} plugins", ("plugin", "from", "offers", "status"), rows)
    for sentence in (*(plugin.problem for plugin in plugins if plugin.problem), *conflicts):
        tell(sentence)


def plugin_to_json(plugin: Plugin) -> dict[str, Any]:
    """A plugin, what it offers and what is wrong with it."""
    return {
        "name": plugin.provenance.name,
        "from": plugin.provenance.origin,
        "status": "broken" if plugin.problem else "ok",
        **fields_to_json(plugin, "problem"),
        "offers": {word: list(things) for word, things in plugin.contributions.items()},
    }
