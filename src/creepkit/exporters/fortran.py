"""Fixed-form Fortran: expressions, statements within 72 columns, the stable functions, and a law as a subroutine.

The text is Fortran 90 (gfortran and ifort compile it), all in double precision.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Any

import sympy
from sympy.core.relational import Relational
from sympy.logic.boolalg import BooleanFunction

from creepkit.exporters.law_code import LawCode, called_names
from creepkit.kernels.kernel_functions import TARGET_FUNCTIONS, KernelPrinter

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
    choice = "merge({branch}, {otherwise}, {condition})"

    def _print_BooleanTrue(self, e: Any) -> str:
        return f".{e}.".lower()

    _print_BooleanFalse = _print_BooleanTrue


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
    """Internal functions, as statements: those called, each after those it calls in turn."""
    required: dict[str, list[str]] = {}

    def require(name: str) -> None:
        definition = _function_definition(name)
        for other in called_names(definition):
            if other in _FUNCTIONS and other != name:
                require(other)
        required.setdefault(name, definition)

    for name in sorted({*names_called} & _FUNCTIONS.keys()):
        require(name)
    return [line for definition in required.values() for line in definition]


def _function_definition(name: str) -> list[str]:
    signature, *assignments, result = _FUNCTIONS[name]
    kind = "logical" if name in ("both", "either") else "double precision"
    if isinstance(result, str):
        body = [f"{name} = {result}"]
    else:
        condition, where_true, otherwise = result
        body = [f"if ({condition}) then", f"  {name} = {where_true}", "else", f"  {name} = {otherwise}", "endif"]
    return [
        f"pure {kind} function {name}({signature})",
        f"  {kind}, intent(in) :: {signature}",
        *(f"  double precision {variable}" for variable, _ in assignments),
        *(f"  {variable} = {value}" for variable, value in assignments),
        *(f"  {line}" for line in body),
        f"end function {name}",
    ]


_NOT_ZERO = ("b", "max(a, 1.0d-30)")


_FUNCTIONS: dict[str, Any] = {
    "power": ("a, b", "a**b"),
    "square": ("a", "a*a"),
    "both": ("a, b", "a .and. b"),
    "either": ("a, b", "a .or. b"),
    "larger": ("a, b", "merge(a, b, a >= b .or. a /= a)"),
    "smaller": ("a, b", "merge(a, b, a <= b .or. a /= a)"),
    "heaviside": ("a", "merge(1.0d0, 0.0d0, a > 0.0d0)"),
    "floored": ("a, least", "merge(least, a, a < least)"),
    "log_floor": ("a, least", "log(merge(least, a, a < least))"),
    "expm1": ("a", ("abs(a) < 1.0d0", "2.0d0*sinh(0.5d0*a)*exp(0.5d0*a)", "exp(min(a, 709.0d0)) - 1.0d0")),
    "log1p": ("a", ("abs(a) < 0.5d0", "2.0d0*atanh(a/(2.0d0 + a))", "log(1.0d0 + a)")),
    "log_sinh": ("a", _NOT_ZERO, "b + log(-0.5d0*expm1(-2.0d0*b))"),
    "log_cosh": (
        *("a", ("b", "abs(a)")),
        ("b < 1.0d0", "log1p(2.0d0*sinh(0.5d0*b)**2)", "b + log1p(exp(-2.0d0*b)) - log(2.0d0)"),
    ),
    "log_rise": ("a", _NOT_ZERO, ("b > log(2.0d0)", "log1p(-exp(-b))", "log(-expm1(-b))")),
    "log_tanh": ("a", _NOT_ZERO, "log_rise(2.0d0*b) - log1p(exp(-2.0d0*b))"),
    "coth": ("a", "1.0d0/tanh(max(a, 1.0d-30))"),
    "exp_difference": ("a, b", ("a >= b", "-exp(a)*expm1(b - a)", "exp(b)*expm1(a - b)")),
}
"""{name: (arguments, (variable, value) ..., result)}, a result as a text or as (condition, where it holds, otherwise).

The formulas are those of kernels.scalar_functions. Fortran has neither log1p nor expm1: 2 artanh(a/(2 + a)) and
2 sinh(a/2) exp(a/2) keep all digits near zero, whatever an optimiser does to sums.
"""


def law_subroutine(code: LawCode, name: str) -> list[str]:
    """Return `subroutine NAME(x, out)` as lines of fixed-form Fortran.

    Its x is stress MPa, strain, time s, temperature K, largest principal and mean stress MPa, then internal variables,
    then conditions; out is row by row (value, derivatives to all of them but conditions) of ln rate and of each state's
    rate, in the order of creepkit's kernels.
    """
    function = code.function("update")
    logs = code.logarithms_used(function)
    definitions = [*(f"{ln} = log({plain})" for ln, plain in logs.items()), *fortran_assignments(function.assignments)]
    results = [f"out({k + 1}) = {fortran_expression(e)}" for k, e in enumerate(function.outputs)]
    input_positions = {s: k + 1 for k, s in enumerate((*code.point, *code.states, *code.conditions))}
    input_lines = [f"{s} = x({input_positions[s]})" for s in function.inputs]
    parameters_used = [s for s in code.parameters if s in function.symbols or s in logs.values()]
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
            f"  double precision, intent(in) :: x({len(input_positions)})",
            f"  double precision, intent(out) :: out({len(function.outputs)})",
            *(f"  double precision, parameter :: {s} = {fortran_number(code.parameters[s])}" for s in parameters_used),
            *(f"  {line}" for line in double_declarations(variables)),
            *(f"  logical {name}" for name in logical_names),
            *(f"  {line}" for line in body),
            *(["contains", *(f"  {line}" for line in internal_functions)] if internal_functions else []),
            f"end subroutine {name}",
        ]
    )
