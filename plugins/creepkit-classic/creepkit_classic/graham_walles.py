"""Graham-Walles: strain at constant stress is a sum of powers of time, with exponents 1/3, 1 and 3.

    strain = C_1 s^n_1 t^(1/3) + C_2 s^n_2 t + C_3 s^n_3 t^3, and the rate is its derivative

The primary, secondary and tertiary stage of a curve. C_i is the strain at 1 MPa after 1 s; a C_i per h^k is
divided by 3600^k, where k is the exponent of time.
"""

import sympy

from creepkit.language import CreepLaw, Param, hookimpl, parameters, stress, time

C_1, n_1, C_2, n_2, C_3, n_3 = parameters("C_1 n_1 C_2 n_2 C_3 n_3")

GRAHAM_WALLES = CreepLaw(
    name="graham-walles",
    title="Graham-Walles: powers 1/3, 1 and 3 of time",
    terms={
        "primary": C_1 * stress**n_1 * time ** sympy.Rational(-2, 3) / 3,
        "secondary": C_2 * stress**n_2,
        "tertiary": 3 * C_3 * stress**n_3 * time**2,
    },
    params={
        C_1: Param("primary strain at 1 MPa, 1 s", unit="1", bounds=(1e-40, 1e-2), scale="log", off=0.0, widens=True),
        n_1: Param("stress exponent of primary creep", bounds=(0.5, 12)),
        C_2: Param("secondary strain at 1 MPa, 1 s", unit="1", bounds=(1e-50, 1e-5), scale="log", off=0.0, widens=True),
        n_2: Param("stress exponent of secondary creep", bounds=(1, 16)),
        C_3: Param("tertiary strain at 1 MPa, 1 s", unit="1", bounds=(1e-90, 1e-10), scale="log", off=0.0, widens=True),
        n_3: Param("stress exponent of tertiary creep", bounds=(1, 30)),
    },
    references=("Graham and Walles (1955), J. Iron Steel Inst. 179, 105",),
)

TYPICAL = {"C_1": 4e-9, "n_1": 2.0, "C_2": 1e-20, "n_2": 5.0, "C_3": 3e-43, "n_3": 9.0}
"""Orders of magnitude for a heat-resistant steel: at 100 MPa 1e-10 1/s, 1 % tertiary strain in a year."""


@hookimpl
def creepkit_laws() -> list[CreepLaw]:
    return [GRAHAM_WALLES]
