"""Quantities and their units: how a number that is written in some unit becomes creepkit's own, MPa, mm, s, K, N."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import HistoryError, quoted
from creepkit.limits import HOTTEST
from creepkit.records.units import UnitConversion, conversions


@dataclass(frozen=True)
class QuantityKind:
    """A kind of quantity: the unit suffixes it may carry (creepkit's own first) and the values that make sense.

    low, high : the values, in creepkit's unit, that bound the sensible ones; both excluded when `open_interval`.
    """

    name: str
    units: Mapping[str, UnitConversion]
    low: float = -1e30
    high: float = 1e30
    open_interval: bool = False

    def unit(self, suffix: str, location: str, name: str) -> UnitConversion:
        """Return the unit that a suffix means; an error says by `name` and `location` what was read and where.

        location : "" where whoever catches the error says it.
        """
        if suffix not in self.units:
            raise HistoryError(
                f"{_before(location)}{self._unit_error(name, suffix)}; allowed: {self._spellings(name, suffix)}"
            )
        return self.units[suffix]

    def convert(self, number: float, suffix: str, location: str, name: str) -> float:
        """Return `number` in creepkit's unit."""
        unit = self.unit(suffix, location, name)
        value = unit.factor * number + unit.offset
        if not (math.isfinite(value) and self._is_inside(value)):
            raise HistoryError(f"{_before(location)}'{name}' is {number:g}; a {self.name} must lie {self.range_text}")
        return value

    @property
    def range_text(self) -> str:
        """The sensible values in words."""
        unit = next(iter(self.units))
        template = ("above {} and below {}" if self.open_interval else "from {} to {}").format(
            f"{self.low:g}", f"{self.high:g}"
        )
        return f"{template} {unit}".rstrip()

    @property
    def is_ambiguous_without_unit(self) -> bool:
        """Whether a number without unit may mean several things, as a strain may be a fraction or in per cent."""
        return "" in self.units and len(self.units) > 1

    def convert_all(self, numbers: Floats, suffix: str, locate: Callable[[int], str], name: str) -> Floats:
        """Return numbers in creepkit's unit; `locate` gives the place of number k for the error.

        numbers : (numbers,) in the unit of the suffix.
        """
        unit = self.unit(suffix, "", name)
        values: Floats = unit.factor * numbers + unit.offset
        for k in np.flatnonzero(~self._is_inside(values))[:1]:
            self.convert(float(numbers[k]), suffix, locate(int(k)), name)
        return values

    def _is_inside(self, values: Any) -> Any:
        if self.open_interval:
            return (self.low < values) & (values < self.high)
        return (self.low <= values) & (values <= self.high)

    def standard_deviation(self) -> QuantityKind:
        """The kind of a standard deviation of this quantity: same units, above zero."""
        units = {suffix: UnitConversion(unit.factor) for suffix, unit in self.units.items()}
        return replace(self, name=f"standard deviation of a {self.name}", units=units, low=0.0, open_interval=True)

    def _unit_error(self, name: str, suffix: str) -> str:
        named = f"'{quoted(name, 60)}'"
        return f"the unit '{quoted(suffix)}' of {named} is not understood" if suffix else f"{named} has no unit"

    def _spellings(self, name: str, suffix: str) -> str:
        if not name.endswith(suffix):  # the unit stood apart from the name
            return ", ".join(unit or "no unit" for unit in self.units)
        stem = name.removesuffix(suffix).rstrip("_")[:60]
        return ", ".join(f"{stem}_{unit}" if unit else stem for unit in self.units)


def _before(location: str) -> str:
    return f"{location}: " if location else ""


TIME = QuantityKind("time", conversions("s", "min", "h", "d", "kh"), low=0.0)


LENGTH = QuantityKind("length", conversions("mm", "um", "m", "in", "mil"))


NUMBER = QuantityKind("number", {"": UnitConversion(1.0)})


_PERCENT = conversions("pct")["pct"]


STRAIN = QuantityKind(
    "strain", {**NUMBER.units, **conversions("1", "pct"), "percent": _PERCENT, **conversions("permille", "microstrain")}
)


RATE = QuantityKind(
    "creep rate",
    {
        f"{prefix}/{unit}": UnitConversion(strain.factor / time.factor)
        for prefix, strain in {**conversions("1", "pct"), "%": _PERCENT}.items()
        for unit, time in TIME.units.items()
    },
    low=0.0,
    high=1e3,
    open_interval=True,
)


STRESS = QuantityKind(
    "stress", conversions("MPa", "kPa", "GPa", "Pa", "bar", "ksi", "psi", "kgf/mm2", "tsi"), low=0.0, high=1e5
)


SIGNED_STRESS = replace(STRESS, low=-1e5)


MODULUS = QuantityKind("modulus", conversions("MPa", "GPa", "ksi", "Msi"), 0.0, 1e8, open_interval=True)


POISSON = QuantityKind("Poisson's ratio", NUMBER.units, low=-1.0, high=0.5, open_interval=True)


TEMPERATURE = QuantityKind("temperature", conversions("K", "C", "F"), low=0.0, high=HOTTEST, open_interval=True)


FLAG = QuantityKind("flag", NUMBER.units, low=0.0, high=1.0)


FORCE = QuantityKind("force", conversions("N", "kN", "lbf", "kgf", "daN"))


AREA = QuantityKind("area", conversions("mm2", "cm2", "in2"), 0.0, 1e9, open_interval=True)


MOMENT = QuantityKind("moment", conversions("Nmm", "Nm"))


ANGLE = QuantityKind("angle", conversions("rad", "deg"))


QUANTITIES: Mapping[str, QuantityKind] = MappingProxyType(
    {
        **{one.name: one for one in (STRAIN, NUMBER, LENGTH, STRESS, FORCE, MOMENT, ANGLE, TEMPERATURE, TIME)},
        **{"pressure": STRESS, "signed stress": SIGNED_STRESS},
    }
)
"""{name: kind} of what the outputs and loads of a specimen may be; creepkit's own unit is the first of each kind."""


def unit_of(quantity: str) -> str:
    """creepkit's own unit of a quantity, "" for a number without one."""
    return next(iter(QUANTITIES[quantity].units))
