"""Units at the edge: a name such as `stress_MPa` says quantity and unit; inside there are only MPa, mm, s and K."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from creepkit.errors import HistoryError
from creepkit.records import ZERO_CELSIUS


@dataclass(frozen=True)
class Unit:
    """How a number in some unit becomes creepkit's own: factor * number + shift."""

    factor: float
    shift: float = 0.0


@dataclass(frozen=True)
class Kind:
    """A kind of quantity: the unit suffixes it may carry (creepkit's own first) and the values that make sense.

    low, high : the values, in creepkit's unit, that bound the sensible ones; both excluded when `open`.
    """

    name: str
    units: Mapping[str, Unit]
    low: float = -1e30
    high: float = 1e30
    open: bool = False

    def unit(self, suffix: str, place: str, name: str) -> Unit:
        """Return the unit that a suffix means; `name` and `place` say in the error what was read and where."""
        if suffix not in self.units:
            raise HistoryError(f"{place}: {self._complaint(name, suffix)}; allowed: {self._spellings(name, suffix)}")
        return self.units[suffix]

    def convert(self, number: float, suffix: str, place: str, name: str) -> float:
        """Return `number` in creepkit's unit."""
        unit = self.unit(suffix, place, name)
        value = unit.factor * number + unit.shift
        inside = self.low < value < self.high if self.open else self.low <= value <= self.high
        if not (math.isfinite(value) and inside):
            raise HistoryError(f"{place}: '{name}' is {number:g}; a {self.name} must lie {self.range}")
        return value

    @property
    def range(self) -> str:
        """The sensible values in words."""
        unit = next(iter(self.units))
        words = ("above {} and below {}" if self.open else "from {} to {}").format(f"{self.low:g}", f"{self.high:g}")
        return f"{words} {unit}".rstrip()

    def spread(self) -> Kind:
        """The kind of a standard deviation of this quantity: same units, above zero."""
        units = {suffix: Unit(unit.factor) for suffix, unit in self.units.items()}
        return replace(self, name=f"standard deviation of a {self.name}", units=units, low=0.0, open=True)

    def _complaint(self, name: str, suffix: str) -> str:
        return f"the unit '{suffix}' of '{name}' is not understood" if suffix else f"'{name}' has no unit"

    def _spellings(self, name: str, suffix: str) -> str:
        if not name.endswith(suffix):  # the unit stood apart from the name
            return ", ".join(self.units)
        stem = name.removesuffix(suffix).rstrip("_")
        return ", ".join(f"{stem}_{unit}" if unit else stem for unit in self.units)


TIME = Kind("time", {"s": Unit(1.0), "min": Unit(60.0), "h": Unit(3600.0), "d": Unit(86400.0)}, low=0.0)
LENGTH = Kind("length", {"mm": Unit(1.0), "um": Unit(1e-3), "m": Unit(1e3)})
STRAIN = Kind("strain", {"": Unit(1.0), "pct": Unit(1e-2), "percent": Unit(1e-2)})
NUMBER = Kind("number", {"": Unit(1.0)})
STRESS = Kind(
    "stress",
    {"MPa": Unit(1.0), "kPa": Unit(1e-3), "GPa": Unit(1e3), "bar": Unit(0.1), "ksi": Unit(6.894757293168361)},
    low=0.0,
    high=1e5,
)
SIGNED_STRESS = replace(STRESS, low=-1e5)
MODULUS = Kind("modulus", {"MPa": Unit(1.0), "GPa": Unit(1e3), "ksi": Unit(6.894757293168361)}, 0.0, 1e8, open=True)
POISSON = Kind("Poisson's ratio", NUMBER.units, low=-1.0, high=0.5, open=True)
TEMPERATURE = Kind("temperature", {"K": Unit(1.0), "C": Unit(1.0, ZERO_CELSIUS)}, low=0.0, high=1e4, open=True)
FLAG = Kind("flag", NUMBER.units, low=0.0, high=1.0)


def split(name: str, known: Mapping[str, Kind]) -> tuple[str, str] | None:
    """Split `stress_MPa` into the longest known quantity and the unit behind it; None when it begins with none."""
    for quantity in sorted(known, key=len, reverse=True):
        if name == quantity or name.startswith(f"{quantity}_"):
            return quantity, name[len(quantity) + 1 :]
    return None
