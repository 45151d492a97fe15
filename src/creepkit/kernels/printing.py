"""One printer for every target: the same readable text, evaluated by the functions a target provides.

The names used (exp, log, log_floor, log_sinh, exp_difference, larger, choose ...) are defined once per target in
numpy_functions, torch_functions and numba_functions.
"""

from __future__ import annotations

from typing import Any

import sympy
from sympy.printing.pycode import PythonCodePrinter

from creepkit.errors import LawError
from creepkit.kernels.entries import Entry

NAMES = {
    "exp": "exp",
    "log": "log",
    "sinh": "sinh",
    "cosh": "cosh",
    "tanh": "tanh",
    "sin": "sin",
    "cos": "cos",
    "atan": "atan",
    "erf": "erf",
    "Abs": "absolute",
    "LogFloor": "log_floor",
    "Floored": "floored",
    "LogSinh": "log_sinh",
    "Coth": "coth",
    "Expm1": "expm1",
    "ExpDifference": "exp_difference",
    "Heaviside": "heaviside",
}
FUNCTIONS = (*sorted(set(NAMES.values())), "choose", "larger", "power", "smaller", "sqrt")


class KernelPrinter(PythonCodePrinter):  # type: ignore[misc]
    """Print lowered expressions as calls of the target's functions."""

    reserved_words = (*PythonCodePrinter.reserved_words, *FUNCTIONS)

    def _print_Function(self, e: Any) -> str:
        name = NAMES.get(type(e).__name__)
        if name is None:
            raise LawError(f"the function {type(e).__name__} has no kernel; allowed are {', '.join(sorted(NAMES))}")
        arguments = e.args[:1] if name == "heaviside" else e.args
        return f"{name}({', '.join(self._print(a) for a in arguments)})"

    _print_exp = _print_log = _print_sinh = _print_cosh = _print_tanh = _print_Abs = _print_Function
    _print_sin = _print_cos = _print_atan = _print_erf = _print_Heaviside = _print_Function

    def _print_Float(self, e: Any) -> str:
        return repr(float(e))

    def _print_Integer(self, e: Any) -> str:
        return f"{int(e)}.0"

    def _print_Rational(self, e: Any) -> str:
        return repr(float(e))

    def _print_NumberSymbol(self, e: Any) -> str:
        return repr(float(e))

    _print_Pi = _print_Exp1 = _print_NumberSymbol

    def _print_Pow(self, e: Any, rational: bool = False, **_: Any) -> str:
        base = self._print(e.base)
        if e.exp == sympy.S.Half:
            return f"sqrt({base})"
        if e.exp == -1:
            return f"1.0/{self.parenthesize(e.base, sympy.printing.precedence.PRECEDENCE['Pow'])}"
        if e.exp.is_Integer and 2 <= abs(int(e.exp)) <= 4:
            product = "*".join([self.parenthesize(e.base, sympy.printing.precedence.PRECEDENCE["Pow"])] * abs(int(e.exp)))
            return f"({product})" if e.exp > 0 else f"1.0/({product})"
        return f"power({base}, {self._print(e.exp)})"

    def _print_Max(self, e: Any) -> str:
        return self._nested("larger", list(e.args))

    def _print_Min(self, e: Any) -> str:
        return self._nested("smaller", list(e.args))

    def _nested(self, name: str, arguments: list[Any]) -> str:
        text = self._print(arguments[0])
        for argument in arguments[1:]:
            text = f"{name}({text}, {self._print(argument)})"
        return text

    def _print_Piecewise(self, e: Any) -> str:
        text = self._print(e.args[-1].expr)
        for branch, condition in reversed(e.args[:-1]):
            text = f"choose({self._print(condition)}, {self._print(branch)}, {text})"
        return text


_PRINTER = KernelPrinter({"standard": "python3"})


def name_of(symbol: sympy.Symbol) -> str:
    """The symbol's name in printed text (words of Python and of the target get a tail)."""
    return str(_PRINTER.doprint(symbol))


def body(entry: Entry, indent: str) -> list[str]:
    """The assignments of an entry's steps as lines of text."""
    return [f"{indent}{symbol} = {_PRINTER.doprint(expression)}" for symbol, expression in entry.steps]


def results(entry: Entry) -> list[str]:
    """The entry's outputs as texts."""
    return [str(_PRINTER.doprint(expression)) for expression in entry.outputs]


def array_function(entry: Entry) -> str:
    """An entry as a function of arrays or tensors that returns a tuple."""
    arguments = ", ".join(name_of(s) for s in entry.inputs)
    lines = [f"def {entry.name}({arguments}):", *body(entry, "    ")]
    outputs = "".join(f"        {text},\n" for text in results(entry))
    return "\n".join(lines) + f"\n    return (\n{outputs}    )\n"
