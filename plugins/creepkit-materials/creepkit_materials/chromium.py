"""Unalloyed chromium: a power law through the 49 minimum rates of NASA TM X-2499, as dualmesh has fitted it.

The covariance is that of the same least squares, ln rate = ln A + n ln s - (Q/R)(1/T - 1/T_ref), for the scatter of
the rates about the line: 0.51 in ln rate.
"""

from creepkit.hookspecs import hookimpl
from creepkit.records import Material
from creepkit_materials.forms import at_reference, norton_arrhenius

T_REF = 1300.0

CHROMIUM = Material(
    name="chromium",
    title="unalloyed chromium",
    law=norton_arrhenius(T_REF),
    values={"A": at_reference(43.19, 333640.0, T_REF), "n": 4.7691, "Q": 333640.0},
    ranges={"stress": (3.70, 100.5), "temperature": (816.0 + 273.15, 1316.0 + 273.15)},
    source=(
        "Stephens and Klopp (1972), High-Temperature Creep of Polycrystalline Chromium, NASA TM X-2499, Table I; fit "
        "to its 49 rates by MohamedAbdulHameed/dualmesh (2026), python/dualmesh/fuel/atf.py, class ChromiumCoating, "
        "https://github.com/MohamedAbdulHameed/dualmesh"
    ),
    form="polycrystals of 0.23 and 0.90 mm grains",
    covariance=((0.746818, -0.239979, -16768.5), (-0.239979, 0.0777007, 5430.80), (-16768.5, 5430.80, 4.13575e8)),
)


@hookimpl
def creepkit_materials() -> list[Material]:
    return [CHROMIUM]
