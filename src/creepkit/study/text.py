"""Laws as text for a target."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from creepkit import registry
from creepkit.errors import ExportError
from creepkit.records import Exporter, Units, ValuedLaw
from creepkit.study.nouns import law_given

if TYPE_CHECKING:
    from creepkit.discovery.trend import TemperatureLaw
    from creepkit.inverse.identification import Identification
    from creepkit.language import CreepLaw, Elastic


def export(
    source: CreepLaw | Identification | TemperatureLaw | ValuedLaw | str,
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
    from creepkit.export.writing import write_text

    exporter = registry.default().exporter(target)
    if temperature is not None:
        notes = [*notes, f"taken at a temperature of {temperature:g} K"]
    valued = _valued(source, values, notes)
    valued = valued.replace(
        units=valued.units if units is None else _units(units),
        elastic=elastic or valued.elastic,
        name=name or valued.name,
    )
    if temperature is not None:
        valued = valued.at(temperature)
    if to is not None:
        write_text(valued, exporter, to, force=force)
    return exporter.text(valued)


def exporters() -> dict[str, Exporter]:
    """Return every target that laws can be exported to: {name: exporter}."""
    return {name: found.value for name, found in registry.default().exporters().items()}


def _valued(
    source: CreepLaw | Identification | TemperatureLaw | ValuedLaw | str, values: Mapping[str, float] | None,
    notes: Sequence[str],
) -> ValuedLaw:  # fmt: skip
    """The source with its own values, or those given in their place, which its notes then tell."""
    from creepkit.inverse.identification import Identification

    given: Any = getattr(source, "valued", source)  # a law of temperature has one
    if isinstance(given, Identification):
        from creepkit.inverse.printing import notes_of

        given = ValuedLaw(given.law, given.values, tuple(notes_of(given)), ranges=given.ranges)
    if not isinstance(given, ValuedLaw):
        return ValuedLaw(law_given(given), values or {}, tuple(notes))
    own, found = given.values, given if values is None else given.replace(values=values)
    changed = [
        f"{k} = {v:.8g} was set by hand, in place of {own[k]:.8g}" for k, v in found.values.items() if v != own[k]
    ]
    return found.replace(notes=(*given.notes, *changed, *notes))


def _units(given: Units | Mapping[str, str]) -> Units:
    if isinstance(given, Units):
        return given
    odd = sorted({*given} - {"stress", "time"})
    if odd:
        raise ExportError(f"units have no '{odd[0]}'; write units={{'stress': 'Pa', 'time': 'h'}}")
    return Units(**given)
