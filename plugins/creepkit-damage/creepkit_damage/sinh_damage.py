"""Sinh damage (Stewart): hyperbolic sines of stress, rates finite up to rupture at w = 1.

    rate  = A sinh(s/s_s) exp(lambda_ w^(3/2))
    dw/dt = M (1 - exp(-phi))/phi sinh(s_r/s_t)^chi exp(phi w)

lambda_ is ln(final rate/minimum rate). At constant stress: rupture at t_r = 1/(M sinh(s_r/s_t)^chi), and
w = -ln(1 - (1 - exp(-phi)) t/t_r)/phi. Under multiaxial stress s_r is Hayhurst's rupture stress,
alpha s_1 + 3 beta s_m + (1 - alpha - beta) s; in a tension test it is s.
"""

import sympy

from creepkit.language import (
    CreepLaw,
    Param,
    State,
    hookimpl,
    mean_stress,
    parameters,
    principal_stress,
    states,
    stress,
)

A, s_s, lambda_, M, s_t, chi, phi, alpha, beta = parameters("A s_s lambda_ M s_t chi phi alpha beta")
(w,) = states("w")

# A rupture stress below zero has no real power: compression does not damage.
rupture_stress = sympy.Max(alpha * principal_stress + 3 * beta * mean_stress + (1 - alpha - beta) * stress, 0)
damage_rate = M * (1 - sympy.exp(-phi)) / phi * sympy.sinh(rupture_stress / s_t) ** chi * sympy.exp(phi * w)

SINH_DAMAGE = CreepLaw(
    name="sinh-damage",
    title="Sinh creep damage of Stewart",
    terms={"damaged creep": A * sympy.sinh(stress / s_s) * sympy.exp(lambda_ * w ** sympy.Rational(3, 2))},
    params={
        A: Param("rate coefficient", unit="1/s", bounds=(1e-40, 1e-3), scale="log", off=0.0, widens=True),
        s_s: Param("breakdown stress of creep", unit="MPa", bounds=(3.0, 1e3), scale="log"),
        lambda_: Param("ln of the final over the minimum rate", bounds=(0, 15)),
        M: Param("damage rate coefficient", unit="1/s", bounds=(1e-40, 1e-2), scale="log", off=0.0, widens=True),
        s_t: Param("breakdown stress of damage", unit="MPa", bounds=(30.0, 1e3), scale="log"),
        chi: Param("exponent of sinh in damage", bounds=(1, 8)),
        phi: Param("exponential growth of damage", bounds=(0.5, 20)),
        alpha: Param("share of the largest principal stress in the rupture stress", bounds=(0, 1), off=0.0),
        beta: Param("share of the hydrostatic stress in the rupture stress", bounds=(0, 1), off=0.0),
    },
    states={w: State(0.0, damage_rate, "damage", limit=1.0)},
    constraints=(alpha + beta <= 1,),
    references=(
        "Stewart (2013), A Hybrid Constitutive Model for Creep, Fatigue, and Creep-Fatigue Damage, UCF dissertation",
        "Haque and Stewart (2016), ASME Pressure Vessels and Piping Conf., PVP2016-63089",
        "Haque and Stewart (2017), J. Pressure Vessel Technol. 139, 041403",
        "Hayhurst (1972), J. Mech. Phys. Solids 20, 381 (the rupture stress)",
    ),
)

TYPICAL = {
    **{"A": 1e-11, "s_s": 30.0, "lambda_": 2.5, "M": 1e-8, "s_t": 150.0, "chi": 3.0, "phi": 4.0},
    **{"alpha": 0.5, "beta": 0.0},
}
"""Orders of magnitude for type 304 steel at 600 C and 200 MPa: 4e-9 1/s and rupture after 5000 h."""


@hookimpl
def creepkit_laws() -> list[CreepLaw]:
    return [SINH_DAMAGE]
