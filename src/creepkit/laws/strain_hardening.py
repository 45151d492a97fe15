"""Strain-hardening power law (SPL): the rate falls with the creep strain already reached."""

from creepkit.language import CreepLaw, Param, hookimpl, parameters, strain, stress
from creepkit.laws.paper import PAPER

A, n, m = parameters("A n m")


STRAIN_HARDENING = CreepLaw(
    name="strain-hardening",
    title="Strain-hardening power law (SPL)",
    terms={"strain hardening": A * stress**n * strain**m},
    params={
        A: Param("rate coefficient", unit="1/s", bounds=(1e-40, 1e-5), scale="log", off=0.0, widens=True),
        n: Param("stress exponent", bounds=(1, 8), off=0.0, widens=True),
        m: Param("strain exponent", bounds=(-1, 0), off=0.0),
    },
    references=(f"{PAPER}, Table 1",),
)


@hookimpl
def creepkit_laws() -> list[CreepLaw]:
    return [STRAIN_HARDENING]
