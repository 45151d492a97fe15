"""A law in mpmath arithmetic, straight from the author's expression: the reference for every other target."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from typing import Any

import mpmath
import sympy

from creepkit.language.law import CreepLaw
from creepkit.language.symbols import POINT_VARIABLES


class MultiprecisionLaw:
    """Rate and derivatives of a law with `digits` digits; derivatives are of the author's own expression."""

    def __init__(self, law: CreepLaw, digits: int = 50) -> None:
        self.law, self.digits = law, digits
        self.variables = (*POINT_VARIABLES, *law.states, *law.params)
        logarithmic = {symbol for symbol, param in law.params.items() if param.scale == "log"}
        self._logarithmic = [v in logarithmic for v in self.variables]
        self._expressions = [*law.terms.values(), *(state.rate for state in law.states.values())]
        self._values = self._lambdified(self._expressions)

    def terms(self, point: Iterable[float], theta: Iterable[float]) -> list[Any]:
        """Each term at a point (six variables, then states) with internal parameters theta."""
        with mpmath.workdps(self.digits):
            author_values = [self._author_value(k, v) for k, v in enumerate(_mpmath_numbers(point, theta))]
            return self._evaluate(author_values)[: len(self.law.terms)]

    def term_and_state_rates(self, point: Iterable[float], values: Iterable[float]) -> list[Any]:
        """Each term, then each state rate, at a point with the author's values of the parameters."""
        with mpmath.workdps(self.digits):
            return self._evaluate(_mpmath_numbers(point, values))

    def values_and_derivatives(self, point: Iterable[float], theta: Iterable[float]) -> list[list[Any]]:
        """For the rate and each state rate: value, derivatives to the point and states, then to theta."""
        with mpmath.workdps(self.digits):
            author_values = [self._author_value(k, v) for k, v in enumerate(_mpmath_numbers(point, theta))]
            try:
                columns = self._derivative_columns(*author_values)
            except (ZeroDivisionError, ValueError):  # slopes such as n x^n/x at x = 0
                return self.values_and_differences(point, theta)
            chain = [v if log else 1 for v, log in zip(author_values, self._logarithmic, strict=True)]
            scaled = [[slope * c for slope in column] for column, c in zip(columns, chain, strict=True)]
            return self._rows([self._evaluate(author_values), *scaled])

    @cached_property
    def _derivative_columns(self) -> Callable[..., Any]:
        """For each variable, the derivatives of every part."""
        return self._lambdified([[_derivative(part, v) for part in self._expressions] for v in self.variables])

    def values_and_differences(self, point: Iterable[float], theta: Iterable[float]) -> list[list[Any]]:
        """The same with central differences, in four times the digits, for derivatives."""
        with mpmath.workdps(4 * self.digits):
            numbers = _mpmath_numbers(point, theta)
            author_values = [self._author_value(k, v) for k, v in enumerate(numbers)]
            return self._rows(
                [
                    self._evaluate(author_values),
                    *(self._difference(numbers[k], author_values, k) for k in range(len(author_values))),
                ]
            )

    def _difference(self, number: Any, plain: list[Any], k: int) -> list[Any]:
        step = mpmath.mpf(10) ** -(self.digits + 10) * (abs(number) or 1)
        high, low = (
            self._evaluate([*plain[:k], self._author_value(k, number + s), *plain[k + 1 :]]) for s in (step, -step)
        )
        return [(a - b) / (2 * step) for a, b in zip(high, low, strict=True)]

    def _rows(self, columns: Sequence[Sequence[Any]]) -> list[list[Any]]:
        """Columns of parts (terms, then state rates) as rows of the rate and the state rates."""
        split = len(self.law.terms)
        added = [[mpmath.fsum(parts[:split]), *parts[split:]] for parts in columns]
        return [[mpmath.mpmathify(v) for v in row] for row in zip(*added, strict=True)]

    def _lambdified(self, expressions: Sequence[Any]) -> Callable[..., Any]:
        function: Callable[..., Any] = sympy.lambdify(self.variables, expressions, "mpmath", cse=True, dummify=True)
        return function

    def _author_value(self, k: int, number: Any) -> Any:
        """The author's value of an internal variable."""
        return mpmath.exp(number) if self._logarithmic[k] else number

    def _evaluate(self, plain: list[Any]) -> list[Any]:
        return [mpmath.mpmathify(v) for v in self._values(*plain)]


def _derivative(expression: sympy.Expr, variable: sympy.Symbol) -> sympy.Expr:
    """The derivative away from jumps."""
    return sympy.diff(expression, variable).replace(sympy.DiracDelta, lambda *_: sympy.S.Zero)


def _mpmath_numbers(point: Iterable[float], theta: Iterable[float]) -> list[Any]:
    return [mpmath.mpf(float(v)) for v in (*point, *theta)]
