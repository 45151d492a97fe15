"""User materials of finite element codes: one stress update with its tangent, and a thin wrapper for each code.

The update is that of templates/stress_update.txt, printed as C or as fixed-form Fortran beside the law; what a code
calls is a template that puts its arguments in the update's order. A target is a record of UserMaterial.
"""

from __future__ import annotations

import keyword
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from importlib import resources
from string import Template

import sympy

from creepkit.errors import ExportError
from creepkit.exporters.algorithm_printers import CAlgorithm, ConstantValue, FortranAlgorithm
from creepkit.exporters.c import (
    C_RESERVED,
    STABLE_FUNCTION_NAMES,
    c_assignments,
    c_block_comment,
    c_expression,
    c_function_definition,
    stable_functions_in,
)
from creepkit.exporters.creep_forms import elastic_expressions
from creepkit.exporters.fortran import (
    FORTRAN_RESERVED,
    double_declarations,
    fortran_expression,
    fortran_statements,
    law_subroutine,
    stable_function_definitions,
    wrapped_lines,
)
from creepkit.exporters.law_code import Identifiers, LawCode, called_names
from creepkit.exporters.law_description import comment_lines, comment_safe, heading, refuse_conditions
from creepkit.exporters.python import array_dialect, with_helpers
from creepkit.hookspecs import hookimpl
from creepkit.kernels.kernel_functions import TARGET_FUNCTIONS, assignment_lines, expression_source
from creepkit.language.symbols import principal_stress, time
from creepkit.records import Exporter, LawWithValues

MAX_FORTRAN_NAME = 31
"""Characters of a name by any standard since Fortran 90; a longer one might not fit into a line either."""

_LONGEST_ENDING = len("_largest_principal")
"""Characters of what the algorithm adds to a routine's stem."""

NO_LIMIT = 1e308

SMALLEST_EXPONENT = 0.05
"""Exponents of time are not taken below this, as in creepkit's own integrators."""

TEMPERATURE = "kelvin"
"""The name of the temperature in the moduli's routine."""


@dataclass(frozen=True)
class UserMaterial:
    """A target: what a code calls, around the update.

    template : its file in templates/, empty where the update itself is what is called. way : how to use the file, and
    where it was run. kept : numbers that the wrapper keeps beside the states, first the temperature.
    takes_conditions : whether it is given conditions of the material.
    """

    name: str
    title: str
    suffix: str
    template: str
    way: tuple[str, ...]
    serves: tuple[str, ...] = ()
    kept: int = 0
    takes_conditions: bool = False

    def text(self, source: LawWithValues) -> str:
        """Return the file's text; ExportError where there is no elasticity."""
        require_elasticity(source, self.name)
        if not self.takes_conditions:
            refuse_conditions(source.law, self.name)
        in_c = self.suffix == ".c"
        reserved = C_RESERVED | STABLE_FUNCTION_NAMES | {"x", "out"} if in_c else FORTRAN_RESERVED
        longest = 63 if in_c else MAX_FORTRAN_NAME - _LONGEST_ENDING
        stem = Identifiers(reserved, ignore_case=not in_c, max_length=longest).unique(source.name or source.law.name)
        stem = stem if in_c else stem.lower()
        longest = 63 if in_c else MAX_FORTRAN_NAME
        code = LawCode(source, Identifiers(reserved | {f"{stem}_law"}, ignore_case=not in_c, max_length=longest))
        lines = [*heading(code.source, mentions_floors=True), *code.renaming_notes(), "", *self._usage(code)]
        write = c_update if in_c else fortran_update
        return write(code, stem, lines, self._wrapper(code, stem), update_constants(code))

    def _usage(self, code: LawCode) -> Iterator[str]:
        yield from (sentence.format(states=len(code.states) + 1 + self.kept) for sentence in self.way)
        yield from _update_notes(code)

    def _wrapper(self, code: LawCode, stem: str) -> str:
        if not self.template:
            return ""
        ny, kept = 1 + len(code.states), 1 + len(code.states) + min(self.kept, 1)
        last = f"statev({kept})"
        ends = ("temp", "temp + dtemp", "predef({k})", "predef({k}) + dpred({k})")
        outside = outside_statements(code, *(("temp", "temp", *ends[2:]) if self.kept else ends))
        if self.kept:  # the code tells the temperature at the end alone
            outside += f"      if ({last} .gt. 0.0d0) outside(1, 1) = {last}\n"
        return Template(read_template(self.template)).substitute(
            id=stem,
            ny=ny,
            no=1 + len(code.conditions),
            kept=kept,
            time=code.source.units.time,
            outside=outside,
            keep=f"      statev({kept}) = outside(2, 1)\n" if self.kept else "",
        )


def require_elasticity(source: LawWithValues, target: str) -> None:
    """ExportError, with what to write, where a law comes without."""
    if source.elastic is None:
        raise ExportError(
            f"'{target}' writes the elasticity too; give elastic=Elastic(E=150e3), in a command --modulus-gpa 150"
        )


def outside_statements(code: LawCode, first: str, last: str, first_field: str, last_field: str) -> str:
    """Temperature and conditions where an increment begins and where it ends, as statements for a template."""
    lines = [f"outside(1, 1) = {first} + to_kelvin", f"outside(2, 1) = {last} + to_kelvin"]
    for k in range(1, 1 + len(code.conditions)):
        lines += [f"outside({row}, {1 + k}) = {text.format(k=k)}" for row, text in ((1, first_field), (2, last_field))]
    return "".join(f"      {line}\n" for line in lines)


def read_template(name: str) -> str:
    """A file of templates/."""
    return resources.files("creepkit.exporters").joinpath("templates", name).read_text(encoding="utf-8")


def _update_notes(code: LawCode) -> Iterator[str]:
    """What every text says of its states, elasticity, time and method."""
    names = ["equivalent creep strain", *(s.name for s in code.law.states)]
    yield f"States: {', '.join(names)}, each less its start, so that zeros are a fresh material."
    if code.conditions:
        yield f"Conditions, in this order: {', '.join(f'{c.name} in {c.unit}' for c in code.law.conditions)}."
    assert code.source.elastic is not None
    yield f"Elasticity: E = {code.source.elastic.E} MPa, nu = {code.source.elastic.nu}."
    if code.law.uses(time):
        yield "Time is that of the code's clock, from the first load on."
    yield (
        "Isotropic elasticity, creep along the deviator of stress; an L-stable method of order 2 whose steps are "
        "halved within an increment by their estimated error, with the tangent of the steps that were taken."
    )


def update_constants(code: LawCode) -> dict[str, ConstantValue]:
    """The numbers in capitals of the algorithm, for one law."""
    law, units = code.law, code.source.units
    states = list(law.states.values())
    ns, nc = len(states), len(code.conditions)
    limits = [NO_LIMIT if state.limit is None else state.limit for state in states]
    return {
        "NS": ns,
        "NC": nc,
        "NY": 1 + ns,
        "NV": 7 + ns,
        "NX": 6 + ns,
        "PRINCIPAL": law.uses(principal_stress),
        "BETA": min(max(code.leading_time_exponent(), SMALLEST_EXPONENT), 1.0),
        "INITIAL": (0.0, *(state.initial for state in states)),
        "LIMIT": (NO_LIMIT, *limits),
        "SIDE": (1.0, *(1.0 if end > state.initial else -1.0 for end, state in zip(limits, states, strict=True))),
        "MPA": float(units.megapascals),
        "SECONDS": float(units.seconds),
        **{"HELD": False, "ND": 6, "NT": 6, "MOST": 600.0, "VIRGIN": True},
        **{"TOLERANCE": 1e-3, "TICKS": 65536, "FIRST": 1},
    }


def _moduli(code: LawCode) -> dict[str, sympy.Expr]:
    """Shear and bulk modulus, MPa, as formulas of a temperature in K."""
    assert code.source.elastic is not None
    native = code.source.replace(units=type(code.source.units)())
    E, nu = (sympy.N(e, 17) for e in elastic_expressions(native, code.source.elastic, TEMPERATURE))
    return {"shear": E / (2.0 * (1.0 + nu)), "bulk": E / (3.0 * (1.0 - 2.0 * nu))}


# ---- C -------------------------------------------------------------------------------------------------------------


def c_update(
    code: LawCode, stem: str, head: Iterable[str], wrapper: str, constants: Mapping[str, ConstantValue]
) -> str:
    """The file in C99."""
    printer = CAlgorithm(read_template("stress_update.txt"), constants, stem)
    functions, used = printer.program("update")
    law = [*_c_law(code, stem), *_c_moduli(code, stem)]
    parts = [
        *c_block_comment(comment_lines(map(comment_safe, head), " *", 110)),
        "#include <math.h>",
        "",
        *printer.constants([name for name in printer.numbers if name in used]),
        "",
        *map(c_function_definition, stable_functions_in(law)),
        *law,
        *functions,
        *(["", wrapper] if wrapper else []),
    ]
    return "\n".join(parts).rstrip() + "\n"


def _c_law(code: LawCode, stem: str) -> Iterator[str]:
    function = code.function("update")
    inputs = {s: k for k, s in enumerate((*code.point, *code.states, *code.conditions))}
    used = {*function.symbols, *code.logarithms_used(function).values()}
    yield "/* The law: ln of the rate and each internal variable's rate, 1/s, then derivatives to x, row by row. */"
    yield f"static void {stem}_law(const double x[{len(inputs)}], double out[{len(function.outputs)}])"
    yield "{"
    yield from (f"  const double {s} = {value!r};" for s, value in code.parameters.items() if s in used)
    yield from (f"  const double {s} = x[{inputs[s]}];" for s in function.inputs)
    yield from (f"  const double {ln} = log({plain});" for ln, plain in code.logarithms_used(function).items())
    yield from (f"  {line}" for line in c_assignments(function.assignments))
    yield from (f"  out[{k}] = {c_expression(e)};" for k, e in enumerate(function.outputs))
    yield from ("}", "")


def _c_moduli(code: LawCode, stem: str) -> Iterator[str]:
    yield "/* Shear and bulk modulus, MPa, at a temperature, K. */"
    yield f"static void {stem}_moduli(double {TEMPERATURE}, double modulus[2])"
    yield "{"
    yield f"  (void){TEMPERATURE};"
    yield from (f"  modulus[{k}] = {c_expression(e)};" for k, e in enumerate(_moduli(code).values()))
    yield "}"


# ---- Fortran -------------------------------------------------------------------------------------------------------


def fortran_update(
    code: LawCode,
    stem: str,
    head: Iterable[str],
    wrapper: str,
    constants: Mapping[str, ConstantValue],
    entry: str = "update",
) -> str:
    """The file in fixed-form Fortran. entry : the function of the algorithm that the wrapper calls."""
    functions, _ = FortranAlgorithm(read_template("stress_update.txt"), constants, stem).program(entry)
    parts = [
        *comment_lines(map(comment_safe, head), "!", 71),
        "!",
        *wrapped_lines(wrapper.rstrip()),
        *filter(None, functions),
        "!",
        "! The law: ln of the rate and each internal variable's rate, 1/s,",
        "! then their derivatives to x, row by row.",
        *law_subroutine(code, f"{stem}_law"),
        *(_fortran_moduli(code, stem) if entry == "update" else ()),
    ]
    return "\n".join(parts) + "\n"


def _fortran_moduli(code: LawCode, stem: str) -> list[str]:
    body = [f"modulus({k}) = {fortran_expression(e)}" for k, e in enumerate(_moduli(code).values(), 1)]
    functions = stable_function_definitions(called_names(body))
    lines = [
        f"subroutine {stem}_moduli({TEMPERATURE}, modulus)",
        "  implicit none",
        *(f"  {line}" for line in double_declarations([TEMPERATURE, "modulus(2)"])),
        *(f"  {line}" for line in body),
        *(["contains", *(f"  {line}" for line in functions)] if functions else []),
        f"end subroutine {stem}_moduli",
    ]
    return ["!", "! Shear and bulk modulus, MPa, at a temperature, K.", *fortran_statements(lines)]


# ---- NumPy ---------------------------------------------------------------------------------------------------------


class NumpyUpdate:
    """The update of many points at once, as a module that needs nothing but NumPy."""

    name = "numpy-update"
    title = "NumPy stress update of many points with consistent tangent"
    suffix = ".py"
    serves = ("felupe", "fenicsx")

    def text(self, source: LawWithValues) -> str:
        """Return the module's text; ExportError where there is no elasticity."""
        require_elasticity(source, self.name)
        dialect = array_dialect()
        code = LawCode(source, Identifiers((*keyword.kwlist, *TARGET_FUNCTIONS, *dialect.helpers, *_NUMPY_NAMES)))
        function = code.function("update")
        printer = CAlgorithm(read_template("stress_update.txt"), update_constants(code), "")
        inputs = {s: k for k, s in enumerate((*code.point, *code.states, *code.conditions))}
        ny, nx = 1 + len(code.states), 6 + len(code.states)
        used = {*function.symbols, *code.logarithms_used(function).values()}
        law = [
            "def law(x):",
            '    """ln of the rate and each internal variable\'s rate, 1/s, and derivatives to x but conditions."""',
            *(f"    {s} = {value!r}" for s, value in code.parameters.items() if s in used),
            *(f"    {ln} = {dialect.log_expression(str(s))}" for ln, s in code.logarithms_used(function).items()),
            *(f"    {s} = x[{inputs[s]}]" for s in function.inputs),
            "    with errstate(over='ignore', divide='ignore', invalid='ignore'):",
            *assignment_lines(function.assignments, " " * 8),
            "        out = [",
            *(f"            {expression_source(e)}," for e in function.outputs),
            "        ]",
            "    out = np.stack([value + np.zeros(x.shape[1]) for value in out])",
            f"    return out[:{ny}], out[{ny}:].reshape({ny}, {nx}, -1)",
        ]
        moduli = [
            f"def moduli({TEMPERATURE}):",
            '    """Shear and bulk modulus, MPa."""',
            f"    return {', '.join(expression_source(e) for e in _moduli(code).values())}",
        ]
        units = code.source.units
        body = Template(read_template("numpy_update.txt")).substitute(
            ny=ny, nv=6 + ny, nx=nx, no=1 + len(code.conditions), time=units.time, stress=units.stress
        )
        lines = [*heading(code.source, mentions_floors=True), *code.renaming_notes(), "", *_update_notes(code)]
        opening = ['"""A creep law\'s stress update, exported by creepkit."""', "", *comment_lines(lines, "#"), ""]
        numbers = [
            f"{name} = {f'np.array({[*value]})[:, None]' if isinstance(value, tuple) else repr(value)}"
            for name, value in printer.numbers.items()
            if name in _NUMPY_NUMBERS
        ]
        blocks = ["\n".join(part) for part in (numbers, law, moduli)]
        return "\n".join([*opening, with_helpers("\n\n\n".join([*blocks, body.strip()]), dialect)]) + "\n"


_NUMPY_NUMBERS = ("PRINCIPAL", "BETA", "INITIAL", "LIMIT", "SIDE", "MPA", "SECONDS", "TOLERANCE", "TICKS", "GAMMA")
"""The numbers in capitals that it uses."""

_NUMPY_NAMES = ("np", "x", "out", "value", "errstate", TEMPERATURE)
"""What the module calls its own variables in the function that holds the law."""


TARGETS = (
    UserMaterial(
        name="c-update",
        title="C99 stress update with consistent tangent",
        suffix=".c",
        template="",
        takes_conditions=True,
        way=("Declare the function at the end of this file where you call it, and link with -lm.",),
    ),
    UserMaterial(
        name="abaqus-umat",
        title="Abaqus/Standard UMAT with consistent tangent (fixed-form Fortran)",
        suffix=".f",
        template="umat.f",
        serves=("umat",),
        takes_conditions=True,
        way=(
            "Abaqus/Standard: *USER MATERIAL, CONSTANTS=1, UNSYMM (a constant is not used) and *DEPVAR of {states}. "
            "Not run in Abaqus.",
        ),
    ),
    UserMaterial(
        name="calculix-umat",
        title="CalculiX umat.f with consistent tangent (fixed-form Fortran)",
        suffix=".f",
        template="umat.f",
        serves=("umat", "ccx"),
        way=(
            "CalculiX: replace umat.f of its source. *MATERIAL, NAME=ABAQUSNL... calls it with logarithmic strains, "
            "NAME=ABAQUS... with small ones; *USER MATERIAL, CONSTANTS=1 (which is not used), *DEPVAR of {states}, the "
            "last for the temperature, and *INITIAL CONDITIONS, TYPE=TEMPERATURE.",
        ),
        kept=1,
    ),
    UserMaterial(
        name="ansys-usermat",
        title="Ansys USERMAT with consistent tangent (fixed-form Fortran)",
        suffix=".f",
        template="usermat.f",
        serves=("usermat",),
        way=("Ansys: TB,USER and TB,STATE,,,{states}. Not run in Ansys.",),
    ),
    UserMaterial(
        name="ls-dyna-umat",
        title="LS-DYNA umat43 and utan43 in double precision (fixed-form Fortran)",
        suffix=".f",
        template="ls_dyna.f",
        serves=("umat", "dyna"),
        way=(
            "LS-DYNA: *MAT_USER_DEFINED_MATERIAL_MODELS with MT=43, NHV={states} and ITHERM=1, double precision, "
            "implicit, solids. The tangent stands among the history variables. Not run in LS-DYNA.",
        ),
        kept=37,
    ),
)
"""The targets of this module."""


@hookimpl
def creepkit_exporters() -> list[Exporter]:
    """The exporters of this module."""
    return [*TARGETS, NumpyUpdate()]
