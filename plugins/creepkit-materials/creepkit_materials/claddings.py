"""Claddings and coatings of nuclear fuel, which creep by heat and by fast neutrons (E > 1 MeV but where stated).

Stress-relieved Zircaloy-4 by Limback and Andersson, secondary creep alone:

    rate = A E/T sinh(a_i stress/E)^n exp(-Q/(R T)) + C flux^0.85 stress,    E = 1.148e5 - 59.9 T MPa
    a_i = 650 (1 - 0.56 (1 - exp(-1.4e-27 fluence^1.3))),    fluence in n/cm^2

Flux and fluence are conditions. That source states per hour, and R = 8.314 J/(mol K).
"""

import sympy

from creepkit.hookspecs import hookimpl
from creepkit.language import GAS_CONSTANT, CreepLaw, Param, conditions, parameters, stress, temperature
from creepkit.records import Material
from creepkit_materials.forms import at_reference, norton_arrhenius

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
    references=("Limback and Andersson (1996), ASTM STP 1295",),
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

B, K_0, K_1, K_2 = parameters("B K_0 K_1 K_2")

IRRADIATION = CreepLaw(
    name="irradiation-creep",
    title="creep in proportion to stress and flux",
    terms={"by irradiation": B * flux * stress},
    params={B: Param("compliance", unit="1/s", bounds=(1e-20, 1e-6), scale="log", off=0.0, widens=True)},
    references=("Terrani, Karlsen and Yamamoto (2016), ORNL/TM-2016/191, Sect. 4.2",),
)

T_REF = 1000.0
"""K."""

FECRAL = Material(
    name="fecral",
    title="wrought iron-chromium-aluminium cladding",
    law=norton_arrhenius(T_REF) + IRRADIATION,
    values={"A": at_reference(0.83, 326e3, T_REF), "n": 7.1, "Q": 326e3, "B": 5e-6 * 0.9e-25 * 1e18},
    ranges={"stress": (1.0, 150.0), "temperature": (623.15, 1473.15), "fast_flux": (0.0, 1.0)},
    source=(
        "Field, Snead, Yamamoto and Terrani (2018), ORNL/SPR-2018/905, Eq. (3.9) and Table 4, by heat; Terrani, "
        "Karlsen and Yamamoto (2016), ORNL/TM-2016/191, Sect. 4.2, for the 0.9 dpa in 1e25 n/m^2 of IAEA-TECDOC-1921 "
        "(2020), Eq. (5); read in python/dualmesh/fuel/atf.py of https://github.com/MohamedAbdulHameed/dualmesh"
    ),
    form="all alloys of the handbook; APMT creeps 30 to 280 times slower by heat",
)

celsius = temperature - 273.15

PYROCARBON_CREEP = CreepLaw(
    name="pyrocarbon-creep",
    title="creep in proportion to stress and flux, with a parabola of temperature",
    terms={"by irradiation": (K_0 + K_1 * celsius + K_2 * celsius**2) * 1e-7 * flux * stress},
    params={
        K_0: Param("compliance for 1e25 n/m^2 at 0 C", unit="1", bounds=(1e-5, 1e-2)),
        K_1: Param("slope of the compliance", unit="1/K", bounds=(-1e-5, 1e-5)),
        K_2: Param("curvature of the compliance", unit="1/K^2", bounds=(0.0, 1e-8)),
    },
    references=("IAEA-TECDOC-1674 (2012), chapter 9",),
)

PYROCARBON = Material(
    name="pyrocarbon",
    title="dense pyrocarbon of coated particles",
    law=PYROCARBON_CREEP,
    values={"K_0": 4.386e-4, "K_1": -9.70e-7, "K_2": 8.0294e-10},
    ranges={"temperature": (873.15, 1273.15), "fast_flux": (0.0, 1.0)},
    source=(
        "IAEA-TECDOC-1674 (2012), benchmark CRP-6, correlation (d) of Table 9.8, neutrons above 0.18 MeV; read in "
        "docs/theory/triso.rst of https://github.com/MohamedAbdulHameed/dualmesh"
    ),
)


@hookimpl
def creepkit_materials() -> list[Material]:
    return [ZIRCALOY, FECRAL, PYROCARBON]
