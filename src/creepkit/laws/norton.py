"""Norton power law: steady creep, no memory of time or strain."""

from creepkit.language import CreepLaw, Param, hookimpl, parameters, stress

A, n = parameters("A n")


NORTON = CreepLaw(
    name="norton",
    title="Norton power law (PL)",
    terms={"power law": A * stress**n},
    params={
        A: Param("rate coefficient", unit="1/s", bounds=(1e-40, 1e-5), scale="log", off=0.0, widens=True),
        n: Param("stress exponent", bounds=(1, 8), off=0.0, widens=True),
    },
    references=("Norton (1929), The Creep of Steel at High Temperatures, McGraw-Hill",),
)


@hookimpl
def creepkit_laws() -> list[CreepLaw]:
    return [NORTON]
