"""Temperature forms that a user gives: sympy expressions, functions of temperature and feature libraries of pysindy.

An expression with the symbol of a parameter takes its place. One without it is a function of temperature that is added
on the parameter's own scale, less its value at T_ref, times a coefficient where it has no symbol of its own.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy

from creepkit.errors import FitError
from creepkit.language import Param, TemperatureFactor, TemperatureForm, temperature
from creepkit.language.temperature_forms import LOG_PARAMETER_RANGE, TEMPERATURE_SPAN

TRACED_FUNCTIONS = ("exp", "log", "sqrt", "sin", "cos", "tan", "sinh", "cosh", "tanh", "arctan")
"""Functions of NumPy that a function of temperature may call."""


def given_forms(form: Any, T_ref: float) -> list[TemperatureFactor | TemperatureForm]:
    """The forms that one entry of a list of forms stands for: one, or those of a feature library.

    form : a form or a factor; a sympy expression; a function of T_ref that returns a form or a factor, as ck.linear, or
        one of temperature; a feature library of pysindy, whose features of T/1000 K are forms each and all together.
    """
    if isinstance(form, TemperatureFactor | TemperatureForm):
        return [form]
    if isinstance(form, sympy.Expr):
        return [_expression_form([form], T_ref)]
    if all(hasattr(form, name) for name in ("fit", "transform", "get_feature_names")):
        features = _features(form)
        together = [_expression_form(features, T_ref)] if len(features) > 1 else []
        return [*(_expression_form([one], T_ref) for one in features), *together]
    if not callable(form):
        raise FitError(f"{form!r} is no form: give a name, a sympy expression in ck.temperature, or a function of it")
    try:
        made = form(T_ref)
    except (TypeError, ValueError, ArithmeticError):
        made = None
    if isinstance(made, TemperatureFactor | TemperatureForm):
        return [made]
    return [_expression_form([_traced(form)], T_ref)]


def _expression_form(expressions: Sequence[sympy.Expr], T_ref: float) -> TemperatureForm:
    """The form of functions of temperature, each with a coefficient of its own, or of one expression with symbols."""
    name = " and ".join(str(one).replace(temperature.name, "T") for one in expressions)

    def build(symbol: sympy.Symbol, param: Param) -> tuple[sympy.Expr, dict[sympy.Symbol, Param]]:
        own = {s: sympy.Symbol(s.name, real=True) for one in expressions for s in one.free_symbols - {temperature}}
        parts = [one.xreplace(own) for one in expressions]
        real_symbol = sympy.Symbol(symbol.name, real=True)
        if real_symbol in own.values():
            expression = parts[0].xreplace({real_symbol: symbol})
            increment = sympy.log(expression / symbol) if param.scale == "log" else expression - symbol
            coefficients = [s for s in own.values() if s != real_symbol]
        else:
            coefficients = list(own.values())
            if not coefficients:
                coefficients = [sympy.Symbol(f"{symbol.name}_{k + 1}", real=True) for k in range(len(parts))]
                parts = [c * part for c, part in zip(coefficients, parts, strict=True)]
            increment = sum(part - part.subs(temperature, sympy.Float(T_ref)) for part in parts)
            expression = symbol * sympy.exp(increment) if param.scale == "log" else symbol + increment
        return expression, {c: _coefficient(c, increment, param, name, T_ref) for c in coefficients}

    return TemperatureForm(name, build, "given by the user", float(T_ref))


def _coefficient(symbol: sympy.Symbol, increment: sympy.Expr, param: Param, form: str, T_ref: float) -> Param:
    """A coefficient; its bounds let the parameter move by half its range in 100 K, as in the built-in forms."""
    slope = sympy.diff(increment, symbol)
    known = slope.free_symbols <= {temperature}
    moved = [float(slope.subs(temperature, T_ref + dT)) for dT in (0.0, TEMPERATURE_SPAN)] if known else [0.0, 0.0]
    if not moved[1] - moved[0]:
        raise FitError(
            f"form '{form}': '{symbol}' is no coefficient of a function of temperature, so that it needs bounds; give "
            "a TemperatureForm whose build() returns its Param"
        )
    low, high = param.bounds
    reach = (LOG_PARAMETER_RANGE if param.scale == "log" else high - low) / 2 / abs(moved[1] - moved[0])
    return Param(f"coefficient of {form} in {param.meaning}", bounds=(-reach, reach), off=0.0)


@dataclass(frozen=True)
class _Traced:
    """A number of which the operations are recorded as a sympy expression; NumPy calls its functions as methods."""

    expression: sympy.Expr

    def __getattr__(self, name: str) -> Callable[[], _Traced]:
        if name not in TRACED_FUNCTIONS:
            raise AttributeError(name)
        function = getattr(sympy, {"arctan": "atan"}.get(name, name))
        return lambda: _Traced(function(self.expression))

    def __neg__(self) -> _Traced:
        return _Traced(-self.expression)


def _trace(operation: Callable[[Any, Any], Any]) -> None:
    """Give traced numbers an operator of Python, with a number on either side."""
    name = operation.__name__
    setattr(_Traced, f"__{name}__", lambda self, other: _Traced(operation(self.expression, _expression_of(other))))
    setattr(_Traced, f"__r{name}__", lambda self, other: _Traced(operation(_expression_of(other), self.expression)))


for _operation in (operator.add, operator.sub, operator.mul, operator.truediv, operator.pow):
    _trace(_operation)


def _expression_of(value: Any) -> sympy.Expr:
    if isinstance(value, _Traced):
        return value.expression
    return sympy.Integer(int(value)) if float(value).is_integer() else sympy.Float(float(value))


def _traced(function: Callable[[Any], Any]) -> sympy.Expr:
    """What a function of temperature computes."""
    try:
        return _expression_of(function(_Traced(temperature)))
    except (TypeError, ValueError, AttributeError) as error:
        raise FitError(
            f"the function {getattr(function, '__name__', function)!r} cannot be written as an expression ({error}): "
            f"use arithmetic and {', '.join(TRACED_FUNCTIONS)} of numpy, or give a sympy expression in ck.temperature"
        ) from None


def _features(library: Any) -> list[sympy.Expr]:
    """The features of a library that depend on temperature, as functions of T/1000 K."""
    library.fit(np.array([[0.9], [1.0], [1.1]]))
    try:
        row = library.transform(np.array([[_Traced(temperature / 1000)]], dtype=object))
        found = [_expression_of(one) for one in np.asarray(row, dtype=object).ravel()]
    except (TypeError, ValueError, AttributeError) as error:
        raise FitError(
            f"the features of {type(library).__name__} cannot be written as expressions ({error}): use arithmetic and "
            f"{', '.join(TRACED_FUNCTIONS)} of numpy"
        ) from None
    return [one for one in found if one.has(temperature)]


def symbol_names(form: Any) -> set[str]:
    """Names of all symbols of a form beside temperature, where it is an expression."""
    return {s.name for s in form.free_symbols - {temperature}} if isinstance(form, sympy.Expr) else set()
