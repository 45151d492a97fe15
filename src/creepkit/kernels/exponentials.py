"""Differences of exponentials, paired so that they keep their digits: exp(a) - exp(b) where a is close to b."""

from __future__ import annotations

from collections import defaultdict

import sympy

from creepkit.kernels.stable_functions import ExpDifference, Expm1


def paired(total: sympy.Expr) -> sympy.Expr:
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


def paired_everywhere(expression: sympy.Expr) -> sympy.Expr:
    """The same in every sum within an expression."""
    return expression.replace(lambda e: e.is_Add, paired)


def _cancels(group: list[tuple[sympy.Expr, sympy.Expr]]) -> bool:
    return len(group) == 2 and group[0][0] + group[1][0] == 0


def _difference(a: sympy.Expr, b: sympy.Expr) -> sympy.Expr:
    if b == 0:
        return Expm1(a)
    if a == 0:
        return -Expm1(b)
    return ExpDifference(a, b)
