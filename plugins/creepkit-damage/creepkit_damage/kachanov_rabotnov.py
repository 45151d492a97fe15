"""Kachanov-Rabotnov damage: the section that carries load shrinks with the damage w, and w feeds on itself.

    rate = A (s/(1-w))^n t^m,    dw/dt = B s_r^chi t^m / ((1+phi) (1-w)^phi),    s_r = alpha s_1 + (1-alpha) s

The law keeps v = 1 - (1-w)^(1+phi), the share of life spent, in the place of w: dv/dt = B s_r^chi t^m. It is the same
law, but w takes its last steps in (1-w)^(1+phi) of the life, which at phi = 13 and w = .9 is too short a time for
double precision, while v grows evenly. The creep rate is infinite at v = 1, so the point is broken at v = 1 - 1e-8.
`damage(v, phi)` gives w.

At constant stress and m = 0: rupture at t_r = 1/(B s_r^chi), v = t/t_r and w = 1 - (1 - t/t_r)^(1/(1+phi)).
The exponent m (0: no primary creep) is that of the rate, so strain grows as t^(1+m) at first.
"""

from typing import Any

import sympy

from creepkit.language import CreepLaw, Param, State, hookimpl, parameters, principal_stress, states, stress, time

A, n, B, chi, phi, alpha, m = parameters("A n B chi phi alpha m")
(v,) = states("v")


def damage(v: Any, phi: Any) -> Any:
    """Damage w, from the share `v` of life that is spent: numbers, arrays or symbols."""
    return 1 - (1 - v) ** (1 / (1 + phi))


# A rupture stress below zero has no real power: compression does not damage.
rupture_stress = sympy.Max(alpha * principal_stress + (1 - alpha) * stress, 0)

KACHANOV_RABOTNOV = CreepLaw(
    name="kachanov-rabotnov",
    title="Kachanov-Rabotnov creep damage",
    terms={"damaged creep": A * (stress / (1 - damage(v, phi))) ** n * time**m},
    params={
        A: Param("rate coefficient", unit="1/s", bounds=(1e-60, 1e-5), scale="log", off=0.0, widens=True),
        n: Param("stress exponent", bounds=(1, 20), widens=True),
        B: Param("damage rate coefficient", unit="1/s", bounds=(1e-60, 1e-3), scale="log", off=0.0, widens=True),
        chi: Param("stress exponent of damage", bounds=(1, 20)),
        phi: Param("exponent of damage", bounds=(0, 30)),
        alpha: Param("share of the largest principal stress in the rupture stress", bounds=(0, 1), off=0.0),
        m: Param("time exponent", bounds=(-0.95, 0), off=0.0),
    },
    states={v: State(0.0, B * rupture_stress**chi * time**m, "share of life spent", limit=1 - 1e-8)},
    references=(
        "Kachanov (1958), Izv. Akad. Nauk SSSR, Otd. Tekh. Nauk 8, 26",
        "Rabotnov (1969), Creep Problems in Structural Members, North-Holland",
        "Hayhurst (1972), J. Mech. Phys. Solids 20, 381 (the rupture stress)",
        "Hyde, Sun and Hyde (2014), Applied Creep Mechanics, McGraw-Hill (the form with 1 + phi)",
    ),
)

TYPICAL = {"A": 4.08e-33, "n": 10.147, "B": 7.6e-34, "chi": 10.949, "phi": 12.4, "alpha": 0.5, "m": 0.0}
"""Type 316 steel at 600 C. A = 1.47e-29 per hour and n: Wen, Tu et al. (2013), 13th Int. Conf. on Fracture, Table 2.

The damage constants are of the right order only: rupture after 3200 h at 240 MPa, and 27 % strain.
"""


@hookimpl
def creepkit_laws() -> list[CreepLaw]:
    return [KACHANOV_RABOTNOV]
