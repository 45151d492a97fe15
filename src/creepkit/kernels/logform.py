"""The lowering pass: each term of a law as its logarithm, in functions that every target evaluates accurately.

A term f becomes ln f = ln A + n ln(stress) + m ln(strain) + ...: nothing overflows on the way, and derivatives
become f d(ln f). Parameters of log scale enter as their logarithm (A of 1e-40 is the number -92.1). Only states
that are bases of powers are floored (FLOOR below), never parameters.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from typing import Any

import sympy

from creepkit.language.law import CreepLaw
from creepkit.language.symbols import POINT

FLOOR = 1e-30
"""Stress, strain, time and states below this act as this when they are bases of powers; slopes are those there."""

TINY = 1e-300
"""Composite bases, such as Max(stress - threshold, 0), are floored here: zero to any power above 1.04 is zero."""


class LogFloor(sympy.Function):  # type: ignore[misc]
    """ln(max(x, floor)), with slope 1/max(x, floor) on both sides."""

    nargs = 2

    def fdiff(self, argindex: int = 1) -> sympy.Expr:
        """Slope, one-sided at and below the floor."""
        return 1 / Floored(*self.args) if argindex == 1 else sympy.S.Zero


class Floored(sympy.Function):  # type: ignore[misc]
    """max(x, floor), with slope 1 on both sides."""

    nargs = 2

    def fdiff(self, argindex: int = 1) -> sympy.Expr:
        """Slope 1: the floor is not felt."""
        return sympy.S.One if argindex == 1 else sympy.S.Zero


class LogSinh(sympy.Function):  # type: ignore[misc]
    """ln sinh(x) for x > 0, without overflow or cancellation."""

    nargs = 1

    def fdiff(self, argindex: int = 1) -> sympy.Expr:
        """Slope."""
        return Coth(self.args[0])


class Coth(sympy.Function):  # type: ignore[misc]
    """coth(x) for x > 0."""

    nargs = 1

    def fdiff(self, argindex: int = 1) -> sympy.Expr:
        """Slope."""
        return 1 - Coth(self.args[0]) ** 2


class Expm1(sympy.Function):  # type: ignore[misc]
    """exp(x) - 1 without cancellation."""

    nargs = 1

    def fdiff(self, argindex: int = 1) -> sympy.Expr:
        """Slope."""
        return sympy.exp(self.args[0])


class ExpDifference(sympy.Function):  # type: ignore[misc]
    """exp(a) - exp(b) without cancellation."""

    nargs = 2

    def fdiff(self, argindex: int = 1) -> sympy.Expr:
        """Slope."""
        return sympy.exp(self.args[0]) if argindex == 1 else -sympy.exp(self.args[1])


@dataclass(frozen=True)
class LogForm:
    """A law in log form.

    terms : ln of each term, in the law's order.
    state_rates : the rate of each internal variable, linear.
    theta : internal parameters, one symbol each in the law's order (`ln_A` for A of log scale, else itself).
    coefficients : for each term, the positions in theta that multiply it: -inf there switches the term off.
    """

    terms: tuple[sympy.Expr, ...]
    state_rates: tuple[sympy.Expr, ...]
    theta: tuple[sympy.Symbol, ...]
    coefficients: tuple[tuple[int, ...], ...]


def log_form(law: CreepLaw) -> LogForm:
    """Lower a law; raises nothing for a valid law."""
    pass_ = _Pass(law)
    terms = tuple(pass_.log_of(term) for term in law.terms.values())
    coefficients = tuple(
        tuple(k for k, t in enumerate(pass_.theta) if t in pass_.logs.values() and sympy.diff(term, t) == 1)
        for term in terms
    )
    rates = tuple(pass_.linear(state.rate) for state in law.states.values())
    return LogForm(terms, rates, pass_.theta, coefficients)


class _Pass:
    """One walk over a law's expressions; keeps which symbols are logarithms."""

    def __init__(self, law: CreepLaw) -> None:
        log_scaled = [s for s, p in law.params.items() if p.scale == "log"]
        self.logs = {s: sympy.Symbol(f"ln_{s.name}", real=True) for s in log_scaled}
        self.theta = tuple(self.logs.get(s, s) for s in law.params)
        self.bases = {*POINT, *law.states}

    def log_of(self, e: sympy.Expr) -> sympy.Expr:
        """Return ln(e) for e > 0."""
        if e.is_Number:
            return sympy.Float(sympy.log(e).evalf(30), 17) if e > 0 else sympy.Float(-690.0)
        if e in self.logs:
            return self.logs[e]
        if e.is_Mul:
            return sympy.Add(*(self.log_of(factor) for factor in _positive_factors(e)))
        if e.is_Pow:
            return self.linear(e.exp) * self.log_of(e.base)
        if isinstance(e, sympy.exp):
            return self.linear(e.args[0])
        if isinstance(e, sympy.sinh):
            return LogSinh(self.linear(e.args[0]))
        return LogFloor(self.linear(e), sympy.Float(FLOOR if e in self.bases else TINY))

    def linear(self, e: sympy.Expr) -> sympy.Expr:
        """Return e itself in internal parameters, with powers as exp(k ln x) and differences of exponentials paired."""
        if e in self.logs:
            return sympy.exp(self.logs[e])
        if not e.args:
            return e
        if e.is_Pow and not e.exp.is_Integer:
            return sympy.exp(self.linear(e.exp) * self.log_of(e.base))
        rebuilt = e.func(*(self.linear(argument) for argument in e.args))
        return paired_exponentials(rebuilt) if rebuilt.is_Add else rebuilt


def paired_exponentials(total: sympy.Expr) -> sympy.Expr:
    """Rewrite c exp(a) - c exp(b) as c ExpDifference(a, b), and c exp(a) - c as c Expm1(a), wherever they occur."""
    if not total.has(sympy.exp):
        return total
    groups: dict[sympy.Expr, list[tuple[sympy.Expr, sympy.Expr]]] = defaultdict(list)
    for summand in sympy.Add.make_args(sympy.expand_mul(total)):
        number, rest = summand.as_coeff_Mul()
        exponents = [f.args[0] for f in sympy.Mul.make_args(rest) if isinstance(f, sympy.exp)]
        others = [f for f in sympy.Mul.make_args(rest) if not isinstance(f, sympy.exp)]
        groups[sympy.Mul(*others)].append((number, sympy.Add(*exponents)))
    if not any(_cancels(group) for group in groups.values()):
        return total
    parts = []
    for other, group in groups.items():
        if _cancels(group):
            (number, a), (_, b) = group
            parts.append(number * other * _difference(a, b))
        else:
            parts += [number * other * sympy.exp(a) for number, a in group]
    return sympy.Add(*parts)


def _cancels(group: list[tuple[sympy.Expr, sympy.Expr]]) -> bool:
    return len(group) == 2 and group[0][0] + group[1][0] == 0


def _difference(a: sympy.Expr, b: sympy.Expr) -> sympy.Expr:
    if b == 0:
        return Expm1(a)
    if a == 0:
        return -Expm1(b)
    return ExpDifference(a, b)


def _positive_factors(product: sympy.Mul) -> list[Any]:
    """The factors of a positive product, with a negative number moved into a sum: -3 (a - b) is 3 (b - a)."""
    number, rest = product.as_coeff_Mul()
    factors = list(sympy.Mul.make_args(rest))
    if number < 0:
        sums = [k for k, f in enumerate(factors) if f.is_Add]
        if sums:
            factors[sums[0]] = sympy.Add(*(-a for a in factors[sums[0]].args))
            number = -number
    return factors if number == 1 else [number, *factors]
