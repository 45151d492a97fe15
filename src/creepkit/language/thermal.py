"""Temperature forms: how a parameter, a rate or a modulus depends on temperature.

A form is written about a reference temperature T_ref, so that the parameter keeps its value, and Table 1's bounds,
there: the Arrhenius factor is exp[-(Q/R)(1/T - 1/T_ref)].
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import sympy

from creepkit.errors import LawError
from creepkit.language.params import Param
from creepkit.language.symbols import GAS_CONSTANT, temperature

ACTIVATION_ENERGY_BOUNDS = (5e4, 9e5)
"""Bounds of an activation energy, J/mol: grain-boundary diffusion to apparent values of precipitate-hardened alloys."""


@dataclass(frozen=True)
class TemperatureFactor:
    """A positive factor of temperature that multiplies rates, 1 at T_ref, with parameters of its own."""

    name: str
    expression: sympy.Expr
    params: Mapping[sympy.Symbol, Param]
    reference: str
    T_ref: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "params", MappingProxyType(dict(self.params)))


@dataclass(frozen=True)
class TemperatureForm:
    """A rule that makes a parameter a function of temperature; the parameter stays its value at T_ref.

    build(symbol, param) returns the expression and the extra parameters it introduces.
    """

    name: str
    build: Callable[[sympy.Symbol, Param], tuple[sympy.Expr, dict[sympy.Symbol, Param]]]
    reference: str
    T_ref: float


def arrhenius(T_ref: float = 1073.15, Q: float | None = None) -> TemperatureFactor:
    """The Arrhenius factor exp[-(Q/R)(1/T - 1/T_ref)] of Eq. (5); T_ref in K, Q in J/mol (a parameter unless given)."""
    check_reference_temperature(T_ref)
    symbol = sympy.Symbol("Q", real=True)
    energy = symbol if Q is None else sympy.Float(Q)
    expression = sympy.exp(energy * _reciprocal_decrease(T_ref) / GAS_CONSTANT)
    params = {} if Q is not None else {symbol: Param("activation energy", bounds=ACTIVATION_ENERGY_BOUNDS, unit="J/mol")}
    return TemperatureFactor("arrhenius", expression, params, "Arrhenius (1889), Z. Phys. Chem. 4, 226", float(T_ref))


def linear(T_ref: float = 1073.15, slope: tuple[float, float] | None = None) -> TemperatureForm:
    """p(T) = p + p_T (T - T_ref); the slope p_T, per K, lies by default within half the range of p in 100 K."""
    check_reference_temperature(T_ref)

    def build(symbol: sympy.Symbol, param: Param) -> tuple[sympy.Expr, dict[sympy.Symbol, Param]]:
        if param.scale == "log":
            raise LawError(f"parameter '{symbol}' has a log scale: use exponential() or activated(), not linear()")
        low, high = param.bounds
        reach = slope or (-(high - low) / 200.0, (high - low) / 200.0)
        rate = sympy.Symbol(f"{symbol.name}_T", real=True)
        unit = "1/K" if param.unit == "1" else f"{param.unit}/K"
        extra = {rate: Param(f"temperature slope of {param.meaning}", bounds=reach, unit=unit, off=0.0)}
        return symbol + rate * (temperature - sympy.Float(T_ref)), extra

    return TemperatureForm("linear", build, "straight line about T_ref", float(T_ref))


def inverse_temperature(T_ref: float = 1073.15, slope: tuple[float, float] | None = None) -> TemperatureForm:
    """p(T) = p + p_I (1000/T - 1000/T_ref); default bounds of p_I: the range of p over 0.5."""
    check_reference_temperature(T_ref)

    def build(symbol: sympy.Symbol, param: Param) -> tuple[sympy.Expr, dict[sympy.Symbol, Param]]:
        if param.scale == "log":
            raise LawError(f"parameter '{symbol}' has a log scale: use activated() for it, not inverse()")
        low, high = param.bounds
        reach = slope or (-2.0 * (high - low), 2.0 * (high - low))
        rate = sympy.Symbol(f"{symbol.name}_I", real=True)
        unit = "1000 K" if param.unit == "1" else f"{param.unit} 1000 K"
        extra = {rate: Param(f"slope of {param.meaning} against 1000/T", bounds=reach, unit=unit, off=0.0)}
        return symbol - 1000 * rate * _reciprocal_decrease(T_ref), extra

    return TemperatureForm("inverse", build, "straight line in 1/T about T_ref", float(T_ref))


def activated(T_ref: float = 1073.15, Q: tuple[float, float] = (-9e5, 9e5)) -> TemperatureForm:
    """p(T) = p exp[-(Q_p/R)(1/T - 1/T_ref)] for a positive parameter; Q_p in J/mol, of either sign."""
    check_reference_temperature(T_ref)

    def build(symbol: sympy.Symbol, param: Param) -> tuple[sympy.Expr, dict[sympy.Symbol, Param]]:
        energy = sympy.Symbol(f"Q_{symbol.name}", real=True)
        extra = {energy: Param(f"activation energy of {param.meaning}", bounds=Q, unit="J/mol", off=0.0)}
        return symbol * sympy.exp(energy * _reciprocal_decrease(T_ref) / GAS_CONSTANT), extra

    return TemperatureForm("activated", build, "Arrhenius (1889), Z. Phys. Chem. 4, 226", float(T_ref))


def exponential(T_ref: float = 1073.15, slope: tuple[float, float] = (-0.1, 0.1)) -> TemperatureForm:
    """p(T) = p exp[p_T (T - T_ref)] for a positive parameter; p_T in 1/K."""
    check_reference_temperature(T_ref)

    def build(symbol: sympy.Symbol, param: Param) -> tuple[sympy.Expr, dict[sympy.Symbol, Param]]:
        rate = sympy.Symbol(f"{symbol.name}_T", real=True)
        extra = {rate: Param(f"relative temperature slope of {param.meaning}", bounds=slope, unit="1/K", off=0.0)}
        return symbol * sympy.exp(rate * (temperature - sympy.Float(T_ref))), extra

    return TemperatureForm("exponential", build, "exponential about T_ref", float(T_ref))


def wachtman(E0: float, b: float, T0: float) -> sympy.Expr:
    """Young's modulus E0 - b T exp(-T0/T) as an expression of temperature; E0 in MPa, b in MPa/K, T0 and T in K.

    Wachtman et al. (1961), Phys. Rev. 122, 1754.
    """
    return sympy.Float(E0) - sympy.Float(b) * temperature * sympy.exp(-sympy.Float(T0) / temperature)


def _reciprocal_decrease(T_ref: float) -> sympy.Expr:
    """1/T_ref - 1/T as (T - T_ref)/(T_ref T), which loses no digits near T_ref and is exactly 0 there."""
    return (temperature - sympy.Float(T_ref)) / (sympy.Float(T_ref) * temperature)


def check_reference_temperature(T_ref: float) -> None:
    """A reference temperature is one in K."""
    if not 0 < float(T_ref) < 1e4:
        raise LawError(f"T_ref = {T_ref!r} is not a temperature in K (allowed: above 0, below 10000)")
