"""What is registered, for people and as JSON: laws, specimens, materials and plugins."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from creepkit.registry import kinds
from creepkit.reports.blocks import Block, Paragraph, Table, as_text
from creepkit.reports.json_values import fields_to_json
from creepkit.reports.terminal import print_table, tell

if TYPE_CHECKING:
    from creepkit.language import CreepLaw
    from creepkit.records import Material, Specimen
    from creepkit.registry import Plugin, Registered


DETAILS: dict[kinds.PluginKind[Any], tuple[str, Callable[[Any], str]]] = {
    kinds.LAWS: ("parameters", lambda law: " ".join(law.names)),
    kinds.SPECIMENS: ("outputs", lambda specimen: " ".join(specimen.outputs)),
    kinds.MATERIALS: ("range", lambda material: ", ".join(material.spans)),
}
"""{kind: what a list of it says of each, and its text}."""


def print_registered(
    kind: kinds.PluginKind[Any], found: Mapping[str, Registered[Any]], conflicts: Sequence[str]
) -> None:
    """Print one row each, and on stderr what was left out because two plugins offer it."""
    head, text = DETAILS.get(kind, ("from", None))
    rows = [
        (name, getattr(one.value, "title", ""), text(one.value) if text else str(one.provenance))
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


def print_material(entry: Registered[Material]) -> None:
    """Print the law of a material with its values, its range and its source, as an export states them."""
    from creepkit.exporters.law_description import heading

    tell("\n".join([entry.value.name, *heading(entry.value.valued), f"From {entry.provenance}."]))


def material_to_json(entry: Registered[Material]) -> dict[str, Any]:
    """All that is known of a material; its law as that of a list of laws."""
    return {
        **fields_to_json(entry.value, "name title form source"),
        "law": law_to_json(replace(entry, value=entry.value.law)),  # type: ignore[arg-type]
        "values": dict(entry.value.values),
        "ranges": {name: list(ends) for name, ends in entry.value.ranges.items()},
        "covariance": [list(row) for row in entry.value.covariance],
        "provenance": str(entry.provenance),
    }


IN_FULL: Mapping[kinds.PluginKind[Any], tuple[Callable[[Any], None], Callable[[Any], dict[str, Any]]]] = {
    kinds.LAWS: (print_law, law_to_json),
    kinds.SPECIMENS: (print_specimen, specimen_to_json),
    kinds.MATERIALS: (print_material, material_to_json),
}
"""{kind: how one of it is printed in full, and as JSON}."""


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
