"""Python: a module with `rate` and `state_rates`, for numbers (needs `math` only) or for arrays (needs NumPy only).

The formulas are those of the kernels, terms in log form; the author's parameter values are defaults of arguments.
"""

from __future__ import annotations

import ast
import keyword
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

import sympy

from creepkit.errors import SAID, ExportError, LawError, restated
from creepkit.exporters.law_code import Identifiers, factor_text
from creepkit.exporters.law_description import comment_lines, heading, printable_text
from creepkit.exporters.unit_conversion import STRESSES
from creepkit.hookspecs import hookimpl
from creepkit.kernels.kernel_functions import TARGET_FUNCTIONS, KernelPrinter, joined
from creepkit.kernels.log_form import FLOOR, TIME_FLOOR, log_form
from creepkit.language.symbols import POINT_VARIABLES, time
from creepkit.records import Exporter, LawWithValues, Units

_MODULE_NAMES = ("INITIAL", "LIMIT", "errstate", "inf", "max", "min", "np", "rate", "state_rates")


LogSymbols = Mapping[sympy.Symbol, sympy.Symbol]


@dataclass(frozen=True)
class PythonDialect:
    """What sets one kind of module apart.

    printer : of its expressions. helpers : {name: text} of the functions that the module takes along where needed.
    import_lines : import statements for the names that a module reads.
    log_expression : text of a parameter's logarithm, from its name.
    context_manager : statement around the body, or nothing.
    overflow_sentence : the sentence on results that no double holds.
    """

    printer: KernelPrinter
    helpers: Mapping[str, str]
    import_lines: Callable[[set[str]], str]
    log_expression: Callable[[str], str]
    context_manager: str
    overflow_sentence: str


ALONG_THE_FLOW = (
    "Stress and back stress are components along the flow, whose sign is that of their difference; where it turns, "
    "both change sign."
)


def module_text(source: LawWithValues, dialect: PythonDialect) -> str:
    """Return the module of a law; ExportError when it holds what no kernel can evaluate."""
    source = source.without_inactive_terms()
    with restated(LawError, ExportError, f"cannot be written as Python: {SAID}"):
        functions = _ModuleFunctions(source, dialect)
    body = functions.text()
    floors = any(f"{floor!r})" in body for floor in (FLOOR, TIME_FLOOR))
    along = [ALONG_THE_FLOW] if source.law.back_stresses else []
    lines = [*heading(source, mentions_floors=floors), *along, *functions.renaming_notes(), dialect.overflow_sentence]
    opening_lines = ['"""A creep law with its values, exported by creepkit."""', "", *comment_lines(lines, "#"), ""]
    return "\n".join([*opening_lines, with_helpers(body, dialect)]) + "\n"


# ---- the functions -------------------------------------------------------------------------------------------------


class _ModuleFunctions:
    """The code of one law: its log form, with the author's parameters wherever a logarithm is not needed."""

    def __init__(self, source: LawWithValues, dialect: PythonDialect) -> None:
        self.source, self.law, self.dialect = source, source.law, dialect
        form = log_form(self.law)
        self._identifiers = Identifiers((*keyword.kwlist, *TARGET_FUNCTIONS, *dialect.helpers, *_MODULE_NAMES))
        symbols = (*POINT_VARIABLES, *self.law.states, *self.law.conditions, *self.law.params)
        self.names = {s: self._symbol(s.name) for s in symbols}
        self.logs = {self._symbol(theta.name): self.names[s] for s, theta in form.logs.items()}
        renamed = self.names | dict(zip(form.logs.values(), self.logs, strict=True))
        self.terms = [_with_author_parameters(e.xreplace(renamed), self.logs) for e in form.terms]
        self.state_rates = [_with_author_parameters(e.xreplace(renamed), self.logs) for e in form.state_rates]

    def renaming_notes(self) -> list[str]:
        """One line for each name of the author's that had to change."""
        return self._identifiers.renaming_notes([s.name for s in self.names])

    def text(self) -> str:
        """The functions, and where internal variables start and end."""
        title = f"Rate of equivalent creep strain, 1/{self.source.units.time}."
        rate = self._function_text("rate", title, self._return_statement(), self.terms)
        if not self.law.states:
            return rate
        factor = factor_text(self.source.units.seconds)
        rates = [f"{factor}({text})" if factor else text for text in map(self._printed, self.state_rates)]
        lines = [f'    "{s.name}": {text},' for s, text in zip(self.law.states, rates, strict=True)]
        title = f"Rates of the internal variables, 1/{self.source.units.time}."
        states = self._function_text("state_rates", title, ["return {", *lines, "}"], self.state_rates)
        initial = {symbol.name: state.initial for symbol, state in self.law.states.items()}
        limits = {symbol.name: state.limit for symbol, state in self.law.states.items()}
        return f"INITIAL = {initial!r}\nLIMIT = {limits!r}\n\n\n{rate}\n\n\n{states}"

    def _return_statement(self) -> list[str]:
        """The return statement, each term under its name."""
        texts = [self._printed(sympy.exp(term, evaluate=False)) for term in self.terms]
        labels, factor = [printable_text(label) for label in self.law.terms], factor_text(self.source.units.seconds)
        if len(texts) == 1:
            return [f"# {labels[0]}", f"return {factor}{texts[0]}"]
        pairs = enumerate(zip(labels, texts, strict=True))
        lines = [line for k, (label, text) in pairs for line in (f"    # {label}", f"    {'+ ' if k else ''}{text}")]
        return [f"return {factor}(", *lines, ")"]

    def _function_text(self, name: str, title: str, result: list[str], expressions: Sequence[sympy.Expr]) -> str:
        used = set().union(*(e.free_symbols for e in expressions))
        logs = [f"{theta} = {self.dialect.log_expression(s.name)}" for theta, s in self.logs.items() if theta in used]
        body = [*self._unit_conversions(used), *logs, *result]
        if self.dialect.context_manager:
            body = [f"{self.dialect.context_manager}:", *(f"    {line}" for line in body)]
        docstring = [f'    """{title}', "", *self._argument_docs(), '    """']
        signature = [f"def {name}(", *self._signature_lines(), "):"]
        return "\n".join([*signature, *docstring, *(f"    {line}" for line in body)])

    def _unit_conversions(self, used: set[sympy.Basic]) -> list[str]:
        """Stress and time on entry, in the law's own units."""
        units = self.source.units
        pairs = [*((s, units.megapascals) for s in STRESSES), (time, units.seconds)]
        return [f"{s} = {factor!r} * {s}" for s, factor in pairs if factor != 1 and s in used]

    def _signature_lines(self) -> list[str]:
        """Variables of the point by keyword, needed where the law uses them; then parameters with their values."""
        required = [s for s in POINT_VARIABLES[1:] if self.law.uses(s)] + [*self.law.states, *self.law.conditions]
        optional = [s for s in POINT_VARIABLES[1:4] if not self.law.uses(s)]
        return [
            "    stress,",
            "    *,",
            *(f"    {self.names[s]}," for s in required),
            *(f"    {self.names[s]}=None," for s in optional),
            *(f"    {self.names[s]}={self.source.values[s.name]!r}," for s in self.law.params),
        ]

    def _argument_docs(self) -> list[str]:
        meanings = _argument_meanings(self.source.units)
        lines = [f"    {s.name} : {meanings[s.name]}" for s in POINT_VARIABLES if self.law.uses(s)]
        for symbol, state in self.law.states.items():  # nothing in a meaning ends the docstring, or escapes in it
            meaning = printable_text(state.meaning).replace("\\", "/").replace('"', "'")
            lines.append(f"    {self.names[symbol]} : {meaning}")
        lines += [f"    {self.names[one]} : condition of the material, {one.unit}" for one in self.law.conditions]
        unused = [s.name for s in POINT_VARIABLES[:4] if not self.law.uses(s)]
        return [*lines, f"    {', '.join(unused)} : not used by this law"] if unused else lines

    def _symbol(self, requested: str) -> sympy.Symbol:
        return sympy.Symbol(self._identifiers.unique(requested), real=True)

    def _printed(self, expression: sympy.Expr) -> str:
        return str(self.dialect.printer.doprint(expression))


def _argument_meanings(units: Units) -> dict[str, str]:
    return {
        "stress": f"von Mises stress, {units.stress}",
        "strain": "accumulated equivalent creep strain, logarithmic",
        "time": f"time since the load was first applied, {units.time}",
        "temperature": "temperature, K",
        "principal_stress": f"largest principal stress, {units.stress}",
        "mean_stress": f"mean stress, {units.stress}",
    }


def _with_author_parameters(expression: sympy.Expr, logs: LogSymbols) -> sympy.Expr:
    """Write exp(ln_B) as B again, free of the rounding of a logarithm."""

    def factored(e: sympy.Expr) -> sympy.Expr:
        summands = sympy.Add.make_args(e.args[0])
        powers_of_parameters = {
            a: p for a in summands for t, s in logs.items() for sign, p in ((1, s), (-1, 1 / s)) if a == sign * t
        }
        rest = sympy.Add(*(a for a in summands if a not in powers_of_parameters))
        return sympy.Mul(*powers_of_parameters.values(), sympy.exp(rest))

    return expression.replace(lambda e: isinstance(e, sympy.exp), factored)


# ---- imports and helpers -------------------------------------------------------------------------------------------


def with_helpers(code: str, dialect: PythonDialect) -> str:
    """Put the imports and the functions that the code calls before it."""
    helpers, required = dialect.helpers, _free_names(code)
    for name in reversed([*helpers]):
        if name in required:
            required |= _free_names(helpers[name])
    body = "\n\n\n".join([*(text for name, text in helpers.items() if name in required), code])
    return f"{dialect.import_lines(_free_names(body))}\n\n\n{body}"


def kernel_functions(file: str) -> dict[str, str]:
    """{name: text} of the functions that kernels call, from a file of creepkit.kernels, without annotations."""
    source = resources.files("creepkit.kernels").joinpath(file).read_text(encoding="utf-8")
    result: dict[str, str] = {}
    for node in ast.parse(source).body:
        if isinstance(node, ast.FunctionDef):
            node.decorator_list, node.returns = [], None
            for argument in node.args.args:
                argument.annotation = None
            result[node.name] = ast.unparse(node)
        elif isinstance(node, ast.Assign):  # to a name, or to several at once
            target, value = node.targets[0], node.value
            several = isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple)
            pairs: Any = zip(target.elts, value.elts, strict=True) if several else [(target, value)]  # type: ignore[attr-defined]
            result |= {t.id: f"{t.id} = {ast.unparse(v)}" for t, v in pairs if t.id != "__all__"}
    return result


def _free_names(code: str) -> set[str]:
    """Every name that top-level functions and statements read from outside themselves."""
    free: set[str] = set()
    for statement in ast.parse(code).body:
        names = [n for n in ast.walk(statement) if isinstance(n, ast.Name)]
        bound = {n.arg for n in ast.walk(statement) if isinstance(n, ast.arg)}
        free |= {n.id for n in names} - bound - {n.id for n in names if isinstance(n.ctx, ast.Store)}
    return free


class PythonExporter:
    """A Python module with `rate` (and `state_rates`), the values as defaults."""

    serves = ("py",)
    name = "python"
    title = "Python module that needs nothing but the standard library"
    suffix = ".py"

    def text(self, source: LawWithValues) -> str:
        """Return the module's text; stress and time are converted on entry, rates on exit."""
        return module_text(source, _scalar_dialect())


class _ScalarPrinter(KernelPrinter):
    """Kernel text for one number at a time: branches are taken lazily, maxima are Python's."""

    choice = "({branch} if {condition} else {otherwise})"
    _print_Max, _print_Min = joined("max(", ", "), joined("min(", ", ")
    _print_And, _print_Or = joined("(", " and "), joined("(", " or ")


def _math_imports(names: set[str]) -> str:
    return f"from math import {', '.join(sorted(name for name in names if hasattr(math, name)))}"


@cache
def _scalar_dialect() -> PythonDialect:
    """One number at a time."""
    return PythonDialect(
        printer=_ScalarPrinter({"standard": "python3"}),
        helpers=kernel_functions("scalar_functions.py"),
        import_lines=_math_imports,
        log_expression=lambda name: f"log({name}) if {name} != 0.0 else -inf",
        context_manager="",
        overflow_sentence="A result beyond 1.8e308 raises OverflowError.",
    )


class NumpyExporter:
    """A Python module of arrays with `rate` (and `state_rates`), the values as defaults."""

    name = "numpy"
    title = "Python module for arrays that needs nothing but NumPy"
    suffix = ".py"

    def text(self, source: LawWithValues) -> str:
        """Return the module's text; stress and time are converted on entry, rates on exit."""
        return module_text(source, array_dialect())


def _numpy_imports(names: set[str]) -> str:
    """The error function is the standard library's: NumPy has none."""
    import numpy as np  # for this target alone

    imported = sorted(name for name in names & {*TARGET_FUNCTIONS, "errstate"} if hasattr(np, name))
    lines = ["import numpy as np", *([f"from numpy import {', '.join(imported)}"] if imported else [])]
    return "\n".join(["import math", "", *lines] if "math" in names else lines)


@cache
def array_dialect() -> PythonDialect:
    """Whole arrays; branches are evaluated everywhere, hence the guard against warnings of those not taken."""
    return PythonDialect(
        printer=KernelPrinter({"standard": "python3"}),
        helpers=kernel_functions("numpy_functions.py") | {"erf": "erf = np.vectorize(math.erf, otypes=[float])"},
        import_lines=_numpy_imports,
        log_expression=lambda name: f"log_or_off({name})",
        context_manager='with errstate(over="ignore", divide="ignore", invalid="ignore")',
        overflow_sentence="Arguments and parameters broadcast as arrays do. A result beyond 1.8e308 is inf.",
    )


@hookimpl
def creepkit_exporters() -> list[Exporter]:
    """The exporters of this module."""
    return [PythonExporter(), NumpyExporter()]
