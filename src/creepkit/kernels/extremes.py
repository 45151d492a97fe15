"""Max, Min and Heaviside of sympy that compare numbers alone.

Sympy compares every pair of arguments whenever it builds a maximum, also when it differentiates one or replaces a
symbol in it: eight sums take minutes. Those here keep their arguments as they are; only duplicates, nested ones and
all numbers but one go. They have the names of sympy's, so that printers and the order of arguments are the same.
"""

from __future__ import annotations

from typing import Any, ClassVar

import sympy
from sympy.core.sorting import ordered


class _Extreme:
    """What Max and Min share: building without comparing, and slopes that are steps."""

    most: ClassVar[Any]
    args: tuple[Any, ...]

    def __new__(cls, *arguments: Any, **_: Any) -> Any:
        arguments = tuple(map(sympy.sympify, arguments))
        parts = {p for a in arguments for p in (a.args if isinstance(a, cls) else (a,))}
        numbers = {p for p in parts if p.is_Number}
        if len(numbers) > 1:
            parts = parts - numbers | {cls.most(*numbers)}
        if len(parts) == 1:
            return parts.pop()
        built: Any = sympy.Expr.__new__(cls, *ordered(parts))
        built._argset = frozenset(parts)
        return built

    def _others(self: Any, k: int) -> Any:
        return self.func(*self.args[:k], *self.args[k + 1 :])


class Max(_Extreme, sympy.Max):  # type: ignore[misc]
    """The largest argument; its slope to one is 1 where that is above the others."""

    most = sympy.Max

    def fdiff(self, argindex: int = 1) -> sympy.Expr:
        """Slope with respect to one argument."""
        return Heaviside(self.args[argindex - 1] - self._others(argindex - 1))


class Min(_Extreme, sympy.Min):  # type: ignore[misc]
    """The smallest argument; its slope to one is 1 where that is below the others."""

    most = sympy.Min

    def fdiff(self, argindex: int = 1) -> sympy.Expr:
        """Slope with respect to one argument."""
        return Heaviside(self._others(argindex - 1) - self.args[argindex - 1])


class Heaviside(sympy.Heaviside):  # type: ignore[misc]
    """The unit step; its value is found for numbers alone."""

    def __new__(cls, arg: Any, H0: Any = sympy.S.Half, **options: Any) -> Any:
        """The step of an argument; sympy's own constructor knows no subclass."""
        return sympy.Function.__new__(cls, arg, H0, **options)

    @classmethod
    def eval(cls, arg: sympy.Expr, H0: sympy.Expr = sympy.S.Half) -> sympy.Expr | None:
        """The value, None where the step stays."""
        return sympy.Heaviside.eval(arg, H0) if arg.is_Number else None
