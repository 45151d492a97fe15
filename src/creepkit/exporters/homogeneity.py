"""The degree of a rate in quantities that change by one factor, which decides in which unit its coefficient stands.

It is found from the parts of an expression, in time proportional to its length; sympy is not asked to simplify.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import sympy

MOST_OPERATIONS = 60
"""Of a degree; longer ones, of exponents within exponents, count as none."""


def degree(expression: sympy.Basic, degrees: Mapping[sympy.Symbol, int]) -> sympy.Expr | None:
    """d in f(c^k x, ...) = c^d f(x, ...), where `degrees` says k of each symbol, else 0.

    None where there is no d, and for maxima of what changes.
    """
    if not expression.args or not expression.free_symbols & degrees.keys():
        return sympy.Integer(degrees.get(expression, 0))
    if isinstance(expression, sympy.Pow):
        base, exponent = (degree(part, degrees) for part in expression.args)
        return None if base is None or exponent != 0 else _short(base * expression.exp)
    if isinstance(expression, sympy.Piecewise):
        if any(degree(condition, degrees) is None for _, condition in expression.args):
            return None
        return _common([branch for branch, _ in expression.args], degrees)
    if isinstance(expression, sympy.Mul):
        parts = [degree(part, degrees) for part in expression.args]
        return None if None in parts else _short(sympy.Add(*parts))
    if isinstance(expression, sympy.Abs):
        return degree(expression.args[0], degrees)
    if isinstance(expression, sympy.Add):
        return _common(expression.args, degrees)
    if isinstance(expression, sympy.core.relational.Relational):
        return None if _common(expression.args, degrees) is None else sympy.S.Zero
    if isinstance(expression, sympy.Heaviside | sympy.sign):
        return None if degree(expression.args[0], degrees) is None else sympy.S.Zero
    return sympy.S.Zero if all(degree(part, degrees) == 0 for part in expression.args) else None


def _common(parts: Iterable[sympy.Basic], degrees: Mapping[sympy.Symbol, int]) -> sympy.Expr | None:
    """The degree that all parts have; zero has any."""
    found = [degree(part, degrees) for part in parts if part != 0]
    first = found[0] if found else None
    if first is None:
        return None
    same = all(other is not None and (other == first or sympy.expand(other - first) == 0) for other in found)
    return first if same else None


def _short(value: sympy.Expr) -> sympy.Expr | None:
    return value if value.count_ops() <= MOST_OPERATIONS else None
