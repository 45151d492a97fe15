"""C and C++: expressions, and the stable functions of kernels as C functions or C++ lambdas."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Any

import sympy

from creepkit.kernels.printing import TARGET_FUNCTIONS, KernelPrinter

STABLE_FUNCTIONS: dict[str, tuple[tuple[str, ...], str]] = {
    "square": (("value",), "value * value"),
    "larger": (("value", "other"), "value >= other || value != value ? value : other"),
    "smaller": (("value", "other"), "value <= other || value != value ? value : other"),
    "heaviside": (("value",), "value > 0.0 ? 1.0 : 0.0"),
    "floored": (("value", "least"), "value < least ? least : value"),
    "log_floor": (("value", "least"), "log(floored(value, least))"),
    "log_sinh": (("value",), "floored(value, 1e-30) + log(-0.5 * expm1(-2.0 * floored(value, 1e-30)))"),
    "near_log_cosh": (("value",), "log1p(2.0 * sinh(0.5 * value) * sinh(0.5 * value))"),
    "far_log_cosh": (("value",), "fabs(value) + log1p(exp(-2.0 * fabs(value))) - log(2.0)"),
    "log_cosh": (("value",), "fabs(value) < 1.0 ? near_log_cosh(value) : far_log_cosh(value)"),
    "log_rise": (("value",), "value > log(2.0) ? log1p(-exp(-value)) : log(-expm1(-floored(value, 1e-30)))"),
    "log_tanh": (("value",), "log_rise(2.0 * floored(value, 1e-30)) - log1p(exp(-2.0 * floored(value, 1e-30)))"),
    "coth": (("value",), "1.0 / tanh(floored(value, 1e-30))"),
    "exp_difference": (
        ("value", "other"),
        "value >= other ? -exp(value) * expm1(other - value) : exp(other) * expm1(value - other)",
    ),
}
"""{name: (arguments, result)}, each after those it calls; the formulas are those of kernels.numba_functions."""

STABLE_FUNCTION_NAMES = frozenset((*TARGET_FUNCTIONS, *STABLE_FUNCTIONS, "value", "other", "least"))


class CPrinter(KernelPrinter):
    """Print lowered expressions as C, which is C++ too; branches are taken lazily."""

    reserved_words = ()

    def _print_Pow(self, e: Any, rational: bool = False, **_: Any) -> str:
        return re.sub(r"^power\(", "pow(", super()._print_Pow(e, rational))

    def _print_And(self, e: Any) -> str:
        return f"({' && '.join(self._print(a) for a in e.args)})"

    def _print_Or(self, e: Any) -> str:
        return f"({' || '.join(self._print(a) for a in e.args)})"

    def _print_Piecewise(self, e: Any) -> str:
        branches = [f"{self._print(condition)} ? {self._print(branch)} : " for branch, condition in e.args[:-1]]
        return f"({''.join(branches)}{self._print(e.args[-1].expr)})"


_PRINTER = CPrinter({"standard": "python3"})


def c_expression(expression: sympy.Basic) -> str:
    """An expression as C."""
    return str(_PRINTER.doprint(expression))


def c_assignments(definitions: Iterable[tuple[sympy.Symbol, sympy.Expr]], type_name: str = "const double") -> list[str]:
    """Steps as definitions."""
    return [f"{type_name} {symbol} = {c_expression(expression)};" for symbol, expression in definitions]


def stable_functions_in(texts: Sequence[str]) -> list[str]:
    """The names of the helpers that texts call, and of those that they call in turn, in order."""
    required = _called_names(texts)
    for name in reversed([*STABLE_FUNCTIONS]):
        if name in required:
            required |= _called_names([STABLE_FUNCTIONS[name][1]])
    return [name for name in STABLE_FUNCTIONS if name in required]


def c_function_definition(name: str) -> str:
    """A helper as a function of this file."""
    arguments, result = STABLE_FUNCTIONS[name]
    return f"static double {name}({', '.join(f'double {a}' for a in arguments)}) {{ return {result}; }}"


def cpp_lambda_definition(name: str) -> str:
    """A helper as a C++ lambda of MFront's `real`."""
    arguments, result = STABLE_FUNCTIONS[name]
    return f"const auto {name} = [&](const real {', const real '.join(arguments)}) -> real {{ return {result}; }};"


def c_block_comment(lines: Iterable[str]) -> list[str]:
    """Lines, each made ` * ...`, between comment marks; whatever could end a comment is taken apart."""
    return ["/*", *(comment_safe(line) for line in lines), " */"]


def comment_safe(text: str) -> str:
    """Text in which no comment ends or starts, nor a trigraph."""
    return text.replace("*/", "* /").replace("/*", "/ *").replace("??", "? ?")


def _called_names(texts: Iterable[str]) -> set[str]:
    return {name for text in texts for name in re.findall(r"(\w+)\(", text)}
