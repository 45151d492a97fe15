"""Exports: a law with its values as text for a target, of anything that has such a law."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from creepkit import limits
from creepkit.checked_arguments import checked
from creepkit.errors import ExportError
from creepkit.files.writing import write_text
from creepkit.language import CreepLaw, Elastic, elastic_of
from creepkit.options import CELSIUS, GIGAPASCAL, Options, option
from creepkit.records import Exporter, LawWithValues, Units
from creepkit.records.plugin_calls import call_of_plugin
from creepkit.registry import default_registry, kinds, resolve_law


@runtime_checkable
class Valued(Protocol):
    """A result that has a law with values: an identification, a ranking, a temperature law."""

    @property
    def valued(self) -> LawWithValues:
        """The law, its values, the ranges of the tests, and as notes the intervals and the verdict."""


@checked
def export(
    source: CreepLaw | Valued | LawWithValues | str,
    target: str | Exporter,
    values: Mapping[str, float] | None = None,
    *,
    units: Units | Mapping[str, str] | None = None,
    temperature: float | None = None,
    elastic: Elastic | None = None,
    to: str | Path | None = None,
    force: bool = False,
) -> str:
    """Return a law with its values as text for a target (latex, python, abaqus ...), and write it to a file if asked.

    source : a law, which needs `values` {parameter: value}, or an identification or a temperature law, whose intervals
        and range of validity become comments, or a ranking, whose best law is written with the verdict on it, or a
        material, whose range and source become comments, or the record of law_with_values(), which may have notes, and
        a name for the target, as well.
    target : one of `available("exporters")`, or an exporter itself. units : of stress and time in the text,
        Units("Pa", "h") or {"stress": "Pa"}.
    temperature : K, puts a number in the place of the temperature, for targets that know none.
    elastic : E in MPa, and nu, for targets that state them. to, force : the file to write, and whether one that exists
        may be replaced.

    ExportError, with the reason, when the target cannot express the law.
    """
    exporter = default_registry().one(kinds.EXPORTERS, target) if isinstance(target, str) else target
    record = law_with_values(source, values, elastic=elastic)
    if units is not None:
        record = record.replace(units=_units(units))
    if temperature is not None:
        taken = (f"taken at a temperature of {temperature:g} K", record.caution(temperature=temperature))
        record = record.replace(notes=(*record.notes, *filter(None, taken))).at(temperature)
    text = exported_text(exporter, record)
    if to is not None:
        write_text(text, Path(to), ExportError, force=force)
    return text


@checked
def law_with_values(
    source: CreepLaw | Valued | LawWithValues | str,
    values: Mapping[str, float] | None = None,
    *,
    elastic: Elastic | None = None,
    name: str = "",
    notes: Sequence[str] = (),
) -> LawWithValues:
    """Return a law with its values and what goes with them into every export.

    source, values, elastic : as export() takes them; notes say which values were set by hand in the place of others.
    name : what a target calls the law. notes : lines that become comments.
    """
    if isinstance(source, (str, CreepLaw)):
        return LawWithValues(resolve_law(source), values or {}, tuple(notes), elastic=elastic, name=name)
    given = source if isinstance(source, LawWithValues) else source.valued
    record = given if values is None else given.replace(values=values)
    changed = [
        f"{parameter} = {value:.8g} was set by hand, in place of {given.values[parameter]:.8g}"
        for parameter, value in record.values.items()
        if value != given.values[parameter]
    ]
    return record.replace(
        notes=(*given.notes, *changed, *notes), elastic=elastic or record.elastic, name=name or record.name
    )


def exported_text(exporter: Exporter, source: LawWithValues) -> str:
    """The text of an exporter; ExportError where text() raises another error or returns no text."""
    what = f"exporter '{exporter.name}': text()"
    text = call_of_plugin(lambda: exporter.text(source), exporter, what, ExportError)
    if not isinstance(text, str):
        raise ExportError(f"{what} returned a {type(text).__name__}; it must return a str")
    return text


PROGRAMS: Mapping[str, Mapping[str, str]] = {
    "Abaqus": {
        "abaqus-cards": "*CREEP",
        "abaqus": "*CREEP, LAW=USER with a subroutine",
        "mfront": "an MFront behaviour",
    },
    "CalculiX": {
        "calculix-cards": "*CREEP",
        "calculix": "*CREEP, LAW=USER with a subroutine",
        "mfront": "an MFront behaviour",
    },
    "Ansys": {"ansys": "TB,CREEP", "abaqus": "a subroutine USERCREEP"},  # which is given what CREEP is
}
"""{finite element code: {target: how the line of its creep law begins, or what it needs}}, the simplest first."""


def input_of_programs(source: Valued) -> dict[str, str]:
    """{finite element code: the line of its own creep law where the law is one, else the routine that it needs}."""
    found: dict[str, str] = {}
    for program, targets in PROGRAMS.items():
        for target, needed in targets.items():
            with suppress(ExportError):
                text = exported_text(default_registry().one(kinds.EXPORTERS, target), source.valued)
                found[program] = next((one for one in text.splitlines() if one.startswith(needed)), needed)
                break
    return found


def _units(units: Units | Mapping[str, str]) -> Units:
    if isinstance(units, Units):
        return units
    unknown = sorted({*units} - {"stress", "time"})
    if unknown:
        raise ExportError(f"units have no '{unknown[0]}'; write units={{'stress': 'Pa', 'time': 'h'}}")
    return Units(**units)


@checked
@dataclass(frozen=True)
class ExportOptions(Options, title="options of an export"):
    """What is said of an export beside its target. temperature : K, modulus : MPa."""

    name: str = option("", "What the target is to call the law.")
    stress_unit: str = option("MPa", "MPa, Pa, kPa, GPa, psi or ksi.")
    time_unit: str = option("s", "s, min, h, day or year.")
    temperature: float | None = option(None, "A number in the place of the temperature.", limits.CELSIUS, **CELSIUS)
    modulus: float | None = option(None, "Young's modulus, for targets that state it.", limits.GIGAPASCAL, **GIGAPASCAL)
    poisson: float = option(0.3, "Poisson's ratio, beside the modulus.", limits.POISSON)

    def text(
        self, source: Any, target: str, values: Mapping[str, float] | None = None, to: str | Path | None = None
    ) -> str:
        """The export of what has a law with values, and written to a file if asked."""
        record = law_with_values(source, values, elastic=elastic_of(self.modulus, self.poisson), name=self.name)
        units = {"stress": self.stress_unit, "time": self.time_unit}
        return export(record, target, units=units, temperature=self.temperature, to=to)
