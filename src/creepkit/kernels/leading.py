"""The leading exponent of time: strain ~ t^beta as t -> 0+ from a virgin state at constant stress.

A term that behaves as t^a strain^b alone gives beta = (1 + a)/(1 - b); the smallest beta of the active terms leads.
Integrators step in s = t^beta, in which strain starts as a straight line.
"""

from __future__ import annotations

import sympy

from creepkit.kernels.logform import FLOOR, Coth, ExpDifference, Expm1, Floored, LogFloor, LogForm, LogSinh
from creepkit.language.symbols import strain, time

_IN_FULL = {
    LogFloor: lambda x, _: sympy.log(x),
    Floored: lambda x, _: x,
    LogSinh: lambda x: sympy.log(sympy.sinh(x)),
    Coth: lambda x: sympy.cosh(x) / sympy.sinh(x),
    Expm1: lambda x: sympy.exp(x) - 1,
    ExpDifference: lambda a, b: sympy.exp(a) - sympy.exp(b),
}


def exponents(form: LogForm) -> tuple[tuple[sympy.Expr, sympy.Expr], ...]:
    """For each term (a, b), the exponents of time and of strain at t -> 0+, as functions of theta."""
    return tuple((_exponent(term, time), _exponent(term, strain)) for term in form.terms)


def _exponent(term: sympy.Expr, variable: sympy.Symbol) -> sympy.Expr:
    """The limit of x d(ln f)/dx at x -> 0+, with time zero elsewhere."""
    atom = LogFloor(variable, sympy.Float(FLOOR))
    mark = sympy.Dummy("mark")
    marked = term.xreplace({atom: mark})
    power = sympy.diff(marked, mark).subs(mark, 0)
    rest = marked.subs(mark, 0)
    if rest.has(variable) and not _regular(rest, variable):
        power += _limit(rest, variable)
    return sympy.simplify(power.subs({time: 0, strain: 0}))


def _regular(expression: sympy.Expr, variable: sympy.Symbol) -> bool:
    """Whether the slope at zero is a plain finite number, so that the variable's exponent gains nothing."""
    slope = sympy.diff(_in_full(expression), variable).subs(variable, 0)
    return not slope.has(sympy.zoo, sympy.nan, sympy.oo)


def _limit(expression: sympy.Expr, variable: sympy.Symbol) -> sympy.Expr:
    positive = {s: sympy.Dummy(s.name, positive=True) for s in expression.free_symbols}
    back = {d: s for s, d in positive.items()}
    slope = (variable * sympy.diff(_in_full(expression), variable)).xreplace(positive)
    return sympy.limit(slope, positive[variable], 0, "+").xreplace(back)


def _in_full(expression: sympy.Expr) -> sympy.Expr:
    for function, plain in _IN_FULL.items():
        expression = expression.replace(function, plain)
    return expression

