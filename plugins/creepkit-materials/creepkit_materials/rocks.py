"""Rocks of mantle and crust by dislocation and diffusion creep, in axial compression at no pressure.

The sources print A per MPa^n and s for exp(-(E + P V)/(R T)); here P = 0, and A is brought to T_REF. Stress and rate
are those of the tests, a difference of principal stresses and an axial rate, which are von Mises' here.
"""

from creepkit.hookspecs import hookimpl
from creepkit.language import CreepLaw, Param, arrhenius, conditions, parameters, stress
from creepkit.records import Material
from creepkit_materials.forms import at_reference, norton_arrhenius

T_REF = 1500.0
"""K."""

GEOPARAMS = "src/CreepLaw/Data and test/ of https://github.com/JuliaGeodynamics/GeoParams.jl, commit b088a01 (2026)"

A, n, p = parameters("A n p")
(grain_size,) = conditions("grain_size", unit="um")

GRAIN_SIZE_POWER_LAW = CreepLaw(
    name="grain-size-power-law",
    title="power law of stress and grain size",
    terms={"power law": A * stress**n * grain_size**-p},
    params={
        A: Param("rate coefficient", unit="1/s", bounds=(1e-40, 1e5), scale="log", off=0.0, widens=True),
        n: Param("stress exponent", bounds=(1, 8)),
        p: Param("exponent of grain size", bounds=(1, 4)),
    },
    references=("Hirth and Kohlstedt (2003), Geophysical Monograph 138, 83",),
)

HIRTH = "Hirth and Kohlstedt (2003), Rheology of the Upper Mantle and the Mantle Wedge, Geophysical Monograph 138, 83"
RYBACKI = (
    "Rybacki, Gottschalk, Wirth and Dresen (2006), J. Geophys. Res. 111, B03203, Table 5, doi:10.1029/2005JB003663"
)

OLIVINE = Material(
    name="olivine",
    title="dry olivine, dislocation creep",
    law=norton_arrhenius(T_REF),
    values={"A": at_reference(1.1e5, 530e3, T_REF), "n": 3.5, "Q": 530e3},
    ranges={"temperature": (1673.0, 1673.0)},
    source=f"{HIRTH}, Table 1; {GEOPARAMS}",
)

OLIVINE_GERYA = Material(
    name="olivine-gerya",
    title="dry olivine of Gerya's textbook, dislocation creep",
    law=norton_arrhenius(T_REF),
    values={"A": at_reference(2.5e-17 * 1e6**3.5, 532e3, T_REF), "n": 3.5, "Q": 532e3},
    ranges={"temperature": (673.15, 1473.15)},
    source=f"Gerya (2019), Introduction to Numerical Geodynamic Modelling, 2nd edition, exercise 6.1; {GEOPARAMS}",
)

ANORTHITE = Material(
    name="anorthite",
    title="dry anorthite, diffusion creep",
    law=GRAIN_SIZE_POWER_LAW.times(arrhenius(T_ref=T_REF)),
    values={"A": at_reference(10**12.1, 460e3, T_REF), "n": 1.0, "p": 3.0, "Q": 460e3},
    ranges={"temperature": (923.15, 923.15), "grain_size": (5000.0, 5000.0)},
    source=f"{RYBACKI}; {GEOPARAMS}",
    form="fine-grained aggregates",
)


@hookimpl
def creepkit_materials() -> list[Material]:
    return [OLIVINE, OLIVINE_GERYA, ANORTHITE]
