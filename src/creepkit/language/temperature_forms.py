"""Temperature forms: how a parameter, a rate or a modulus depends on temperature.

A form is written about a reference temperature T_ref, so that the parameter keeps its value, and its bounds, there: the
Arrhenius factor is exp[-(Q/R)(1/T - 1/T_ref)]. With x the parameter (its logarithm, where its scale is log) a sum of
basis functions reads x(T) = x + sum_j c_j b_j(T); every basis function is 0 at T_ref.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import sympy

from creepkit.checked_arguments import checked
from creepkit.errors import LawError
from creepkit.language.symbols import GAS_CONSTANT, Param, Symbol, temperature

ACTIVATION_ENERGY_BOUNDS = (2e4, 9e5)
"""Bounds of an activation energy, J/mol: grain-boundary diffusion to apparent values of precipitate-hardened alloys."""


Built = tuple[sympy.Expr, dict[sympy.Symbol, Param]]
"""A parameter as an expression of temperature, and the parameters that it introduces."""


@dataclass(frozen=True)
class TemperatureFactor:
    """A positive factor of temperature that multiplies rates, 1 at T_ref, with parameters of its own."""

    name: str
    expression: sympy.Expr
    params: Mapping[sympy.Symbol, Param]
    reference: str
    T_ref: float

    def __post_init__(self) -> None:
        check_reference_temperature(self.T_ref)
        object.__setattr__(self, "params", MappingProxyType(dict(self.params)))


@dataclass(frozen=True)
class TemperatureForm:
    """A rule that makes a parameter a function of temperature; the parameter stays its value at T_ref.

    build(symbol, param) returns the expression and the extra parameters it introduces.
    """

    name: str
    build: Callable[[sympy.Symbol, Param], Built]
    reference: str
    T_ref: float

    def __post_init__(self) -> None:
        check_reference_temperature(self.T_ref)


@checked
def arrhenius(T_ref: float = 1073.15, Q: float | None = None) -> TemperatureFactor:
    """The Arrhenius factor exp[-(Q/R)(1/T - 1/T_ref)] of Eq. (5); T_ref in K, Q in J/mol (a parameter unless given)."""
    symbol = Symbol("Q")
    energy = symbol if Q is None else sympy.Float(Q)
    expression = sympy.exp(energy * _reciprocal_decrease(T_ref) / GAS_CONSTANT)
    params = (
        {} if Q is not None else {symbol: Param("activation energy", bounds=ACTIVATION_ENERGY_BOUNDS, unit="J/mol")}
    )
    return TemperatureFactor("arrhenius", expression, params, "Arrhenius (1889), Z. Phys. Chem. 4, 226", float(T_ref))


@checked
def linear(T_ref: float = 1073.15, slope: tuple[float, float] | None = None) -> TemperatureForm:
    """p(T) = p + p_T (T - T_ref); the slope p_T, per K, lies by default within half the range of p in 100 K."""
    difference = temperature - sympy.Float(T_ref)
    shape = _BasisFunction("T", difference, "temperature slope of", "1/K", 1 / (2 * TEMPERATURE_SPAN))
    return _straight_line("linear", "straight line about T_ref", T_ref, shape, slope)


@checked
def inverse_temperature(T_ref: float = 1073.15, slope: tuple[float, float] | None = None) -> TemperatureForm:
    """p(T) = p + p_I (1000/T - 1000/T_ref); default bounds of p_I: the range of p over 0.5."""
    shape = _BasisFunction("I", -1000 * _reciprocal_decrease(T_ref), "slope against 1000/T of", "1000 K", 2.0)
    return _straight_line("inverse", "straight line in 1/T about T_ref", T_ref, shape, slope)


@checked
def activated(T_ref: float = 1073.15, Q: tuple[float, float] = (-9e5, 9e5)) -> TemperatureForm:
    """p(T) = p exp[-(Q_p/R)(1/T - 1/T_ref)] for a positive parameter; Q_p in J/mol, of either sign."""

    def build(symbol: sympy.Symbol, param: Param) -> Built:
        energy, extra = _coefficient(f"Q_{symbol.name}", f"activation energy of {param.meaning}", Q, "J/mol")
        return symbol * sympy.exp(energy * _reciprocal_decrease(T_ref) / GAS_CONSTANT), extra

    return TemperatureForm("activated", build, "Arrhenius (1889), Z. Phys. Chem. 4, 226", float(T_ref))


@checked
def exponential(T_ref: float = 1073.15, slope: tuple[float, float] = (-0.1, 0.1)) -> TemperatureForm:
    """p(T) = p exp[p_T (T - T_ref)] for a positive parameter; p_T in 1/K."""

    def build(symbol: sympy.Symbol, param: Param) -> Built:
        meaning = f"relative temperature slope of {param.meaning}"
        rate, extra = _coefficient(f"{symbol.name}_T", meaning, slope, "1/K")
        return symbol * sympy.exp(rate * (temperature - sympy.Float(T_ref))), extra

    return TemperatureForm("exponential", build, "exponential about T_ref", float(T_ref))


def _coefficient(
    name: str, meaning: str, bounds: tuple[float, float], unit: str
) -> tuple[sympy.Symbol, dict[sympy.Symbol, Param]]:
    """A parameter that a form introduces, which 0 switches off."""
    symbol = Symbol(name)
    return symbol, {symbol: Param(meaning, bounds=bounds, unit=unit, off=0.0)}


def _reciprocal_decrease(T_ref: float) -> sympy.Expr:
    """1/T_ref - 1/T as (T - T_ref)/(T_ref T), which loses no digits near T_ref and is exactly 0 there."""
    return (temperature - sympy.Float(T_ref)) / (sympy.Float(T_ref) * temperature)


def check_reference_temperature(T_ref: float) -> None:
    """A reference temperature is one in K."""
    if not 0 < float(T_ref) < 1e4:
        raise LawError(f"T_ref = {T_ref:g} is not a temperature in K (allowed: above 0, below 10000)")


TEMPERATURE_SPAN = 100.0
"""K in which, by default, a parameter may move by half the range of its bounds."""


LOG_PARAMETER_RANGE = 20.0
"""The range that counts for parameters of log scale, whose bounds may span fifty decades: e^10 in 100 K."""


T0_BOUNDS = (300.0, 3e4)
"""K, of T0 in exp(-T0/T): 2.5 to 250 kJ/mol; below, the form is one in 1/T."""


@dataclass(frozen=True)
class _BasisFunction:
    """One shape of temperature: the suffix of its coefficient, what it means, its unit, and the size of its bounds.

    coefficient_bound : bounds of the coefficient for a parameter whose range is 1.
    """

    suffix: str
    expression: sympy.Expr
    meaning: str
    unit: str
    coefficient_bound: float


def logarithmic(T_ref: float = 1073.15) -> TemperatureForm:
    """p(T) = p + p_L ln(T/T_ref); on a log scale the power p (T/T_ref)^p_L."""
    basis_function = _BasisFunction(
        "L", sympy.log(temperature / sympy.Float(T_ref)), "slope against ln T of", "1", T_ref / (2 * TEMPERATURE_SPAN)
    )
    return _basis_form("logarithmic", "straight line in ln T about T_ref", T_ref, [basis_function])


def t_log_t(T_ref: float = 1073.15) -> TemperatureForm:
    """p(T) = p + p_TL (T ln T - T_ref ln T_ref)/1000; T in K."""
    check_reference_temperature(T_ref)
    T0 = sympy.Float(T_ref)
    expression = (temperature * sympy.log(temperature / T0) + (temperature - T0) * sympy.log(T0)) / 1000
    coefficient_bound = 1000.0 / (2 * TEMPERATURE_SPAN * (1.0 + float(sympy.log(T0))))
    basis_function = _BasisFunction("TL", expression, "slope against T ln T of", "1/(1000 K)", coefficient_bound)
    return _basis_form("t-log-t", "straight line in T ln T about T_ref", T_ref, [basis_function])


def boltzmann(T_ref: float = 1073.15, T0: tuple[float, float] = T0_BOUNDS) -> TemperatureForm:
    """p(T) = p + p_E (T_ref^2/T0) [exp(-T0 (1/T - 1/T_ref)) - 1]: a + b exp(-T0/T) with slope p_E per K at T_ref."""

    def shape(start: sympy.Symbol) -> sympy.Expr:
        return sympy.Float(T_ref) ** 2 / start * (sympy.exp(start * _reciprocal_decrease(T_ref)) - 1)

    return _form_with_T0("boltzmann", "exponential of reciprocal temperature", T_ref, T0, "E", shape)


def wachtman_form(T_ref: float = 1073.15, T0: tuple[float, float] = T0_BOUNDS) -> TemperatureForm:
    """p(T) = a + b T exp(-T0/T), the form of Wachtman's modulus, written with its slope p_W per K at T_ref."""

    def shape(start: sympy.Symbol) -> sympy.Expr:
        grown = temperature * sympy.exp(start * _reciprocal_decrease(T_ref)) - sympy.Float(T_ref)
        return grown / (1 + start / sympy.Float(T_ref))

    return _form_with_T0("wachtman", "Wachtman et al. (1961), Phys. Rev. 122, 1754", T_ref, T0, "W", shape)


def curved(T_ref: float = 1073.15) -> TemperatureForm:
    """p(T) = a + b T + c/T as p + p_T (T - T_ref) + p_C (T - T_ref)^2/T, which spans the same."""
    difference = temperature - sympy.Float(T_ref)
    linear_term = _BasisFunction("T", difference, "slope at T_ref of", "1/K", 1 / (2 * TEMPERATURE_SPAN))
    curvature_term = _BasisFunction(
        "C", difference**2 / temperature, "curvature against T of", "1/K", T_ref / TEMPERATURE_SPAN**2
    )
    return _basis_form("curved", "T and 1/T about T_ref", T_ref, [linear_term, curvature_term])


def modified_arrhenius(T_ref: float = 1073.15) -> TemperatureForm:
    """p(T) = p (T/T_ref)^b exp[...], Kooij's form, with Q_p the apparent activation energy at T_ref.

    ln p(T) = ln p - (Q_p/R)(1/T - 1/T_ref) + p_B [ln(T/T_ref) + T_ref/T - 1]; on a linear scale p + p_I (1/T_ref -
    1/T) 1000 and the same bend.
    """
    reciprocal_decrease = _reciprocal_decrease(T_ref)
    curvature = sympy.log(temperature / sympy.Float(T_ref)) - sympy.Float(T_ref) * reciprocal_decrease

    def build(symbol: sympy.Symbol, param: Param) -> Built:
        bent = _BasisFunction("B", curvature, "bend against 1/T of", "1", 2 * (T_ref / TEMPERATURE_SPAN) ** 2)
        if param.scale == "log":
            expression, reach = reciprocal_decrease / GAS_CONSTANT, 9e5 / LOG_PARAMETER_RANGE
            first = _BasisFunction("Q", expression, "activation energy at T_ref of", "J/mol", reach)
        else:
            expression, reach = -1000 * reciprocal_decrease, T_ref**2 / (2 * TEMPERATURE_SPAN * 1000.0)
            first = _BasisFunction("I", expression, "slope against 1000/T of", "1000 K", reach)
        return _basis_expansion(symbol, param, [first, bent])

    return TemperatureForm("modified-arrhenius", build, "Kooij (1893), Z. Phys. Chem. 12, 155", float(T_ref))


def _basis_form(name: str, reference: str, T_ref: float, basis: Sequence[_BasisFunction]) -> TemperatureForm:
    return TemperatureForm(name, lambda symbol, param: _basis_expansion(symbol, param, basis), reference, float(T_ref))


def _straight_line(
    name: str, reference: str, T_ref: float, shape: _BasisFunction, slope: tuple[float, float] | None
) -> TemperatureForm:
    """The form of one shape for parameters of linear scale alone; slope : bounds of its coefficient."""

    def build(symbol: sympy.Symbol, param: Param) -> Built:
        if param.scale == "log":
            raise LawError(f"parameter '{symbol}' has a log scale: use activated() or exponential(), not {name}()")
        built, coefficients = _basis_expansion(symbol, param, [shape])
        return built, {c: replace(p, bounds=slope or p.bounds) for c, p in coefficients.items()}

    return TemperatureForm(name, build, reference, float(T_ref))


def _basis_expansion(symbol: sympy.Symbol, param: Param, basis: Sequence[_BasisFunction]) -> Built:
    """The parameter with its shapes added on its own scale, and their coefficients."""
    low, high = param.bounds
    parameter_range = LOG_PARAMETER_RANGE if param.scale == "log" else high - low
    coefficients: dict[sympy.Symbol, Param] = {}
    increment: sympy.Expr = sympy.S.Zero
    for shape in basis:
        name = f"Q_{symbol.name}" if shape.suffix == "Q" else f"{symbol.name}_{shape.suffix}"
        coefficient, unit = Symbol(name), _coefficient_unit(shape.unit, param)
        bounds = (-shape.coefficient_bound * parameter_range, shape.coefficient_bound * parameter_range)
        coefficients[coefficient] = Param(f"{shape.meaning} {param.meaning}", bounds=bounds, unit=unit, off=0.0)
        increment += coefficient * shape.expression
    return (symbol * sympy.exp(increment) if param.scale == "log" else symbol + increment), coefficients


def _coefficient_unit(unit: str, param: Param) -> str:
    if param.scale == "log" or param.unit == "1":
        return unit
    return param.unit if unit == "1" else f"{param.unit} {unit}".replace(" 1/", "/")


def _form_with_T0(
    name: str,
    reference: str,
    T_ref: float,
    T0: tuple[float, float],
    suffix: str,
    shape: Callable[[sympy.Symbol], sympy.Expr],
) -> TemperatureForm:
    """The form of one shape, which a parameter T0 inside its exponential belongs to."""

    def build(symbol: sympy.Symbol, param: Param) -> Built:
        start = Symbol(f"{symbol.name}_T0")
        basis = _BasisFunction(suffix, shape(start), "slope at T_ref of", "1/K", 1 / (2 * TEMPERATURE_SPAN))
        built, coefficients = _basis_expansion(symbol, param, [basis])
        return built, coefficients | {start: Param(f"T0 of {param.meaning}", bounds=T0, unit="K")}

    return TemperatureForm(name, build, reference, float(T_ref))
