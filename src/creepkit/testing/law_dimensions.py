"""Dimensions of a law's rates, from the units of its parameters.

In a law stress is the ratio to 1 MPa and time the ratio to 1 s, so that a stress may stand against a parameter in MPa
or against one without a unit, and a rate comes out in 1/s or without a unit. Whole numbers up to ten and simple
fractions have no unit; any other number may have whatever unit the law needs (a reference temperature, a modulus),
but where an energy stands over the temperature it must be the gas constant, or Boltzmann's, in the energy's own unit.

Units of measurement are powers of base units with a factor: "kJ/mol" is 1000 J^1 mol^-1.
"""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import reduce
from itertools import pairwise
from typing import TypeAlias

import sympy

from creepkit.errors import SAID, LawError, restated
from creepkit.language.law import CreepLaw
from creepkit.language.symbols import GAS_CONSTANT, mean_stress, principal_stress, strain, stress, temperature, time
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


RATIO_OF_STRESS, RATIO_OF_TIME = "stress", "time"
"""Powers of stress and time themselves, each a ratio or a quantity with its unit, as the rest needs."""


BOLTZMANN_CONSTANT = 1.380649e-23
"""J/K, of the SI."""


CONSTANT_TOLERANCE = 5e-3
"""By which a rounded gas constant may differ: 8.31, 8.314."""


FACTOR_TOLERANCE = 1e-6


LARGEST_PLAIN_NUMBER = 10


Unit: TypeAlias = UnitPowers | None
"""None where the unit is not known, for numbers have any."""


class DimensionError(LawError):
    """Units that do not go together; its message is one sentence."""


def check_dimensions(law: CreepLaw) -> None:
    """DimensionError, saying which part has which unit, unless all rates of a law are consistent."""
    units: dict[sympy.Symbol, Unit] = {strain: NO_UNIT, temperature: parse_unit(KELVIN)}
    units |= {s: UnitPowers(1.0, {RATIO_OF_STRESS: Fraction(1)}) for s in (stress, principal_stress, mean_stress)}
    units[time] = UnitPowers(1.0, {RATIO_OF_TIME: Fraction(1)})
    declared = {symbol: param.unit for symbol, param in law.params.items()}
    declared |= {symbol: state.unit for symbol, state in law.states.items()}
    for symbol, text in declared.items():
        try:
            units[symbol] = NO_UNIT if text in ("", "-") else parse_unit(text)
        except UnknownUnitError as error:
            raise DimensionError(
                f"the unit of {symbol} is not understood, {error}; write it with MPa, s, K, mm, J, mol and numbers, "
                "such as 1/(MPa s)"
            ) from None
    analysis = _Analysis(units)
    rates = {f"term '{label}'": (term, NO_UNIT) for label, term in law.terms.items()}
    rates |= {f"rate of '{s}'": (z.rate, units[s] or NO_UNIT) for s, z in law.states.items()}
    for place, (rate, of) in rates.items():
        with restated(DimensionError, DimensionError, f"{place}: {SAID}{_state_without_unit(law, rate, units)}"):
            unit = analysis.unit(rate)
        if unit is not None and not _is_rate(unit * of.power(Fraction(-1))):
            raise DimensionError(
                f"{place} comes out in {_text(unit)}, and must in {'' if of is NO_UNIT else f'{of} per s, '}1/s or "
                'without a unit; correct unit= of its parameters, "1/s" for a rate coefficient'
            )


def _state_without_unit(law: CreepLaw, rate: sympy.Expr, units: Mapping[sympy.Symbol, Unit]) -> str:
    """The remedy where a rate goes together as soon as a state that was given no unit has one."""
    for symbol in (s for s, state in law.states.items() if state.unit == "1"):
        with suppress(DimensionError):
            _Analysis({**units, symbol: None}).unit(rate)
            return f"; or give the state '{symbol}' its unit, ck.State(..., unit=...)"
    return ""


class _Analysis:
    def __init__(self, units: dict[sympy.Symbol, Unit]) -> None:
        self.units = units

    def unit(self, expression: sympy.Basic) -> Unit:
        """The unit of an expression; DimensionError where its parts do not go together."""
        if isinstance(expression, sympy.Symbol):
            return self.units.get(expression)
        if expression.is_number:
            return NO_UNIT if _is_plain(expression) else None
        if isinstance(expression, sympy.Mul):
            return self.product(expression)
        if isinstance(expression, sympy.Add | sympy.Max | sympy.Min):
            return self.sum_of(expression, list(expression.args))
        if isinstance(expression, sympy.Piecewise):
            for _, condition in expression.args:
                for relation in condition.atoms(sympy.core.relational.Relational):
                    self.sum_of(relation, list(relation.args))
            return self.sum_of(expression, [branch for branch, _ in expression.args])
        if isinstance(expression, sympy.Pow):
            return self.power(expression)
        if isinstance(expression, sympy.Abs | sympy.Heaviside | sympy.sign):
            unit = self.unit(expression.args[0])
            return unit if isinstance(expression, sympy.Abs) else NO_UNIT
        for argument in expression.args:  # of exp, log, sinh and so on
            self.require_none(argument, f"the argument of {type(expression).__name__}")
        return NO_UNIT

    def product(self, expression: sympy.Mul) -> Unit:
        numbers = [factor for factor in expression.args if factor.is_number]
        units = [self.unit(factor) for factor in expression.args if not factor.is_number]
        known = [unit for unit in units if unit is not None]
        if len(known) < len(units):
            return None
        unit = reduce(operator.mul, known, NO_UNIT)
        return (
            unit if all(map(_is_plain, numbers)) else _with_constant(expression, unit, abs(float(sympy.Mul(*numbers))))
        )

    def sum_of(self, expression: sympy.Basic, parts: list[sympy.Basic]) -> Unit:
        known = [(part, unit) for part in parts if part != 0 and (unit := self.unit(part)) is not None]
        for (a, first), (b, second) in pairwise(known):
            if not _fits(first, second):
                raise DimensionError(
                    f"{expression} puts {a} in {_text(first)} beside {b} in {_text(second)}; "
                    "correct unit= of a parameter"
                )
        flexible = [u for _, u in known if {RATIO_OF_STRESS, RATIO_OF_TIME} & set(u.powers)]
        return next(iter([*flexible, *(u for _, u in known)]), None)

    def power(self, expression: sympy.Pow) -> Unit:
        base, exponent = expression.as_base_exp()
        self.require_none(exponent, "the exponent")
        unit = self.unit(base)
        if unit is None or (not unit.powers and abs(unit.factor - 1.0) < 1e-9):
            return unit
        if exponent.is_Rational:
            return unit.power(Fraction(int(exponent.p), int(exponent.q)))
        if set(unit.powers) <= {RATIO_OF_STRESS, RATIO_OF_TIME} or _fits(unit, NO_UNIT):
            return NO_UNIT  # a ratio
        hard = {u for u in unit.powers if u not in (PRESSURE, SECOND, RATIO_OF_STRESS, RATIO_OF_TIME)}
        if hard or abs(unit.factor - 1.0) > FACTOR_TOLERANCE:
            raise DimensionError(
                f"{base} in {_text(unit)} is raised to {exponent}; divide it by a reference of that unit"
            )
        return None  # in MPa or s, which are ratios as well

    def require_none(self, expression: sympy.Basic, what: str) -> None:
        unit = self.unit(expression)
        if unit is not None and not _fits(unit, NO_UNIT):
            energy = set(unit.powers) >= {PRESSURE, LENGTH, KELVIN}
            remedy = (
                f"divide by the gas constant, GAS_CONSTANT = {GAS_CONSTANT:.5g} J/(mol K)"
                if energy
                else "it must have none; correct unit= of its parameters, or divide by a reference"
            )
            raise DimensionError(f"{what}, {expression}, is in {_text(unit)}; {remedy}")


def _with_constant(expression: sympy.Mul, unit: UnitPowers, number: float) -> Unit:
    """The unit of a product with a number; an energy over the temperature needs the right constant."""
    for constant, of, amount in ((GAS_CONSTANT, "J/mol", {AMOUNT: Fraction(-1)}), (BOLTZMANN_CONSTANT, "J", {})):
        if dict(unit.powers) == {PRESSURE: Fraction(1), LENGTH: Fraction(3), KELVIN: Fraction(-1)} | amount:
            joules = unit.factor / 1e3
            if _is_multiple(number * constant / joules):
                return NO_UNIT
            if _is_multiple(number * constant):
                problem = f"in {joules:g} J by a constant in J; give the energy in {of}, or multiply by {joules:g}"
            else:
                per_kelvin = "J/(mol K)" if amount else "J/K"
                problem = f"in {_text(unit)} by a number that is not {constant:.5g} {per_kelvin} in that unit"
            raise DimensionError(f"{expression} divides an energy {problem}")
    return None


def _fits(first: UnitPowers, second: UnitPowers) -> bool:
    """Whether two units are the same, stress counting as MPa or as a ratio, time as s or as one."""
    if abs(first.factor / second.factor - 1.0) > FACTOR_TOLERANCE:
        return False
    difference = dict((first * second.power(Fraction(-1))).powers)
    for ratio, unit in ((RATIO_OF_STRESS, PRESSURE), (RATIO_OF_TIME, SECOND)):
        as_ratio, as_unit = difference.pop(ratio, Fraction()), difference.pop(unit, Fraction())
        if as_unit not in (0, -as_ratio):
            return False
    return not difference


def _is_rate(unit: UnitPowers) -> bool:
    return any(_fits(unit, UnitPowers(1.0, {SECOND: Fraction(power)} if power else {})) for power in (-1, 0))


def _is_plain(number: sympy.Basic) -> bool:
    """Whether a number is a factor of mathematics, not a quantity: 2, 1/3, sqrt(2), pi."""
    if number.atoms(sympy.Float):
        return any(float(number) == k / 2 for k in range(-2 * LARGEST_PLAIN_NUMBER, 2 * LARGEST_PLAIN_NUMBER + 1))
    return all(max(abs(r.p), r.q) <= LARGEST_PLAIN_NUMBER for r in number.atoms(sympy.Rational))


def _is_multiple(ratio: float) -> bool:
    """Whether a ratio is 1, or a small number times or over 1, within the rounding of physical constants."""
    return any(
        abs(ratio * k - 1.0) < CONSTANT_TOLERANCE or abs(ratio / k - 1.0) < CONSTANT_TOLERANCE for k in (1, 2, 3)
    )


def _text(unit: UnitPowers) -> str:
    """A unit in words; powers of stress and time count as ratios."""
    left = {u: p for u, p in unit.powers.items() if u not in (RATIO_OF_STRESS, RATIO_OF_TIME)}
    if left.get(LENGTH) == 3 and left.get(PRESSURE) == 1:
        rest = {u: p for u, p in left.items() if u not in (LENGTH, PRESSURE)}
        factor = unit.factor / 1e3
        return f"{'' if abs(factor - 1) < 1e-9 else f'{factor:g} '}J {UnitPowers(1.0, rest)}".replace(" 1", "").strip()
    return str(UnitPowers(unit.factor, left))
