"""Coble creep: vacancies flow along grain boundaries, rate = 14 pi D Omega s/(k T d^3), D = delta D_b exp(-Q/(R T)).

D is the diffusivity in the boundary times its width delta, in mm^3/s (1 m^3/s is 1e9 mm^3/s). The number 14 pi = 44 is
that of Frost and Ashby, for equiaxed grains of diameter d; Coble's abstract says about 150, which later texts quote as
150/pi = 48. d is a condition, which each test states: `label grain_size: 10 um`. D_b and Omega multiply each other: fix
what is known, as in `law.fix(Omega=1.09e-20)`.
"""

import sympy

from creepkit.language import GAS_CONSTANT, CreepLaw, Param, conditions, hookimpl, parameters, stress, temperature

BOLTZMANN = 1.380649e-20
"""k in N mm/K (1.380649e-23 J/K, exact since 2019)."""

D_b, Q, Omega = parameters("D_b Q Omega")
(d,) = conditions("grain_size", unit="mm")
diffusivity = D_b * sympy.exp(-Q / (GAS_CONSTANT * temperature))

COBLE = CreepLaw(
    name="coble",
    title="Coble creep by diffusion along grain boundaries",
    terms={"boundary diffusion": 14 * sympy.pi * diffusivity * Omega * stress / (BOLTZMANN * temperature * d**3)},
    params={
        D_b: Param(
            "width times frequency factor of boundary diffusion",
            unit="mm^3/s",
            bounds=(1e-12, 1e-1),
            scale="log",
            off=0.0,
            widens=True,
        ),
        Q: Param("activation energy of boundary diffusion", unit="J/mol", bounds=(2e4, 9e5)),
        Omega: Param("atomic volume", unit="mm^3", bounds=(5e-21, 1e-19), scale="log"),
    },
    references=(
        "Coble (1963), J. Appl. Phys. 34, 1679",
        "Frost and Ashby (1982), Deformation-Mechanism Maps, Pergamon, Eq. (2.29)",
    ),
)

TYPICAL = {"D_b": 3.5e-6, "Q": 115e3, "Omega": 1.09e-20}
"""Nickel: Frost and Ashby (1982), Table 4.1."""


@hookimpl
def creepkit_laws() -> list[CreepLaw]:
    return [COBLE]
