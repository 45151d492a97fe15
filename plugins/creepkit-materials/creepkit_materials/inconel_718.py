"""Inconel 718: a power law through the 23 minimum rates of Hayes (1991), as creep-fatigue-In718 has fitted it.

The covariance is that of the same least squares, ln rate = ln A + n ln s - (Q/R)(1/T - 1/T_ref), for the scatter of
the rates about the line: 0.58 in ln rate.
"""

from creepkit.hookspecs import hookimpl
from creepkit.records import Material
from creepkit_materials.forms import at_reference, norton_arrhenius

T_REF = 973.15

INCONEL_718 = Material(
    name="inconel-718",
    title="Inconel 718",
    law=norton_arrhenius(T_REF),
    values={"A": at_reference(4.97777e-9, 611322.0685, T_REF), "n": 12.184367, "Q": 611322.0685},
    ranges={"stress": (276.0, 724.0), "temperature": (650.0 + 273.15, 760.0 + 273.15)},
    source=(
        "Hayes (1991), Superalloys 718, 625 and Various Derivatives, Table III; fit to its 23 rates by "
        "jonghunlee05/creep-fatigue-In718 (2025), models/calibrations/creep/in718_norton.yaml, "
        "https://github.com/jonghunlee05/creep-fatigue-In718"
    ),
    form="two heat treatments, A and B, taken together",
    covariance=((26.6481, -4.27131, -170921.0), (-4.27131, 0.685064, 27410.8), (-170921.0, 27410.8, 1.633344e9)),
)


@hookimpl
def creepkit_materials() -> list[Material]:
    return [INCONEL_718]
