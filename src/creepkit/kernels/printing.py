"""One printer for every target: the same readable text, evaluated by the functions a target provides.

The names used (exp, log, log_floor, log_sinh, exp_difference, larger, choose ...) are defined once per target in
numpy_functions, torch_functions and numba_functions.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import sympy
from sympy.printing.precedence import PRECEDENCE
from sympy.printing.pycode import PythonCodePrinter

from creepkit.errors import LawError

if TYPE_CHECKING:
    from creepkit.kernels.entries import KernelFunction
    from creepkit.language.law import CreepLaw

TARGET_FUNCTION_NAMES = {
    "exp": "exp",
    "log": "log",
    "sinh": "sinh",
    "cosh": "cosh",
    "asinh": "asinh",
    "tanh": "tanh",
    "sin": "sin",
    "cos": "cos",
    "atan": "atan",
    "erf": "erf",
    "LogFloor": "log_floor",
    "Floored": "floored",
    "Log1p": "log1p",
    "LogSinh": "log_sinh",
    "LogCosh": "log_cosh",
    "LogTanh": "log_tanh",
    "LogRise": "log_rise",
    "Tanh": "tanh",
    "Coth": "coth",
    "Expm1": "expm1",
    "ExpDifference": "exp_difference",
    "Heaviside": "heaviside",
}
"""{sympy class: function of every target}; Heaviside comes from the slopes of Max and Min."""

TARGET_FUNCTIONS = (*sorted({*TARGET_FUNCTION_NAMES.values()}), "both", "choose", "either", "larger", "power", "smaller", "sqrt", "square")


class KernelPrinter(PythonCodePrinter):  # type: ignore[misc]
    """Print lowered expressions as calls of the target's functions."""

    reserved_words = (*PythonCodePrinter.reserved_words, *TARGET_FUNCTIONS)

    def _print_Function(self, e: Any) -> str:
        name = TARGET_FUNCTION_NAMES.get(type(e).__name__)
        if name is None:
            raise LawError(f"the function {type(e).__name__} has no kernel; allowed are {', '.join(sorted(TARGET_FUNCTION_NAMES))}")
        arguments = e.args[:1] if name == "heaviside" else e.args
        return f"{name}({', '.join(self._print(a) for a in arguments)})"

    _print_exp = _print_log = _print_sinh = _print_cosh = _print_tanh = _print_asinh = _print_Function
    _print_sin = _print_cos = _print_atan = _print_erf = _print_Heaviside = _print_Function

    def _print_Float(self, e: Any) -> str:
        return repr(float(e))

    def _print_Integer(self, e: Any) -> str:
        return repr(float(e))

    def _print_Rational(self, e: Any) -> str:
        return repr(float(e))

    def _print_NumberSymbol(self, e: Any) -> str:
        return repr(float(e))

    _print_Pi = _print_Exp1 = _print_NumberSymbol

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

    def _print_Max(self, e: Any) -> str:
        return self._nested("larger", list(e.args))

    def _print_Min(self, e: Any) -> str:
        return self._nested("smaller", list(e.args))

    def _print_And(self, e: Any) -> str:
        return self._nested("both", list(e.args))

    def _print_Or(self, e: Any) -> str:
        return self._nested("either", list(e.args))

    def _nested(self, name: str, arguments: list[Any]) -> str:
        text: str = self._print(arguments[0])
        for argument in arguments[1:]:
            text = f"{name}({text}, {self._print(argument)})"
        return text

    def _print_Piecewise(self, e: Any) -> str:
        text: str = self._print(e.args[-1].expr)
        for branch, condition in reversed(e.args[:-1]):
            text = f"choose({self._print(condition)}, {self._print(branch)}, {text})"
        return text


_PRINTER = KernelPrinter({"standard": "python3"})


def expression_source(expression: sympy.Basic) -> str:
    """An expression as text."""
    return str(_PRINTER.doprint(expression))


def assignment_lines(steps: Iterable[tuple[sympy.Symbol, sympy.Expr]], indent: str) -> list[str]:
    """Steps as lines of text."""
    return [f"{indent}{symbol} = {expression_source(expression)}" for symbol, expression in steps]


def array_function_source(entry: KernelFunction) -> str:
    """An entry as a function of arrays or tensors that returns a tuple."""
    arguments = ", ".join(s.name for s in entry.inputs)
    lines = [f"def {entry.name}({arguments}):", *assignment_lines((*entry.constants, *entry.steps), "    ")]
    outputs = "".join(f"        {expression_source(output)},\n" for output in entry.outputs)
    return "\n".join(lines) + f"\n    return (\n{outputs}    )\n"


def law_comments(law: CreepLaw) -> list[str]:
    """The terms and state rates of a law as comments; nothing in a label can end one."""
    lines = [f"{label}: {term}" for label, term in law.terms.items()]
    lines += [f"d{symbol}/dt: {state.rate}" for symbol, state in law.states.items()]
    return [f"# {''.join(c if c.isprintable() else ' ' for c in line)}" for line in lines]
