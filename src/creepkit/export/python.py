"""Plain Python: a module that needs `math` alone and evaluates the law as kernels do, from its log form."""

from __future__ import annotations

import ast
import keyword
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

import sympy

from creepkit.errors import ExportError, LawError
from creepkit.kernels.logform import FLOOR, LogForm, log_form
from creepkit.kernels.printing import FUNCTIONS, KernelPrinter
from creepkit.kernels.stable_functions import Floored
from creepkit.language.law import CreepLaw
from creepkit.language.symbols import POINT, temperature

_MEANINGS = {
    "stress": "von Mises stress, MPa",
    "strain": "accumulated equivalent creep strain, logarithmic",
    "time": "time since the load was first applied, s",
    "temperature": "temperature, K",
    "principal_stress": "largest principal stress, MPa",
    "mean_stress": "mean stress, MPa",
}


@dataclass(frozen=True)
class PythonExporter:
    """A Python module with `rate` (and `state_rates`), the values as defaults."""

    name: str = "python"
    title: str = "Python module that needs nothing but the standard library"
    suffix: str = ".py"

    def text(self, law: CreepLaw, values: Mapping[str, float], notes: Sequence[str] = ()) -> str:
        """Return the module's text."""
        values = law.values(values)
        try:
            code = _Functions(law, values).text()
        except LawError as error:
            raise ExportError(f"cannot be written as Python: {error}") from None
        code = _with_helpers(code)
        head = _comments([*_description(law, values, code), *(f"Note: {note}" for note in notes)])
        return "\n".join(['"""A creep law with its values, exported by creepkit."""', "", *head, "", code]) + "\n"


# ---- the head ------------------------------------------------------------------------------------------------------


def _description(law: CreepLaw, values: Mapping[str, float], code: str) -> list[str]:
    lines = [f"{law.name}: {law.title}" if law.title else law.name, ""]
    leads = ["rate =", *["     +"] * (len(law.terms) - 1)]
    lines += [f"{lead} {term}    [{label}]" for lead, (label, term) in zip(leads, law.terms.items(), strict=True)]
    for symbol, state in law.states.items():
        until = "" if state.limit is None else f" to failure at {state.limit:g}"
        lines.append(f"d{symbol}/dt = {state.rate}, from {state.initial:g}{until}    [{state.meaning}]")
    lines += ["", "Stress in MPa (as a ratio to 1 MPa), time in s, temperature in K, rates in 1/s.", "Parameters:"]
    for name, param in law.table.items():
        unit = "" if param.unit == "1" else f" {param.unit}"
        lines.append(f"  {name} = {values[name]!r}{unit}, {param.meaning}")
    if f"{FLOOR!r})" in code:
        lines.append(f"Stress, strain and internal variables that are bases of powers act as {FLOOR:g} below it.")
    lines.append("A result beyond 1.8e308 raises OverflowError.")
    lines += [f"Valid where {sympy.sstr(relation)}." for relation in law.constraints]
    return [*lines, *(f"Source: {reference}" for reference in law.references)]


def _comments(lines: Sequence[str]) -> list[str]:
    """Each line as a comment; whatever could end a comment is taken out."""
    return [f"# {_printable(part)}".rstrip() for line in lines for part in (line.splitlines() or [""])]


def _printable(text: str) -> str:
    return "".join(c if c.isprintable() else " " for c in text)


# ---- the functions -------------------------------------------------------------------------------------------------


class _Printer(KernelPrinter):
    """Kernel text for one number at a time: branches are taken lazily, maxima are Python's."""

    reserved_words = (*keyword.kwlist, *FUNCTIONS, "inf", "max", "min")

    def _print_Max(self, e: Any) -> str:
        return f"max({', '.join(self._print(a) for a in e.args)})"

    def _print_Min(self, e: Any) -> str:
        return f"min({', '.join(self._print(a) for a in e.args)})"

    def _print_And(self, e: Any) -> str:
        return f"({' and '.join(self._print(a) for a in e.args)})"

    def _print_Or(self, e: Any) -> str:
        return f"({' or '.join(self._print(a) for a in e.args)})"

    def _print_Piecewise(self, e: Any) -> str:
        branches = [f"{self._print(branch)} if {self._print(condition)} else " for branch, condition in e.args[:-1]]
        return f"({''.join(branches)}{self._print(e.args[-1].expr)})"


class _Functions:
    """The code of one law: its log form, with the author's parameters wherever a logarithm is not needed."""

    def __init__(self, law: CreepLaw, values: Mapping[str, float]) -> None:
        self.law, self.values = law, values
        self.form: LogForm = log_form(law)
        self.logs = {theta: symbol for symbol, theta in self.form.logs.items()}
        self.printer = _Printer({"standard": "python3"})

    def text(self) -> str:
        terms = [_author_form(term, self.logs) for term in self.form.terms]
        rate = self._function("rate", "Rate of equivalent creep strain, 1/s.", self._sum(terms), terms)
        if not self.law.states:
            return rate
        rates = [_author_form(expression, self.logs) for expression in self.form.state_rates]
        lines = [
            f'        "{symbol.name}": {self.printer.doprint(expression)},'
            for symbol, expression in zip(self.law.states, rates, strict=True)
        ]
        title = "Rates of the internal variables, 1/s."
        states = self._function("state_rates", title, ["    return {", *lines, "    }"], rates)
        initial = {symbol.name: state.initial for symbol, state in self.law.states.items()}
        limits = {symbol.name: state.limit for symbol, state in self.law.states.items()}
        return f"INITIAL = {initial!r}\nLIMIT = {limits!r}\n\n\n{rate}\n\n\n{states}"

    def _sum(self, terms: Sequence[sympy.Expr]) -> list[str]:
        """The return statement, each term under its name."""
        texts = [self.printer.doprint(sympy.exp(term, evaluate=False)) for term in terms]
        labels = [_printable(label) for label in self.law.terms]
        if len(texts) == 1:
            return [f"    # {labels[0]}", f"    return {texts[0]}"]
        signs = ["", *["+ "] * (len(texts) - 1)]
        lines = [
            line
            for sign, label, text in zip(signs, labels, texts, strict=True)
            for line in (f"        # {label}", f"        {sign}{text}")
        ]
        return ["    return (", *lines, "    )"]

    def _function(self, name: str, title: str, result: list[str], expressions: Sequence[sympy.Expr]) -> str:
        read = set().union(*(e.free_symbols for e in expressions))
        logs = [
            f"    {self.printer.doprint(theta)} = log({name}) if {name} != 0.0 else -inf"
            for theta, name in ((theta, self.printer.doprint(symbol)) for theta, symbol in self.logs.items())
            if theta in read
        ]
        head = [f"def {name}(", *self._signature(), "):", f'    """{title}', "", *self._arguments(), '    """']
        return "\n".join([*head, *logs, *result])

    def _signature(self) -> list[str]:
        """Variables of the point by keyword, needed where the law uses them; then parameters with their values."""
        needed = [s for s in POINT[1:] if self.law.uses(s)] + list(self.law.states)
        optional = [s for s in POINT[1:4] if not self.law.uses(s)]
        return [
            "    stress,",
            "    *,",
            *(f"    {self.printer.doprint(s)}," for s in needed),
            *(f"    {self.printer.doprint(s)}=None," for s in optional),
            *(f"    {self.printer.doprint(s)}={self.values[s.name]!r}," for s in self.law.params),
        ]

    def _arguments(self) -> list[str]:
        lines = [f"    {s.name} : {_MEANINGS[s.name]}" for s in POINT if self.law.uses(s)]
        lines += [f"    {s.name} : {state.meaning}" for s, state in self.law.states.items()]
        idle = [s.name for s in POINT[:4] if not self.law.uses(s)]
        return [*lines, f"    {', '.join(idle)} : not used by this law"] if idle else lines


def _author_form(expression: sympy.Expr, logs: Mapping[sympy.Symbol, sympy.Symbol]) -> sympy.Expr:
    """Write exp(ln_B) as B again, free of the rounding of a logarithm, and temperature without a floor."""

    def factored(e: sympy.Expr) -> sympy.Expr:
        summands = sympy.Add.make_args(e.args[0])
        found = {a: p for a in summands for t, s in logs.items() for sign, p in ((1, s), (-1, 1 / s)) if a == sign * t}
        rest = sympy.Add(*(a for a in summands if a not in found))
        return sympy.Mul(*found.values(), sympy.exp(rest))

    plain = expression.xreplace({Floored(temperature, sympy.Float(FLOOR)): temperature})
    return plain.replace(lambda e: isinstance(e, sympy.exp), factored)


# ---- imports and helpers -------------------------------------------------------------------------------------------


def _with_helpers(code: str) -> str:
    """Put the imports and the functions that the code calls before it."""
    helpers = _helpers()
    needed = _names(code)
    for name in reversed(helpers):
        if name in needed:
            needed |= _names(helpers[name])
    body = "\n\n\n".join([*(text for name, text in helpers.items() if name in needed), code])
    imported = sorted(name for name in _names(body) if hasattr(math, name))
    return f"from math import {', '.join(imported)}\n\n\n{body}"


@cache
def _helpers() -> dict[str, str]:
    """{name: text} of the functions for one number that compiled kernels call, in their order."""
    source = resources.files("creepkit.kernels").joinpath("numba_functions.py").read_text(encoding="utf-8")
    found: dict[str, str] = {}
    for node in ast.parse(source).body:
        if isinstance(node, ast.FunctionDef):
            node.decorator_list, node.returns = [], None
            for argument in node.args.args:
                argument.annotation = None
            found[node.name] = ast.unparse(node)
        elif isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            found[node.targets[0].id] = ast.unparse(node)
    return found


def _names(code: str) -> set[str]:
    """Every name that top-level functions and statements read from outside themselves."""
    return set().union(*(_read(node) for node in ast.parse(code).body))


def _read(node: ast.stmt) -> set[str]:
    inner = list(ast.walk(node))
    own = {n.arg for n in inner if isinstance(n, ast.arg)}
    own |= {n.id for n in inner if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
    return {n.id for n in inner if isinstance(n, ast.Name)} - own
