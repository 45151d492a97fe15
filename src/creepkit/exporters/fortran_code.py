"""Fixed-form Fortran: expressions, statements within 72 columns, stable functions, and the law as a subroutine.

The text is Fortran 90 in fixed form (gfortran and ifort compile it), all in double precision.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Any

import sympy
from sympy.core.relational import Relational
from sympy.logic.boolalg import BooleanFunction

from creepkit.exporters.law_code import LawCode
from creepkit.kernels.kernel_functions import TARGET_FUNCTIONS, KernelPrinter
from creepkit.language.symbols import POINT_VARIABLES

FORTRAN_LINE_LENGTH = 72


_NUMBER = re.compile(r"(?<![\w.])(\d+\.?\d*)(?:[eE]([+-]?\d+))?(?![\w.])")


_TOKEN = re.compile(r"\d+\.?\d*(?:d[+-]?\d+)?|\w+|\*\*|[<>=/]=|::|\S|\s+")


_FORTRAN_WORDS = """
abs atanh contains do double else end endif exit function if implicit intent log max merge min none out parameter
precision pure return subroutine then x
"""


FORTRAN_RESERVED = frozenset(_FORTRAN_WORDS.split()) | {*TARGET_FUNCTIONS}
"""Words that no name of a law may be: those of the routine that evaluates it."""


class FortranPrinter(KernelPrinter):
    """Print lowered expressions as Fortran."""

    reserved_words = ()

    def _print_Piecewise(self, e: Any) -> str:
        text: str = self._print(e.args[-1].expr)
        for branch, condition in reversed(e.args[:-1]):
            text = f"merge({self._print(branch)}, {text}, {self._print(condition)})"
        return text

    def _print_BooleanTrue(self, e: Any) -> str:
        return ".true."

    def _print_BooleanFalse(self, e: Any) -> str:
        return ".false."


_PRINTER = FortranPrinter({"standard": "python3"})


def fortran_expression(expression: sympy.Basic) -> str:
    """An expression as Fortran, every number in double precision."""
    return str(_NUMBER.sub(_double_literal, _PRINTER.doprint(expression))).replace("!=", "/=")


def fortran_number(value: float) -> str:
    """A number in double precision, all of its digits."""
    return _NUMBER.sub(_double_literal, repr(float(value)))


def _double_literal(match: re.Match[str]) -> str:
    digits = match[1] if "." in match[1] else f"{match[1]}.0"
    return f"{digits}d{int(match[2] or 0)}"


def fortran_statement(text: str, depth: int = 0) -> list[str]:
    """One statement as lines of at most 72 columns, broken between tokens."""
    first_indent, continuation = " " * (6 + 2 * depth), f"     &{' ' * (2 * depth + 2)}"
    lines, line = [], first_indent
    for token in _TOKEN.findall(text):
        if len(line) + len(token) > FORTRAN_LINE_LENGTH:
            lines.append(line.rstrip())
            line = continuation + token.lstrip()
        else:
            line += token
    return [*lines, line.rstrip()]


def fortran_statements(texts: Iterable[str], depth: int = 0) -> list[str]:
    """Several statements; indentation of a text adds to the depth, two blanks a level."""
    lines = []
    for text in texts:
        body = text.lstrip(" ")
        lines += fortran_statement(body, depth + (len(text) - len(body)) // 2) if body[:1] != "!" else [body]
    return lines


def wrapped_lines(text: str) -> list[str]:
    """Lines of fixed form, each that is longer than 72 columns broken between tokens."""
    lines = []
    for line in text.splitlines():
        body = line[6:].lstrip(" ")
        wrapped = (
            fortran_statement(body, (len(line[6:]) - len(body)) // 2)
            if len(line) > FORTRAN_LINE_LENGTH and line[:1] != "!"
            else [line]
        )
        lines += [line[:6] + wrapped[0][6:], *wrapped[1:]]
    return lines


def fortran_assignments(definitions: Iterable[tuple[sympy.Symbol, sympy.Expr]]) -> list[str]:
    """Steps as statements."""
    return [f"{symbol} = {fortran_expression(expression)}" for symbol, expression in definitions]


def double_declarations(names: Sequence[str]) -> list[str]:
    """Declarations of double precision variables, some a statement."""
    return [f"double precision {', '.join(names[k : k + 6])}" for k in range(0, len(names), 6)]


# ---- the stable functions ------------------------------------------------------------------------------------------


def stable_function_definitions(names_called: Iterable[str]) -> list[str]:
    """Internal functions, as statements: those called and those they need in turn."""
    required: dict[str, None] = {}

    def require(name: str) -> None:
        for other in _FUNCTION_CALLS.get(name, ()):
            require(other)
        required[name] = None

    for name in sorted(set(names_called) & _FUNCTION_BODIES.keys()):
        require(name)
    return [line for name in required for line in _function_definition(name)]


def called_names(texts: Iterable[str]) -> set[str]:
    """The names that statements call."""
    return {name for text in texts for name in re.findall(r"(\w+)\(", text)}


def _function_definition(name: str) -> list[str]:
    arguments, locals_, body = _FUNCTION_BODIES[name]
    logical = name in ("both", "either")
    kind = "logical" if logical else "double precision"
    return [
        f"pure {kind} function {name}({arguments})",
        f"  {kind}, intent(in) :: {arguments}",
        *([f"  double precision {locals_}"] if locals_ else []),
        *(f"  {line}" for line in body),
        f"end function {name}",
    ]


_FUNCTION_BODIES: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "power": ("a, b", "", ("power = a**b",)),
    "square": ("a", "", ("square = a*a",)),
    "both": ("a, b", "", ("both = a .and. b",)),
    "either": ("a, b", "", ("either = a .or. b",)),
    "larger": ("a, b", "", ("larger = merge(a, b, a >= b .or. a /= a)",)),
    "smaller": ("a, b", "", ("smaller = merge(a, b, a <= b .or. a /= a)",)),
    "heaviside": ("a", "", ("heaviside = merge(1.0d0, 0.0d0, a > 0.0d0)",)),
    "floored": ("a, least", "", ("floored = merge(least, a, a < least)",)),
    "log_floor": ("a, least", "", ("log_floor = log(merge(least, a, a < least))",)),
    "expm1": (
        "a",
        "",
        (
            "if (abs(a) < 1.0d0) then",
            "  expm1 = 2.0d0*sinh(0.5d0*a)*exp(0.5d0*a)",
            "else",
            "  expm1 = exp(min(a, 709.0d0)) - 1.0d0",
            "endif",
        ),
    ),
    "log1p": (
        "a",
        "",
        (
            "if (abs(a) < 0.5d0) then",
            "  log1p = 2.0d0*atanh(a/(2.0d0 + a))",
            "else",
            "  log1p = log(1.0d0 + a)",
            "endif",
        ),
    ),
    "log_sinh": ("a", "b", ("b = max(a, 1.0d-30)", "log_sinh = b + log(-0.5d0*expm1(-2.0d0*b))")),
    "log_cosh": (
        "a",
        "b",
        (
            "b = abs(a)",
            "if (b < 1.0d0) then",
            "  log_cosh = log1p(2.0d0*sinh(0.5d0*b)**2)",
            "else",
            "  log_cosh = b + log1p(exp(-2.0d0*b)) - log(2.0d0)",
            "endif",
        ),
    ),
    "log_rise": (
        "a",
        "b",
        (
            "b = max(a, 1.0d-30)",
            "if (b > log(2.0d0)) then",
            "  log_rise = log1p(-exp(-b))",
            "else",
            "  log_rise = log(-expm1(-b))",
            "endif",
        ),
    ),
    "log_tanh": ("a", "b", ("b = max(a, 1.0d-30)", "log_tanh = log_rise(2.0d0*b) - log1p(exp(-2.0d0*b))")),
    "coth": ("a", "", ("coth = 1.0d0/tanh(max(a, 1.0d-30))",)),
    "exp_difference": (
        "a, b",
        "",
        (
            "if (a >= b) then",
            "  exp_difference = -exp(a)*expm1(b - a)",
            "else",
            "  exp_difference = exp(b)*expm1(a - b)",
            "endif",
        ),
    ),
}
"""{name: (arguments, local variables, statements)}; the formulas are those of kernels.scalar_functions.

Fortran has neither log1p nor expm1: 2 artanh(a/(2 + a)) and 2 sinh(a/2) exp(a/2) keep all digits near zero, whatever
an optimiser does to sums.
"""


_FUNCTION_CALLS = {
    "log_sinh": ("expm1",),
    "log_cosh": ("log1p",),
    "log_rise": ("log1p", "expm1"),
    "log_tanh": ("log_rise", "log1p"),
    "exp_difference": ("expm1",),
}


def law_subroutine(code: LawCode, name: str) -> list[str]:
    """Return `subroutine NAME(x, out)` as lines of fixed-form Fortran.

    Its x is stress MPa, strain, time s, temperature K, largest principal and mean stress MPa, then internal variables;
    out is row by row (value, derivatives to x) of ln rate and of each state's rate, in the order of creepkit's kernels.
    """
    function = code.function("update")
    width = len(POINT_VARIABLES) + len(code.states)
    logs = code.logarithms_used(function)
    definitions = [*(f"{ln} = log({plain})" for ln, plain in logs.items()), *fortran_assignments(function.assignments)]
    results = [f"out({k + 1}) = {fortran_expression(e)}" for k, e in enumerate(function.outputs)]
    input_positions = {s: k + 1 for k, s in enumerate((*code.point, *code.states))}
    input_lines = [f"{s} = x({input_positions[s]})" for s in function.inputs]
    used_symbols = set().union(*(e.free_symbols for e in (*(e for _, e in function.assignments), *function.outputs)))
    parameters_used = [s for s in code.parameters if s in used_symbols or s in logs.values()]
    logical_names = [str(s) for s, e in function.assignments if isinstance(e, (Relational, BooleanFunction))]
    variables = [
        str(s) for s in (*function.inputs, *logs, *(s for s, _ in function.assignments)) if str(s) not in logical_names
    ]
    body = [*input_lines, *definitions, *results]
    internal_functions = stable_function_definitions(called_names(body))
    return fortran_statements(
        [
            f"subroutine {name}(x, out)",
            "  implicit none",
            f"  double precision, intent(in) :: x({width})",
            f"  double precision, intent(out) :: out({len(function.outputs)})",
            *(f"  double precision, parameter :: {s} = {fortran_number(code.parameters[s])}" for s in parameters_used),
            *(f"  {line}" for line in double_declarations(variables)),
            *(f"  logical {name}" for name in logical_names),
            *(f"  {line}" for line in body),
            *(["contains", *(f"  {line}" for line in internal_functions)] if internal_functions else []),
            f"end subroutine {name}",
        ]
    )
