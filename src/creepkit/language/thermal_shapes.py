"""Temperature forms that add shapes of temperature to a parameter on its own scale.

With x the parameter (its logarithm, where its scale is log) a form reads x(T) = x + sum_j c_j shape_j(T). Every shape
is 0 at T_ref, so that the parameter keeps its value there; a shape that bends is flat at T_ref, or has slope 1 there,
so that its coefficient does not stand in for those of the other shapes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import sympy

from creepkit.language.params import Param
from creepkit.language.symbols import GAS_CONSTANT, temperature
from creepkit.language.thermal import TemperatureForm, check_reference

SPAN = 100.0
"""K in which, by default, a parameter may move by half the range of its bounds."""
LOG_RANGE = 20.0
"""The range that counts for parameters of log scale, whose bounds may span fifty decades: e^10 in 100 K."""
T0_BOUNDS = (300.0, 3e4)
"""K, of T0 in exp(-T0/T): 2.5 to 250 kJ/mol; below, the form is one in 1/T."""


@dataclass(frozen=True)
class _Shape:
    """One shape of temperature: the suffix of its coefficient, what it means, its unit, and the size of its bounds.

    reach : bounds of the coefficient for a parameter whose range is 1.
    """

    suffix: str
    expression: sympy.Expr
    meaning: str
    unit: str
    reach: float


def logarithmic(T_ref: float = 1073.15) -> TemperatureForm:
    """p(T) = p + p_L ln(T/T_ref); on a log scale the power p (T/T_ref)^p_L."""
    check_reference(T_ref)
    shape = _Shape("L", sympy.log(temperature / sympy.Float(T_ref)), "slope against ln T of", "1", T_ref / (2 * SPAN))
    return _form("logarithmic", "straight line in ln T about T_ref", T_ref, [shape])


def t_log_t(T_ref: float = 1073.15) -> TemperatureForm:
    """p(T) = p + p_TL (T ln T - T_ref ln T_ref)/1000; T in K."""
    check_reference(T_ref)
    T0 = sympy.Float(T_ref)
    expression = (temperature * sympy.log(temperature / T0) + (temperature - T0) * sympy.log(T0)) / 1000
    reach = 1000.0 / (2 * SPAN * (1.0 + float(sympy.log(T0))))
    shape = _Shape("TL", expression, "slope against T ln T of", "1/(1000 K)", reach)
    return _form("t-log-t", "straight line in T ln T about T_ref", T_ref, [shape])


def boltzmann(T_ref: float = 1073.15, T0: tuple[float, float] = T0_BOUNDS) -> TemperatureForm:
    """p(T) = p + p_E (T_ref^2/T0) [exp(-T0 (1/T - 1/T_ref)) - 1]: a + b exp(-T0/T) with slope p_E per K at T_ref."""
    check_reference(T_ref)

    def build(symbol: sympy.Symbol, param: Param) -> tuple[sympy.Expr, dict[sympy.Symbol, Param]]:
        start, extra = _activation(symbol, param, T0)
        expression = sympy.Float(T_ref) ** 2 / start * (sympy.exp(-start * _inverse_rise(T_ref)) - 1)
        shape = _Shape("E", expression, "slope at T_ref of", "1/K", 1 / (2 * SPAN))
        built, coefficients = _sum(symbol, param, [shape])
        return built, coefficients | extra

    return TemperatureForm("boltzmann", build, "exponential of reciprocal temperature", float(T_ref))


def wachtman_like(T_ref: float = 1073.15, T0: tuple[float, float] = T0_BOUNDS) -> TemperatureForm:
    """p(T) = a + b T exp(-T0/T), the form of Wachtman's modulus, written with its slope p_W per K at T_ref."""
    check_reference(T_ref)

    def build(symbol: sympy.Symbol, param: Param) -> tuple[sympy.Expr, dict[sympy.Symbol, Param]]:
        start, extra = _activation(symbol, param, T0)
        grown = temperature * sympy.exp(-start * _inverse_rise(T_ref)) - sympy.Float(T_ref)
        shape = _Shape("W", grown / (1 + start / sympy.Float(T_ref)), "slope at T_ref of", "1/K", 1 / (2 * SPAN))
        built, coefficients = _sum(symbol, param, [shape])
        return built, coefficients | extra

    return TemperatureForm("wachtman", build, "Wachtman et al. (1961), Phys. Rev. 122, 1754", float(T_ref))


def curved(T_ref: float = 1073.15) -> TemperatureForm:
    """p(T) = a + b T + c/T as p + p_T (T - T_ref) + p_C (T - T_ref)^2/T, which spans the same."""
    check_reference(T_ref)
    rise = temperature - sympy.Float(T_ref)
    line = _Shape("T", rise, "slope at T_ref of", "1/K", 1 / (2 * SPAN))
    bend = _Shape("C", rise**2 / temperature, "curvature against T of", "1/K", T_ref / SPAN**2)
    return _form("curved", "T and 1/T about T_ref", T_ref, [line, bend])


def modified_arrhenius(T_ref: float = 1073.15) -> TemperatureForm:
    """p(T) = p (T/T_ref)^b exp[...], Kooij's form, with Q_p the apparent activation energy at T_ref.

    ln p(T) = ln p - (Q_p/R)(1/T - 1/T_ref) + p_B [ln(T/T_ref) + T_ref/T - 1]; on a linear scale p + p_I (1/T_ref -
    1/T) 1000 and the same bend.
    """
    check_reference(T_ref)
    per = sympy.Float(T_ref) * temperature
    fall = (temperature - sympy.Float(T_ref)) / per
    bend = sympy.log(temperature / sympy.Float(T_ref)) - sympy.Float(T_ref) * fall

    def build(symbol: sympy.Symbol, param: Param) -> tuple[sympy.Expr, dict[sympy.Symbol, Param]]:
        bent = _Shape("B", bend, "bend against 1/T of", "1", 2 * (T_ref / SPAN) ** 2)
        if param.scale == "log":
            first = _Shape("Q", fall / GAS_CONSTANT, "activation energy at T_ref of", "J/mol", 9e5 / LOG_RANGE)
        else:
            first = _Shape("I", -1000 * fall, "slope against 1000/T of", "1000 K", T_ref**2 / (2 * SPAN * 1000.0))
        return _sum(symbol, param, [first, bent])

    return TemperatureForm("modified-arrhenius", build, "Kooij (1893), Z. Phys. Chem. 12, 155", float(T_ref))


def _form(name: str, reference: str, T_ref: float, shapes: Sequence[_Shape]) -> TemperatureForm:
    return TemperatureForm(name, lambda symbol, param: _sum(symbol, param, shapes), reference, float(T_ref))


def _sum(symbol: sympy.Symbol, param: Param, shapes: Sequence[_Shape]) -> tuple[sympy.Expr, dict[sympy.Symbol, Param]]:
    """The parameter with its shapes added on its own scale, and their coefficients."""
    low, high = param.bounds
    own = LOG_RANGE if param.scale == "log" else high - low
    extra: dict[sympy.Symbol, Param] = {}
    total: sympy.Expr = sympy.S.Zero
    for shape in shapes:
        name = f"Q_{symbol.name}" if shape.suffix == "Q" else f"{symbol.name}_{shape.suffix}"
        coefficient, unit = sympy.Symbol(name, real=True), _unit(shape.unit, param)
        bounds = (-shape.reach * own, shape.reach * own)
        extra[coefficient] = Param(f"{shape.meaning} {param.meaning}", bounds=bounds, unit=unit, off=0.0)
        total += coefficient * shape.expression
    return (symbol * sympy.exp(total) if param.scale == "log" else symbol + total), extra


def _unit(unit: str, param: Param) -> str:
    if param.scale == "log" or param.unit == "1":
        return unit
    return param.unit if unit == "1" else f"{param.unit} {unit}"


def _activation(
    symbol: sympy.Symbol, param: Param, T0: tuple[float, float]
) -> tuple[sympy.Symbol, dict[sympy.Symbol, Param]]:
    start = sympy.Symbol(f"{symbol.name}_T0", real=True)
    return start, {start: Param(f"T0 of {param.meaning}", bounds=T0, unit="K")}


def _inverse_rise(T_ref: float) -> sympy.Expr:
    """1/T - 1/T_ref as (T_ref - T)/(T_ref T), which loses no digits near T_ref and is exactly 0 there."""
    return (sympy.Float(T_ref) - temperature) / (sympy.Float(T_ref) * temperature)
