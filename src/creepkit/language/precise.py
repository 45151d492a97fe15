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

_BINARY_EXPONENT_LIMIT = 2.0**30
"""Largest |log2| of a number that is computed."""


def evaluate_multiprecision(expression: sympy.Basic, values: Mapping[sympy.Symbol, Any]) -> Any:
    """Return the value of `expression` (an mpf, an mpc, or a bool for a condition) with the symbols of `at` as given.

    ArithmeticError when it has no finite value there or none that can be computed; LawError for a function unknown.
    """
    if isinstance(expression, sympy.Symbol):
        return values[expression]
    if isinstance(expression, sympy.Rational):
        return mpmath.mpf(expression.p) / mpmath.mpf(expression.q)
    if isinstance(expression, sympy.Float):
        return mpmath.mpf(expression)
    if isinstance(expression, sympy.Piecewise):
        return _evaluate_piecewise(expression, values)
    function = _FUNCTIONS.get(expression.func) or _mpmath_function(expression.func)
    try:
        return function(*(evaluate_multiprecision(argument, values) for argument in expression.args))
    except (ValueError, TypeError) as error:  # the logarithm of zero, the order of complex numbers
        raise ArithmeticError(f"{expression} has no value: {error}") from None


def _evaluate_piecewise(expression: sympy.Piecewise, values: Mapping[sympy.Symbol, Any]) -> Any:
    for branch, condition in expression.args:
        if evaluate_multiprecision(condition, values):
            return evaluate_multiprecision(branch, values)
    raise ArithmeticError(f"no branch of {expression} holds")


def _power(base: Any, exponent: Any) -> Any:
    if base != 0 and abs(exponent) * (abs(mpmath.mag(base)) + 1) > _BINARY_EXPONENT_LIMIT:
        raise OverflowError("a power is too large or too small to be computed")
    return base**exponent


def _overflow_guarded(function: Callable[[Any], Any]) -> Callable[[Any], Any]:
    def guarded(x: Any) -> Any:
        if abs(x) > _BINARY_EXPONENT_LIMIT:
            raise OverflowError(f"{function.__name__} of {mpmath.nstr(x, 6)} is too large or too small to be computed")
        return function(x)

    return guarded


def _mpmath_function(head: Any) -> Callable[..., Any]:
    function = getattr(mpmath, head.__name__, None)
    if not callable(function):
        raise LawError(f"the function '{head.__name__}' has no numeric form; build the law from other functions")
    return function  # type: ignore[no-any-return]


_FUNCTIONS: dict[Any, Callable[..., Any]] = {
    sympy.Add: lambda *terms: mpmath.fsum(terms),
    sympy.Mul: lambda *factors: mpmath.fprod(factors),
    sympy.Pow: _power,
    sympy.exp: _overflow_guarded(mpmath.exp),
    sympy.sinh: _overflow_guarded(mpmath.sinh),
    sympy.cosh: _overflow_guarded(mpmath.cosh),
    sympy.coth: _overflow_guarded(mpmath.coth),
    sympy.sin: _overflow_guarded(mpmath.sin),
    sympy.cos: _overflow_guarded(mpmath.cos),
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
