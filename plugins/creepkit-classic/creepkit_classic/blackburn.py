"""Blackburn's law: a fast and a slow transient above steady creep, here with powers of stress.

    strain = X_f (1 - exp(-r_f t)) + X_s (1 - exp(-r_s t)) + r t at constant stress,
    r = A s^n,  X_f = C_f s^a,  X_s = C_s s^a,  r_f = K_f r,  r_s = K_s r

The transients are strains f and g with df/dt = r_f (X_f - f), dg/dt = r_s (X_s - g), which also hold when the stress
changes (without recovery where it falls). Blackburn gives r, X and the rate constants as functions of stress and
temperature of their own for each steel; rate constants proportional to r are what Garofalo found for austenitic steels.
"""

import sympy

from creepkit.language import CreepLaw, Param, State, hookimpl, parameters, states, stress

A, n, C_f, C_s, a, K_f, K_s = parameters("A n C_f C_s a K_f K_s")
f, g = states("f g")

steady = A * stress**n
fast = K_f * steady * sympy.Max(C_f * stress**a - f, 0)
slow = K_s * steady * sympy.Max(C_s * stress**a - g, 0)
STRAIN = Param("transient strain at 1 MPa", unit="1", bounds=(1e-20, 1e-2), scale="log")
SPEED = Param("rate constant over steady rate", unit="1", bounds=(1.0, 1e6), scale="log", off=0.0)

BLACKBURN = CreepLaw(
    name="blackburn",
    title="Blackburn: two exponential transients and steady creep",
    terms={"fast transient": fast, "slow transient": slow, "steady": steady},
    params={
        A: Param("steady rate coefficient", unit="1/s", bounds=(1e-60, 1e-5), scale="log", off=0.0, widens=True),
        n: Param("stress exponent of steady creep", bounds=(1, 16), widens=True),
        C_f: STRAIN,
        C_s: STRAIN,
        a: Param("stress exponent of transient strain", bounds=(0.5, 6)),
        K_f: SPEED,
        K_s: SPEED,
    },
    states={f: State(0.0, fast, "strain of the fast transient"), g: State(0.0, slow, "strain of the slow transient")},
    constraints=(K_f >= K_s,),
    references=(
        "Blackburn (1972), The Generation of Isochronous Stress-Strain Curves, ASME, 15",
        "Garofalo (1965), Fundamentals of Creep and Creep-Rupture in Metals, Macmillan",
    ),
)

TYPICAL = {"A": 1e-24, "n": 7.0, "C_f": 3e-9, "C_s": 1e-8, "a": 2.5, "K_f": 2000.0, "K_s": 100.0}
"""Orders of magnitude for an austenitic steel about 600 C: 1e-10 1/s and 0.1 % slow transient strain at 100 MPa."""


@hookimpl
def creepkit_laws() -> list[CreepLaw]:
    return [BLACKBURN]
