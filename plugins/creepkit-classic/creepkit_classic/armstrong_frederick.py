"""Armstrong-Frederick: dislocations that are held up push back by a stress X, which flow builds and heat recovers.

    rate = A |s - X|^n,  flow along s - X,    dX/dt = C rate - gamma X |rate| - r X

in a bar, with signs: the language writes X and s as components along the flow. In tension at a constant stress X rises
to C/gamma, where r = 0, and the rate falls to A (s - C/gamma)^n: primary creep. After a stress dip below X the bar
creeps backwards until X, by that and by recovery, has fallen below s. A reversed load finds X beside it and creeps
faster (the Bauschinger effect). With r = 0 and rate p' of one sign, X = C/gamma (1 - exp(-gamma p)).
"""

from creepkit.language import CreepLaw, Param, State, hookimpl, parameters, states, stress

A, n, C, gamma, r = parameters("A n C gamma r")
(X,) = states("X")

creep = A * (stress - X) ** n

ARMSTRONG_FREDERICK = CreepLaw(
    name="armstrong-frederick",
    title="Norton creep with the back stress of Armstrong and Frederick, and static recovery",
    terms={"power law of the effective stress": creep},
    params={
        A: Param("rate coefficient", unit="1/s", bounds=(1e-40, 1e-5), scale="log", off=0.0, widens=True),
        n: Param("stress exponent", bounds=(1, 10), widens=True),
        C: Param("hardening modulus", unit="MPa", bounds=(1e2, 1e6), scale="log", off=0.0, widens=True),
        gamma: Param("dynamic recovery", bounds=(0.0, 1e4), off=0.0),
        r: Param("static recovery", unit="1/s", bounds=(1e-12, 1e-1), scale="log", off=0.0, widens=True),
    },
    states={X: State(0.0, C * creep - gamma * X * creep - r * X, "back stress", unit="MPa", kind="back stress")},
    references=(
        "Armstrong and Frederick (1966), CEGB Report RD/B/N731; reprinted 2007 in Mater. High Temp. 24, 1",
        "Chaboche (1989), Int. J. Plast. 5, 247 (viscoplasticity in the effective stress, static recovery)",
    ),
)

TYPICAL = {"A": 1e-14, "n": 4.0, "C": 2e4, "gamma": 400.0, "r": 1e-6}
"""Orders of magnitude for a stainless steel about 600 C: X tends to 50 MPa over a strain of some 0.3 %."""


@hookimpl
def creepkit_laws() -> list[CreepLaw]:
    return [ARMSTRONG_FREDERICK]
