"""Double power law: climb at low stress, glide at high stress, each with an activation energy.

    rate = A_1 s^n_1 exp(-Q_1/(R T)) + A_2 s^n_2 exp(-Q_2/(R T)),    n_2 >= n_1

Q = 0 (off) makes a term the same at all temperatures.
"""

import sympy

from creepkit.language import GAS_CONSTANT, CreepLaw, Param, hookimpl, parameters, stress, temperature

A_1, n_1, Q_1, A_2, n_2, Q_2 = parameters("A_1 n_1 Q_1 A_2 n_2 Q_2")

RATE = Param("rate coefficient", unit="1/s", bounds=(1e-80, 1e40), scale="log", off=0.0, widens=True)
ENERGY = Param("activation energy", unit="J/mol", bounds=(1e4, 9e5), off=0.0)

DOUBLE_POWER = CreepLaw(
    name="double-power",
    title="Double power law, each term with an activation energy",
    terms={
        "low stress": A_1 * stress**n_1 * sympy.exp(-Q_1 / (GAS_CONSTANT * temperature)),
        "high stress": A_2 * stress**n_2 * sympy.exp(-Q_2 / (GAS_CONSTANT * temperature)),
    },
    params={
        A_1: RATE,
        n_1: Param("stress exponent at low stress", bounds=(1, 8)),
        Q_1: ENERGY,
        A_2: RATE,
        n_2: Param("stress exponent at high stress", bounds=(2, 20)),
        Q_2: ENERGY,
    },
    constraints=(n_2 >= n_1,),
    references=(
        "Wiese, Meusel and Wolter (2003), 53rd Electronic Components and Technology Conf., 197",
        "Naumenko, Altenbach and Gorash (2009), Arch. Appl. Mech. 79, 619 (steels: n_1 = 1)",
    ),
)

TYPICAL = {
    **{"A_1": 4e-7, "n_1": 3.0, "Q_1": 3223.0 * GAS_CONSTANT},
    **{"A_2": 1e-12, "n_2": 12.0, "Q_2": 7348.0 * GAS_CONSTANT},
}
"""Solder Sn-Ag-Cu: Wiese et al. (2003), as quoted by Syed (2004), 54th ECTC, 737; Q/R = 3223 and 7348 K."""


@hookimpl
def creepkit_laws() -> list[CreepLaw]:
    return [DOUBLE_POWER]
