"""Threshold stress: particles hold dislocations back below s_0, rate = A (s - s_0)^n above it and 0 below.

For temperature: `law.times(arrhenius())`, and `.with_temperature(s_0=linear())`.
"""

import sympy

from creepkit.language import CreepLaw, Param, hookimpl, parameters, stress

A, n, s_0 = parameters("A n s_0")

THRESHOLD_STRESS = CreepLaw(
    name="threshold-stress",
    title="Power law above a threshold stress",
    terms={"power law above threshold": A * sympy.Max(stress - s_0, 0) ** n},
    params={
        A: Param("rate coefficient", unit="1/s", bounds=(1e-40, 1e-5), scale="log", off=0.0, widens=True),
        n: Param("stress exponent", bounds=(1, 10), widens=True),
        s_0: Param("threshold stress", unit="MPa", bounds=(0.0, 500.0), off=0.0),
    },
    references=(
        "Lagneborg and Bergman (1976), Met. Sci. 10, 20",
        "Williams and Wilshire (1973), Met. Sci. J. 7, 176 (Nimonic 80A: n is 4 once the threshold is taken off)",
    ),
)

TYPICAL = {"A": 1e-17, "n": 4.0, "s_0": 60.0}
"""Orders of magnitude for a precipitation-hardened nickel alloy about 850 C: 2e-9 1/s at 180 MPa."""


@hookimpl
def creepkit_laws() -> list[CreepLaw]:
    return [THRESHOLD_STRESS]
