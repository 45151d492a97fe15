"""Liu-Murakami damage: microcracks soften the matrix exponentially, so both rates stay finite up to rupture at w = 1.

    rate  = A s^n exp[ 2 (n+1) / (pi sqrt(1 + 3/n)) (s_1/s)^2 w^(3/2) ]
    dw/dt = B (1 - exp(-q_2))/q_2 s_r^p exp(q_2 w),    s_r = alpha s_1 + (1-alpha) s

At constant stress: rupture at t_r = 1/(B s_r^p), and w = -ln(1 - (1 - exp(-q_2)) t/t_r)/q_2.
"""

import sympy

from creepkit.language import CreepLaw, Param, State, hookimpl, parameters, principal_stress, states, stress

A, n, B, p, q_2, alpha = parameters("A n B p q_2 alpha")
(w,) = states("w")

softening = 2 * (n + 1) / (sympy.pi * sympy.sqrt(1 + 3 / n)) * (principal_stress / stress) ** 2
# A rupture stress below zero has no real power: compression does not damage.
rupture_stress = sympy.Max(alpha * principal_stress + (1 - alpha) * stress, 0)

LIU_MURAKAMI = CreepLaw(
    name="liu-murakami",
    title="Liu-Murakami creep damage",
    terms={"damaged creep": A * stress**n * sympy.exp(softening * w ** sympy.Rational(3, 2))},
    params={
        A: Param("rate coefficient", unit="1/s", bounds=(1e-60, 1e-5), scale="log", off=0.0, widens=True),
        n: Param("stress exponent", bounds=(1, 20), widens=True),
        B: Param("damage rate coefficient", unit="1/s", bounds=(1e-60, 1e-3), scale="log", off=0.0, widens=True),
        p: Param("stress exponent of damage", bounds=(1, 20)),
        q_2: Param("exponential growth of damage", bounds=(0.5, 20)),
        alpha: Param("share of the largest principal stress in the rupture stress", bounds=(0, 1), off=0.0),
    },
    states={
        w: State(0.0, B * (1 - sympy.exp(-q_2)) / q_2 * rupture_stress**p * sympy.exp(q_2 * w), "damage", limit=1.0)
    },
    references=("Liu and Murakami (1998), JSME Int. J. Ser. A 41, 57",),
)

TYPICAL = {"A": 4.08e-33, "n": 10.147, "B": 7.6e-34, "p": 10.949, "q_2": 6.35, "alpha": 0.5}
"""Type 316 steel at 600 C. A = 1.47e-29 per hour and n: Wen, Tu et al. (2013), 13th Int. Conf. on Fracture, Table 2.

The damage constants are of the right order only: rupture after 3200 h at 240 MPa.
"""


@hookimpl
def creepkit_laws() -> list[CreepLaw]:
    return [LIU_MURAKAMI]
