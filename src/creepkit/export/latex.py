r"""LaTeX: the equation, a table of the identified values, and Arrhenius' law in both of its forms (needs amsmath)."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import mpmath
import sympy

from creepkit.export import sheet
from creepkit.export.conversion import Converted, converted
from creepkit.export.heading import comments
from creepkit.language.law import CreepLaw
from creepkit.language.printing import Activation, LawPrinter, activation_of, equations_of
from creepkit.language.symbols import GAS_CONSTANT
from creepkit.records import ValuedLaw

_ESCAPES = {
    "\\": r"\textbackslash{}", "{": r"\{", "}": r"\}", "$": r"\$", "&": r"\&", "#": r"\#", "%": r"\%", "_": r"\_",
    "^": r"\textasciicircum{}", "~": r"\textasciitilde{}",
}  # fmt: skip


@dataclass(frozen=True)
class LatexExporter:
    """Equation and table of values for a paper."""

    name: str = "latex"
    title: str = "LaTeX equation and table of values"
    suffix: str = ".tex"

    def text(self, source: ValuedLaw) -> str:
        """Return an align environment and a tabular; notes and references become comments."""
        law, numbers, printer = source.law, converted(source), LawPrinter(source.law)
        told = (source.title, *source.notes, *(f"Source: {reference}" for reference in law.references))
        lines = comments(told, "%")
        lines += _aligned([row for left, right in equations_of(law, printer) for row in _rows(left, right)])
        lines += [rf"Valid where ${printer.doprint(relation)}$." for relation in law.constraints]
        lines += _table(source, numbers, printer)
        lines += [] if source.units.native else [f"In this table, {escaped(numbers.reference)}."]
        lines += _without_reference(law, numbers, printer)
        return "\n".join(lines) + "\n"


def _rows(left: str, summands: Sequence[str]) -> list[str]:
    """One equation, a summand a row."""
    first, *rest = summands
    return [f"{left} &= {first}", *(rf"&\quad + {summand}" for summand in rest)]


def _aligned(rows: Sequence[str]) -> list[str]:
    return [r"\begin{align*}", " \\\\\n".join(f"  {row}" for row in rows), r"\end{align*}"]


def _table(source: ValuedLaw, numbers: Converted, printer: LawPrinter) -> list[str]:
    rows = [
        (f"{printer.doprint(row.symbol)}{'(0)' if row.start else ''}", row.meaning, row.value, row.unit)
        for row in sheet.rows(source, numbers)
    ]
    return [
        r"\begin{tabular}{llll}",
        r"  \hline",
        r"  Symbol & Meaning & Value & Unit \\",
        r"  \hline",
        *(rf"  ${name}$ & {escaped(meaning)} & ${number(value)}$ & {unit(u)} \\" for name, meaning, value, u in rows),
        r"  \hline",
        r"\end{tabular}",
    ]


def escaped(text: str) -> str:
    """Text with LaTeX's special characters made plain."""
    return "".join(_ESCAPES.get(c, c) for c in text)


def unit(text: str) -> str:
    """A unit for the table, where there is one."""
    return "" if not text else f"${_upright(text)}$"


def number(value: float | mpmath.mpf, digits: int = 6) -> str:
    r"""A number of any size as 4.2 \times 10^{5}."""
    mantissa, _, exponent = mpmath.nstr(mpmath.mpf(value), digits, strip_zeros=True).partition("e")
    mantissa = mantissa.removesuffix(".0")
    return rf"{mantissa} \times 10^{{{int(exponent)}}}" if exponent else mantissa


def _upright(text: str) -> str:
    top, _, bottom = text.partition("/")
    if top == "1" and re.fullmatch(r"\w+", bottom):
        return rf"\mathrm{{{escaped(bottom)}}}^{{-1}}"
    return rf"\mathrm{{{escaped(text)}}}".replace(" ", r"\,")


# ---- Arrhenius' law without a reference temperature ----------------------------------------------------------------


@dataclass(frozen=True)
class _Activated:
    """A term as coefficient x Arrhenius factors x rest."""

    coefficient: sympy.Symbol
    factors: tuple[Activation, ...]
    rest: sympy.Expr


def _activated(law: CreepLaw, term: sympy.Expr) -> _Activated | None:
    """Take a term apart; None when it has no Arrhenius factor or not exactly one rate coefficient."""
    factors = sympy.Mul.make_args(term)
    coefficients = [f for f in factors if f in law.params and law.params[f].scale == "log"]
    exponents = [a for f in factors if isinstance(f, sympy.exp) for a in sympy.Add.make_args(f.args[0])]
    found = {exponent: activation_of(exponent) for exponent in exponents}
    active = tuple(activation for activation in found.values() if activation)
    if len(coefficients) != 1 or not active:
        return None
    others = [f for f in factors if f not in coefficients and not isinstance(f, sympy.exp)]
    remaining = [exponent for exponent, activation in found.items() if not activation]
    return _Activated(coefficients[0], active, sympy.Mul(*others, sympy.exp(sympy.Add(*remaining))))


def _without_reference(law: CreepLaw, numbers: Converted, printer: LawPrinter) -> list[str]:
    """The law with A_inf exp(-Q/(R T)) in place of A exp[-(Q/R)(1/T - 1/T_ref)], and the value of every A_inf."""
    parts = {term: _activated(law, term) for term in law.terms.values()}
    if not any(parts.values()):
        return []
    right = [_far(part, printer) if part else printer.doprint(term) for term, part in parts.items()]
    rows = _rows(r"\dot{\varepsilon}_{cr}", right)
    rows += [_far_value(law, part, numbers, printer) for part in parts.values() if part]
    return [f"% The same without a reference temperature, R = {GAS_CONSTANT} J/(mol K):", *_aligned(rows)]


def _far(part: _Activated, printer: LawPrinter) -> str:
    """A_inf times the rest times exp(-Q/(R T))."""
    rest = "" if part.rest == 1 else printer.doprint(part.rest) + " "
    factors = " ".join(rf"\exp\!\left[-\frac{{{printer.doprint(f.Q)}}}{{R T}}\right]" for f in part.factors)
    return f"{_infinite(printer.doprint(part.coefficient))} {rest}{factors}"


def _far_value(law: CreepLaw, part: _Activated, numbers: Converted, printer: LawPrinter) -> str:
    """A_inf = A exp[Q/(R T_ref)] and its number, which may lie far outside double range."""
    name = printer.doprint(part.coefficient)
    fractions = [rf"\frac{{{printer.doprint(f.Q)}}}{{R \cdot {f.T_ref:g}\,\mathrm{{K}}}}" for f in part.factors]
    size = mpmath.mpf(numbers.values[part.coefficient.name])
    for factor in part.factors:
        energy = factor.Q.xreplace({s: sympy.Float(numbers.values[s.name]) for s in law.params})
        size *= mpmath.exp(mpmath.mpf(float(energy)) / (GAS_CONSTANT * factor.T_ref))
    told = f"{number(size)} \\; {_upright(numbers.units[part.coefficient.name])}"
    return rf"{_infinite(name)} &= {name} \exp\!\left[{' + '.join(fractions)}\right] = {told}"


def _infinite(name: str) -> str:
    return rf"{name[:-1]},\infty}}" if re.search(r"_\{[^{}]*\}$", name) else rf"{name}_{{\infty}}"
