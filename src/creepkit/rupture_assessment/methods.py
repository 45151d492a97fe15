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

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from creepkit.arrays import Floats
from creepkit.language.symbols import GAS_CONSTANT
from creepkit.records import SECONDS_PER_HOUR
from creepkit.rupture_assessment.observed_tests import TensileStrength

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

    @classmethod
    def isotherm(cls, stress: Floats, temperature: float, tensile: TensileStrength) -> Conditions:
        """At one temperature, K, without rates; stress : (points,) MPa."""
        T = np.full(stress.shape, float(temperature))
        return cls(stress, T, tensile(T), np.full(stress.shape, np.nan))


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


Columns = dict[str, Floats]
"""{constant: (points,) what it is multiplied by}, in the order of the coefficients."""


@dataclass(frozen=True)
class RuptureMethod:
    """A time-temperature method: log10 of the time is a sum of columns times constants, some of which may be fixed.

    equation : of the median rupture time, in words of the list above. columns : (conditions, degree, centre) ->
    Columns. units : of constants by name, for t in h, T in K and x of MPa; "a" of all a_0, a_1 ...; the others have
    none. fixable : constants that may be given in the place of fitted ones. degrees : whether its stress function is a
    polynomial whose degree is chosen. bilinear : whether all but the first two columns grow with the temperature by k.
    literature : (constants, k, centre) -> {name: value} as the literature writes them; by default the constants.
    needs : what of a test it needs beside stress and temperature: "", "tensile_strength" or "rate".
    """

    name: str
    equation: str
    columns: Callable[[Conditions, int, Centre], Columns]
    units: Mapping[str, str] = field(default_factory=dict)
    fixable: tuple[str, ...] = ()
    degrees: bool = True
    bilinear: bool = False
    thermal: bool = True
    needs: str = ""
    literature: Callable[[dict[str, float], float, Centre], dict[str, float]] = lambda constants, *_: constants

    def basis(self, at: Conditions, degree: int, fixed: Mapping[str, float], centre: Centre) -> Basis:
        """Offset and columns at conditions (points,)."""
        columns = self.columns(at, degree, centre)
        offset: Floats = sum((value * columns.pop(name) for name, value in fixed.items()), np.zeros(at.stress.shape))
        linear, bilinear = np.column_stack([*columns.values()]), None
        if self.bilinear:
            bilinear = (at.temperature - centre.temperature)[:, None] * linear
            bilinear[:, :2] = 0.0
        return Basis(offset, linear, bilinear)

    def parameters(
        self, coefficients: Floats, k: float, degree: int, fixed: Mapping[str, float], centre: Centre
    ) -> dict[str, float]:
        """{name: value} of the constants that were fitted, as the literature writes them.

        coefficients : (constants,) in the order of the columns.
        """
        names = [name for name in self.columns(_ANY_CONDITION, degree, centre) if name not in fixed]
        return self.literature(dict(zip(names, map(float, coefficients), strict=True)), k, centre)

    def unit(self, name: str) -> str:
        """Of a constant."""
        return self.units.get("a" if name.startswith("a_") else name, "")


_ANY_CONDITION = Conditions(*(np.full(1, value) for value in (1.0, 1000.0, 2.0, 1e-8)))


def _polynomial(at: Conditions, degree: int, centre: float = 0.0) -> Columns:
    """Powers of log10 of the stress, a_0 and so on."""
    x = np.log10(at.stress) - centre
    return {f"a_{k}": x**k for k in range(degree + 1)}


def _inverse_energy(at: Conditions) -> Floats:
    return np.asarray(1.0 / (THERMAL * at.temperature))


def _larson_miller(at: Conditions, degree: int, _: Centre) -> Columns:
    divided = {name: column / at.temperature for name, column in _polynomial(at, degree).items()}
    return {"C": -np.ones(at.stress.shape), **divided}


def _manson_haferd(at: Conditions, degree: int, centre: Centre) -> Columns:
    polynomial = _polynomial(at, degree, centre.log_stress)
    return {"m_0": polynomial.pop("a_0"), "m_1": at.temperature - centre.temperature, **polynomial}


def _of_manson_haferd(constants: dict[str, float], k: float, centre: Centre) -> dict[str, float]:
    m_0, m_1, *of_stress = constants.values()
    inverse, shifted, power = 1.0 / k if k else np.inf, np.zeros(1 + len(of_stress)), np.ones(1)
    for value in (m_1, *(k * c for c in of_stress)):
        shifted[: power.size] += value * power
        power = np.convolve(power, [-centre.log_stress, 1.0])
    ends = {"log10 t_a": float(m_0 - m_1 * inverse), "T_a": float(centre.temperature - inverse)}
    return {**ends, **{f"a_{n}": float(value) for n, value in enumerate(shifted)}}


def _wilshire(at: Conditions, _degree: int, _: Centre) -> Columns:
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.log(-np.log(at.stress / at.tensile_strength)) / LN10
    return {"1/u": ratio, "log10 k_1 / u": -np.ones(at.stress.shape), "Q": _inverse_energy(at)}


def _of_wilshire(constants: dict[str, float], _k: float, _: Centre) -> dict[str, float]:
    inverse, shift, *energy = constants.values()
    return {"u": 1.0 / inverse, "ln k_1": LN10 * shift / inverse, **dict(zip(["Q"], energy, strict=False))}


ENERGY = {"Q": "J/mol"}

LARSON_MILLER = RuptureMethod(
    "larson-miller", "log10 t = -C + (a_0 + a_1 x + ...) / T", _larson_miller, {"a": "K"}, fixable=("C",)
)

ORR_SHERBY_DORN = RuptureMethod(
    "orr-sherby-dorn",
    "log10 t = Q / (R T ln 10) + a_0 + a_1 x + ...",
    lambda at, degree, _: {"Q": _inverse_energy(at), **_polynomial(at, degree)},
    ENERGY,
    fixable=("Q",),
)

MANSON_HAFERD = RuptureMethod(
    "manson-haferd",
    "log10 t = log10 t_a + (T - T_a) (a_0 + a_1 x + ...)",
    _manson_haferd,
    {"T_a": "K", "a": "1/K"},
    bilinear=True,
    literature=_of_manson_haferd,
)

WILSHIRE = RuptureMethod(
    "wilshire",
    "stress / tensile strength = exp(-k_1 (t exp(-Q / (R T)))^u)",
    _wilshire,
    {**ENERGY, "ln k_1": "k_1 in h^-u"},
    fixable=("Q",),
    degrees=False,
    needs="tensile_strength",
    literature=_of_wilshire,
)

MONKMAN_GRANT = RuptureMethod(
    "monkman-grant",
    "log10 t = c - m log10 of the minimum creep rate in 1/h",
    lambda at, *_: {"c": np.ones(at.rate.shape), "m": -np.log10(at.rate * SECONDS_PER_HOUR)},
    degrees=False,
    thermal=False,
    needs="rate",
)

MINIMUM_RATE = RuptureMethod(
    "minimum-rate",
    "ln of the minimum creep rate in 1/h = a + n ln(stress) - Q / (R T)",
    lambda at, *_: {"a": np.full(at.stress.shape, 1.0 / LN10), "n": np.log10(at.stress), "Q": -_inverse_energy(at)},
    ENERGY,
    degrees=False,
)
"""No method of rupture times: the rate law that predicts minimum rates for Monkman-Grant's."""

ISOTHERMAL = RuptureMethod(
    "isothermal", "log10 t = a_0 + a_1 x + ...", lambda at, degree, _: _polynomial(at, degree), thermal=False
)


METHODS = {
    m.name: m
    for m in (LARSON_MILLER, ORR_SHERBY_DORN, MANSON_HAFERD, WILSHIRE, MONKMAN_GRANT, ISOTHERMAL, MINIMUM_RATE)
}
"""By name; x is log10 of the stress in MPa, t in hours, T in K."""
