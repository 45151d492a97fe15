"""Norton-Bailey time-hardening power law (TPL): the rate falls with time.

t^m cannot be integrated from zero at m = -1, so m stops at -0.95 where the paper's Table 1 says -1.
"""

from creepkit.language import CreepLaw, Param, hookimpl, parameters, stress, time
from creepkit.laws.paper import PAPER

A, n, m = parameters("A n m")


TIME_HARDENING = CreepLaw(
    name="time-hardening",
    title="Norton-Bailey time-hardening power law (TPL)",
    terms={"time hardening": A * stress**n * time**m},
    params={
        A: Param("rate coefficient", unit="1/s", bounds=(1e-40, 1e-5), scale="log", off=0.0, widens=True),
        n: Param("stress exponent", bounds=(1, 8), off=0.0, widens=True),
        m: Param("time exponent", bounds=(-0.95, 0), off=0.0),
    },
    references=(
        "Bailey (1935), The Utilization of Creep Test Data in Engineering Design, Proc. Inst. Mech. Eng. 131, 131-349",
        f"{PAPER}, Table 1",
    ),
)


@hookimpl
def creepkit_laws() -> list[CreepLaw]:
    return [TIME_HARDENING]
