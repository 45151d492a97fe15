"""Laws as text and LaTeX."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import sympy
from sympy.printing.latex import LatexPrinter
from sympy.printing.str import StrPrinter

from creepkit.language.law_record import LawRecord
from creepkit.language.symbols import GAS_CONSTANT, LATEX_SYMBOLS, temperature

_LATEX_NAMES = {"n_inf": r"n_\infty"}


# ---- LaTeX ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class ArrheniusExponent:
    """exp[-(Q/R)(1/T - 1/T_ref)] recognised in an expression: Q in J/mol, T_ref in K."""

    Q: sympy.Expr
    T_ref: float


def arrhenius_exponent(exponent: sympy.Expr) -> ArrheniusExponent | None:
    """Read an exponent of the form (Q/R)(1/T_ref - 1/T); None when it is another function of temperature."""
    per_T = sympy.Symbol("per_T", positive=True)
    polynomial = sympy.expand(exponent.xreplace({temperature: 1 / per_T})).as_poly(per_T)
    if polynomial is None or polynomial.degree() != 1:
        return None
    slope, start = polynomial.coeff_monomial(per_T), polynomial.coeff_monomial(1)
    T_ref = sympy.S.Zero if start.is_zero else -slope / start  # 0.0 differs from 0 in sympy
    if not (T_ref.is_Number and T_ref > 0):
        return None
    number, remainder = (-slope * GAS_CONSTANT).as_coeff_Mul()
    return ArrheniusExponent(_without_rounding(number) * remainder, float(_without_rounding(T_ref)))


def _without_rounding(number: sympy.Expr) -> sympy.Expr:
    """The number without the last digits, which products of R and T_ref have rounded."""
    rounded = float(f"{float(number):.12g}")
    return sympy.Integer(int(rounded)) if rounded.is_integer() else sympy.Float(rounded)


class LatexLawPrinter(LatexPrinter):  # type: ignore[misc]
    """Print exponentials as exp[...], those of reciprocal temperature as Arrhenius factors, all else as sympy does."""

    def __init__(self, law: LawRecord) -> None:
        names = {s: _LATEX_NAMES[s.name] for s in law.params if s.name in _LATEX_NAMES}
        super().__init__({"symbol_names": {**LATEX_SYMBOLS, **names}, "mul_symbol": None})

    def _print_exp(self, e: Any, exp: Any = None) -> str:
        parts = {part: arrhenius_exponent(part) for part in sympy.Add.make_args(e.args[0])}
        text = "".join(self._arrhenius_factor(result) for result in parts.values() if result)
        rest = sympy.Add(*(part for part, found in parts.items() if not found))
        if rest != 0:
            text += rf"{' ' if text else ''}\exp\!\left[{self._print(rest)}\right]"
        return text if exp is None else rf"\left({text}\right)^{{{exp}}}"

    def _print_Piecewise(self, expr: Any, exp: Any = None) -> str:
        text = str(super()._print_Piecewise(expr))
        return text if exp is None else rf"\left({text}\right)^{{{exp}}}"

    def _arrhenius_factor(self, found: ArrheniusExponent) -> str:
        is_negative = found.Q.could_extract_minus_sign()
        sign, energy = ("", -found.Q) if is_negative else ("-", found.Q)
        return (
            rf"\exp\!\left[{sign}\frac{{{self._print(energy)}}}{{R}}"
            rf"\left(\frac{{1}}{{T}} - \frac{{1}}{{{found.T_ref:g}\,\mathrm{{K}}}}\right)\right]"
        )


def law_latex(law: LawRecord) -> str:
    r"""Return ``\dot{\varepsilon}_{cr} = ...`` with one summand a term; states follow as further equations."""
    return r",\quad ".join(
        f"{left} = {' + '.join(right)}" for left, right in latex_equations(law, LatexLawPrinter(law))
    )


def latex_equations(law: LawRecord, printer: LatexLawPrinter) -> list[tuple[str, list[str]]]:
    """Return (left side, summands) of the rate of strain, then of each internal variable."""
    states = [(rf"\dot{{{printer.doprint(s)}}}", [printer.doprint(state.rate)]) for s, state in law.states.items()]
    return [(r"\dot{\varepsilon}_{cr}", [printer.doprint(term) for term in law.terms.values()]), *states]


# ---- plain text ----------------------------------------------------------------------------------------------------


class TextPrinter(StrPrinter):  # type: ignore[misc]
    """Print expressions for people: Arrhenius factors as exp(-Q/R*(1/T - 1/1073.15))."""

    def _print_exp(self, e: Any) -> str:
        parts = [(part, arrhenius_exponent(part)) for part in sympy.Add.make_args(e.args[0])]
        text = "*".join(self._arrhenius_factor(result) for _, result in parts if result)
        rest = sympy.Add(*(part for part, found in parts if not found))
        if not text:
            return f"exp({self._print(rest)})"
        return text if rest == 0 else f"{text}*exp({self._print(rest)})"

    def _arrhenius_factor(self, found: ArrheniusExponent) -> str:
        is_negative = found.Q.could_extract_minus_sign()
        sign, energy = ("", -found.Q) if is_negative else ("-", found.Q)
        return f"exp({sign}{self._print(energy)}/R*(1/T - 1/{found.T_ref:g}))"


def expression_text(expression: sympy.Basic) -> str:
    """An expression as one line for people."""
    return str(TextPrinter().doprint(expression))


def state_equations(law: LawRecord) -> list[str]:
    """One line for each internal variable: its equation, where it starts, and where the material ends."""
    return [
        f"d{symbol}/dt = {expression_text(state.rate)}, from {state.initial:g}"
        + ("" if state.limit is None else f", broken at {state.limit:.10g}")
        for symbol, state in law.states.items()
    ]


def law_text(law: LawRecord) -> str:
    """Return the law as a small table for a terminal."""
    lines = [f"{law.name}: {law.title}" if law.title else law.name]
    prefix = "rate ="
    for label, term in law.terms.items():
        lines.append(f"  {prefix:6} {expression_text(term)}    [{label}]")
        prefix = "     +"
    lines += [f"  {equation}" for equation in state_equations(law)]
    for name, param in law.table.items():
        low, high = param.bounds
        off = "" if param.off is None or low <= param.off <= high else f" or {param.off:g}"
        unit = "" if param.unit == "1" else f" {param.unit}"
        scale = ", log scale" if param.scale == "log" else ""
        limits_text = "" if param.limits is None else f", physical {param.physical_range_text}"
        lines.append(f"  {name:8} {param.meaning}: {low:g} to {high:g}{off}{unit}{scale}{limits_text}")
    for relation in law.constraints:
        lines.append(f"  with {expression_text(relation)}")
    for reference in law.references:
        lines.append(f"  see {reference}")
    return "\n".join(lines)
