"""Subroutine CREEP for Abaqus/Standard and CalculiX: a law as fixed-form Fortran, one file that compiles alone.

The increment is integrated inside (templates/increment.f): an implicit step at constant stress in the transformed time
in which the law starts smoothly, with the derivative of the converged update. Both codes keep the stress at the end of
their increment, so that their own step is of first order in time.

The text is Fortran 90 in fixed form, statements within 72 columns (gfortran and ifort compile it), all in double
precision.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from importlib import resources
from string import Template
from typing import Any, ClassVar

import sympy
from sympy.core.relational import Relational
from sympy.logic.boolalg import BooleanFunction

from creepkit.errors import ExportError
from creepkit.exporters.law_code import Identifiers, LawCode, called_names
from creepkit.exporters.law_description import comment_lines, comment_safe, heading, refuse_conditions
from creepkit.hookspecs import hookimpl
from creepkit.kernels.kernel_functions import TARGET_FUNCTIONS, KernelPrinter
from creepkit.language.law import CreepLaw
from creepkit.language.symbols import POINT_VARIABLES, mean_stress, principal_stress, temperature, time
from creepkit.records import Exporter, LawWithValues

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


_MAX_NAME_LENGTH = 31
"""Characters of a name by any standard since Fortran 90; a longer one might not fit into a line either."""


_MAX_STEM_LENGTH = 20
"""Characters of a routine's stem; with its endings it stays a name."""


class CreepSubroutine:
    """The exporter of one of the two codes."""

    name: ClassVar[str]
    title: ClassVar[str]
    suffix: ClassVar[str] = ".f"
    solver: ClassVar[str]
    """The code in words."""
    state_template: ClassVar[str] = ""
    """Template that stores internal variables between increments, for a code that does not."""

    def text(self, source: LawWithValues) -> str:
        """Return the file's text; ExportError where CREEP is not given what the law needs."""
        source = source.without_inactive_terms()
        self._check_inputs(source.law)
        stems = Identifiers(("creep",), ignore_case=True, max_length=_MAX_STEM_LENGTH)
        stem = stems.unique(source.name or source.law.name)
        reserved = FORTRAN_RESERVED | {f"{stem}_law"}
        code = LawCode(source, Identifiers(reserved, ignore_case=True, max_length=_MAX_NAME_LENGTH))
        substitutions = self._template_values(code, stem.lower())
        header = heading(code.source, mentions_floors=True)
        header_lines = [*header, *code.renaming_notes(), "", *self.usage_notes(code)]
        templates = [f"{self.name}.f", "increment.f", *([self.state_template] if code.states else [])]
        routines = [Template(_template_text(name)).substitute(substitutions) for name in filter(None, templates)]
        parts = [
            *comment_lines(map(comment_safe, header_lines), "!", 71),
            "!",
            *(line for text in routines for line in wrapped_lines(text)),
            "!",
            "! The law: ln of the rate and each state's rate, 1/s, then their",
            "! derivatives to stress, strain, time, temperature, largest",
            "! principal stress, mean stress and states, row by row.",
            *law_subroutine(code, f"{substitutions['id']}_law"),
        ]
        return "\n".join(parts) + "\n"

    def usage_notes(self, code: LawCode) -> Iterator[str]:
        """What a user of the code must put into the input file."""
        raise NotImplementedError

    def _check_inputs(self, law: CreepLaw) -> None:
        if law.uses(principal_stress):
            raise ExportError(
                f"law '{law.name}' needs the largest principal stress, which {self.solver} does not pass to "
                f"CREEP; export it as '{self.name}-umat' or 'mfront', or choose a law of the von Mises stress"
            )

    def _state_statements(self, stem: str, count: int) -> dict[str, str]:
        """How internal variables come and go: statements for the template."""
        raise NotImplementedError

    def _template_values(self, code: LawCode, stem: str) -> dict[str, str]:
        law, units, fields = code.law, code.source.units, len(code.conditions)
        states = list(law.states.values())
        starts = [0.0, *(s.initial for s in states)]
        ends = [1e308, *(1e308 if s.limit is None else s.limit for s in states)]
        return {
            "id": stem,
            "ny": str(1 + len(states)),
            "ns": str(len(states)),
            "nx": str(nx := len(POINT_VARIABLES) + len(states)),
            "mx": str(nx + fields),
            "nt": str(2 + fields),
            "np": str(7 + fields),
            "fields": "".join(f"      temps({k + 2}) = predef({k}) - 0.5d0*dpred({k})\n" for k in range(1, fields + 1)),
            "carried": "        point(8:) = temps(3:)\n" if fields else "",
            "placed": f"        x({nx + 1}:) = point(8:)\n" if fields else "",
            "beta": fortran_number(code.leading_time_exponent()),
            "shift_origin": "" if law.uses(time) else "        if (.not. strain > 0.0d0) origin = max(start, 0.0d0)\n",
            "mpa": fortran_number(units.megapascals),
            "seconds": fortran_number(units.seconds),
            "stress": units.stress,
            "time": units.time,
            "limits": "\n".join(f"        ends({k}) = {fortran_number(end)}" for k, end in enumerate(ends, 1)),
            "initial": "\n".join(f"      initial({k}) = {fortran_number(v)}" for k, v in enumerate(starts, 1)),
            **self._state_statements(stem, len(states)),
        }


class AbaqusCreepSubroutine(CreepSubroutine):
    """Subroutine CREEP of Abaqus/Standard."""

    name = "abaqus"
    serves = ("creep",)
    title = "Abaqus/Standard user subroutine CREEP (fixed-form Fortran)"
    solver = "Abaqus"

    def usage_notes(self, code: LawCode) -> Iterator[str]:
        """Lines for the head of the file."""
        yield "Abaqus/Standard: *CREEP, LAW=USER in the material, *VISCO, CETOL=... as the step."
        yield from _time_notes(code)
        if code.conditions:
            fields = ", ".join(f"{k} {one.name} in {one.unit}" for k, one in enumerate(code.law.conditions, 1))
            yield f"Predefined fields (*INITIAL CONDITIONS, TYPE=FIELD, VARIABLE=number): {fields}."
        if code.states:
            state_list = ", ".join(f"{k} {s.name}" for k, s in enumerate(code.law.states, 1))
            yield f"*DEPVAR needs {len(code.states)}: {state_list} (less its initial value, so nil is a fresh start)."
        yield "Creep is isotropic, by the von Mises stress; swelling is nil."

    def _state_statements(self, stem: str, count: int) -> dict[str, str]:
        indices = range(2, 2 + count)
        return {
            "fetch": "".join(f"      y({k}) = y({k}) + statev({k - 1})\n" for k in indices),
            "store": "".join(f"      statev({k - 1}) = y({k}) - initial({k})\n" for k in indices),
        }


CALCULIX_CETOL = (
    "CETOL is a strain, the difference that the rates at both ends of an increment may make: one above what an "
    "increment creeps limits nothing, so 1e-2 and 1e-4 may give one run. Bound increments where the rate falls fast."
)


class CalculixCreepSubroutine(CreepSubroutine):
    """Subroutine CREEP of CalculiX."""

    name = "calculix"
    serves = ("creep", "ccx")
    title = "CalculiX creep.f (fixed-form Fortran)"
    solver = "CalculiX"
    state_template = "calculix_states.f"

    def usage_notes(self, code: LawCode) -> Iterator[str]:
        """Lines for the head of the file."""
        yield (
            "CalculiX: replace creep.f of its source, or preload it as a shared library before a ccx that is built as "
            "one; an ordinary ccx, one program as Debian has it, ignores a preloaded CREEP without a word (PEEQ: 0)."
        )
        yield (
            "*CREEP, LAW=USER in the material without TYPE=ORTHO, by which ccx runs a law of its own, and *VISCO, "
            f"CETOL=... as the step, which insists on CETOL. {CALCULIX_CETOL}"
        )
        yield "It insists on *INITIAL CONDITIONS, TYPE=TEMPERATURE whether or not the law depends on temperature."
        if code.states:
            state_list = ", ".join(s.name for s in code.law.states)
            yield (
                f"Internal variables ({state_list}) are kept in the routine itself, so a restart of ccx begins afresh."
            )
        yield from _time_notes(code)

    def _check_inputs(self, law: CreepLaw) -> None:
        super()._check_inputs(law)
        refuse_conditions(law, "CREEP of CalculiX, which is given no fields,")
        if law.uses(mean_stress):
            raise ExportError(
                f"law '{law.name}' needs the mean stress, which CalculiX does not pass to CREEP; export it as "
                "'calculix-umat'"
            )

    def _state_statements(self, stem: str, count: int) -> dict[str, str]:
        if count == 0:
            return {"fetch": "", "store": ""}
        arguments = "noel, npt, start, finish"
        return {
            "fetch": f"      call {stem}_stored({arguments}, .false., first(2:))\n      first = first + initial\n",
            "store": f"      y(2:) = y(2:) - initial(2:)\n      call {stem}_stored({arguments}, .true., y(2:))\n",
        }


def _time_notes(code: LawCode) -> Iterator[str]:
    if code.law.uses(time):
        yield "Time is the total time, TIME(2), less t_first below: set t_first where loading is not at time zero."
    if code.law.uses(temperature):
        yield "TEMP is taken as K; set to_kelvin = 273.15d0 below where it is in C."


def _template_text(name: str) -> str:
    return resources.files("creepkit.exporters").joinpath("templates", name).read_text(encoding="utf-8")


@hookimpl
def creepkit_exporters() -> list[Exporter]:
    """The exporters of this module."""
    return [AbaqusCreepSubroutine(), CalculixCreepSubroutine()]
