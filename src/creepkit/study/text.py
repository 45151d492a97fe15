"""Laws as text for a target."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from creepkit import registry
from creepkit.errors import ExportError
from creepkit.records import Exporter, Units, LawWithValues
from creepkit.study.nouns import resolve_law

if TYPE_CHECKING:
    from creepkit.discovery.trend import TemperatureLaw
    from creepkit.inverse.identification import Identification
    from creepkit.language import CreepLaw, Elastic


def export(
    source: CreepLaw | Identification | TemperatureLaw | LawWithValues | str,
    target: str,
    values: Mapping[str, float] | None = None,
    *,
    units: Units | Mapping[str, str] | None = None,
    temperature: float | None = None,
    elastic: Elastic | None = None,
    name: str = "",
    notes: Sequence[str] = (),
    to: str | Path | None = None,
    force: bool = False,
) -> str:
    """Return a law with its values as text for a target (latex, python, abaqus ...), and write it to a file if asked.

    source : a law, which needs `values` {parameter: value}, or an identification or a law of temperature that was
        discovered, whose intervals and range of validity become comments, or a ValuedLaw, such as an exported JSON
        read back.
    target : one of `exporters()`. units : of stress and time in the text, Units("Pa", "h") or {"stress": "Pa"}.
    temperature : K, puts a number in the place of the temperature, for targets that know none.
    elastic : E in MPa, and nu, for targets that state them. name : what the target calls the law.
    to, force : the file to write, and whether one that exists may be replaced.

    ExportError, with the reason, when the target cannot express the law.
    """
    from creepkit.export.writing import write_export

    exporter = registry.default_registry().exporter(target)
    if temperature is not None:
        notes = [*notes, f"taken at a temperature of {temperature:g} K"]
    valued = _resolve_valued_law(source, values, notes)
    valued = valued.replace(
        units=valued.units if units is None else _resolve_units(units),
        elastic=elastic or valued.elastic,
        name=name or valued.name,
    )
    if temperature is not None:
        valued = valued.at(temperature)
    if to is not None:
        write_export(valued, exporter, to, force=force)
    return exporter.text(valued)


def exporters() -> dict[str, Exporter]:
    """Return every target that laws can be exported to: {name: exporter}."""
    return {name: entry.value for name, entry in registry.default_registry().exporters().items()}


def _resolve_valued_law(
    source: CreepLaw | Identification | TemperatureLaw | LawWithValues | str, values: Mapping[str, float] | None,
    notes: Sequence[str],
) -> LawWithValues:  # fmt: skip
    """The source with its own values, or those given in their place, which its notes then tell."""
    from creepkit.inverse.identification import Identification

    resolved: Any = getattr(source, "valued", source)  # a law of temperature has one
    if isinstance(resolved, Identification):
        from creepkit.inverse.printing import identification_comments

        resolved = LawWithValues(resolved.law, resolved.values, tuple(identification_comments(resolved)), ranges=resolved.ranges)
    if not isinstance(resolved, LawWithValues):
        return LawWithValues(resolve_law(resolved), values or {}, tuple(notes))
    source_values, valued_law = resolved.values, resolved if values is None else resolved.replace(values=values)
    change_notes = [
        f"{k} = {v:.8g} was set by hand, in place of {source_values[k]:.8g}" for k, v in valued_law.values.items() if v != source_values[k]
    ]
    return valued_law.replace(notes=(*resolved.notes, *change_notes, *notes))


def _resolve_units(units: Units | Mapping[str, str]) -> Units:
    if isinstance(units, Units):
        return units
    unknown = sorted({*units} - {"stress", "time"})
    if unknown:
        raise ExportError(f"units have no '{unknown[0]}'; write units={{'stress': 'Pa', 'time': 'h'}}")
    return Units(**units)
