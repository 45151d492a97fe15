"""Kachanov's damage in the form w' = C (driving stress/(1 - w))^v, with Norton's law of the stress that is left."""

import sympy

from creepkit.language import CreepLaw, Param, State, parameters, states, stress

A, n, C, v = parameters("A n C v")
(damage,) = states("damage")


def kachanov(driving: sympy.Expr, limit: float, more: dict[sympy.Symbol, Param] | None = None) -> CreepLaw:
    """The law whose damage a stress drives, up to a limit; more : parameters of that stress."""
    return CreepLaw(
        name="kachanov",
        terms={"creep": A * (stress / (1 - damage)) ** n},
        params={
            A: Param("rate coefficient", unit="1/s", bounds=(1e-40, 1e-5), scale="log"),
            n: Param("stress exponent", bounds=(1, 8)),
            C: Param("damage coefficient", unit="1/s", bounds=(1e-40, 1e-5), scale="log"),
            v: Param("damage exponent", bounds=(1, 8)),
            **(more or {}),
        },
        states={damage: State(0.0, C * (driving / (1 - damage)) ** v, limit=limit)},
        references=("Kachanov (1958), Izv. AN SSSR OTN 8, 26; Rabotnov (1969), Creep Problems in Structural Members",),
    )
