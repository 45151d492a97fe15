"""Solder Sn-3.0Ag-0.5Cu: Anand's law, whose deformation resistance s grows towards a saturation that the rate sets.

    rate = A sinh(xi stress/s)^(1/m) exp(-Q/(R T)),   ds/dt = h_0 |1 - s/s*|^a sign(1 - s/s*) rate
    s* = s_hat (rate/A exp(Q/(R T)))^n = s_hat sinh(xi stress/s)^(n/m)

Constant stress and constant strain rate end in the same steady state, where s = s*.
"""

import sympy

from creepkit.hookspecs import hookimpl
from creepkit.language import GAS_CONSTANT, CreepLaw, Param, State, parameters, states, stress, temperature
from creepkit.records import Material

A, Q, xi, m, h_0, s_hat, n, a = parameters("A Q xi m h_0 s_hat n a")
(s,) = states("s")

flow = sympy.sinh(xi * stress / s)
rate = A * flow ** (1 / m) * sympy.exp(-Q / (GAS_CONSTANT * temperature))
below = 1 - s / (s_hat * flow ** (n / m))

ANAND = CreepLaw(
    name="anand",
    title="Anand's viscoplastic law",
    terms={"flow": rate},
    params={
        A: Param("rate coefficient", unit="1/s", bounds=(1e-2, 1e12), scale="log", off=0.0, widens=True),
        Q: Param("activation energy", unit="J/mol", bounds=(2e4, 9e5)),
        xi: Param("multiplier of stress", bounds=(0.1, 20.0)),
        m: Param("strain rate sensitivity", bounds=(0.02, 1.0)),
        h_0: Param("hardening coefficient", unit="MPa", bounds=(1.0, 1e7), scale="log"),
        s_hat: Param("coefficient of the saturated resistance", unit="MPa", bounds=(0.1, 1e3), scale="log"),
        n: Param("rate sensitivity of the saturated resistance", bounds=(0.0, 0.5)),
        a: Param("exponent of hardening", bounds=(1.0, 3.0)),
    },
    states={s: State(21.0, h_0 * (sympy.Max(below, 0) ** a - sympy.Max(-below, 0) ** a) * rate, "resistance", "MPa")},
    references=("Anand (1985)", "Brown, Kim and Anand (1989)"),
)

SAC305 = Material(
    name="sac305",
    title="lead-free solder Sn-3.0Ag-0.5Cu",
    law=ANAND,
    values={
        "A": 3501.0,
        "Q": 9320.0 * GAS_CONSTANT,
        "xi": 4.0,
        "m": 0.25,
        "h_0": 180e3,
        "s_hat": 30.2,
        "n": 0.01,
        "a": 1.78,
    },
    ranges={"stress": (13.0, 42.0), "temperature": (298.15, 398.15)},
    source=(
        "Motalab, Cai, Suhling and Lall (2012), ITherm, 910, doi:10.1109/ITHERM.2012.6231522, and Motalab (2013), "
        "thesis (Auburn University), Table 4.1; read in eda_multiphysics/anand.py of "
        "https://github.com/tengzhang48/CoupFE-EDA and arXiv:2204.05583, Table 2"
    ),
    form="bulk, reflowed, not aged",
)


@hookimpl
def creepkit_materials() -> list[Material]:
    return [SAC305]
