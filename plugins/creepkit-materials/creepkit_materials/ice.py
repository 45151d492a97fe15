"""Polycrystalline ice: Glen's law with the two activation energies of Cuffey and Paterson.

The source states A of D = A tau^2 s, tau the second invariant of the deviator s. In simple tension tau = stress/3^0.5
and s = 2 stress/3, so that the rate is 2/9 A stress^3. Its temperature is that below the melting point at the pressure.
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

PASCAL = 1e-6
"""MPa."""

ICE = Material(
    name="ice",
    title="polycrystalline ice of glaciers",
    law=GLEN,
    values={"A": 2.0 / 9.0 * 3.5e-25 / PASCAL**3, "n": 3.0, "Q_cold": 60e3, "Q_warm": 115e3},
    ranges={"temperature": (223.15, 273.15)},
    source=(
        "Cuffey and Paterson (2010), The Physics of Glaciers, 4th edition, p. 72 and Table 3.4; the equation as in "
        "lib/flowparameterlib.py of https://github.com/kehrl/big3, the table as in src/helpers/parameters.jl of "
        "https://github.com/ODINN-SciML/ODINN.jl"
    ),
)


@hookimpl
def creepkit_materials() -> list[Material]:
    return [ICE]
