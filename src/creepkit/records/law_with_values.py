"""A law with the values of its parameters, units and notes: what every exporter takes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from creepkit.checked_arguments import checked
from creepkit.errors import SAID, ExportError, LawError, refuse_unknown, restated
from creepkit.records.units import factors

if TYPE_CHECKING:
    from creepkit.language.elastic import Elastic
    from creepkit.language.law import CreepLaw


STRESS_UNITS = factors("MPa", "Pa", "kPa", "GPa", "psi", "ksi")
"""MPa in one unit of stress; 1 psi is 1 lbf/in^2 = 4.4482216152605 N/(25.4 mm)^2."""


TIME_UNITS = {**factors("s", "min", "h"), "day": factors("d")["d"], **factors("year")}
"""Seconds in one unit of time; a year is a Julian year."""


@checked
@dataclass(frozen=True)
class Units:
    """The units of a text that leaves: of stress (and moduli) and of time; temperatures are in K.

    A law itself is in MPa and s, and its numbers are ratios to 1 MPa and 1 s.
    """

    stress: str = "MPa"
    time: str = "s"

    def __post_init__(self) -> None:
        for what, unit, known in (("stress", self.stress, STRESS_UNITS), ("time", self.time, TIME_UNITS)):
            refuse_unknown(unit, known, ExportError, f"'{unit}' is not a unit of {what}")

    @property
    def megapascals(self) -> float:
        """MPa in one unit of stress."""
        return STRESS_UNITS[self.stress]

    @property
    def seconds(self) -> float:
        """Seconds in one unit of time."""
        return TIME_UNITS[self.time]

    @property
    def is_native(self) -> bool:
        """Whether these are the units of laws themselves."""
        return self == Units()


@checked
@dataclass(frozen=True)
class LawWithValues:
    """A law with its values, and what belongs to them.

    values : {parameter: number in its unit}, completed and checked. Conditions that have a value, in the law's unit,
        become numbers of the law.
    notes : lines that become comments: intervals, range of validity, provenance.
    units : of the text wanted. elastic : E in MPa, and nu, for targets that state them.
    name : what the target is to call the law; by default the law's own name, made an identifier.
    ranges : {"stress": (low, high) MPa, "temperature": K, "strain", "time": s} that the tests covered, where known.
    """

    law: CreepLaw
    values: Mapping[str, float]
    notes: Sequence[str] = ()
    units: Units = field(default_factory=Units)
    elastic: Elastic | None = None
    name: str = ""
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        stated = {one.name: self.values[one.name] for one in self.law.conditions if one.name in self.values}
        law = self.law.at(None, **stated)
        gone = {*stated, *self.law.names} - {*law.names}
        values = {name: value for name, value in self.values.items() if name not in gone}
        object.__setattr__(self, "law", law)
        object.__setattr__(self, "values", MappingProxyType(law.values(values)))
        object.__setattr__(self, "notes", tuple(self.notes))
        object.__setattr__(self, "ranges", MappingProxyType(dict(self.ranges)))

    @property
    def title(self) -> str:
        """The law in words."""
        return self.law.title or self.law.name

    def replace(self, **changes: Any) -> LawWithValues:
        """The same with some fields changed."""
        return replace(self, **changes)

    def caution(self, **point: float | None) -> str:
        """What of a point, in MPa, K, s and units of conditions, lies outside the ranges; "" where nothing does."""
        beyond = [
            f"{name} {value:.4g}{_UNITS.get(name, '')} (known from {low:.4g} to {high:.4g}{_UNITS.get(name, '')})"
            for name, (low, high) in self.ranges.items()
            if (value := point.get(name)) is not None and not _within(value, low, high)
        ]
        return f"caution: extrapolated: {', '.join(beyond)}" if beyond else ""

    @checked
    def at(self, temperature: float | None = None, /, **conditions: float) -> LawWithValues:
        """The same with numbers in the place of the temperature, K, and of conditions, in the law's units."""
        law = self.law.at(temperature, **conditions)
        elastic = self.elastic if self.elastic is None or temperature is None else self.elastic.at(temperature)
        return replace(self, law=law, values={name: self.values[name] for name in law.names}, elastic=elastic)

    def without_inactive_terms(self) -> LawWithValues:
        """The same without what is switched off: terms of a zero coefficient, exponents and shares that are 0.

        ExportError when no term is left.
        """
        table = self.law.table
        inactive = {
            name: value
            for name, value in self.values.items()
            if value == table[name].off or (value == 0 and table[name].within_bounds(value))
        }
        if not inactive:
            return self
        with restated(LawError, ExportError, f"nothing to export: {SAID}"):
            law = self.law.fix(**inactive)
        description = ", ".join(f"{name} = {value:g}" for name, value in inactive.items())
        values = {name: self.values[name] for name in law.names}
        law = replace(law, name=self.law.name, title=self.law.title)
        return replace(self, law=law, values=values, notes=(*self.notes, f"switched off and left out: {description}"))


_UNITS = {"stress": " MPa", "temperature": " K", "time": " s"}


def _within(value: float, low: float, high: float) -> bool:
    """Whether a number lies in a range, or beside it by what rounding may have moved it: 1 K at 1000 K."""
    return bool(low - 1e-3 * abs(low) <= value <= high + 1e-3 * abs(high))
