"""Dorn's law (Bird, Mukherjee and Dorn): power-law creep in the numbers that physics gives.

    rate = A D G b/(k T) (s/G)^n,    D = D_0 exp(-Q/(R T)),    G = G_0 (1 + g (T - 300))

In mm, N and s: 1 m^2/s is 1e6 mm^2/s. A, D_0 and b multiply each other, so a fit can find one of them only: fix what
tables give, as in `dorn.fix(D_0=190, b=2.49e-7, G_0=78900, g=-3.71e-4, Q=284e3)`.
"""

import sympy

from creepkit.language import GAS_CONSTANT, CreepLaw, Param, hookimpl, parameters, stress, temperature

BOLTZMANN = 1.380649e-20
"""k in N mm/K (1.380649e-23 J/K, exact since 2019)."""

A, n, D_0, Q, b, G_0, g = parameters("A n D_0 Q b G_0 g")

diffusivity = D_0 * sympy.exp(-Q / (GAS_CONSTANT * temperature))
modulus = G_0 * (1 + g * (temperature - 300))

DORN = CreepLaw(
    name="dorn",
    title="Dorn's law: power-law creep scaled with diffusivity and shear modulus",
    terms={"climb and glide": A * diffusivity * modulus * b / (BOLTZMANN * temperature) * (stress / modulus) ** n},
    params={
        A: Param("Dorn's constant", unit="1", bounds=(1e-5, 1e20), scale="log", off=0.0, widens=True),
        n: Param("stress exponent", bounds=(1, 12), widens=True),
        D_0: Param("frequency factor of lattice diffusion", unit="mm^2/s", bounds=(1e-3, 1e6), scale="log"),
        Q: Param("activation energy of lattice diffusion", unit="J/mol", bounds=(2e4, 9e5)),
        b: Param("Burgers vector", unit="mm", bounds=(1.5e-7, 8e-7), scale="log"),
        G_0: Param("shear modulus at 300 K", unit="MPa", bounds=(5e3, 3e5), scale="log"),
        g: Param("relative slope of the shear modulus", unit="1/K", bounds=(-7e-4, 0.0), off=0.0),
    },
    constraints=(1 + g * (temperature - 300) >= 0.01,),
    references=(
        "Bird, Mukherjee and Dorn (1969), Quantitative Relation between Properties and Microstructure, 255",
        "Mukherjee, Bird and Dorn (1969), Trans. ASM 62, 155",
    ),
)

TYPICAL = {"A": 3.0e6, "n": 4.6, "D_0": 190.0, "Q": 284e3, "b": 2.49e-7, "G_0": 7.89e4, "g": -0.64 / 1726}
"""Nickel: Frost and Ashby (1982), Deformation-Mechanism Maps, Pergamon, Table 4.1 (A for tensile stress and strain)."""


@hookimpl
def creepkit_laws() -> list[CreepLaw]:
    return [DORN]
