"""The functions in which kernels are written, free of overflow and cancellation, and the printer of kernels.

A class states its partial derivatives, one for each argument, and `plain`, the same function in ordinary sympy. Printed
names (exp, log_floor, larger, choose ...) are defined once a target in numpy_functions, torch_functions and
llvm_functions, and for exported Python code in scalar_functions.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from functools import reduce
from typing import TYPE_CHECKING, Any, ClassVar

import sympy
from sympy import asinh, atan, cos, cosh, erf, exp, log, sin, sinh, tanh
from sympy.printing.precedence import PRECEDENCE
from sympy.printing.pycode import PythonCodePrinter

from creepkit.errors import LawError

if TYPE_CHECKING:
    from creepkit.language.law import CreepLaw


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

    partial_derivatives = (lambda x, floor: 1 / Floored(x, floor), lambda x, floor: sympy.S.Zero)
    sympy_form = staticmethod(lambda x, floor: log(x))


class Floored(StableFunction):
    """max(x, floor), with slope 1 on both sides: the floor is not felt."""

    partial_derivatives = (lambda x, floor: sympy.S.One, lambda x, floor: sympy.S.Zero)
    sympy_form = staticmethod(lambda x, floor: x)


class Log1p(StableFunction):
    """ln(1 + x) for x > -1, with all digits near 0."""

    partial_derivatives = (lambda x: 1 / (1 + x),)
    sympy_form = staticmethod(lambda x: log(1 + x))


class LogSinh(StableFunction):
    """ln sinh(x) for x > 0."""

    partial_derivatives = (lambda x: Coth(x),)
    sympy_form = staticmethod(lambda x: log(sinh(x)))


class LogCosh(StableFunction):
    """ln cosh(x)."""

    partial_derivatives = (lambda x: Tanh(x),)
    sympy_form = staticmethod(lambda x: log(cosh(x)))


class LogTanh(StableFunction):
    """ln tanh(x) for x > 0, with all digits where tanh(x) is nearly 1."""

    partial_derivatives = (lambda x: 2 / sinh(2 * Floored(x, SMALLEST_ARGUMENT)),)
    sympy_form = staticmethod(lambda x: log(tanh(x)))


class LogRise(StableFunction):
    """ln(1 - exp(-x)) for x > 0: the logarithm of a saturating transient, exact at both of its ends."""

    partial_derivatives = (lambda x: 1 / Expm1(Floored(x, SMALLEST_ARGUMENT)),)
    sympy_form = staticmethod(lambda x: log(1 - exp(-x)))


class Tanh(StableFunction):
    """tanh(x), with a slope that keeps its digits where tanh(x) is nearly 1."""

    partial_derivatives = (lambda x: cosh(x) ** -2,)
    sympy_form = staticmethod(lambda x: tanh(x))


class Coth(StableFunction):
    """coth(x) for x > 0."""

    partial_derivatives = (lambda x: -(sinh(Floored(x, SMALLEST_ARGUMENT)) ** -2),)
    sympy_form = staticmethod(lambda x: cosh(x) / sinh(x))


class Expm1(StableFunction):
    """exp(x) - 1."""

    partial_derivatives = (lambda x: exp(x),)
    sympy_form = staticmethod(lambda x: exp(x) - 1)


class ExpDifference(StableFunction):
    """exp(a) - exp(b)."""

    partial_derivatives = (lambda a, b: exp(a), lambda a, b: -exp(b))
    sympy_form = staticmethod(lambda a, b: exp(a) - exp(b))


def in_sympy_functions(expression: sympy.Expr) -> sympy.Expr:
    """The expression in ordinary sympy, for limits."""
    return expression.replace(lambda e: isinstance(e, StableFunction), lambda e: e.sympy_form(*e.args))


TARGET_FUNCTION_NAMES = {
    **{f.__name__: f.__name__ for f in (exp, log, sinh, cosh, asinh, tanh, sin, cos, atan, erf)},
    **{f.__name__: re.sub("(?<=[a-z])(?=[A-Z])", "_", f.__name__).lower() for f in StableFunction.__subclasses__()},
    "Heaviside": "heaviside",
}
"""{sympy class: function of every target}; Heaviside comes from the slopes of Max and Min."""


OPERATIONS = ("both", "choose", "either", "larger", "power", "smaller", "sqrt", "square")
"""Functions of every target for what is no function in sympy."""


TARGET_FUNCTIONS = (*sorted({*TARGET_FUNCTION_NAMES.values()}), *OPERATIONS)


def _nested(name: str) -> Callable[[Any, Any], str]:
    """The method that prints an operation of any number of arguments as calls of a function of two."""
    return lambda printer, e: reduce(lambda a, b: f"{name}({a}, {b})", map(printer._print, e.args))


def joined(head: str, sign: str) -> Callable[[Any, Any], str]:
    """A printing method of arguments with a sign between them, from a head that opens a bracket on."""
    return lambda printer, e: f"{head}{sign.join(map(printer._print, e.args))})"


class KernelPrinter(PythonCodePrinter):  # type: ignore[misc]
    """Print lowered expressions as calls of the target's functions."""

    reserved_words = (*PythonCodePrinter.reserved_words, *TARGET_FUNCTIONS)
    choice = "choose({condition}, {branch}, {otherwise})"

    def _print_Function(self, e: Any) -> str:
        name = TARGET_FUNCTION_NAMES.get(type(e).__name__)
        if name is None:
            raise LawError(
                f"the function {type(e).__name__} has no kernel; allowed are {', '.join(sorted(TARGET_FUNCTION_NAMES))}"
            )
        arguments = e.args[:1] if name == "heaviside" else e.args
        return f"{name}({', '.join(self._print(a) for a in arguments)})"

    _print_exp = _print_log = _print_sinh = _print_cosh = _print_tanh = _print_asinh = _print_Function
    _print_sin = _print_cos = _print_atan = _print_erf = _print_Heaviside = _print_Function

    def _print_Number(self, e: Any) -> str:
        return repr(float(e))

    _print_Float = _print_Integer = _print_Rational = _print_NumberSymbol = _print_Pi = _print_Exp1 = _print_Number

    def _print_Pow(self, e: Any, rational: bool = False, **_: Any) -> str:
        if e.is_number:
            return repr(float(e))
        base, tight = self._print(e.base), self.parenthesize(e.base, PRECEDENCE["Pow"])
        if e.exp == sympy.S.Half:
            return f"sqrt({base})"
        if e.exp == -1:
            return f"1.0/{tight}"
        if e.base.is_Symbol and e.exp in (2, 3, 4):
            return f"({'*'.join([tight] * int(e.exp))})"
        if e.exp == 2:
            return f"square({base})"
        if e.exp.is_Integer and e.exp < -1:
            return f"1.0/{self._print(1 / e)}"
        return f"power({base}, {self._print(e.exp)})"

    _print_Max, _print_Min, _print_And, _print_Or = map(_nested, ("larger", "smaller", "both", "either"))

    def _print_Piecewise(self, e: Any) -> str:
        text: str = self._print(e.args[-1].expr)
        for branch, condition in reversed(e.args[:-1]):
            text = self.choice.format(condition=self._print(condition), branch=self._print(branch), otherwise=text)
        return text


_PRINTER = KernelPrinter({"standard": "python3"})


def expression_source(expression: sympy.Basic) -> str:
    """An expression as text."""
    return str(_PRINTER.doprint(expression))


def assignment_lines(steps: Iterable[tuple[sympy.Symbol, sympy.Expr]], indent: str) -> list[str]:
    """Steps as lines of text."""
    return [f"{indent}{symbol} = {expression_source(expression)}" for symbol, expression in steps]


def law_comments(law: CreepLaw) -> list[str]:
    """The terms and state rates of a law as comments; nothing in a label can end one."""
    lines = [f"{label}: {term}" for label, term in law.terms.items()]
    lines += [f"d{symbol}/dt: {state.rate}" for symbol, state in law.states.items()]
    return [f"# {''.join(c if c.isprintable() else ' ' for c in line)}" for line in lines]
