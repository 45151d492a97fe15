"""The leading exponent of time: strain ~ t^beta as t -> 0+ from a virgin state at constant stress.

A term that behaves as t^a strain^b alone gives beta = (1 + a)/(1 - b); the smallest beta of the active terms leads.
Integrators step in s = t^beta, in which strain starts as a straight line.
"""

from __future__ import annotations

import sympy

from creepkit.kernels.logform import LogForm
from creepkit.kernels.stable_functions import in_sympy_functions
from creepkit.language.symbols import strain, time


def leading_exponents(form: LogForm) -> tuple[tuple[sympy.Expr, sympy.Expr], ...]:
    """For each term (a, b), the exponents of time and of strain at t -> 0+, as functions of theta (and the point).

    An exponent that sympy cannot find counts as 0: it decides how long steps can be, never whether they are right.
    """
    return tuple((_exponent_at_zero(term, time), _exponent_at_zero(term, strain)) for term in form.terms)


def _exponent_at_zero(term: sympy.Expr, variable: sympy.Symbol) -> sympy.Expr:
    """The limit of x d(ln f)/dx at x -> 0+, with time and strain zero elsewhere."""
    summands = [s for s in sympy.Add.make_args(term) if s.has(variable)]
    result = sympy.Add(*(_limit(variable * in_sympy_functions(sympy.diff(s, variable)), variable) for s in summands))
    result = result.subs({time: 0, strain: 0})
    return sympy.S.Zero if _is_undefined(result) else result


def _limit(slope: sympy.Expr, variable: sympy.Symbol) -> sympy.Expr:
    at_zero = slope.subs(variable, 0)
    if not _is_undefined(at_zero):
        return at_zero
    positive = {s: sympy.Dummy(s.name, positive=True) for s in slope.free_symbols}
    original_symbols = {d: s for s, d in positive.items()}
    try:
        return sympy.limit(slope.xreplace(positive), positive[variable], 0, "+").xreplace(original_symbols)
    except (NotImplementedError, ValueError):
        return sympy.S.NaN


def _is_undefined(expression: sympy.Expr) -> bool:
    return bool(expression.has(sympy.nan, sympy.zoo, sympy.oo, -sympy.oo, sympy.Limit, sympy.AccumBounds))
