"""Laws that codes have built in, written by catalogue, by sum, by reduction and in other notations."""

from __future__ import annotations

from sympy import exp, sinh, sqrt

from creepkit.language import GAS_CONSTANT, CreepLaw, Elastic, Param, arrhenius, parameters, strain, stress, temperature
from creepkit.laws.combined import COMBINED
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.laws.time_hardening import TIME_HARDENING
from creepkit.records import LawWithValues, Units

STEEL = Elastic(150e3, 0.3)

_A, _n, _B, _Q, _W = parameters("A n B Q W")
_RATE = Param("rate coefficient", (1e-40, 1e20), "1/s", "log")
OTHER_NOTATION = CreepLaw(
    name="activated hardening",
    terms={"written oddly": 2 * _A * (stress / _B) ** 5 / sqrt(strain) * exp(-_Q / (GAS_CONSTANT * temperature))},
    params={
        _A: _RATE,
        _B: Param("scale of stress", (1, 1e3), "MPa", "log"),
        _Q: Param("activation energy", (1e5, 6e5), "J/mol"),
    },
)
EXPONENTIAL = CreepLaw(
    name="exponential",
    terms={"exponential": _A * exp(stress / _B)},
    params={_A: _RATE, _B: Param("scale of stress", (1, 1e3), "MPa", "log")},
)
GAROFALO = CreepLaw(
    name="garofalo-far",
    terms={"sine": _A * sinh(_W * stress) ** _n * exp(-_Q / (GAS_CONSTANT * temperature))},
    params={
        _A: _RATE,
        _W: Param("inverse stress", (1e-3, 1e-1), "1/MPa", "log"),
        _n: Param("exponent", (1, 8)),
        _Q: Param("activation energy", (1e5, 6e5), "J/mol"),
    },
)


def valued(law: CreepLaw, units: Units | None = None, elastic: Elastic | None = None, **values: float) -> LawWithValues:
    """A law with values, and with intervals as an identification leaves them."""
    notes = ("n = 5.2 [5.1, 5.3]", "valid from 973 to 1123 K")
    return LawWithValues(law, values, notes, units or Units(), elastic)


ARRHENIUS = arrhenius(1073.15)
CASES: dict[str, LawWithValues] = {
    "norton": valued(NORTON, elastic=STEEL, A=1.2e-16, n=5.2),
    "norton with temperature": valued(NORTON.times(ARRHENIUS), elastic=STEEL, A=1.2e-16, n=5.2, Q=4e5),
    "strain hardening": valued(STRAIN_HARDENING, A=3e-12, n=4.0, m=-0.5),
    "strain hardening, small": valued(STRAIN_HARDENING, A=3e-27, n=4.0, m=-0.25),
    "strain hardening with temperature": valued(STRAIN_HARDENING.times(ARRHENIUS), A=3e-14, n=4.0, m=-0.5, Q=3e5),
    "time hardening": valued(TIME_HARDENING, A=3e-13, n=4.5, m=-0.6),
    "time hardening, small": valued(TIME_HARDENING, A=3e-30, n=7.5, m=-0.6),
    "time hardening with temperature": valued(TIME_HARDENING.times(ARRHENIUS), A=3e-13, n=4.5, m=-0.6, Q=3e5),
    "time hardening with temperature, small": valued(TIME_HARDENING.times(ARRHENIUS), A=3e-30, n=7.5, m=-0.8, Q=3e5),
    "sine": valued(HYPERBOLIC_SINE, A=3e-10, n=3.2, B=40.0),
    "sine with temperature": valued(HYPERBOLIC_SINE.times(ARRHENIUS), A=3e-10, n=3.2, B=40.0, Q=4.2e5),
    "garofalo": valued(GAROFALO, A=2e9, n=4.1, W=0.021, Q=3.9e5),
    "exponential": valued(EXPONENTIAL, A=2e-9, B=17.0),
    "two power laws": valued(NORTON + NORTON, elastic=STEEL, A_1=1e-12, n_1=3.0, A_2=1e-18, n_2=6.5),
    "two power laws with temperature": valued(
        (NORTON + NORTON).times(ARRHENIUS), elastic=STEEL, A_1=1e-12, n_1=3, A_2=1e-18, n_2=6, Q=3e5
    ),
    "primary and steady": valued(NORTON + TIME_HARDENING, A_1=1e-16, n_1=5.0, A_2=1e-12, n_2=4.0, m=-0.7),
    "primary and steady with temperature": valued(
        NORTON.times(ARRHENIUS) + TIME_HARDENING.times(ARRHENIUS),
        **dict(A_1=1e-16, n_1=5.0, Q_1=4e5, A_2=1e-12, n_2=4.0, m=-0.7, Q_2=3e5),
    ),
    "graham": valued(
        NORTON + TIME_HARDENING + TIME_HARDENING,
        **dict(A_1=1e-14, n_1=4.0, A_2=1e-12, n_2=4.0, m_1=-0.7, A_3=1e-13, n_3=4.0, m_2=-0.3),
    ),
    "other notation": valued(OTHER_NOTATION, A=2e9, B=30.0, Q=4e5),
    "combined, all but one off": valued(
        COMBINED, A_1=0.0, n_1=3, B=30, A_2=2e-13, n_2=4.4, m_1=-0.3, A_3=0.0, n_3=2, m_2=-0.5
    ),
    "strain hardening without hardening": valued(STRAIN_HARDENING, A=1e-14, n=4.0, m=0.0),
}
"""{name: law with values}; each has a form in at least one code."""

_STEADY = {"norton", "norton with temperature", "strain hardening without hardening"}
_TWO = {"two power laws", "two power laws with temperature"}
_STRAIN = {"strain hardening", "strain hardening, small", "strain hardening with temperature"}
_TIME = {name for name in CASES if name.startswith("time hardening")}
_OTHER = {"other notation", "combined, all but one off"}
HAS = {
    "abaqus-cards": _STEADY | _TWO | _STRAIN | _TIME | _OTHER | {"sine", "sine with temperature", "garofalo"},
    "ansys": {*CASES},
    "moose": _STEADY | _TWO | _TIME | {"primary and steady", "primary and steady with temperature", "graham"},
    "code_aster": _STEADY | _STRAIN | _OTHER,
    "neml2": _STEADY | _TWO,
}
"""{exporter: the cases that its code has}, told from the codes' manuals."""
