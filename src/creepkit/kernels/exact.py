"""The exact form: a law in mpmath arithmetic, straight from the author's expression, to judge every other target."""

from __future__ import annotations

from collections.abc import Sequence
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
        expressions = [law.rate, *(state.rate for state in law.states.values())]
        columns = [[e, *(sympy.diff(e, v) for v in self.variables)] for e in expressions]
        self._rate = sympy.lambdify(self.variables, [row[0] for row in columns], "mpmath")
        self._all = sympy.lambdify(self.variables, columns, "mpmath")

    def rates(self, point: Sequence[float], theta: Sequence[float]) -> list[Any]:
        """Rate and state rates at a point (six variables, then states) with internal parameters theta."""
        with mpmath.workdps(self.digits):
            return [mpmath.mpmathify(v) for v in self._rate(*self._numbers(point, theta))]

    def rows(self, point: Sequence[float], theta: Sequence[float]) -> list[list[Any]]:
        """For the rate and each state rate: value, derivatives to the point and states, then to theta."""
        with mpmath.workdps(self.digits):
            numbers = self._numbers(point, theta)
            scale = [mpmath.mpf(1)] * (len(self.variables) - len(theta))
            scale += [
                value if p.scale == "log" else mpmath.mpf(1)
                for p, value in zip(self.law.params.values(), numbers[len(scale) :], strict=True)
            ]
            return [[mpmath.mpmathify(row[0]), *(d * s for d, s in zip(row[1:], scale, strict=True))] for row in self._all(*numbers)]

    def _numbers(self, point: Sequence[float], theta: Sequence[float]) -> list[Any]:
        params = [
            mpmath.exp(mpmath.mpf(float(v))) if p.scale == "log" else mpmath.mpf(float(v))
            for p, v in zip(self.law.params.values(), theta, strict=True)
        ]
        return [*(mpmath.mpf(float(v)) for v in point), *params]
