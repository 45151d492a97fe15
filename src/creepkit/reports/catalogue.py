"""What is registered, for people and as JSON: laws, specimens, materials and plugins."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from creepkit.registry import kinds
from creepkit.reports.blocks import Block, Paragraph, Table, as_text
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


def print_law(entry: Registered[CreepLaw]) -> None:
    """Print one law in full: its equation, parameters, who registered it, and LaTeX."""
    tell(f"{entry.value}\n  from {entry.provenance}\n  LaTeX: {entry.value.latex()}")


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


def print_material(entry: Registered[Material]) -> None:
    """Print the law of a material with its values, its range and its source, as an export states them."""
    from creepkit.exporters.law_description import heading

    tell("\n".join([entry.value.name, *heading(entry.value.valued), f"From {entry.provenance}."]))


IN_FULL: Mapping[kinds.PluginKind[Any], Callable[[Any], None]] = {
    kinds.LAWS: print_law,
    kinds.SPECIMENS: print_specimen,
    kinds.MATERIALS: print_material,
}
"""{kind: how one of it is printed in full}."""


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
