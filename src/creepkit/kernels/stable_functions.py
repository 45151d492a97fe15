"""The functions in which log forms are written: every target evaluates each without overflow or cancellation.

A class states its slopes, one for each argument, and `plain`, the same function in ordinary sympy.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

import sympy
from sympy import cosh, exp, log, sinh, tanh

SMALLEST = sympy.Float(1e-30)
"""Arguments of functions that have no value at 0 act as this below it."""


class Stable(sympy.Function):  # type: ignore[misc]
    """A function that stays as it is written and has its slopes from a table."""

    slopes: ClassVar[tuple[Callable[..., sympy.Expr], ...]]
    plain: ClassVar[Callable[..., sympy.Expr]]

    def fdiff(self, argindex: int = 1) -> sympy.Expr:
        """Slope with respect to one argument."""
        return self.slopes[argindex - 1](*self.args)


class LogFloor(Stable):
    """ln(max(x, floor)), with slope 1/max(x, floor) on both sides."""

    nargs = 2
    slopes = (lambda x, floor: 1 / Floored(x, floor), lambda x, floor: sympy.S.Zero)
    plain = staticmethod(lambda x, floor: log(x))


class Floored(Stable):
    """max(x, floor), with slope 1 on both sides: the floor is not felt."""

    nargs = 2
    slopes = (lambda x, floor: sympy.S.One, lambda x, floor: sympy.S.Zero)
    plain = staticmethod(lambda x, floor: x)


class Log1p(Stable):
    """ln(1 + x) for x > -1, with all digits near 0."""

    nargs = 1
    slopes = (lambda x: 1 / (1 + x),)
    plain = staticmethod(lambda x: log(1 + x))


class LogSinh(Stable):
    """ln sinh(x) for x > 0."""

    nargs = 1
    slopes = (lambda x: Coth(x),)
    plain = staticmethod(lambda x: log(sinh(x)))


class LogCosh(Stable):
    """ln cosh(x)."""

    nargs = 1
    slopes = (lambda x: Tanh(x),)
    plain = staticmethod(lambda x: log(cosh(x)))


class LogTanh(Stable):
    """ln tanh(x) for x > 0, with all digits where tanh(x) is nearly 1."""

    nargs = 1
    slopes = (lambda x: 2 / sinh(2 * Floored(x, SMALLEST)),)
    plain = staticmethod(lambda x: log(tanh(x)))


class LogRise(Stable):
    """ln(1 - exp(-x)) for x > 0: the logarithm of a saturating transient, exact at both of its ends."""

    nargs = 1
    slopes = (lambda x: 1 / Expm1(Floored(x, SMALLEST)),)
    plain = staticmethod(lambda x: log(1 - exp(-x)))


class Tanh(Stable):
    """tanh(x), with a slope that keeps its digits where tanh(x) is nearly 1."""

    nargs = 1
    slopes = (lambda x: cosh(x) ** -2,)
    plain = staticmethod(lambda x: tanh(x))


class Coth(Stable):
    """coth(x) for x > 0."""

    nargs = 1
    slopes = (lambda x: -(sinh(Floored(x, SMALLEST)) ** -2),)
    plain = staticmethod(lambda x: cosh(x) / sinh(x))


class Expm1(Stable):
    """exp(x) - 1."""

    nargs = 1
    slopes = (lambda x: exp(x),)
    plain = staticmethod(lambda x: exp(x) - 1)


class ExpDifference(Stable):
    """exp(a) - exp(b)."""

    nargs = 2
    slopes = (lambda a, b: exp(a), lambda a, b: -exp(b))
    plain = staticmethod(lambda a, b: exp(a) - exp(b))


def in_full(expression: sympy.Expr) -> sympy.Expr:
    """The expression in ordinary sympy, for limits."""
    return expression.replace(lambda e: isinstance(e, Stable), lambda e: e.plain(*e.args))
