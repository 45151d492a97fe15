"""Norton-Bailey in its time form: strain = A s^n t^m at constant stress, so rate = A m s^n t^(m-1), 0 < m <= 1.

This m is that of Bailey's strain; the m of `norton-bailey-rate` is smaller by 1. `creepkit_classic.conversions` turns
the values of one notation into those of another.
"""

from creepkit.language import CreepLaw, Param, hookimpl, parameters, stress, time

A, n, m = parameters("A n m")

NORTON_BAILEY_TIME = CreepLaw(
    name="norton-bailey-time",
    title="Norton-Bailey, time form: strain = A s^n t^m",
    terms={"time form": A * m * stress**n * time ** (m - 1)},
    params={
        A: Param("strain at 1 MPa after 1 s", unit="1", bounds=(1e-40, 1e-2), scale="log", off=0.0, widens=True),
        n: Param("stress exponent", bounds=(1, 12), widens=True),
        m: Param("time exponent of the strain", bounds=(0.05, 1.0)),
    },
    references=(
        "Bailey (1935), Proc. Inst. Mech. Eng. 131, 131",
        "Norton (1929), The Creep of Steel at High Temperatures",
    ),
)

TYPICAL = {"A": 1e-13, "n": 4.0, "m": 1 / 3}
"""Orders of magnitude: m = 1/3 is Andrade's (1910), n = 4 a metal's; 0.02 % after 3 h at 100 MPa."""


@hookimpl
def creepkit_laws() -> list[CreepLaw]:
    return [NORTON_BAILEY_TIME]
