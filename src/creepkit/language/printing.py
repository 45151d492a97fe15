"""Laws as text and LaTeX."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import sympy
from sympy.printing.latex import LatexPrinter
from sympy.printing.str import StrPrinter

from creepkit.language.law_record import LawRecord
from creepkit.language.symbols import GAS_CONSTANT, LATEX_SYMBOLS, parameters, temperature

# ---- LaTeX ---------------------------------------------------------------------------------------------------------


class ArrheniusExponent(NamedTuple):
    """exp[-(Q/R)(1/T - 1/T_ref)] recognised in an expression: Q in J/mol; -Q is `energy` after `sign`.

    T_ref : K; infinite in exp[-Q/(R T)].
    """

    Q: sympy.Expr
    T_ref: float

    sign: str
    energy: sympy.Expr


def arrhenius_exponent(exponent: sympy.Expr) -> ArrheniusExponent | None:
    """Read an exponent of the form (Q/R)(1/T_ref - 1/T); None when it is another function of temperature.

    Without a reference it is another one too where no R can be told from its number, as in exp(-6000/T).
    """
    per_T = sympy.Symbol("per_T", positive=True)
    polynomial = sympy.expand(exponent.xreplace({temperature: 1 / per_T})).as_poly(per_T)
    if polynomial is None or polynomial.degree() != 1:
        return None
    slope, start = polynomial.coeff_monomial(per_T), polynomial.coeff_monomial(1)
    T_ref = sympy.oo if start.is_zero else -slope / start  # 0.0 differs from 0 in sympy
    number, remainder = (-slope * GAS_CONSTANT).as_coeff_Mul()
    known = T_ref.is_finite or abs(number - _without_rounding(number, 4)) < 1e-9 * abs(number)
    if not (T_ref.is_extended_positive and T_ref.is_number and known):
        return None
    Q = _without_rounding(number) * remainder
    sign, energy = ("", -Q) if Q.could_extract_minus_sign() else ("-", Q)
    return ArrheniusExponent(Q, float(T_ref if T_ref is sympy.oo else _without_rounding(T_ref)), sign, energy)


def _without_rounding(number: sympy.Expr, digits: int = 12) -> sympy.Expr:
    """The number without the last digits, which products of R and T_ref have rounded."""
    rounded = float(f"{float(number):.{digits}g}")
    return sympy.Integer(int(rounded)) if rounded.is_integer() else sympy.Float(rounded)


class ReadableSums:
    """Sums with what is added before what is taken away, and exponentials with Arrhenius factors by themselves."""

    def _as_ordered_terms(self, expr: Any, order: Any = None) -> list[Any]:
        terms = super()._as_ordered_terms(expr, order=order)  # type: ignore[misc]
        return sorted(terms, key=lambda term: term.could_extract_minus_sign())

    def _factors(self, exponent: Any) -> tuple[list[Any], Any]:
        """The Arrhenius factors of an exponential as they are printed, and what else stands in its exponent."""
        found = {part: arrhenius_exponent(part) for part in sympy.Add.make_args(exponent)}
        factors = [self._arrhenius_factor(one) for one in found.values() if one]  # type: ignore[attr-defined]
        return factors, sympy.Add(*(part for part, known in found.items() if not known))


class LatexLawPrinter(ReadableSums, LatexPrinter):  # type: ignore[misc]
    """Print exponentials as exp[...], those of reciprocal temperature as Arrhenius factors, all else as sympy does."""

    def __init__(self, law: LawRecord) -> None:
        names = {symbol: r"n_\infty" for symbol in law.params if symbol.name == "n_inf"}
        names |= {one: rf"\mathrm{{{one.name.replace('_', ' ')}}}".replace(" ", r"\,") for one in law.conditions}
        super().__init__({"symbol_names": {**LATEX_SYMBOLS, **names}, "mul_symbol": None})

    def _print_exp(self, e: Any, exp: Any = None) -> str:
        factors, rest = self._factors(e.args[0])
        text = "".join(factors)
        if rest != 0:
            text += rf"{' ' if text else ''}\exp\!\left[{self._print(rest)}\right]"
        return text if exp is None else rf"\left({text}\right)^{{{exp}}}"

    def _print_Piecewise(self, expr: Any, exp: Any = None) -> str:
        text = str(super()._print_Piecewise(expr))
        return text if exp is None else rf"\left({text}\right)^{{{exp}}}"

    def _arrhenius_factor(self, found: ArrheniusExponent) -> str:
        if math.isinf(found.T_ref):
            return rf"\exp\!\left[{found.sign}\frac{{{self._print(found.energy)}}}{{R T}}\right]"
        difference = rf"\left(\frac{{1}}{{T}} - \frac{{1}}{{{found.T_ref:g}\,\mathrm{{K}}}}\right)"
        return rf"\exp\!\left[{found.sign}\frac{{{self._print(found.energy)}}}{{R}}{difference}\right]"


def latex_equations(law: LawRecord, printer: LatexLawPrinter) -> list[tuple[str, list[str]]]:
    """Return (left side, summands) of the rate of strain, then of each internal variable."""
    states = [(rf"\dot{{{printer.doprint(s)}}}", [printer.doprint(state.rate)]) for s, state in law.states.items()]
    return [(r"\dot{\varepsilon}_{cr}", [printer.doprint(term) for term in law.terms.values()]), *states]


# ---- plain text ----------------------------------------------------------------------------------------------------


class TextPrinter(ReadableSums, StrPrinter):  # type: ignore[misc]
    """Print expressions for people: Arrhenius factors as exp(-Q/R*(1/T - 1/1073.15))."""

    def _print_exp(self, e: Any) -> str:
        factors, rest = self._factors(e.args[0])
        return "*".join([*factors, *([f"exp({self._print(rest)})"] if rest != 0 or not factors else [])])

    def _arrhenius_factor(self, found: ArrheniusExponent) -> str:
        if math.isinf(found.T_ref):
            return f"exp({found.sign}{self._print(found.energy)}/(R*T))"
        return f"exp({found.sign}{self._print(found.energy)}/R*(1/T - 1/{found.T_ref:g}))"


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


def rate_lines(law: LawRecord) -> list[str]:
    """The rate, a term a line with its name, and the equations of internal variables with their meanings."""
    terms = enumerate(law.terms.items())
    states = zip(state_equations(law), law.states.values(), strict=True)
    return [
        *(f"{'+' if k else 'rate =':>6} {expression_text(term)}    [{label}]" for k, (label, term) in terms),
        *(f"{equation}    [{state.meaning}]" for equation, state in states),
    ]


def law_text(law: LawRecord) -> str:
    """Return the law as a small table for a terminal."""
    lines = [f"{law.name}: {law.title}" if law.title else law.name, *(f"  {line}" for line in rate_lines(law))]
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


def law_expression(law: LawRecord) -> sympy.Expr:
    """The rate of a law with the symbols R and T_ref in its Arrhenius factors."""
    (R, T_ref), rate = parameters("R T_ref"), law.rate
    for exponential in rate.atoms(sympy.exp):
        for part in sympy.Add.make_args(exponential.args[0]):
            if found := arrhenius_exponent(part):
                reference = 1 / T_ref if math.isfinite(found.T_ref) else 0
                rate = rate.subs(part, -found.Q / R * (1 / temperature - reference))
    return rate
