"""The functions in which log forms are written: every target evaluates each without overflow or cancellation.

A class states its slopes, one for each argument, and `plain`, the same function in ordinary sympy.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

import sympy
from sympy import cosh, exp, log, sinh, tanh

SMALLEST_ARGUMENT = sympy.Float(1e-30)
"""Arguments of functions that have no value at 0 act as this below it."""


class StableFunction(sympy.Function):  # type: ignore[misc]
    """A function that stays as it is written and has its slopes from a table."""

    partial_derivatives: ClassVar[tuple[Callable[..., sympy.Expr], ...]]
    sympy_form: ClassVar[Callable[..., sympy.Expr]]

    def fdiff(self, argindex: int = 1) -> sympy.Expr:
        """Slope with respect to one argument."""
        return self.partial_derivatives[argindex - 1](*self.args)


class LogFloor(StableFunction):
    """ln(max(x, floor)), with slope 1/max(x, floor) on both sides."""

    nargs = 2
    partial_derivatives = (lambda x, floor: 1 / Floored(x, floor), lambda x, floor: sympy.S.Zero)
    sympy_form = staticmethod(lambda x, floor: log(x))


class Floored(StableFunction):
    """max(x, floor), with slope 1 on both sides: the floor is not felt."""

    nargs = 2
    partial_derivatives = (lambda x, floor: sympy.S.One, lambda x, floor: sympy.S.Zero)
    sympy_form = staticmethod(lambda x, floor: x)


class Log1p(StableFunction):
    """ln(1 + x) for x > -1, with all digits near 0."""

    nargs = 1
    partial_derivatives = (lambda x: 1 / (1 + x),)
    sympy_form = staticmethod(lambda x: log(1 + x))


class LogSinh(StableFunction):
    """ln sinh(x) for x > 0."""

    nargs = 1
    partial_derivatives = (lambda x: Coth(x),)
    sympy_form = staticmethod(lambda x: log(sinh(x)))


class LogCosh(StableFunction):
    """ln cosh(x)."""

    nargs = 1
    partial_derivatives = (lambda x: Tanh(x),)
    sympy_form = staticmethod(lambda x: log(cosh(x)))


class LogTanh(StableFunction):
    """ln tanh(x) for x > 0, with all digits where tanh(x) is nearly 1."""

    nargs = 1
    partial_derivatives = (lambda x: 2 / sinh(2 * Floored(x, SMALLEST_ARGUMENT)),)
    sympy_form = staticmethod(lambda x: log(tanh(x)))


class LogRise(StableFunction):
    """ln(1 - exp(-x)) for x > 0: the logarithm of a saturating transient, exact at both of its ends."""

    nargs = 1
    partial_derivatives = (lambda x: 1 / Expm1(Floored(x, SMALLEST_ARGUMENT)),)
    sympy_form = staticmethod(lambda x: log(1 - exp(-x)))


class Tanh(StableFunction):
    """tanh(x), with a slope that keeps its digits where tanh(x) is nearly 1."""

    nargs = 1
    partial_derivatives = (lambda x: cosh(x) ** -2,)
    sympy_form = staticmethod(lambda x: tanh(x))


class Coth(StableFunction):
    """coth(x) for x > 0."""

    nargs = 1
    partial_derivatives = (lambda x: -(sinh(Floored(x, SMALLEST_ARGUMENT)) ** -2),)
    sympy_form = staticmethod(lambda x: cosh(x) / sinh(x))


class Expm1(StableFunction):
    """exp(x) - 1."""

    nargs = 1
    partial_derivatives = (lambda x: exp(x),)
    sympy_form = staticmethod(lambda x: exp(x) - 1)


class ExpDifference(StableFunction):
    """exp(a) - exp(b)."""

    nargs = 2
    partial_derivatives = (lambda a, b: exp(a), lambda a, b: -exp(b))
    sympy_form = staticmethod(lambda a, b: exp(a) - exp(b))


def in_sympy_functions(expression: sympy.Expr) -> sympy.Expr:
    """The expression in ordinary sympy, for limits."""
    return expression.replace(lambda e: isinstance(e, StableFunction), lambda e: e.plain(*e.args))
