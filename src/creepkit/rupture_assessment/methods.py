"""Time-temperature methods: log10 of the rupture time in hours as a linear combination of functions of the condition.

With x = log10 of the stress in MPa, T in K, R the gas constant and t in hours, the median rupture time is

    Larson-Miller     log10 t = -C + (a_0 + a_1 x + ...) / T
    Orr-Sherby-Dorn   log10 t = Q / (R T ln 10) + a_0 + a_1 x + ...
    Manson-Haferd     log10 t = log10 t_a + (T - T_a) (a_0 + a_1 x + ...)
    Wilshire          s / s_TS = exp(-k_1 (t exp(-Q / (R T)))^u)
    Monkman-Grant     log10 t = c - m log10 of the minimum creep rate in 1/h
    isothermal        log10 t = a_0 + a_1 x + ..., which the first three are at one temperature

Sources, in their order: Larson, Miller (1952), Trans. ASME 74, 765; Orr, Sherby, Dorn (1954), Trans. ASM 46, 113;
Manson, Haferd (1953), NACA TN 2890; Wilshire, Battenbough (2007), Mater. Sci. Eng. A 443, 156; Monkman, Grant (1956),
Proc. ASTM 56, 593.

All are linear in their coefficients but Manson-Haferd's, which is bilinear: with T_0 the mean temperature, x_0 the mean
x, g the polynomial and k = 1 / (T_0 - T_a), log10 t = m_0 + m_1 (T - T_0) + (1 + k (T - T_0)) h(x - x_0), h(0) = 0. In
this form parallel isotherms (k = 0) are a point like any other.

Wilshire's k_1 and u are the same at all stresses here. The literature fits one pair above and another below the yield
stress, or some share of the tensile strength (Gray, Whittaker (2015), Mater. Sci. Eng. A 632, 96), which takes more
tests and the yield stress at each temperature.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.language.symbols import GAS_CONSTANT
from creepkit.records import SECONDS_PER_HOUR

LN10 = float(np.log(10.0))

THERMAL = LN10 * GAS_CONSTANT
"""J/(mol K): log10 of a Boltzmann factor is an energy over this and the temperature."""


@dataclass(frozen=True, eq=False)
class Conditions:
    """Where rupture times are predicted; arrays of one shape.

    stress : (points,) MPa. temperature : (points,) K. tensile_strength : (points,) MPa. rate : (points,) 1/s, minimum.
    """

    stress: Floats
    temperature: Floats
    tensile_strength: Floats
    rate: Floats


@dataclass(frozen=True)
class Centre:
    """Means about which Manson-Haferd's method is written: temperature in K, log10 of the stress in MPa."""

    temperature: float
    log_stress: float


@dataclass(frozen=True, eq=False)
class Basis:
    """log10 t = offset + (linear + k bilinear) coefficients.

    offset : (points,). linear, bilinear : (points, coefficients).
    """

    offset: Floats
    linear: Floats
    bilinear: Floats | None = None


@dataclass(frozen=True)
class RuptureMethod:
    """A time-temperature method.

    equation : of the median rupture time, in words of the list above. fixable : constants that may be given in the
    place of fitted ones. degrees : whether its stress function is a polynomial whose degree is chosen.
    basis : (conditions, degree, fixed, centre) -> Basis.
    parameters : (coefficients, k, degree, fixed, centre) -> {name: value}, as the literature writes them.
    needs : what of a test it needs beside stress and temperature: "", "tensile_strength" or "rate".
    units : of constants by name, for t in h, T in K and x of MPa; "a" of all a_0, a_1 ...; the others have none.
    """

    name: str
    equation: str
    basis: Callable[[Conditions, int, Mapping[str, float], Centre], Basis]
    parameters: Callable[[Floats, float, int, Mapping[str, float], Centre], dict[str, float]]
    units: Mapping[str, str]
    fixable: tuple[str, ...] = ()
    degrees: bool = True
    bilinear: bool = False
    thermal: bool = True
    needs: str = ""

    def unit(self, name: str) -> str:
        """Of a constant."""
        return self.units.get("a" if name.startswith("a_") else name, "")


def _powers(x: Floats, degree: int) -> Floats:
    """(points, degree + 1)."""
    return np.asarray(x)[..., None] ** np.arange(degree + 1)


def _coefficient_names(values: Floats, *_: Any) -> dict[str, float]:
    return {f"a_{k}": float(v) for k, v in enumerate(values)}


def _constant_first(name: str) -> Callable[..., dict[str, float]]:
    """The parameters of a polynomial that stands after one constant, which may be fixed."""

    def parameters(c: Floats, _k: float, _degree: int, fixed: Mapping[str, float], _: Centre) -> dict[str, float]:
        return _coefficient_names(c) if name in fixed else {name: float(c[0]), **_coefficient_names(c[1:])}

    return parameters


def _with_constant(value: float | None, column: Floats, before: Sequence[Floats], after: Sequence[Floats]) -> Basis:
    """Columns before and after that of a constant, which is estimated where no value is given."""
    if value is not None:
        return Basis(value * column, np.column_stack([*before, *after]))
    return Basis(np.zeros(column.shape), np.column_stack([*before, column, *after]))


def _larson_miller(at: Conditions, degree: int, fixed: Mapping[str, float], _: Centre) -> Basis:
    columns = _powers(np.log10(at.stress), degree) / at.temperature[:, None]
    return _with_constant(fixed.get("C"), -np.ones(at.stress.shape), (), (columns,))


def _orr_sherby_dorn(at: Conditions, degree: int, fixed: Mapping[str, float], _: Centre) -> Basis:
    inverse = 1.0 / (THERMAL * at.temperature)
    return _with_constant(fixed.get("Q"), inverse, (), (_powers(np.log10(at.stress), degree),))


def _manson_haferd(at: Conditions, degree: int, _: Mapping[str, float], centre: Centre) -> Basis:
    shape = _powers(np.log10(at.stress) - centre.log_stress, degree)[:, 1:]
    warmer = at.temperature - centre.temperature
    linear = np.column_stack([np.ones(at.stress.shape), warmer, shape])
    bilinear = np.column_stack([np.zeros((at.stress.size, 2)), warmer[:, None] * shape])
    return Basis(np.zeros(at.stress.shape), linear, bilinear)


def _manson_haferd_parameters(
    c: Floats, k: float, _degree: int, _: Mapping[str, float], centre: Centre
) -> dict[str, float]:
    inverse = 1.0 / k if k else np.inf
    about_centre = np.array([c[1], *(k * c[2:])])
    shifted = np.zeros(about_centre.size)
    power = np.ones(1)
    for value in about_centre:
        shifted[: power.size] += value * power
        power = np.convolve(power, [-centre.log_stress, 1.0])
    ends = {"log10 t_a": float(c[0] - c[1] * inverse), "T_a": float(centre.temperature - inverse)}
    return {**ends, **_coefficient_names(shifted)}


def _wilshire(at: Conditions, _degree: int, fixed: Mapping[str, float], _: Centre) -> Basis:
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.log(-np.log(at.stress / at.tensile_strength)) / LN10
    inverse = 1.0 / (THERMAL * at.temperature)
    return _with_constant(fixed.get("Q"), inverse, (ratio, -np.ones(at.stress.shape)), ())


def _wilshire_parameters(c: Floats, _k: float, _degree: int, fixed: Mapping[str, float], _: Centre) -> dict[str, float]:
    values = {"u": 1.0 / float(c[0]), "ln k_1": float(LN10 * c[1] / c[0])}
    return values if "Q" in fixed else {**values, "Q": float(c[2])}


def _monkman_grant(at: Conditions, _degree: int, _fixed: Mapping[str, float], _: Centre) -> Basis:
    log_rate = np.log10(at.rate * SECONDS_PER_HOUR)
    return Basis(np.zeros(at.rate.shape), np.column_stack([np.ones(at.rate.shape), -log_rate]))


def _monkman_grant_parameters(
    c: Floats, _k: float, _degree: int, _fixed: Mapping[str, float], _: Centre
) -> dict[str, float]:
    return {"c": float(c[0]), "m": float(c[1])}


def _minimum_rate(at: Conditions, _degree: int, fixed: Mapping[str, float], _: Centre) -> Basis:
    columns = np.column_stack([np.full(at.stress.shape, 1.0 / LN10), np.log10(at.stress)])
    if "Q" in fixed:
        return Basis(-fixed["Q"] / (THERMAL * at.temperature), columns)
    return Basis(np.zeros(at.stress.shape), np.column_stack([columns, -1.0 / (THERMAL * at.temperature)]))


def _minimum_rate_parameters(
    c: Floats, _k: float, _degree: int, fixed: Mapping[str, float], _: Centre
) -> dict[str, float]:
    values = {"a": float(c[0]), "n": float(c[1])}
    return values if "Q" in fixed else {**values, "Q": float(c[2])}


def _isothermal(at: Conditions, degree: int, _fixed: Mapping[str, float], _: Centre) -> Basis:
    return Basis(np.zeros(at.stress.shape), _powers(np.log10(at.stress), degree))


ENERGY = {"Q": "J/mol"}

LARSON_MILLER = RuptureMethod(
    "larson-miller",
    "log10 t = -C + (a_0 + a_1 x + ...) / T",
    _larson_miller,
    _constant_first("C"),
    {"a": "K"},
    fixable=("C",),
)
ORR_SHERBY_DORN = RuptureMethod(
    "orr-sherby-dorn",
    "log10 t = Q / (R T ln 10) + a_0 + a_1 x + ...",
    _orr_sherby_dorn,
    _constant_first("Q"),
    ENERGY,
    fixable=("Q",),
)
MANSON_HAFERD = RuptureMethod(
    "manson-haferd",
    "log10 t = log10 t_a + (T - T_a) (a_0 + a_1 x + ...)",
    _manson_haferd,
    _manson_haferd_parameters,
    {"T_a": "K", "a": "1/K"},
    bilinear=True,
)
WILSHIRE = RuptureMethod(
    "wilshire",
    "stress / tensile strength = exp(-k_1 (t exp(-Q / (R T)))^u)",
    _wilshire,
    _wilshire_parameters,
    {**ENERGY, "ln k_1": "k_1 in h^-u"},
    fixable=("Q",),
    degrees=False,
    needs="tensile_strength",
)
MONKMAN_GRANT = RuptureMethod(
    "monkman-grant",
    "log10 t = c - m log10 of the minimum creep rate in 1/h",
    _monkman_grant,
    _monkman_grant_parameters,
    {},
    degrees=False,
    thermal=False,
    needs="rate",
)
MINIMUM_RATE = RuptureMethod(
    "minimum-rate",
    "ln of the minimum creep rate in 1/h = a + n ln(stress) - Q / (R T)",
    _minimum_rate,
    _minimum_rate_parameters,
    ENERGY,
    degrees=False,
)
"""No method of rupture times: the rate law that predicts minimum rates for Monkman-Grant's."""
ISOTHERMAL = RuptureMethod(
    "isothermal", "log10 t = a_0 + a_1 x + ...", _isothermal, _coefficient_names, {}, thermal=False
)

METHODS = {
    m.name: m
    for m in (LARSON_MILLER, ORR_SHERBY_DORN, MANSON_HAFERD, WILSHIRE, MONKMAN_GRANT, ISOTHERMAL, MINIMUM_RATE)
}
"""By name; x is log10 of the stress in MPa, t in hours, T in K."""
