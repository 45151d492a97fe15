"""Sums of exponentials that cancel, written so that they keep their digits: exp(a) - exp(b) where a is close to b.

Only sums that vanish as a whole are rewritten: 1 - exp(-t/tau) is, n_inf + (n_0 - n_inf) exp(-t/tau) is not.
"""

from __future__ import annotations

from collections import defaultdict

import sympy

from creepkit.kernels.stable_functions import ExpDifference, Expm1


def with_exponential_differences(expression: sympy.Expr) -> sympy.Expr:
    """Rewrite sums of c exp(a) - c exp(b) as c ExpDifference(a, b), and of c exp(a) - c as c Expm1(a)."""
    if not expression.has(sympy.exp):
        return expression
    groups: dict[sympy.Expr, list[tuple[sympy.Expr, sympy.Expr]]] = defaultdict(list)
    for summand in sympy.Add.make_args(sympy.expand_mul(expression)):
        number, rest = summand.as_coeff_Mul()
        exponents = [f.args[0] for f in sympy.Mul.make_args(rest) if isinstance(f, sympy.exp)]
        others = [f for f in sympy.Mul.make_args(rest) if not isinstance(f, sympy.exp)]
        groups[sympy.Mul(*others)].append((number, sympy.Add(*exponents)))
    if not all(len(group) == 2 and group[0][0] + group[1][0] == 0 for group in groups.values()):
        return expression
    return sympy.Add(*(other * _exponential_difference(*group) for other, group in groups.items()))


def with_all_exponential_differences(expression: sympy.Expr) -> sympy.Expr:
    """The same in every sum within an expression."""
    return expression.replace(lambda e: e.is_Add, with_exponential_differences)


def _exponential_difference(first: tuple[sympy.Expr, sympy.Expr], second: tuple[sympy.Expr, sympy.Expr]) -> sympy.Expr:
    """Return k exp(a) - k exp(b), always with the same one of the two in front."""
    (number, a), (_, b) = sorted((first, second), key=lambda pair: (pair[1] == 0, sympy.default_sort_key(pair[1])))
    return number * (Expm1(a) if b == 0 else ExpDifference(a, b))
