"""The law of Sellars and McTegart, Garofalo's with an activation energy: rate = A sinh(alpha s)^n exp(-Q/(R T)).

A power law of exponent n where alpha s is below 0.8 or so, an exponential of stress above 1.2. A is the coefficient
that papers print, at infinite temperature; `creepkit.law("hyperbolic-sine").times(arrhenius())` is the same law about
a reference temperature, with a coefficient that does not run away with Q.
"""

import sympy

from creepkit.language import GAS_CONSTANT, CreepLaw, Param, hookimpl, parameters, stress, temperature

A, alpha, n, Q = parameters("A alpha n Q")

SELLARS_MCTEGART = CreepLaw(
    name="sellars-mctegart",
    title="Sellars-McTegart: hyperbolic sine with an activation energy",
    terms={"hyperbolic sine": A * sympy.sinh(alpha * stress) ** n * sympy.exp(-Q / (GAS_CONSTANT * temperature))},
    params={
        A: Param("rate coefficient", unit="1/s", bounds=(1e-20, 1e60), scale="log", off=0.0, widens=True),
        alpha: Param("inverse breakdown stress", unit="1/MPa", bounds=(1e-4, 0.5), scale="log"),
        n: Param("exponent of sinh", bounds=(1, 12)),
        Q: Param("activation energy", unit="J/mol", bounds=(1e4, 9e5)),
    },
    references=("Garofalo (1963), Trans. AIME 227, 351", "Sellars and McTegart (1966), Acta Metall. 14, 1136"),
)

TYPICAL = {"A": 277984.0, "alpha": 0.02447, "n": 6.41, "Q": 6500.0 * GAS_CONSTANT}
"""Solder Sn-Ag-Cu: Schubert et al. (2003), 53rd Electronic Components and Technology Conf., 603; Q/R = 6500 K."""


@hookimpl
def creepkit_laws() -> list[CreepLaw]:
    return [SELLARS_MCTEGART]
