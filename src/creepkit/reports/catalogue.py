"""What is registered, as tables and JSON: laws, specimens and plugins."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from creepkit.reports.json_values import fields_to_json
from creepkit.reports.terminal import print_json, print_table, tell

if TYPE_CHECKING:
    from creepkit.language import CreepLaw
    from creepkit.records import Specimen
    from creepkit.registry import Plugin, Registered


def print_laws(registered: Mapping[str, Registered[CreepLaw]], conflicts: Sequence[str], as_json: bool) -> None:
    """Print one row a law, and on stderr what was left out because two plugins offer it."""
    if as_json:
        print_json([_law_to_json(entry) for entry in registered.values()])
        return
    laws = [entry.value for entry in registered.values()]
    rows = [(law.name, law.title, " ".join(law.names)) for law in laws]
    print_table(f"{len(rows)} laws", ("name", "title", "parameters"), rows)
    for sentence in conflicts:
        tell(f"left out: {sentence}", err=True)


def print_law(law: CreepLaw, entry: Registered[CreepLaw], as_json: bool) -> None:
    """Print one law in full: its equation, parameters, who registered it, and LaTeX."""
    if as_json:
        print_json(_law_to_json(entry))
    else:
        tell(f"{law}\n  from {entry.provenance}\n  LaTeX: {law.latex()}")


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
        "parameters": {name: fields_to_json(p, "meaning unit bounds scale off limits") for name, p in table},
        "states": {
            symbol.name: {**fields_to_json(s, "meaning unit initial limit"), "rate": str(s.rate)}
            for symbol, s in law.states.items()
        },
        "constraints": [str(relation) for relation in law.constraints],
        "references": list(law.references),
        "latex": law.latex(),
    }


def print_specimens(registered: Mapping[str, Registered[Specimen]], as_json: bool) -> None:
    """Print one row a specimen, with what is observed of it."""
    if as_json:
        print_json([_specimen_to_json(entry) for entry in registered.values()])
        return
    specimens = [entry.value for entry in registered.values()]
    rows = [(specimen.name, specimen.title, " ".join(specimen.outputs)) for specimen in specimens]
    print_table(f"{len(rows)} specimens", ("name", "title", "outputs"), rows)


def print_specimen(entry: Registered[Specimen], as_json: bool) -> None:
    """Print all that a specimen says of itself; loads and lengths with their options of the command line."""
    if as_json:
        print_json(_specimen_to_json(entry))
        return
    from creepkit.records import dimensions_of, loads_of, outputs_of  # heavy, and a list of laws needs none of it

    specimen = entry.value
    tell(f"{specimen.name}: {specimen.title}\n  from {entry.provenance}")
    outputs = [(o, o.unit, o.long_name, "" if o.noise is None else f"{o.noise:g}") for o in outputs_of(specimen)]
    print_table("outputs", ("name", "unit", "what it is", "noise"), outputs)
    loads = [(load.name, load.unit, load.long_name, _option(load.name)) for load in loads_of(specimen)]
    print_table("loads", ("name", "unit", "what it is", "option"), loads)
    lengths = [
        (d.name, f"{d.default:g}", f"{100 * d.tolerance:g} %" if d.tolerance else "", d.long_name, _option(d.name))
        for d in dimensions_of(specimen)
    ]
    if lengths:
        print_table("lengths, mm", ("name", "default", "tolerance", "what it is", "option"), lengths)
    tell(f"nuisance parameters: {', '.join(_nuisances_of(specimen))}")


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _nuisances_of(specimen: Specimen) -> list[str]:
    return list(getattr(specimen, "nuisances", ()))


def _specimen_to_json(entry: Registered[Specimen]) -> dict[str, Any]:
    from creepkit.records import dimensions_of, loads_of, outputs_of

    specimen = entry.value
    return {
        "name": specimen.name,
        "title": specimen.title,
        "outputs": list(specimen.outputs),
        "units": {o: o.unit for o in outputs_of(specimen)},
        "loads": {load.name: load.unit for load in loads_of(specimen)},
        "lengths_mm": {d.name: d.default for d in dimensions_of(specimen)},
        "nuisances": _nuisances_of(specimen),
        "provenance": str(entry.provenance),
    }


def print_plugins(plugins: Sequence[Plugin], conflicts: Sequence[str], as_json: bool) -> None:
    """Print one row a plugin, what it offers and what is wrong with it."""
    if as_json:
        found = [
            {
                "name": plugin.provenance.name,
                "from": plugin.provenance.origin,
                "status": _status(plugin),
                "problem": plugin.problem,
                "offers": {word: list(things) for word, things in plugin.contributions.items()},
                "commands": plugin.commands,
            }
            for plugin in plugins
        ]
        print_json({"plugins": found, "clashes": conflicts})
        return
    rows = []
    for one in plugins:
        offers = [f"{kind} {name}" for kind, names in one.contributions.items() for name in names]
        offered = ", ".join(offers + ["commands"] * one.commands)
        rows.append((one.provenance.name, one.provenance.origin, offered, _status(one)))
    print_table(f"{len(rows)} plugins", ("plugin", "from", "offers", "status"), rows)
    for sentence in (*(plugin.problem for plugin in plugins if plugin.problem), *conflicts):
        tell(sentence)


def _status(plugin: Plugin) -> str:
    return "broken" if plugin.problem else "ok"
