"""Hyperbolic-sine law (HS): power law at low stress, exponential breakdown at high stress."""

import sympy

from creepkit.language import CreepLaw, Param, hookimpl, parameters, stress

A, n, B = parameters("A n B")


HYPERBOLIC_SINE = CreepLaw(
    name="hyperbolic-sine",
    title="Hyperbolic-sine law (HS)",
    terms={"hyperbolic sine": A * sympy.sinh(stress / B) ** n},
    params={
        A: Param("rate coefficient", unit="1/s", bounds=(1e-40, 1e-5), scale="log", off=0.0, widens=True),
        n: Param("exponent of sinh", bounds=(1, 8), off=0.0),
        B: Param("breakdown stress", unit="MPa", bounds=(1.0, 1e3), scale="log"),
    },
    references=("Garofalo (1963), Trans. AIME 227, 351",),
)


@hookimpl
def creepkit_laws() -> list[CreepLaw]:
    return [HYPERBOLIC_SINE]
