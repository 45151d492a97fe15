"""Nabarro-Herring creep: vacancies flow through the grains, rate = 14 D Omega s/(k T d^2), D = D_0 exp(-Q/(R T)).

In mm, N and s (1 m^2/s is 1e6 mm^2/s). The number 14 is that of Frost and Ashby, for equiaxed grains of diameter d;
Herring's own is 40/3. d is a condition, which each test states: `label grain_size: 50 um`. D_0 and Omega multiply each
other: fix what is known, as in `law.fix(Omega=1.09e-20)`.
"""

import sympy

from creepkit.language import GAS_CONSTANT, CreepLaw, Param, conditions, hookimpl, parameters, stress, temperature

BOLTZMANN = 1.380649e-20
"""k in N mm/K (1.380649e-23 J/K, exact since 2019)."""

D_0, Q, Omega = parameters("D_0 Q Omega")
(d,) = conditions("grain_size", unit="mm")
diffusivity = D_0 * sympy.exp(-Q / (GAS_CONSTANT * temperature))

NABARRO_HERRING = CreepLaw(
    name="nabarro-herring",
    title="Nabarro-Herring creep by diffusion through the lattice",
    terms={"lattice diffusion": 14 * diffusivity * Omega * stress / (BOLTZMANN * temperature * d**2)},
    params={
        D_0: Param(
            "frequency factor of lattice diffusion",
            unit="mm^2/s",
            bounds=(1e-3, 1e6),
            scale="log",
            off=0.0,
            widens=True,
        ),
        Q: Param("activation energy of lattice diffusion", unit="J/mol", bounds=(2e4, 9e5)),
        Omega: Param("atomic volume", unit="mm^3", bounds=(5e-21, 1e-19), scale="log"),
    },
    references=(
        "Nabarro (1948), Strength of Solids, The Physical Society, 75",
        "Herring (1950), J. Appl. Phys. 21, 437",
        "Frost and Ashby (1982), Deformation-Mechanism Maps, Pergamon, Eq. (2.29)",
    ),
)

TYPICAL = {"D_0": 190.0, "Q": 284e3, "Omega": 1.09e-20}
"""Nickel: Frost and Ashby (1982), Table 4.1."""


@hookimpl
def creepkit_laws() -> list[CreepLaw]:
    return [NABARRO_HERRING]
