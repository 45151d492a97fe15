"""Laws as sums of the closed forms that finite element codes have built in, recognised from their algebra.

A form is A f(s) e^m t^k exp(-Q/(R T)), with f(s) one of s^n, sinh(s/B)^n and exp(s/B): stress s, creep strain e, time
t, temperature T. A term that multiplies out to several such products is several forms. What the input text of every
code needs besides stands here too: the heading, numbers within a double's range, elastic constants.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar, Literal

import sympy

from creepkit.errors import ExportError
from creepkit.exporters.law_description import comment_lines, heading, refuse_back_stress, refuse_conditions
from creepkit.exporters.unit_conversion import reference_sentence
from creepkit.kernels.log_form import in_one_sentence
from creepkit.language.elastic import Elastic
from creepkit.language.symbols import GAS_CONSTANT, principal_stress, strain, stress, temperature, time
from creepkit.records import LawWithValues, Units

_INVERSE_T = sympy.Symbol("per_T", positive=True)


_CONSTANT, _INVERSE_TEMPERATURE, _STRESS_MONOMIAL = (0, 0), (1, 0), (0, 1)
"""Monomials of 1/T and stress, as sympy writes them."""


_DIGITS = 30
"""Digits of values while products are taken apart, so that none of a double's are lost."""


StressFunction = Literal["power", "sinh", "exponential"]


@dataclass(frozen=True)
class CreepForm:
    """One product A f(s) e^m t^k exp(-Q/(R T)), of stress s, creep strain e and time t.

    stress_function : f is s^n ("power"), sinh(s/B)^n ("sinh") or exp(s/B) ("exponential"). log_coefficient : ln A, as A
        at infinite temperature may lie outside the range of a double. stress_scale : B in MPa, or the unit of stress.
    strain_exponent, time_exponent : m and k.
    Q : J/mol; 0 where temperature does not matter.
    """

    label: str
    stress_function: StressFunction
    log_coefficient: float
    n: float
    stress_scale: float
    strain_exponent: float
    time_exponent: float
    Q: float

    @property
    def activation_temperature(self) -> float:
        """Q/R in K."""
        return self.Q / GAS_CONSTANT

    @property
    def is_steady(self) -> bool:
        """Whether neither strain nor time enters."""
        return self.strain_exponent == 0 and self.time_exponent == 0

    def log_coefficient_at(self, T: float) -> float:
        """ln of A exp(-Q/(R T)), with T in K."""
        return self.log_coefficient - self.activation_temperature / T

    def in_units(self, units: Units) -> CreepForm:
        """The same form of stress and time in other units, with its rate per unit of time."""
        stress_factor, time_factor = units.megapascals, units.seconds
        shift = (1.0 + self.time_exponent) * math.log(time_factor) + (
            self.n * math.log(stress_factor) if self.stress_function == "power" else 0.0
        )
        return replace(
            self, log_coefficient=self.log_coefficient + shift, stress_scale=self.stress_scale / stress_factor
        )


def creep_forms_of(source: LawWithValues, target: str, alternative: str) -> tuple[CreepForm, ...]:
    """The forms whose sum is the law, in the units of `source`.

    target, alternative : for the ExportError where a term is none: what has no form for it, and what to do.
    """
    source = source.without_inactive_terms()
    law = source.law
    refuse_back_stress(law)
    refuse_conditions(law, target)
    if law.states:
        state_names = ", ".join(f"'{s}'" for s in law.states)
        raise ExportError(f"law '{law.name}': {target} has no internal variable such as {state_names}; {alternative}")
    numbers = {symbol: sympy.Float(source.values[symbol.name], _DIGITS) for symbol in law.params}
    forms = []
    for label, term in law.terms.items():
        with in_one_sentence(law, "written with numbers for its parameters"):
            products = sympy.Add.make_args(sympy.expand_mul(term.xreplace(numbers), deep=False))
        for k, product in enumerate(products, 1):
            name = label if len(products) == 1 else f"{label} {k}"
            try:
                forms.append(_form_of_product(name, product).in_units(source.units))
            except _UnsupportedFormError as reason:
                term_name = f"law '{law.name}', term '{label}'"
                raise ExportError(f"{term_name}: {target} has no form for it, {reason}; {alternative}") from None
    return tuple(forms)


class _UnsupportedFormError(Exception):
    """Why a product is none of the forms."""


# ---- taking a product apart ----------------------------------------------------------------------------------------


@dataclass
class _ProductFactors:
    """What the factors of a product amount to, so far.

    powers : of stress, strain and time. exponent : of e, coefficients of 1, of 1/T and of stress. sinh : (1/B, power).
    """

    powers: dict[sympy.Symbol, float] = field(default_factory=lambda: dict.fromkeys((stress, strain, time), 0.0))
    exponent: dict[tuple[int, int], float] = field(
        default_factory=lambda: dict.fromkeys((_CONSTANT, _INVERSE_TEMPERATURE, _STRESS_MONOMIAL), 0.0)
    )
    sinh: list[tuple[float, float]] = field(default_factory=list)

    def multiply(self, e: sympy.Expr, power: float) -> None:
        """Multiply by e^power."""
        if e.is_Mul:
            for factor in e.args:
                self.multiply(factor, power)
        elif not e.free_symbols:
            self.exponent[_CONSTANT] += power * _log_of_number(e)
        elif e in self.powers:
            self.powers[e] += power
        elif isinstance(e, sympy.Abs) and e.args[0] == stress:
            self.powers[stress] += power
        elif e.is_Pow and not e.exp.free_symbols:
            self.multiply(e.base, power * float(e.exp))
        elif isinstance(e, sympy.exp):
            self._multiply_exponential(e.args[0], power)
        elif e.is_Pow and not e.base.free_symbols and e.base.is_positive:
            self._multiply_exponential(e.exp * sympy.log(e.base), power)
        elif isinstance(e, sympy.sinh):
            self.sinh.append((_inverse_stress_scale(e.args[0]), power))
        else:
            raise _UnsupportedFormError(_reason(e))

    def _multiply_exponential(self, exponent: sympy.Expr, power: float) -> None:
        """Multiply by exp(exponent)^power, the exponent a + b/T + c stress."""
        polynomial = sympy.expand(exponent.xreplace({temperature: 1 / _INVERSE_T})).as_poly(_INVERSE_T, stress)
        if polynomial is None:
            raise _UnsupportedFormError(_reason(sympy.exp(exponent)))
        for powers, coefficient in polynomial.terms():
            if coefficient.free_symbols or powers not in self.exponent:
                raise _UnsupportedFormError(_reason(sympy.exp(exponent)))
            self.exponent[powers] += power * float(coefficient)


def _form_of_product(label: str, product: sympy.Expr) -> CreepForm:
    """The product as a form; _UnsupportedFormError with the reason where it is none."""
    factors = _ProductFactors()
    factors.multiply(product, 1.0)
    n, strain_power, time_power = (factors.powers[s] for s in (stress, strain, time))
    log_number, per_T, per_stress = factors.exponent.values()
    stress_dependences = [n != 0, bool(factors.sinh), per_stress != 0]
    if sum(stress_dependences) > 1 or len(factors.sinh) > 1:
        raise _UnsupportedFormError(f"stress enters {_rounded_text(product)} in several ways at once")
    stress_function: StressFunction = "sinh" if factors.sinh else "exponential" if per_stress else "power"
    if factors.sinh:
        ((per_stress, n),) = factors.sinh
    stress_scale = 1.0 / per_stress if per_stress else math.inf
    Q = -per_T * GAS_CONSTANT if per_T else 0.0
    return CreepForm(label, stress_function, log_number, n, stress_scale, strain_power, time_power, Q)


def _log_of_number(number: sympy.Expr) -> float:
    value = sympy.N(number, _DIGITS)
    if not (value.is_real and value > 0):
        raise _UnsupportedFormError(f"its coefficient {value:.6g} is not positive")
    return float(sympy.log(value))


def _inverse_stress_scale(argument: sympy.Expr) -> float:
    """1/B of sinh(stress/B)."""
    slope = sympy.expand(argument / stress)
    if slope.free_symbols or not slope > 0:
        raise _UnsupportedFormError(_reason(sympy.sinh(argument)))
    return float(slope)


def _reason(factor: sympy.Expr) -> str:
    """What a factor is that no form has, and what may help."""
    remedy = " (constants at one temperature may do: export(..., temperature=1073))" if factor.has(temperature) else ""
    if factor.is_Pow and not factor.base.is_Add:
        return f"as the exponent {_rounded_text(factor.exp)} of {factor.base} is not a number{remedy}"
    return f"which holds {_rounded_text(factor)}{remedy}"


def _rounded_text(expression: sympy.Expr) -> str:
    """An expression with numbers of six digits."""
    rounded = {f: sympy.Float(f"{float(f):.6g}") for f in expression.atoms(sympy.Float)}
    return f"'{expression.xreplace(rounded)}'"


_LINE_LENGTH = 110


def card_heading(source: LawWithValues, marker: str, lines: Iterable[str]) -> list[str]:
    """Comments: the law, its values and notes, the units of the numbers below, then `lines` on the target's form."""
    units = source.units
    units_sentence = (
        f"Numbers below are in {units.stress} and {units.time}, temperatures in K: {reference_sentence(units)}."
    )
    return comment_lines(
        [*heading(source.without_inactive_terms(), units=units_sentence), "", *lines], marker, _LINE_LENGTH
    )


class CodeInput:
    """An exporter of the input text of a code, with the creep laws that the code has built in.

    code : the code, or its law, in words. alternative : what to do where it has no such law, which knows no stress of
        `unknown_there`. marker : of comments. first_lines : what must stand before the heading.
    """

    code: ClassVar[str]
    alternative: ClassVar[str]
    unknown_there: ClassVar[tuple[sympy.Symbol, ...]] = (principal_stress,)
    marker: ClassVar[str]
    first_lines: ClassVar[tuple[str, ...]] = ()

    def text(self, source: LawWithValues) -> str:
        """Return heading and input; ExportError, with what to do, where the law is none of the code's."""
        forms = creep_forms_of(source, self.code, self.way_out(source))
        comments, lines = self.content(source, forms)
        return "\n".join([*self.first_lines, *card_heading(source, self.marker, comments), *lines]) + "\n"

    def content(self, source: LawWithValues, forms: Sequence[CreepForm]) -> tuple[list[str], list[str]]:
        """Comments on the target's form, and the lines of input."""
        raise NotImplementedError

    def refusal(self, source: LawWithValues, reason: str) -> ExportError:
        """The error for a law, why, and what to do."""
        return ExportError(f"law '{source.law.name}'{reason}; {self.way_out(source)}")

    def way_out(self, source: LawWithValues) -> str:
        """What to do with a law that the code does not have: a target that takes it."""
        law = source.without_inactive_terms().law
        multiaxial = any(law.uses(one) for one in self.unknown_there)
        return "export it as 'mfront', which has the principal and the mean stress" if multiaxial else self.alternative


def exp_in_range(logarithm: float, quantity: str, source: LawWithValues) -> float:
    """exp(logarithm); ExportError where that is no double."""
    if not -700.0 < logarithm < 700.0:
        raise ExportError(
            f"law '{source.law.name}': {quantity} would be 1e{logarithm / math.log(10):.0f}, beyond the range of a "
            "double; give the temperature of the analysis, export(..., temperature=1073)"
        )
    return math.exp(logarithm)


def format_number(value: float) -> str:
    """A number of 13 digits: more than the logarithm of a coefficient keeps, and short enough for every code."""
    return f"{value:.13g}"


def temperature_span(source: LawWithValues) -> tuple[float, float]:
    """Ends of tables against temperature, K: what the tests covered and 25 K to each side, else 873 K to 1273 K."""
    tested_range = source.ranges.get("temperature")
    return (873.15, 1273.15) if tested_range is None else (tested_range[0] - 25.0, tested_range[1] + 25.0)


def temperature_grid(low: float, high: float, step: float) -> list[float]:
    """From low in steps to high, and high itself."""
    return [*(low + step * k for k in range(math.ceil((high - low) / step - 1e-9))), high]


@dataclass(frozen=True)
class ElasticConstants:
    """Young's modulus in the text's unit of stress, and Poisson's ratio; T in K, None where it does not matter."""

    T: float | None
    E: float
    nu: float


def constant_elasticity(source: LawWithValues) -> ElasticConstants | None:
    """The moduli where they do not depend on temperature, None where none are given; else ExportError."""
    elastic = source.elastic
    if elastic is None:
        return None
    if elasticity_varies(elastic):
        raise ExportError(
            f"law '{source.law.name}': the elastic moduli depend on temperature, and this text takes numbers; "
            "give elastic.at(1073)"
        )
    return _elastic_constants_at(source, elastic, None)


def elastic_table(source: LawWithValues, step: float, at: Sequence[float] = ()) -> list[ElasticConstants]:
    """The moduli in steps of temperature, or once where they do not depend on it; none where they are not given.

    step : K. at : K, of the rows where another table decides.
    """
    elastic = source.elastic
    if elastic is None or not (at or elasticity_varies(elastic)):
        constant = constant_elasticity(source)
        return [constant] if constant else []
    temperatures = at or temperature_grid(*temperature_span(source), step)
    return [_elastic_constants_at(source, elastic.at(T), T) for T in temperatures]


def elasticity_varies(elastic: Elastic) -> bool:
    """Whether a modulus depends on temperature."""
    return any(isinstance(value, sympy.Expr) and value.free_symbols for value in (elastic.E, elastic.nu))


def elastic_expressions(
    source: LawWithValues, elastic: Elastic, temperature_name: str
) -> tuple[sympy.Expr, sympy.Expr]:
    """Young's modulus in the text's unit of stress, and Poisson's ratio, as formulas of a temperature in K."""
    named = {temperature: sympy.Symbol(temperature_name)}
    E, nu = sympy.sympify(elastic.E) / source.units.megapascals, sympy.sympify(elastic.nu)
    return E.xreplace(named), nu.xreplace(named)


def _elastic_constants_at(source: LawWithValues, elastic: Elastic, T: float | None) -> ElasticConstants:
    return ElasticConstants(T, float(elastic.E) / source.units.megapascals, float(elastic.nu))
