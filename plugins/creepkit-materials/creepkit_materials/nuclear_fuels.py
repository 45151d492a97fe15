"""Nuclear fuels: uranium dioxide by MATPRO, uranium nitride by Hayes, Coble creep and Konovalov.

Fission rates, densities and sizes of grains are conditions. Above a stress that the grains set, diffusion in UO2 takes
no more of it. Times are in s, or in h where the source has them so; 1 cal is 4.184 J.
"""

import sympy

from creepkit.hookspecs import hookimpl
from creepkit.language import GAS_CONSTANT, CreepLaw, Param, conditions, parameters, stress, temperature
from creepkit.records import Material

(grain_size,) = conditions("grain_size", unit="um")
(density,) = conditions("density", unit="%")
(fissions,) = conditions("fission_rate", unit="1e19/(m^3 s)")

MEGAPASCAL, CALORIE, HOUR = 1e6, 4.184, 3600.0
"""Pa, J and s."""

A_1, A_2, A_4, A_7, n, Q_1, Q_2, Q_3 = parameters("A_1 A_2 A_4 A_7 n Q_1 Q_2 Q_3")


def activated(Q: sympy.Symbol) -> sympy.Expr:
    """exp(-Q/(R T))."""
    return sympy.exp(-Q / (GAS_CONSTANT * temperature))


transition = sympy.Min(stress, 16.547 / grain_size**0.5714)

FCREEP = CreepLaw(
    name="matpro-fcreep",
    title="MATPRO's creep of oxide fuel: diffusion, dislocations and fission",
    terms={
        "diffusion": (A_1 + A_2 * fissions) * transition * activated(Q_1) / ((density - 87.7) * grain_size**2),
        "dislocations": A_4 * stress**n * activated(Q_2) / (density - 90.5),
        "fission": A_7 * fissions * stress * activated(Q_3),
    },
    params={
        A_1: Param("rate coefficient of diffusion", unit="1/s", bounds=(1e2, 1e9), scale="log", off=0.0, widens=True),
        A_2: Param("share of fission in it", unit="1/s", bounds=(1e2, 1e9), scale="log", off=0.0, widens=True),
        A_4: Param("rate coefficient of dislocations", unit="1/s", bounds=(1e-2, 1e7), scale="log", widens=True),
        A_7: Param("rate coefficient of fission", unit="1/s", bounds=(1e-15, 1e-3), scale="log", off=0.0, widens=True),
        n: Param("stress exponent", bounds=(1, 8)),
        Q_1: Param("activation energy of diffusion", unit="J/mol", bounds=(1e5, 8e5)),
        Q_2: Param("activation energy of dislocations", unit="J/mol", bounds=(1e5, 8e5)),
        Q_3: Param("activation energy of fission", unit="J/mol", bounds=(1e3, 2e5)),
    },
    constraints=(density >= 91,),
    references=("MATPRO, NUREG/CR-6150 Vol. 4 (1995), Eqs. (2-60) to (2-69)",),
)

DUALMESH = "read in docs/theory/correlations.rst of https://github.com/MohamedAbdulHameed/dualmesh"

STOICHIOMETRIC = 1.0 / (1.0 + float(sympy.exp(-8)))
"""The function of O/M in the activation energies, at O/M = 2."""

UO2 = Material(
    name="uo2",
    title="stoichiometric uranium dioxide",
    law=FCREEP,
    values={
        "A_1": 0.3919 * MEGAPASCAL,
        "A_2": 1.31e-19 * 1e19 * MEGAPASCAL,
        "A_4": 2.0391e-25 * MEGAPASCAL**4.5,
        "A_7": 3.72264e-35 * 1e19 * MEGAPASCAL,
        "n": 4.5,
        "Q_1": (17884.8 * STOICHIOMETRIC + 72124.23) * CALORIE,
        "Q_2": (19872.0 * STOICHIOMETRIC + 111543.5) * CALORIE,
        "Q_3": 2616.8 * GAS_CONSTANT,
    },
    ranges={
        "stress": (20.0, 60.0),
        "temperature": (1500.0, 1800.0),
        "grain_size": (10.0, 10.0),
        "density": (95.0, 95.0),
        "fission_rate": (1.0, 1.0),
    },
    source=f"MATPRO, NUREG/CR-6150 Vol. 4 (1995), Eqs. (2-60) to (2-63) and (2-69); {DUALMESH}, with two rates",
    form="sintered",
)

A_d, A_c, A_i, m, Q_d, Q_c = parameters("A_d A_c A_i m Q_d Q_c")

NITRIDE = CreepLaw(
    name="uranium-nitride",
    title="creep of nitride fuel by dislocations, along grain boundaries and by fission",
    terms={
        "dislocations": A_d * stress**m * activated(Q_d),
        "grain boundaries": A_c * stress / (temperature * grain_size**3) * activated(Q_c),
        "fission": A_i * stress * fissions * sympy.exp((100 - density) / 5),
    },
    params={
        A_d: Param("rate coefficient of dislocations", unit="1/s", bounds=(1e-8, 1e2), scale="log", widens=True),
        A_c: Param("rate coefficient of grain boundaries", unit="1/s", bounds=(1.0, 1e10), scale="log", widens=True),
        A_i: Param("rate coefficient of fission", unit="1/s", bounds=(1e-18, 1e-8), scale="log", off=0.0, widens=True),
        m: Param("stress exponent", bounds=(1, 8)),
        Q_d: Param("activation energy of dislocations", unit="J/mol", bounds=(1e5, 8e5)),
        Q_c: Param("activation energy of grain boundaries", unit="J/mol", bounds=(5e4, 8e5)),
    },
    references=("Hayes, Thomas and Peddicord (1990), J. Nucl. Mater. 171, part II",),
)

EV = 8.617333262e-5
"""Boltzmann's constant, eV/K."""

UN = Material(
    name="un",
    title="uranium nitride",
    law=NITRIDE,
    values={
        "A_d": 2.054e-3,
        "A_c": 582610.427,
        "A_i": 2.9e-22 * 1e13 / HOUR,
        "m": 4.5,
        "Q_d": 39369.5 * GAS_CONSTANT,
        "Q_c": 2.28 / EV * GAS_CONSTANT,
    },
    ranges={
        "stress": (30.0, 30.0),
        "temperature": (800.0, 1400.0),
        "grain_size": (10.0, 10.0),
        "density": (95.0, 100.0),
        "fission_rate": (0.0, 1.0),
    },
    source=(
        "Hayes, Thomas and Peddicord (1990), J. Nucl. Mater. 171, part II; AbdulHameed et al. (2025), "
        "arXiv:2503.03231v4, Eqs. (1), (14) and (15); Konovalov, Tarasov and Glagovsky (2016), Eq. (13); "
        f"{DUALMESH}, with rates"
    ),
    form="sintered",
)


@hookimpl
def creepkit_materials() -> list[Material]:
    return [UO2, UN]
