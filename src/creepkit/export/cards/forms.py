"""Whether a law is a sum of forms that finite element codes have built in, told from its algebra and not from its name.

A form is A f(s) e^m t^k exp(-Q/(R T)), with f(s) one of s^n, sinh(s/B)^n and exp(s/B): stress s, creep strain e, time
t, temperature T. A term that multiplies out to several such products is several forms.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Literal

import sympy

from creepkit.errors import ExportError
from creepkit.language.symbols import GAS_CONSTANT, strain, stress, temperature, time
from creepkit.records import Units, ValuedLaw

_PER_T = sympy.Symbol("per_T", positive=True)
_ONE, _PER_K, _STRESS = (0, 0), (1, 0), (0, 1)
"""Monomials of 1/T and stress, as sympy writes them."""

_DIGITS = 30
"""Digits of values while products are taken apart, so that none of a double's are lost."""


Shape = Literal["power", "sinh", "exponential"]


@dataclass(frozen=True)
class Form:
    """One product A f(s) e^strain t^time exp(-Q/(R T)).

    shape : f is s^n ("power"), sinh(s/B)^n ("sinh") or exp(s/B) ("exponential"); B in MPa, or the unit of stress.
    log_coefficient : ln A, as A at infinite temperature may lie outside the range of a double.
    Q : J/mol; 0 where temperature does not matter.
    """

    label: str
    shape: Shape
    log_coefficient: float
    n: float
    B: float
    strain: float
    time: float
    Q: float

    @property
    def per_kelvin(self) -> float:
        """Q/R in K."""
        return self.Q / GAS_CONSTANT

    @property
    def steady(self) -> bool:
        """Whether neither strain nor time enters."""
        return self.strain == 0 and self.time == 0

    def at(self, T: float) -> float:
        """ln of A exp(-Q/(R T)), with T in K."""
        return self.log_coefficient - self.per_kelvin / T

    def within(self, units: Units) -> Form:
        """The same form of stress and time in other units, with its rate per unit of time."""
        k, c = units.megapascals, units.seconds
        shift = (1.0 + self.time) * math.log(c) + (self.n * math.log(k) if self.shape == "power" else 0.0)
        return replace(self, log_coefficient=self.log_coefficient + shift, B=self.B / k)


def forms_of(source: ValuedLaw, target: str, instead: str) -> tuple[Form, ...]:
    """The forms whose sum is the law, in the units of `source`.

    target, instead : for the ExportError where a term is none: what has no form for it, and what to do.
    """
    source = source.reduced()
    law = source.law
    if law.states:
        told = ", ".join(f"'{s}'" for s in law.states)
        raise ExportError(f"law '{law.name}': {target} has no internal variable such as {told}; {instead}")
    swap = {symbol: sympy.Float(source.values[symbol.name], _DIGITS) for symbol in law.params}
    found = []
    for label, term in law.terms.items():
        products = sympy.Add.make_args(sympy.expand_mul(term.xreplace(swap), deep=False))
        for k, product in enumerate(products, 1):
            name = label if len(products) == 1 else f"{label} {k}"
            try:
                found.append(_form(name, product).within(source.units))
            except _NotAForm as reason:
                where = f"law '{law.name}', term '{label}'"
                raise ExportError(f"{where}: {target} has no form for it, {reason}; {instead}") from None
    return tuple(found)


class _NotAForm(Exception):
    """Why a product is none of the forms."""


# ---- taking a product apart ----------------------------------------------------------------------------------------


@dataclass
class _Factors:
    """What the factors of a product amount to, so far.

    powers : of stress, strain and time. exponent : of e, coefficients of 1, of 1/T and of stress. sinh : (1/B, power).
    """

    powers: dict[sympy.Symbol, float] = field(default_factory=lambda: dict.fromkeys((stress, strain, time), 0.0))
    exponent: dict[tuple[int, int], float] = field(default_factory=lambda: dict.fromkeys((_ONE, _PER_K, _STRESS), 0.0))
    sinh: list[tuple[float, float]] = field(default_factory=list)

    def take(self, e: sympy.Expr, power: float) -> None:
        """Multiply by e^power."""
        if e.is_Mul:
            for factor in e.args:
                self.take(factor, power)
        elif not e.free_symbols:
            self.exponent[_ONE] += power * _log_of(e)
        elif e in self.powers:
            self.powers[e] += power
        elif isinstance(e, sympy.Abs) and e.args[0] == stress:
            self.powers[stress] += power
        elif e.is_Pow and not e.exp.free_symbols:
            self.take(e.base, power * float(e.exp))
        elif isinstance(e, sympy.exp):
            self._exponential(e.args[0], power)
        elif e.is_Pow and not e.base.free_symbols and e.base.is_positive:
            self._exponential(e.exp * sympy.log(e.base), power)
        elif isinstance(e, sympy.sinh):
            self.sinh.append((_slope(e.args[0]), power))
        else:
            raise _NotAForm(_why(e))

    def _exponential(self, exponent: sympy.Expr, power: float) -> None:
        """Multiply by exp(exponent)^power, the exponent a + b/T + c stress."""
        line = sympy.expand(exponent.xreplace({temperature: 1 / _PER_T})).as_poly(_PER_T, stress)
        if line is None:
            raise _NotAForm(_why(sympy.exp(exponent)))
        for powers, coefficient in line.terms():
            if coefficient.free_symbols or powers not in self.exponent:
                raise _NotAForm(_why(sympy.exp(exponent)))
            self.exponent[powers] += power * float(coefficient)


def _form(label: str, product: sympy.Expr) -> Form:
    """The product as a form; _NotAForm with the reason where it is none."""
    factors = _Factors()
    factors.take(product, 1.0)
    n, strain_power, time_power = (factors.powers[s] for s in (stress, strain, time))
    log_number, per_T, per_stress = factors.exponent.values()
    kinds = [n != 0, bool(factors.sinh), per_stress != 0]
    if sum(kinds) > 1 or len(factors.sinh) > 1:
        raise _NotAForm(f"stress enters {_shown(product)} in several ways at once")
    shape: Shape = "sinh" if factors.sinh else "exponential" if per_stress else "power"
    if factors.sinh:
        ((per_stress, n),) = factors.sinh
    B = 1.0 / per_stress if per_stress else math.inf
    Q = -per_T * GAS_CONSTANT if per_T else 0.0
    return Form(label, shape, log_number, n, B, strain_power, time_power, Q)


def _log_of(number: sympy.Expr) -> float:
    value = sympy.N(number, _DIGITS)
    if not (value.is_real and value > 0):
        raise _NotAForm(f"its coefficient {value:.6g} is not positive")
    return float(sympy.log(value))


def _slope(argument: sympy.Expr) -> float:
    """1/B of sinh(stress/B)."""
    slope = sympy.expand(argument / stress)
    if slope.free_symbols or not slope > 0:
        raise _NotAForm(_why(sympy.sinh(argument)))
    return float(slope)


def _why(factor: sympy.Expr) -> str:
    """What a factor is that no form has, and what may help."""
    remedy = " (constants at one temperature may do: export(..., temperature=1073))" if factor.has(temperature) else ""
    if factor.is_Pow and not factor.base.is_Add:
        return f"as the exponent {_shown(factor.exp)} of {factor.base} is not a number{remedy}"
    return f"which holds {_shown(factor)}{remedy}"


def _shown(expression: sympy.Expr) -> str:
    """An expression with numbers of six digits."""
    floats = {f: sympy.Float(f"{float(f):.6g}") for f in expression.atoms(sympy.Float)}
    return f"'{expression.xreplace(floats)}'"
