"""Values of expressions to many digits, in bounded time: behind fingerprints, reference values and the check of files.

Works at mpmath's current precision. A number whose exponent would itself be astronomical raises OverflowError instead
of being computed, so that no expression, 9**9**9**9 included, can hold the machine up.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import mpmath
import sympy

from creepkit.errors import LawError

_EXPONENT_LIMIT = 2.0**30
"""Largest |log2| of a number that is computed."""


def value_of(expression: sympy.Basic, at: Mapping[sympy.Symbol, Any]) -> Any:
    """Return the value of `expression` (an mpf, an mpc, or a bool for a condition) with the symbols of `at` as given.

    ArithmeticError when it has no finite value there or none that can be computed; LawError for a function unknown.
    """
    if isinstance(expression, sympy.Symbol):
        return at[expression]
    if isinstance(expression, sympy.Rational):
        return mpmath.mpf(expression.p) / mpmath.mpf(expression.q)
    if isinstance(expression, sympy.Float):
        return mpmath.mpf(expression)
    if isinstance(expression, sympy.Piecewise):
        return _first_that_holds(expression, at)
    function = _FUNCTIONS.get(expression.func) or _named(expression.func)
    try:
        return function(*(value_of(argument, at) for argument in expression.args))
    except (ValueError, TypeError) as error:  # the logarithm of zero, the order of complex numbers
        raise ArithmeticError(f"{expression} has no value: {error}") from None


def _first_that_holds(expression: sympy.Piecewise, at: Mapping[sympy.Symbol, Any]) -> Any:
    for branch, condition in expression.args:
        if value_of(condition, at):
            return value_of(branch, at)
    raise ArithmeticError(f"no branch of {expression} holds")


def _power(base: Any, exponent: Any) -> Any:
    if base != 0 and abs(exponent) * (abs(mpmath.mag(base)) + 1) > _EXPONENT_LIMIT:
        raise OverflowError("a power is too large or too small to be computed")
    return base**exponent


def _bounded(function: Callable[[Any], Any]) -> Callable[[Any], Any]:
    def guarded(x: Any) -> Any:
        if abs(x) > _EXPONENT_LIMIT:
            raise OverflowError(f"{function.__name__} of {mpmath.nstr(x, 6)} is too large or too small to be computed")
        return function(x)

    return guarded


def _named(head: Any) -> Callable[..., Any]:
    function = getattr(mpmath, head.__name__, None)
    if not callable(function):
        raise LawError(f"the function '{head.__name__}' has no numeric form; build the law from other functions")
    return function  # type: ignore[no-any-return]


_FUNCTIONS: dict[Any, Callable[..., Any]] = {
    sympy.Add: lambda *terms: mpmath.fsum(terms),
    sympy.Mul: lambda *factors: mpmath.fprod(factors),
    sympy.Pow: _power,
    sympy.exp: _bounded(mpmath.exp),
    sympy.sinh: _bounded(mpmath.sinh),
    sympy.cosh: _bounded(mpmath.cosh),
    sympy.coth: _bounded(mpmath.coth),
    sympy.sin: _bounded(mpmath.sin),
    sympy.cos: _bounded(mpmath.cos),
    sympy.Abs: abs,
    sympy.Max: max,
    sympy.Min: min,
    sympy.Heaviside: lambda x, half: mpmath.mpf(x > 0) if x != 0 else half,
    type(sympy.pi): lambda: +mpmath.pi,
    type(sympy.E): lambda: +mpmath.e,
    sympy.GreaterThan: lambda a, b: a >= b,
    sympy.StrictGreaterThan: lambda a, b: a > b,
    sympy.LessThan: lambda a, b: a <= b,
    sympy.StrictLessThan: lambda a, b: a < b,
    sympy.And: lambda *conditions: all(conditions),
    sympy.Or: lambda *conditions: any(conditions),
    type(sympy.true): lambda: True,
    type(sympy.false): lambda: False,
}
