"""Stress-relieved Zircaloy-4 cladding: secondary creep of Limback and Andersson, by heat and by fast neutrons.

    rate = A E/T sinh(a_i stress/E)^n exp(-Q/(R T)) + C flux^0.85 stress,    E = 1.148e5 - 59.9 T MPa
    a_i = 650 (1 - 0.56 (1 - exp(-1.4e-27 fluence^1.3))),    fluence in n/cm^2

Flux and fluence of fast neutrons (E > 1 MeV) are conditions; the transient of primary creep is left out. The source
states per hour, and R = 8.314 J/(mol K).
"""

import sympy

from creepkit.hookspecs import hookimpl
from creepkit.language import GAS_CONSTANT, CreepLaw, Param, conditions, parameters, stress, temperature
from creepkit.records import Material

A, n, Q, C, p = parameters("A n Q C p")
(flux,) = conditions("fast_flux", unit="1e18/(m^2 s)")
(fluence,) = conditions("fast_fluence", unit="1e25/m^2")

HOUR = 3600.0

modulus = 1.148e5 - 59.9 * temperature
hardening = 650 * (1 - 0.56 * (1 - sympy.exp(-1.4e-27 * (1e21 * fluence) ** 1.3)))

LIMBACK = CreepLaw(
    name="limback-andersson",
    title="Limback and Andersson's secondary creep, by heat and irradiation",
    terms={
        "by heat": A
        * modulus
        / temperature
        * sympy.sinh(hardening * stress / modulus) ** n
        * sympy.exp(-Q / (GAS_CONSTANT * temperature)),
        "by irradiation": C * flux**p * stress,
    },
    params={
        A: Param("rate coefficient times K/MPa", unit="1/s", bounds=(1e2, 1e9), scale="log", off=0.0, widens=True),
        n: Param("exponent of sinh", bounds=(1, 5)),
        Q: Param("activation energy", unit="J/mol", bounds=(1e5, 4e5)),
        C: Param(
            "rate coefficient of irradiation", unit="1/s", bounds=(1e-16, 1e-8), scale="log", off=0.0, widens=True
        ),
        p: Param("exponent of the flux", bounds=(0.5, 1.0)),
    },
    constraints=(modulus >= 1e3,),
    references=("Limback and Andersson (1996), ASTM STP 1295, 448",),
)

ZIRCALOY = Material(
    name="zircaloy-4",
    title="Zircaloy-4 cladding",
    law=LIMBACK,
    values={
        "A": 1.08e9 / HOUR,
        "n": 2.0,
        "Q": 201e3 * GAS_CONSTANT / 8.314,
        "C": 3.557e-24 * 1e18**0.85 / HOUR,
        "p": 0.85,
    },
    ranges={"stress": (1.0, 100.0), "temperature": (570.0, 720.0), "fast_flux": (0.0, 4.0), "fast_fluence": (0.0, 5.0)},
    source=(
        "Limback and Andersson (1996), ASTM STP 1295, as its constants of stress-relieved cladding and rates stand in "
        "the rheology tests of the Rust crate outram_park_fork_offbeat (2026), a port of OFFBEAT, "
        "https://github.com/theodoreOnzGit/outram-park-backend, and in zryCreepRate() of "
        "https://github.com/MohamedAbdulHameed/dualmesh"
    ),
    form="tube, cold-worked and stress-relieved",
)


@hookimpl
def creepkit_materials() -> list[Material]:
    return [ZIRCALOY]
