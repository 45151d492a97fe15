"""Units of measurement as powers of base units with a factor: "kJ/mol" is 1000 J^1 mol^-1."""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

from creepkit.records.units import factors, spelled_factors

PRESSURE, SECOND, KELVIN, LENGTH, AMOUNT = "MPa", "s", "K", "mm", "mol"
"""Base units; an energy is MPa mm^3, which is N mm."""


_ENERGIES = {"J": 1e3, "kJ": 1e6, "MJ": 1e9, "eV": 1.602176634e-16, "cal": 4184.0, "kcal": 4.184e6}
"""In N mm, which is MPa mm^3."""


@dataclass(frozen=True)
class UnitPowers:
    """A product of powers of base units with a factor in front; powers : {base unit: power}, none of them zero."""

    factor: float
    powers: Mapping[str, Fraction]

    def __mul__(self, other: UnitPowers) -> UnitPowers:
        powers = {u: self.powers.get(u, 0) + other.powers.get(u, Fraction()) for u in {**self.powers, **other.powers}}
        return UnitPowers(self.factor * other.factor, {u: p for u, p in powers.items() if p})

    def power(self, exponent: Fraction) -> UnitPowers:
        """It to a power."""
        powers = {u: p * exponent for u, p in self.powers.items() if exponent}
        return UnitPowers(self.factor ** float(exponent), powers)

    def __str__(self) -> str:
        text = " ".join(u if p == 1 else f"{u}^{p}" for u, p in self.powers.items()) or "1"
        return text if abs(self.factor - 1.0) < 1e-9 else f"{self.factor:g} {text}"


NO_UNIT = UnitPowers(1.0, {})


def _table(known: Mapping[str, float], **powers: int) -> dict[str, UnitPowers]:
    return {name: UnitPowers(factor, {u: Fraction(p) for u, p in powers.items()}) for name, factor in known.items()}


KNOWN_UNITS = {
    **_table(factors("MPa", "Pa", "kPa", "GPa", "psi", "ksi"), MPa=1),
    **_table(spelled_factors("s", "min", "h", "d", "year"), s=1),
    **_table(factors("mm", "m", "cm", "um", "nm"), mm=1),
    **_table(_ENERGIES, MPa=1, mm=3),
    **_table({"N": 1.0}, MPa=1, mm=2),
    **_table({"K": 1.0}, K=1),
    **_table({"mol": 1.0}, mol=1),
    **_table({"percent": 0.01, "rad": 1.0}),
}


class UnknownUnitError(ValueError):
    """A unit that is not understood; its message names the part."""


def parse_unit(text: str) -> UnitPowers:
    """The unit of a text such as "1/(MPa s)", "J/(mol K)" and "mm^2/s"; UnknownUnitError for anything else."""
    spelled = text.strip().replace("^", "**").replace("·", "*").replace("%", "percent")
    spelled = re.sub(r"(?<=[A-Za-z])\.(?=[A-Za-z])", "*", spelled)
    spelled = re.sub(r"(?<=[A-Za-z])(-?\d)", r"**\1", spelled)  # mm2 and s-1
    spelled = re.sub(r"(?<=[\w)])\s+(?=[\w(])", "*", spelled)
    try:
        return _of(ast.parse(spelled, mode="eval").body, text)
    except (SyntaxError, RecursionError, ValueError) as error:
        if isinstance(error, UnknownUnitError):
            raise
        raise UnknownUnitError(f"'{text}'") from None


def _of(node: ast.expr, whole: str) -> UnitPowers:
    """The unit of a part of the text as Python's parser has it."""
    if isinstance(node, ast.Name) and node.id in KNOWN_UNITS:
        return KNOWN_UNITS[node.id]
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        return UnitPowers(float(node.value), {})
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
        return _of(node.left, whole).power(_number(node.right, whole))
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult | ast.Div):
        left, right = _of(node.left, whole), _of(node.right, whole)
        return left * (right.power(Fraction(-1)) if isinstance(node.op, ast.Div) else right)
    raise UnknownUnitError(f"'{ast.unparse(node)}' in '{whole}'")


def _number(node: ast.expr, whole: str) -> Fraction:
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        return Fraction(str(node.value))
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        return -_number(node.operand, whole)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Div):
        return _number(node.left, whole) / _number(node.right, whole)
    raise UnknownUnitError(f"the exponent '{ast.unparse(node)}' in '{whole}'")
