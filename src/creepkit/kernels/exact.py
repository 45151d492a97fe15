"""The exact form: a law in mpmath arithmetic, straight from the author's expression, to judge every other target."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from typing import Any

import mpmath
import sympy

from creepkit.language.law import CreepLaw
from creepkit.language.symbols import POINT


class Exact:
    """Rate and derivatives of a law with `digits` digits; derivatives are of the author's own expression."""

    def __init__(self, law: CreepLaw, digits: int = 50) -> None:
        self.law, self.digits = law, digits
        self.variables = (*POINT, *law.states, *law.params)
        logarithmic = {symbol for symbol, param in law.params.items() if param.scale == "log"}
        self._logarithmic = [v in logarithmic for v in self.variables]
        self._parts = [*law.terms.values(), *(state.rate for state in law.states.values())]
        self._values = self._compiled(self._parts)

    def terms(self, point: Iterable[float], theta: Iterable[float]) -> list[Any]:
        """Each term at a point (six variables, then states) with internal parameters theta."""
        with mpmath.workdps(self.digits):
            plain = [self._plain(k, v) for k, v in enumerate(_numbers(point, theta))]
            return self._at(plain)[: len(self.law.terms)]

    def parts(self, point: Iterable[float], values: Iterable[float]) -> list[Any]:
        """Each term, then each state rate, at a point with the author's values of the parameters."""
        with mpmath.workdps(self.digits):
            return self._at(_numbers(point, values))

    def rows(self, point: Iterable[float], theta: Iterable[float]) -> list[list[Any]]:
        """For the rate and each state rate: value, derivatives to the point and states, then to theta."""
        with mpmath.workdps(self.digits):
            plain = [self._plain(k, v) for k, v in enumerate(_numbers(point, theta))]
            try:
                columns = self._columns(*plain)
            except (ZeroDivisionError, ValueError):  # slopes such as n x^n/x at x = 0
                return self.differences(point, theta)
            chain = [v if log else 1 for v, log in zip(plain, self._logarithmic, strict=True)]
            scaled = [[slope * c for slope in column] for column, c in zip(columns, chain, strict=True)]
            return self._rows([self._at(plain), *scaled])

    @cached_property
    def _columns(self) -> Callable[..., Any]:
        """For each variable, the derivatives of every part."""
        return self._compiled([[_slope(part, v) for part in self._parts] for v in self.variables])

    def differences(self, point: Iterable[float], theta: Iterable[float]) -> list[list[Any]]:
        """The same with central differences, in four times the digits, for derivatives."""
        with mpmath.workdps(4 * self.digits):
            numbers = _numbers(point, theta)
            plain = [self._plain(k, v) for k, v in enumerate(numbers)]
            return self._rows([self._at(plain), *(self._difference(numbers[k], plain, k) for k in range(len(plain)))])

    def _difference(self, number: Any, plain: list[Any], k: int) -> list[Any]:
        step = mpmath.mpf(10) ** -(self.digits + 10) * (abs(number) or 1)
        high, low = (self._at([*plain[:k], self._plain(k, number + s), *plain[k + 1 :]]) for s in (step, -step))
        return [(a - b) / (2 * step) for a, b in zip(high, low, strict=True)]

    def _rows(self, columns: Sequence[Sequence[Any]]) -> list[list[Any]]:
        """Columns of parts (terms, then state rates) as rows of the rate and the state rates."""
        split = len(self.law.terms)
        added = [[mpmath.fsum(parts[:split]), *parts[split:]] for parts in columns]
        return [[mpmath.mpmathify(v) for v in row] for row in zip(*added, strict=True)]

    def _compiled(self, expressions: Sequence[Any]) -> Callable[..., Any]:
        function: Callable[..., Any] = sympy.lambdify(self.variables, expressions, "mpmath", cse=True, dummify=True)
        return function

    def _plain(self, k: int, number: Any) -> Any:
        """The author's value of an internal variable."""
        return mpmath.exp(number) if self._logarithmic[k] else number

    def _at(self, plain: list[Any]) -> list[Any]:
        return [mpmath.mpmathify(v) for v in self._values(*plain)]


def _slope(part: sympy.Expr, variable: sympy.Symbol) -> sympy.Expr:
    """The derivative away from jumps."""
    return sympy.diff(part, variable).replace(sympy.DiracDelta, lambda *_: sympy.S.Zero)


def _numbers(point: Iterable[float], theta: Iterable[float]) -> list[Any]:
    return [mpmath.mpf(float(v)) for v in (*point, *theta)]
