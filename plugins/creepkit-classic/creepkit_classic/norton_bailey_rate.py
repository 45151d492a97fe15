"""Norton-Bailey in its rate form, time hardening: rate = A s^n t^m, -1 < m <= 0.

The notation of Abaqus (*CREEP, LAW=TIME) and of ANSYS (TB,CREEP,,,,2 with C4 = 0); the built-in law `time-hardening`
is the same with narrower bounds. At constant stress, strain = A s^n t^(m+1)/(m+1).
"""

from creepkit.language import CreepLaw, Param, hookimpl, parameters, stress, time

A, n, m = parameters("A n m")

NORTON_BAILEY_RATE = CreepLaw(
    name="norton-bailey-rate",
    title="Norton-Bailey, time hardening: rate = A s^n t^m",
    terms={"time hardening": A * stress**n * time**m},
    params={
        A: Param("rate at 1 MPa and 1 s", unit="1/s", bounds=(1e-40, 1e-2), scale="log", off=0.0, widens=True),
        n: Param("stress exponent", bounds=(1, 12), widens=True),
        m: Param("time exponent of the rate", bounds=(-0.95, 0.0), off=0.0),
    },
    references=(
        "Bailey (1935), Proc. Inst. Mech. Eng. 131, 131",
        "Abaqus Analysis User's Guide, Rate-dependent plasticity: creep and swelling",
    ),
)

TYPICAL = {"A": 1e-13 / 3, "n": 4.0, "m": -2 / 3}
"""The TYPICAL values of `norton-bailey-time` in this notation."""


@hookimpl
def creepkit_laws() -> list[CreepLaw]:
    return [NORTON_BAILEY_RATE]
