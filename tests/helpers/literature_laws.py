"""Laws as others would write them: rate equations of the creep literature and awkward ways to write them."""

from __future__ import annotations

from typing import Any

import sympy
from sympy import Abs, Heaviside, Max, Min, Piecewise, asinh, atan, cosh, erf, exp, log, pi, sinh, sqrt, tanh

from creepkit.language import (
    GAS_CONSTANT,
    CreepLaw,
    Param,
    State,
    activated,
    arrhenius,
    linear,
    parameters,
    principal_stress,
    states,
    strain,
    stress,
    temperature,
    time,
)
from creepkit.laws.combined import COMBINED
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.norton import NORTON
from creepkit.laws.time_hardening import TIME_HARDENING

A, n, m, B, s_0, Q, r, a, b, k = parameters("A n m B s_0 Q r a b k")
(omega,) = states("omega")

RATE = Param("rate coefficient", bounds=(1e-40, 1e-5), unit="1/s", scale="log", off=0.0)
POWER = Param("exponent", bounds=(1, 8))


def number(low: float, high: float) -> Param:
    """A parameter on a linear scale."""
    return Param("number", bounds=(low, high))


def scale(low: float, high: float, off: float | None = None) -> Param:
    """A parameter on a log scale."""
    return Param("scale", bounds=(low, high), unit="1", scale="log", off=off)


def law(terms: Any, params: dict[sympy.Symbol, Param], name: str = "foreign", **more: Any) -> CreepLaw:
    """A law of one term, or of {label: term}, with what every law must have."""
    terms = terms if isinstance(terms, dict) else {"term": terms}
    return CreepLaw(name=name, title="A foreign law", terms=terms, params=params, references=("somebody",), **more)


def damage(rate: Any, growth: Any, params: dict[sympy.Symbol, Param]) -> CreepLaw:
    """A law with a damage variable that fails at 0.99."""
    return law(rate, params, states={omega: State(0, growth, limit=0.99)})


_FRACTURE = 2 * (n + 1) / (pi * sqrt(1 + 3 / n)) * (principal_stress / stress) ** 2 * omega ** sympy.Rational(3, 2)
_MIXED = a * principal_stress + (1 - a) * stress
_WORDS = dict(zip(("lam", "exp_", "x_0", "row", "out"), parameters("lambda exp x0 row out"), strict=True))
_LN_A, _FLAGS, _Y0 = parameters("ln_A flags y0")

EQUATIONS = {
    "threshold": law(A * Max(stress - s_0, 0) ** n, {A: RATE, n: POWER, s_0: number(0, 100)}),
    "threshold by branches": law(
        Piecewise((A * (stress - s_0) ** n, stress > s_0), (0, True)), {A: RATE, n: POWER, s_0: number(0, 100)}
    ),
    "two regimes": law(
        Piecewise((A * stress**n, stress < s_0), (A * s_0**n * (stress / s_0) ** k, True)),
        {A: RATE, n: POWER, k: POWER, s_0: number(10, 100)},
    ),
    "Garofalo": law(
        A * sinh(a * stress) ** n * exp(-Q / (GAS_CONSTANT * temperature)),
        {A: scale(1e-5, 1e20), a: scale(1e-3, 1e-1), n: POWER, Q: number(1e5, 5e5)},
    ),
    "activation volume": law(
        A * exp(-Q / (GAS_CONSTANT * temperature)) * sinh(stress * B / (GAS_CONSTANT * temperature)),
        {A: RATE, B: number(1, 1000), Q: number(1e5, 5e5)},
    ),
    "MPC Omega": law(A * stress**n * exp(m * strain), {A: RATE, n: POWER, m: number(1, 200)}),
    "theta projection": law(
        {"primary": A * r * exp(-r * time), "tertiary": B * k * exp(k * time)},
        {A: scale(1e-5, 1e-1, off=0.0), r: scale(1e-8, 1e-3), B: scale(1e-6, 1e-1, off=0.0), k: scale(1e-8, 1e-5)},
    ),
    "Blackburn": law(
        {"primary": A * r * exp(-r * time) * stress**n, "steady": B * stress**m},
        {A: scale(1e-12, 1e-5, off=0.0), r: scale(1e-8, 1e-3), n: POWER, B: RATE, m: POWER},
    ),
    "saturating": law(A * stress**n * (1 - exp(-r * time)), {A: RATE, r: scale(1e-8, 1e-3), n: POWER}),
    "saturating to a power": law(
        A * stress**n * (1 - exp(-r * time)) ** m, {A: RATE, r: scale(1e-8, 1e-3), n: POWER, m: number(-0.5, 2)}
    ),
    "shared parameters": law(
        {"primary": A * stress**n * strain**m, "steady": A * B * stress**n},
        {A: RATE, n: POWER, m: number(-1, 0), B: scale(1e-3, 1e3, off=0.0)},
    ),
    "one term of two parts": law(A * stress**n + B * stress**m, {A: RATE, n: POWER, B: RATE, m: POWER}),
    "Kachanov-Rabotnov": damage(
        A * (stress / (1 - omega)) ** n,
        B * principal_stress**k / (1 - omega) ** r,
        {A: RATE, n: POWER, B: RATE, k: POWER, r: POWER},
    ),
    "Liu-Murakami": damage(
        A * stress**n * exp(_FRACTURE),
        B * (1 - exp(-r)) / r * _MIXED**k * exp(r * omega),
        {A: RATE, n: POWER, B: RATE, k: POWER, a: number(0, 1), r: number(1, 10)},
    ),
    "logarithmic in time": law(A * stress**n / (1 + B * time), {A: RATE, n: POWER, B: scale(1e-6, 1)}),
    "logarithmic in strain": law(
        A * exp(stress / B) * exp(-strain / k), {A: RATE, B: number(1, 100), k: scale(1e-3, 1)}
    ),
    "shifted time": law(A * stress**n * (B + time) ** m, {A: RATE, n: POWER, B: scale(1, 1e3), m: number(-1, 0)}),
    "exponential less one": law(A * (exp(stress / B) - 1), {A: RATE, B: scale(1, 1000)}),
    "cosh less one": law(A * (cosh(stress / B) - 1), {A: RATE, B: scale(1, 1000)}),
    "tanh": law(A * tanh(stress / B) * stress**n, {A: RATE, B: scale(1, 1000), n: POWER}),
    "asinh": law(A * asinh(stress / B) ** n, {A: RATE, B: number(1, 1000), n: POWER}),
    "erf and atan": law(
        {"one": A * stress**n * erf(time / B), "two": A * stress**n * (1 + atan(time / B))},
        {A: RATE, n: POWER, B: number(1, 1e4)},
    ),
    "step in time": law(A * stress**n * (1 + m * Heaviside(time - 1000)), {A: RATE, n: POWER, m: number(0, 5)}),
    "capped": law(A * Min(Abs(stress), s_0) ** n, {A: RATE, n: POWER, s_0: number(1, 100)}),
    "integer powers": law(A * stress**5 / B**2 / sqrt(strain), {A: RATE, B: number(1, 100)}),
    "square of strain": law(A * pi * stress**n / strain**2, {A: RATE, n: POWER}),
    "base ten": law(A * 10 ** (n * stress / 1000) * log(1 + stress), {A: RATE, n: POWER}),
    "softening where it holds": law(
        A * stress**n * (1 - m * strain), {A: RATE, n: POWER, m: number(0, 5)}, constraints=(1 - m * strain >= 0,)
    ),
    "names of Python": law(
        _WORDS["lam"]
        * stress ** _WORDS["exp_"]
        * exp(-Q / temperature)
        * strain ** _WORDS["x_0"]
        * (1 + _WORDS["row"]),
        {
            _WORDS["lam"]: RATE,
            _WORDS["exp_"]: POWER,
            Q: Param("activation temperature", bounds=(1e3, 1e4), unit="K"),
            _WORDS["x_0"]: number(-1, 0),
            _WORDS["row"]: number(0, 1),
        },
    ),
    "names of kernels": law(
        A * _LN_A * stress**n * (_FLAGS + _Y0 + _WORDS["out"]),
        {A: RATE, _LN_A: number(1, 2), n: POWER, _FLAGS: number(1, 2), _Y0: number(1, 2), _WORDS["out"]: number(1, 2)},
    ),
    "two activated": NORTON.times(arrhenius()) + NORTON.times(arrhenius()),
    "combined with temperature": COMBINED.times(arrhenius()).with_temperature(n_2=linear()),
    "activated breakdown stress": HYPERBOLIC_SINE.times(arrhenius()).with_temperature(B=activated()),
    "exponent of time with temperature": TIME_HARDENING.with_temperature(m=linear(slope=(-1e-5, 1e-5))),
}
"""{name: law}, each fit for every verb."""
