"""C: one file of C99 that needs math.h only, with the rate, its logarithm with derivatives, and internal variables.

The printer, the numerically stable functions and the reserved words serve C++ (MFront) as well.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Any

import sympy

from creepkit.exporters.law_code import CodeFunction, Identifiers, LawCode, called_names, factor_text
from creepkit.exporters.law_description import comment_lines, comment_safe, heading, printable_text
from creepkit.hookspecs import hookimpl
from creepkit.kernels.kernel_functions import TARGET_FUNCTIONS, KernelPrinter, joined
from creepkit.language.symbols import POINT_VARIABLES, mean_stress, principal_stress, stress, time
from creepkit.records import Exporter, LawWithValues

_KEYWORDS = """
auto break case char const continue default do double else enum extern float for goto if inline int long register
restrict return short signed sizeof static struct switch typedef union unsigned void volatile while _Bool _Complex
_Imaginary asm typeof main
"""
"""C99, with the words that compilers add."""


_CPP_KEYWORDS = """
alignas alignof and and_eq bitand bitor bool catch char8_t char16_t char32_t class co_await co_return co_yield compl
concept const_cast consteval constexpr constinit decltype delete dynamic_cast explicit export false friend mutable
namespace new noexcept not not_eq nullptr operator or or_eq private protected public reinterpret_cast requires
static_assert static_cast template this thread_local throw true try typeid typename using virtual wchar_t xor xor_eq
std min max abs eval
"""
"""What C++20 has beside C99, and names that code for it calls unqualified."""


_MATH_FUNCTIONS = """
acos asin atan atan2 cos sin tan acosh asinh atanh cosh sinh tanh exp exp2 expm1 frexp ilogb ldexp log log10 log1p log2
logb modf scalbn scalbln cbrt fabs hypot pow sqrt erf erfc lgamma tgamma ceil floor nearbyint rint lrint llrint round
lround llround trunc fmod remainder remquo copysign nan nextafter nexttoward fdim fmax fmin fma cabs cacos cacosh carg
casin casinh catan catanh ccos ccosh cexp cimag clog conj cpow cproj creal csin csinh csqrt ctan ctanh gamma j0 j1 jn
y0 y1 yn drem scalb significand exp10 pow10 fadd fdiv fmul fsub ffma fsqrt llogb nextup nextdown roundeven sincos
"""
"""math.h and complex.h, with what Unix adds: compilers know these as functions, included or not; also with f and l."""


_LIBRARY_NAMES = """
fpclassify isfinite isinf isnan isnormal signbit isgreater isgreaterequal isless islessequal islessgreater isunordered
signgam float_t double_t INFINITY NAN HUGE_VAL abort atexit bsearch calloc div exit free getenv labs ldiv malloc qsort
rand realloc srand strtod system aligned_alloc at_quick_exit atof atoi atol atoll clearenv drand48 ecvt fcvt fd_set
finite gcvt getpt initstate iszero lldiv llabs mblen mktemp on_exit pselect putenv quick_exit random realpath select
setenv setstate srandom strtof strtol strtold uint ulong unlockpt ushort valloc isalpha isdigit isspace tolower toupper
fclose fopen printf putc puts remove rename scanf sprintf memchr memcpy memset strcat strchr strcmp strcpy strlen
alloca ffs fork gettext index rindex
"""
"""Macros and types of math.h, and functions of other headers that compilers know without them."""


_MACROS = """
linux unix i386 NULL EOF errno stdin stdout stderr assert offsetof HUGE MAXFLOAT DOMAIN SING OVERFLOW UNDERFLOW PLOSS
TLOSS near far small interface
"""
"""What compilers and the headers that math.h brings along replace before they look at names, without underscores."""


_MATH_CONSTANTS = "E LOG2E LOG10E LN2 LN10 PI PI_2 PI_4 1_PI 2_PI 2_SQRTPI SQRT2 SQRT1_2"
_WIDTHS = ("", "f", "l", "f16", "f32", "f64", "f128", "f32x", "f64x")
"""Endings of what math.h has for each type of number; in capitals for some of its macros."""


C_RESERVED = frozenset(f"{_KEYWORDS} {_CPP_KEYWORDS} {_LIBRARY_NAMES} {_MACROS}".split()).union(
    (name + width for name in _MATH_FUNCTIONS.split() for width in _WIDTHS),
    (f"M_{name}{width}" for name in _MATH_CONSTANTS.split() for width in _WIDTHS),
    (name + width.upper() for name in ("HUGE_VAL", "HUGE_VAL_", "SNAN") for width in _WIDTHS),
)


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
"""{name: (arguments, result)}, each after those it calls; the formulas are those of kernels.scalar_functions."""


STABLE_FUNCTION_NAMES = frozenset((*TARGET_FUNCTIONS, *STABLE_FUNCTIONS, "value", "other", "least"))


class CPrinter(KernelPrinter):
    """Print lowered expressions as C, which is C++ too; branches are taken lazily."""

    reserved_words = ()
    choice = "({condition} ? {branch} : {otherwise})"
    _print_And, _print_Or = joined("(", " && "), joined("(", " || ")

    def _print_Pow(self, e: Any, rational: bool = False, **_: Any) -> str:
        return re.sub(r"^power\(", "pow(", super()._print_Pow(e, rational))


_PRINTER = CPrinter({"standard": "python3"})


def c_expression(expression: sympy.Basic) -> str:
    """An expression as C."""
    return str(_PRINTER.doprint(expression))


def c_assignments(definitions: Iterable[tuple[sympy.Symbol, sympy.Expr]], type_name: str = "const double") -> list[str]:
    """Steps as definitions."""
    return [f"{type_name} {symbol} = {c_expression(expression)};" for symbol, expression in definitions]


def stable_functions_in(texts: Sequence[str]) -> list[str]:
    """The names of the helpers that texts call, and of those that they call in turn, in order."""
    required = called_names(texts)
    for name in reversed([*STABLE_FUNCTIONS]):
        if name in required:
            required |= called_names([STABLE_FUNCTIONS[name][1]])
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


_LINE_LENGTH = 120


class CExporter:
    """A C file: NAME_rate, NAME_log_rate with slopes and, for laws with internal variables, NAME_state_rates."""

    serves = ("c++", "cpp")
    name = "c"
    title = "C99 file with the rate and its derivatives"
    suffix = ".c"

    def text(self, source: LawWithValues) -> str:
        """Return the file's text; stress and time are converted on entry, rates on exit."""
        return _CFile(source).text()


class _CFile:
    """One law as C."""

    def __init__(self, source: LawWithValues) -> None:
        identifiers = Identifiers(C_RESERVED | STABLE_FUNCTION_NAMES | {"rates", "slopes"})
        self.prefix = identifiers.unique(source.name or source.law.name)
        identifiers.unique_names(
            f"{self.prefix}_{ending}" for ending in ("rate", "log_rate", "state_rates", "initial", "limit")
        )
        self.code = LawCode(source, identifiers)
        self.source, self.law, self.units = self.code.source, self.code.law, source.units
        used = [k for k, s in enumerate(POINT_VARIABLES) if s == stress or self.law.uses(s)]
        self.input_indices = [*used, *(len(POINT_VARIABLES) + k for k in range(len(self.law.states)))]
        inputs = (*self.code.point, *self.code.states)
        self.arguments = [inputs[k] for k in self.input_indices]
        factors = dict.fromkeys((stress, principal_stress, mean_stress), self.units.megapascals)
        factors[time] = self.units.seconds
        self.unit_factors = [factors.get(s, 1.0) for s in (*POINT_VARIABLES, *self.law.states)]
        self.update = self.code.function("update")

    def text(self) -> str:
        """The whole file."""
        functions = [self._rate(), self._log_rate(), *([self._state_rates()] if self.law.states else [])]
        helpers = [c_function_definition(name) for name in stable_functions_in([line for f in functions for line in f])]
        blocks = [
            self._header(functions),
            ["#include <math.h>"],
            ["/* The parameters, for stress as a ratio to 1 MPa and time to 1 s. */", *self._parameters()],
            *([self._state_constants()] if self.law.states else []),
            *([helpers] if helpers else []),
            *functions,
        ]
        return "\n\n".join("\n".join(block) for block in blocks) + "\n"

    # ---- comments --------------------------------------------------------------------------------------------------

    def _header(self, functions: Sequence[Sequence[str]]) -> list[str]:
        header_lines = [
            *heading(self.source, mentions_floors=any("floor" in line for body in functions[:2] for line in body)),
            *self.code.renaming_notes(),
            "A result beyond 1.8e308 is INFINITY.",
        ]
        declared = [
            "",
            "Declarations for the code that calls this file (exported by creepkit; link with -lm):",
            *(f"  {declaration};" for _, declaration, *_ in functions),
            f"Slopes are derivatives to {', '.join(map(str, self.arguments))}, in this order.",
        ]
        return c_block_comment([*comment_lines(header_lines, " *", _LINE_LENGTH), *comment_lines(declared, " *")])

    def _parameters(self) -> list[str]:
        lines = []
        for (symbol, value), param in zip(self.code.parameters.items(), self.law.params.values(), strict=True):
            unit = "" if param.unit == "1" else f"{param.unit}, "
            lines.append(f"static const double {symbol} = {value!r}; /* {comment_safe(unit + param.meaning)} */")
        return lines

    def _state_constants(self) -> list[str]:
        """Where internal variables start, and where the material has failed."""
        states, count = self.law.states.values(), len(self.law.states)
        limits = ["INFINITY" if state.limit is None else repr(state.limit) for state in states]
        names = ", ".join(map(str, self.code.states))
        return [
            f"/* Start of {names}, and the value at which the material has failed. */",
            f"const double {self.prefix}_initial[{count}] = {{{', '.join(repr(state.initial) for state in states)}}};",
            f"const double {self.prefix}_limit[{count}] = {{{', '.join(limits)}}};",
        ]

    # ---- the functions ---------------------------------------------------------------------------------------------

    def _rate(self) -> list[str]:
        labels = [comment_safe(printable_text(label)) for label in self.law.terms]
        function = self.code.function("rate").with_outputs([0])
        comment = f"Rate of equivalent creep strain, 1/{self.units.time}: {' + '.join(labels)}."
        result = f"return {_product(self.units.seconds, function.outputs[0])};"
        return self._function_definition(comment, "double", "rate", [], function, [result])

    def _log_rate(self) -> list[str]:
        function = self.update.with_outputs([0, *self._output_indices(0)])
        shift = "" if self.units.seconds == 1 else f"log({self.units.seconds!r}) + "
        body = [
            *self._derivative_lines("slopes", function.outputs[1:], 1.0),
            f"return {shift}{c_expression(function.outputs[0])};",
        ]
        comment = f"ln of the rate in 1/{self.units.time}, and its derivatives."
        return self._function_definition(
            comment, "double", "log_rate", [f"double slopes[{len(self.arguments)}]"], function, body
        )

    def _state_rates(self) -> list[str]:
        count, width = len(self.law.states), len(self.arguments)
        rows = range(1, count + 1)
        function = self.update.with_outputs([*rows, *(index for row in rows for index in self._output_indices(row))])
        body = []
        for k in range(count):
            derivatives = function.outputs[count + k * width : count + (k + 1) * width]
            body.append(f"rates[{k}] = {_product(self.units.seconds, function.outputs[k])};")
            body += self._derivative_lines(f"slopes[{k}]", derivatives, self.units.seconds)
        comment = f"Rates of internal variables, 1/{self.units.time}, and their derivatives, a row each."
        outputs = [f"double rates[{count}]", f"double slopes[{count}][{width}]"]
        return self._function_definition(comment, "void", "state_rates", outputs, function, body)

    def _function_definition(
        self, comment: str, kind: str, name: str, outputs: Sequence[str], function: CodeFunction, results: Sequence[str]
    ) -> list[str]:
        """Comment, declaration and body; stress and time come in the law's own units from the first statements on."""
        inputs = [f"double {s}" for s in (*self.arguments, *self.code.conditions)]
        scales = [(s, self.unit_factors[k]) for k, s in zip(self.input_indices, self.arguments, strict=True)]
        body = [
            *(f"(void){s};" for s in (*self.arguments, *self.code.conditions) if s not in function.inputs),
            *(f"{s} *= {scale!r};" for s, scale in scales if scale != 1 and s in function.inputs),
            *(f"const double {ln} = log({plain});" for ln, plain in self.code.logarithms_used(function).items()),
            *c_assignments(function.assignments),
            *results,
        ]
        declaration = f"{kind} {self.prefix}_{name}({', '.join((*inputs, *outputs))})"
        return [f"/* {comment} */", declaration, "{", *(f"    {line}" for line in body), "}"]

    def _derivative_lines(self, target: str, derivatives: Sequence[sympy.Expr], factor: float) -> list[str]:
        """One row of derivatives, to the arguments in the units in which they come."""
        factors = [self.unit_factors[k] * factor for k in self.input_indices]
        return [
            f"{target}[{k}] = {_product(f, e) if e != 0 else c_expression(e)};"
            for k, (f, e) in enumerate(zip(factors, derivatives, strict=True))
        ]

    def _output_indices(self, row: int) -> list[int]:
        """Where the derivatives of a row to the arguments stand in the update entry."""
        rows = 1 + len(self.law.states)
        return [rows + row * (len(POINT_VARIABLES) + rows - 1) + column for column in self.input_indices]


def _product(factor: float, expression: sympy.Expr) -> str:
    """A factor times an expression, which stands in brackets where that is needed."""
    text = c_expression(expression)
    return f"{factor_text(factor)}({text})" if factor != 1 and expression.is_Add else f"{factor_text(factor)}{text}"


@hookimpl
def creepkit_exporters() -> list[Exporter]:
    """The exporter of this module."""
    return [CExporter()]
