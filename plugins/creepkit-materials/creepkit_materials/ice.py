"""Polycrystalline ice: Glen's law with the temperatures of Cuffey and Paterson, of Paterson and Budd, and of Hooke.

The sources state A of D = A tau^2 s, tau the second invariant of the deviator s. In simple tension tau = stress/3^0.5
and s = 2 stress/3, so that the rate is 2/9 A stress^3. Temperatures are corrected for melting under pressure.
"""

import sympy

from creepkit.hookspecs import hookimpl
from creepkit.language import GAS_CONSTANT, CreepLaw, Param, parameters, stress, temperature
from creepkit.records import Material

A, n, Q_cold, Q_warm = parameters("A n Q_cold Q_warm")

T_REF = 263.15
"""K, -10 C, where the activation energy changes."""

beyond = (1 / temperature - 1 / sympy.Float(T_REF)) / GAS_CONSTANT

GLEN = CreepLaw(
    name="glen",
    title="Glen's flow law with an activation energy on each side of -10 C",
    terms={
        "dislocation creep": A * stress**n * sympy.exp(-Q_cold * sympy.Max(beyond, 0) - Q_warm * sympy.Min(beyond, 0))
    },
    params={
        A: Param("rate coefficient at -10 C", unit="1/s", bounds=(1e-12, 1e-3), scale="log", off=0.0, widens=True),
        n: Param("stress exponent", bounds=(1, 5)),
        Q_cold: Param("activation energy below -10 C", unit="J/mol", bounds=(2e4, 3e5)),
        Q_warm: Param("activation energy above -10 C", unit="J/mol", bounds=(2e4, 3e5)),
    },
    references=("Glen (1955), Proc. R. Soc. London A 228, 519",),
)

A_cold, A_warm, T_r, C, k, Q = parameters("A_cold A_warm T_r C k Q")


def coefficient(meaning: str) -> Param:
    """A rate coefficient that stands before exp(-Q/(R T))."""
    return Param(meaning, unit="1/s", bounds=(1e-3, 1e30), scale="log", off=0.0, widens=True)


# PISM takes the warm line above -10 C, where the two lines cross; between -10.7 C and there it takes the lower one.
PATERSON_BUDD = CreepLaw(
    name="paterson-budd",
    title="Glen's flow law by Paterson and Budd: the faster of a cold and a warm Arrhenius line",
    terms={
        "dislocation creep": stress**n
        * sympy.Max(
            A_cold * sympy.exp(-Q_cold / (GAS_CONSTANT * temperature)),
            A_warm * sympy.exp(-Q_warm / (GAS_CONSTANT * temperature)),
        )
    },
    params={
        A_cold: coefficient("rate coefficient of the cold line"),
        A_warm: coefficient("rate coefficient of the warm line"),
        n: GLEN.params[n],
        Q_cold: GLEN.params[Q_cold],
        Q_warm: GLEN.params[Q_warm],
    },
    references=("Paterson and Budd (1982), Cold Reg. Sci. Technol. 6, 175",),
)

HOOKE = CreepLaw(
    name="hooke",
    title="Glen's flow law by Hooke: it softens towards the melting point",
    terms={
        "dislocation creep": A
        * stress**n
        * sympy.exp(-Q / (GAS_CONSTANT * temperature) + n * C / (T_r - temperature) ** k)
    },
    params={
        A: coefficient("rate coefficient"),
        n: GLEN.params[n],
        Q: Param("activation energy", unit="J/mol", bounds=(2e4, 3e5)),
        C: Param("softening", unit="K^k", bounds=(0.0, 2.0), off=0.0),
        T_r: Param("temperature at which it would be infinitely soft", unit="K", bounds=(273.2, 275.0)),
        k: Param("exponent of softening", bounds=(0.5, 3.0)),
    },
    constraints=(T_r - temperature >= 0.1,),
    references=("Hooke (1981), Rev. Geophys. Space Phys. 19, 664",),
)

PASCAL = 1e-6
"""MPa."""

IN_TENSION = 2.0 / 9.0 / PASCAL**3

ICE = Material(
    name="ice",
    title="polycrystalline ice of glaciers",
    law=GLEN,
    values={"A": IN_TENSION * 3.5e-25, "n": 3.0, "Q_cold": 60e3, "Q_warm": 115e3},
    ranges={"temperature": (223.15, 273.15)},
    source=(
        "Cuffey and Paterson (2010), The Physics of Glaciers, 4th edition, p. 72 and Table 3.4; the equation as in "
        "lib/flowparameterlib.py of https://github.com/kehrl/big3, the table as in src/helpers/parameters.jl of "
        "https://github.com/ODINN-SciML/ODINN.jl"
    ),
)

PISM = "src/pism_config.cdl and test/miscellaneous.py (FlowLaw) of https://github.com/pism/pism, commit 6314953 (2026)"

ICE_PATERSON_BUDD = Material(
    name="ice-paterson-budd",
    title="polycrystalline ice of ice sheets",
    law=PATERSON_BUDD,
    values={"A_cold": IN_TENSION * 3.61e-13, "A_warm": IN_TENSION * 1.73e3, "n": 3.0, "Q_cold": 60e3, "Q_warm": 139e3},
    ranges={"stress": (0.017, 0.26), "temperature": (243.15, 273.15)},
    source=f"Paterson and Budd (1982), flow law 'pb' in {PISM}",
)

ICE_HOOKE = Material(
    name="ice-hooke",
    title="polycrystalline ice, softening near the melting point",
    law=HOOKE,
    values={"A": IN_TENSION * 4.42165e-9, "n": 3.0, "Q": 78.8e3, "C": 0.16612, "T_r": 273.39, "k": 1.17},
    ranges={"stress": (0.017, 0.26), "temperature": (243.15, 273.15)},
    source=f"Hooke (1981), flow law 'hooke' in {PISM}",
)


@hookimpl
def creepkit_materials() -> list[Material]:
    return [ICE, ICE_PATERSON_BUDD, ICE_HOOKE]
