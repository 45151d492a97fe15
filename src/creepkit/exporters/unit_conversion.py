"""Units of rate coefficients, and parameter values in other units, such that the same formula gives the rate in those.

A law's stress is a ratio to 1 MPa and its time a ratio to 1 s. With units of k MPa and c seconds a stress parameter B
becomes B/k and a time parameter tau/c. A rate of degree p in what is a stress, and q in what is a time, then is
k^p c^(q + 1) of what it must be, a number for each term that goes into the term's rate coefficient. Where there is no
such degree, as with an exponent that depends on time or temperature, the conversion is refused. Degrees are found from
the parts of an expression, in time proportional to its length; sympy is not asked to simplify.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import mpmath
import sympy

from creepkit.errors import ExportError
from creepkit.language.algebra import rate_coefficients
from creepkit.language.law import CreepLaw
from creepkit.language.printing import expression_text
from creepkit.language.symbols import POINT_VARIABLES, mean_stress, principal_stress, stress, time
from creepkit.records import LawWithValues, Units

STRESSES = (stress, principal_stress, mean_stress)
"""The variables of a point that are in the units of stress."""


_FACTOR_TOLERANCE = 1e-9
"""Relative difference of factors that counts as none."""


@dataclass(frozen=True)
class ConvertedValues:
    """Values and units of a law's parameters for a system of units, and the sentence that names the reference."""

    values: Mapping[str, float]
    units: Mapping[str, str]
    reference_sentence: str


def convert_values(source: LawWithValues) -> ConvertedValues:
    """Return a law's numbers in `source.units`; ExportError where no number can do it."""
    law, units, values = source.law, source.units, dict(source.values)
    new_units = {name: _unit_text(param.unit, units) for name, param in law.table.items()}
    if not units.is_native:
        for name, param in law.table.items():
            values[name] *= _unit_factor(param.unit, units)
        for name, factor in _coefficient_factors(law, source.values, units).items():
            values[name] *= factor
    return ConvertedValues(values, new_units, reference_sentence(units))


def reference_sentence(units: Units) -> str:
    """What a law's stress and time are ratios to."""
    return f"stress is a ratio to 1 {units.stress}, time to 1 {units.time}, rates are per {units.time}"


def _coefficient_factors(law: CreepLaw, values: Mapping[str, float], units: Units) -> dict[str, float]:
    """{rate coefficient: what it must be multiplied by}."""
    parameter_powers = {symbol: _unit_powers(param.unit) for symbol, param in law.params.items()}
    stresses = (*STRESSES, *law.back_stresses)
    of_stress = dict.fromkeys(stresses, 1) | {symbol: power for symbol, (power, _) in parameter_powers.items()}
    of_time = {time: 1} | {symbol: power for symbol, (_, power) in parameter_powers.items()}
    numbers = {symbol: values[symbol.name] for symbol in law.params}
    candidates = [s for s, param in law.params.items() if param.scale == "log" and values[s.name] > 0]
    rates = [(f"term '{label}'", term) for label, term in law.terms.items()]
    rates += [(f"rate of '{symbol}'", rate) for symbol, rate in _rates_of_states(law)]
    factors: dict[str, float] = {}
    for label, rate in rates:
        p, q = (_degree_in_numbers(rate, degrees, numbers) for degrees in (of_stress, of_time))
        factor = None
        if p is not None and q is not None:
            factor = mpmath.mpf(units.megapascals) ** p * mpmath.mpf(units.seconds) ** (1 + q)
        if rate.xreplace(numbers) == 0 or (factor is not None and abs(factor - 1) < _FACTOR_TOLERANCE):
            continue
        found = ((s.name, _degree_in_numbers(rate, {s: 1}, numbers)) for s in candidates)
        name, power = next((pair for pair in found if pair[1]), ("", None))
        coefficient_factor = 0.0 if factor is None or power is None else float(factor ** (1 / power))
        if factor is None or power is None:
            reason = "the factor varies with the point" if factor is None else "it has no rate coefficient"
            problem = f"law '{law.name}', {label}: no constants give it with {reference_sentence(units)} ({reason})"
        elif not 0 < coefficient_factor < float("inf"):
            problem = f"law '{law.name}': {name} would leave double precision with {reference_sentence(units)}"
        elif abs(factors.setdefault(name, coefficient_factor) / coefficient_factor - 1) > _FACTOR_TOLERANCE:
            problem = f"law '{law.name}': {name} would need two values with {reference_sentence(units)}"
        else:
            continue
        raise ExportError(f"{problem}; export it in MPa and s")
    return factors


def _rates_of_states(law: CreepLaw) -> Iterator[tuple[sympy.Symbol, sympy.Expr]]:
    """Each state with its rate; a back stress, whose unit is that of stress, with each summand over the stress."""
    for symbol, state in law.states.items():
        if symbol in law.back_stresses:
            yield from ((symbol, part / stress) for part in sympy.Add.make_args(state.rate))
        else:
            yield symbol, state.rate


def _degree_in_numbers(
    rate: sympy.Expr, degrees: Mapping[sympy.Symbol, int], numbers: Mapping[sympy.Symbol, float]
) -> float | None:
    """The degree where parameters that do not change have their values; None where it varies with the point."""
    power = degree(rate.xreplace({s: sympy.Float(v) for s, v in numbers.items() if not degrees.get(s)}), degrees)
    power = None if power is None else power.subs(numbers)
    return None if power is None or power.free_symbols else float(power)


# ---- degrees -------------------------------------------------------------------------------------------------------

_DEGREE_TOLERANCE = 1e-12
"""By which degrees may differ that are sums of the same numbers."""


MOST_OPERATIONS = 60
"""Of a degree; longer ones, of exponents within exponents, count as none."""


def degree(expression: sympy.Basic, degrees: Mapping[sympy.Symbol, int]) -> sympy.Expr | None:
    """d in f(c^k x, ...) = c^d f(x, ...), where `degrees` says k of each symbol, else 0.

    None where there is no d.
    """
    if not expression.args or not expression.free_symbols & degrees.keys():
        return sympy.Integer(degrees.get(expression, 0))
    if isinstance(expression, sympy.Pow):
        base, exponent = (degree(part, degrees) for part in expression.args)
        return None if base is None or exponent != 0 else _short(base * expression.exp)
    if isinstance(expression, sympy.Piecewise):
        if any(degree(condition, degrees) is None for _, condition in expression.args):
            return None
        return _common([branch for branch, _ in expression.args], degrees)
    if isinstance(expression, sympy.Mul):
        parts = [degree(part, degrees) for part in expression.args]
        return None if None in parts else _short(sympy.Add(*parts))
    if isinstance(expression, sympy.Abs):
        return degree(expression.args[0], degrees)
    if isinstance(expression, sympy.Add | sympy.Max | sympy.Min):
        return _common(expression.args, degrees)
    if isinstance(expression, sympy.core.relational.Relational):
        return None if _common(expression.args, degrees) is None else sympy.S.Zero
    if isinstance(expression, sympy.Heaviside | sympy.sign):
        return None if degree(expression.args[0], degrees) is None else sympy.S.Zero
    return sympy.S.Zero if all(degree(part, degrees) == 0 for part in expression.args) else None


def _common(parts: Iterable[sympy.Basic], degrees: Mapping[sympy.Symbol, int]) -> sympy.Expr | None:
    """The degree that all parts have; zero has any."""
    found = [degree(part, degrees) for part in parts if part != 0]
    first = found[0] if found else None
    if first is None:
        return None
    gaps = [None if other is None else sympy.expand(other - first) for other in found]
    return first if all(gap is not None and gap.is_number and abs(gap) < _DEGREE_TOLERANCE for gap in gaps) else None


def _short(value: sympy.Expr) -> sympy.Expr | None:
    return value if value.count_ops() <= MOST_OPERATIONS else None


def coefficient_unit(law: CreepLaw, name: str) -> str:
    """The unit of a rate coefficient where stress and time are no ratios, such as MPa^-n s^-1.

    Empty where it is 1/s all the same, as in a law of (stress/s_0)^n, and where no such unit exists, as for an exponent
    that depends on temperature.
    """
    symbol = next(one for one in law.params if one.name == name)
    rates = [*law.terms.values(), *(rate for _, rate in _rates_of_states(law))]
    rates = [rate for rate in rates if symbol in rate_coefficients(law, rate)]
    if law.params[symbol].unit != "1/s" or not rates or any(rate.has(sympy.Max, sympy.Min) for rate in rates):
        return ""
    stresses = (*STRESSES, *law.back_stresses)
    powers = {(_power(law, rate, stresses, "MPa"), _power(law, rate, (time,), "s")) for rate in rates}
    of_stress, of_time = powers.pop()
    if powers or of_stress is None or of_time is None or of_stress == of_time == 0:
        return ""
    parts = [_unit_with_power("MPa", -of_stress), _unit_with_power("s", -of_time - 1)]
    return " ".join(part for part in parts if part)


def _power(law: CreepLaw, rate: sympy.Expr, variables: Sequence[sympy.Symbol], unit: str) -> sympy.Expr | None:
    """The power of a unit by which a rate grows when its variables and parameters change; None where there is none.

    A rate coefficient has no part in it: the unit asked for is its own.
    """
    coefficients = rate_coefficients(law, rate)
    powers = {unit: 1, f"1/{unit}": -1}
    scaled = dict.fromkeys(variables, 1) | {
        symbol: powers[param.unit]
        for symbol, param in law.params.items()
        if param.unit in powers and symbol not in coefficients
    }
    power = degree(rate, scaled)
    return None if power is None or power.free_symbols & {*POINT_VARIABLES, *law.states} else power


def _unit_with_power(unit: str, power: sympy.Expr) -> str:
    power = sympy.expand(power)
    if power == 0:
        return ""
    if power == 1:
        return unit
    negative = power.could_extract_minus_sign()
    text = expression_text(-power if negative else power)
    return f"{unit}^{'-' if negative else ''}{text if text.isidentifier() or text.isdecimal() else f'({text})'}"


# ---- units as text -------------------------------------------------------------------------------------------------


def _unit_powers(unit: str) -> tuple[int, int]:
    """The powers of MPa and of s in a unit such as MPa/K or 1/s."""
    numerator, _, denominator = unit.partition("/")
    patterns = [rf"(?<!\w){word}(?![\w^])" for word in ("MPa", "s")]
    stress, time = (len(re.findall(p, numerator)) - len(re.findall(p, denominator)) for p in patterns)
    return stress, time


def _unit_factor(unit: str, units: Units) -> float:
    stress, time = _unit_powers(unit)
    return float(units.megapascals**-stress * units.seconds**-time)


def _unit_text(unit: str, units: Units) -> str:
    text = re.sub(r"(?<!\w)MPa(?![\w^])", units.stress, unit)
    return re.sub(r"(?<!\w)s(?![\w^])", units.time, text)
