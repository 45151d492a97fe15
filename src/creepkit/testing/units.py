"""Units of measurement as powers of base units with a factor: "kJ/mol" is 1000 J^1 mol^-1."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

from creepkit.records.units import factors, spelled_factors

PRESSURE, SECOND, KELVIN, LENGTH, AMOUNT = "MPa", "s", "K", "mm", "mol"
"""Base units; an energy is MPa mm^3, which is N mm."""


_LEVEL = factors("MPa", "Pa", "kPa", "GPa", "psi", "ksi")


_TIMES = spelled_factors("s", "min", "h", "d", "year")


_LENGTHS = factors("mm", "m", "cm", "um", "nm")


_ENERGIES = {"J": 1e3, "kJ": 1e6, "MJ": 1e9, "eV": 1.602176634e-16, "cal": 4184.0, "kcal": 4.184e6}
"""In N mm, which is MPa mm^3."""


@dataclass(frozen=True)
class UnitPowers:
    """A product of powers of base units with a factor in front; powers : {base unit: power}, none of them zero."""

    factor: float
    powers: Mapping[str, Fraction]

    def __mul__(self, other: UnitPowers) -> UnitPowers:
        powers = {u: self.powers.get(u, Fraction()) + other.powers.get(u, Fraction()) for u in self._units(other)}
        return UnitPowers(self.factor * other.factor, {u: p for u, p in powers.items() if p})

    def power(self, exponent: Fraction) -> UnitPowers:
        """It to a power."""
        return UnitPowers(
            self.factor ** float(exponent), {u: p * exponent for u, p in self.powers.items() if p * exponent}
        )

    def _units(self, other: UnitPowers) -> list[str]:
        return list(dict.fromkeys((*self.powers, *other.powers)))

    def __str__(self) -> str:
        text = " ".join(u if p == 1 else f"{u}^{p}" for u, p in self.powers.items()) or "1"
        return text if abs(self.factor - 1.0) < 1e-9 else f"{self.factor:g} {text}"


NO_UNIT = UnitPowers(1.0, {})


def _known() -> dict[str, UnitPowers]:
    table = {name: UnitPowers(f, {PRESSURE: Fraction(1)}) for name, f in _LEVEL.items()}
    table |= {name: UnitPowers(f, {SECOND: Fraction(1)}) for name, f in _TIMES.items()}
    table |= {name: UnitPowers(f, {LENGTH: Fraction(1)}) for name, f in _LENGTHS.items()}
    energy = {PRESSURE: Fraction(1), LENGTH: Fraction(3)}
    table |= {name: UnitPowers(f, energy) for name, f in _ENERGIES.items()}
    table |= {"N": UnitPowers(1.0, {PRESSURE: Fraction(1), LENGTH: Fraction(2)})}
    table |= {"K": UnitPowers(1.0, {KELVIN: Fraction(1)}), "mol": UnitPowers(1.0, {AMOUNT: Fraction(1)})}
    return table | {"%": UnitPowers(0.01, {}), "rad": NO_UNIT}


KNOWN_UNITS = _known()


_TOKEN = re.compile(r"\s*(?:(?P<number>\d+(?:\.\d+)?(?:[eE][+-]?\d+)?)|(?P<name>[A-Za-z%]+)|(?P<sign>\*\*|[*/()^.]|·))")
_EXPONENT = re.compile(
    r"\s*(?:\^|\*\*)\s*(?:\(\s*)?(?P<sign>[+-]?)\s*(?P<value>\d+(?:/\d+|\.\d+)?)(?:\s*\))?|(?P<bare>-?\d)(?!\d)"
)


class UnknownUnitError(ValueError):
    """A unit that is not understood; its message names the part."""


def parse_unit(text: str) -> UnitPowers:
    """The unit of a text such as "1/(MPa s)", "J/(mol K)" and "mm^2/s"; UnknownUnitError for anything else."""
    result, rest = _product(text.strip(), text)
    if rest.strip():
        raise UnknownUnitError(f"'{rest.strip()}' in '{text}'")
    return result


def _product(text: str, whole: str) -> tuple[UnitPowers, str]:
    result, inverse = NO_UNIT, False
    while True:
        match = _TOKEN.match(text)
        if match is None or match["sign"] == ")":
            if text.strip() and match is None:
                raise UnknownUnitError(f"'{text.strip()}' in '{whole}'")
            return result, text
        text = text[match.end() :]
        if match["sign"] in ("*", ".", "·"):
            continue
        if match["sign"] == "/":
            inverse = True
            continue
        if match["sign"] == "(":
            factor, text = _product(text, whole)
            if not text.lstrip().startswith(")"):
                raise UnknownUnitError(f"a bracket that is not closed in '{whole}'")
            text = text.lstrip()[1:]
        elif match["number"]:
            factor = UnitPowers(float(match["number"]), {})
        elif match["name"] in KNOWN_UNITS:
            factor = KNOWN_UNITS[match["name"]]
        else:
            raise UnknownUnitError(f"'{match['name'] or match['sign']}' in '{whole}'")
        exponent = _EXPONENT.match(text)
        if exponent is not None:
            text = text[exponent.end() :]
            value = exponent["bare"] or f"{exponent['sign']}{exponent['value']}"
            factor = factor.power(Fraction(value))
        result = result * (factor.power(Fraction(-1)) if inverse else factor)
        inverse = False
