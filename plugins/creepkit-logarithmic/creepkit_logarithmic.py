"""Logarithmic creep: each increment of strain makes the next one exponentially harder."""

import sympy

from creepkit.language import CreepLaw, Param, hookimpl, parameters, strain, stress

A, n, e_0 = parameters("A n e_0")

LOGARITHMIC = CreepLaw(
    name="logarithmic",
    title="Logarithmic creep in its strain-hardening form",
    terms={"exhaustion": A * stress**n * sympy.exp(-strain / e_0)},
    params={
        A: Param("rate coefficient", unit="1/s", bounds=(1e-40, 1e-5), scale="log", off=0.0, widens=True),
        n: Param("stress exponent", bounds=(1, 8), widens=True),
        e_0: Param("strain that divides the rate by e", unit="1", bounds=(1e-5, 1.0), scale="log"),
    },
    references=("Wyatt (1953), Proc. Phys. Soc. B 66, 459",),
)


@hookimpl
def creepkit_laws() -> list[CreepLaw]:
    return [LOGARITHMIC]
