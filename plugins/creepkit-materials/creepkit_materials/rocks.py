"""Rocks of mantle and crust by dislocation and diffusion creep, in axial compression at no pressure but where stated.

The sources print A per MPa^n and s for exp(-(E + P V)/(R T)); here P = 0, and A is brought to T_REF. Stress and rate
are those of the tests, a difference of principal stresses and an axial rate, which are von Mises' here. Water enters by
its fugacity, which the content of hydrogen states.
"""

import sympy

from creepkit.hookspecs import hookimpl
from creepkit.language import GAS_CONSTANT, CreepLaw, Param, arrhenius, conditions, parameters, stress, temperature
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

A_w, r, Q_w, V, A_p, Q_p, stress_p, p_1, q = parameters("A_w r Q_w V A_p Q_p stress_p p_1 q")
(pressure,) = conditions("pressure", unit="MPa")
(hydrogen,) = conditions("hydrogen", unit="H/1e6 Si")

# 26 H/1e6 Si are in equilibrium with 1 MPa at infinite temperature; 40 kJ/mol and 10 cm^3/mol are of the solution.
fugacity = hydrogen / 26 * sympy.exp((40e3 + 10 * pressure) / (GAS_CONSTANT * temperature))

WET = CreepLaw(
    name="wet-power-law",
    title="power law of stress and water fugacity",
    terms={
        "dislocations": A_w * stress**n * fugacity**r * sympy.exp(-(Q_w + pressure * V) / (GAS_CONSTANT * temperature))
    },
    params={
        A_w: Param("rate coefficient", unit="1/s", bounds=(1e-10, 1e20), scale="log", off=0.0, widens=True),
        n: Param("stress exponent", bounds=(1, 8)),
        r: Param("exponent of fugacity", bounds=(0, 3), off=0.0),
        Q_w: Param("activation energy", unit="J/mol", bounds=(1e5, 9e5)),
        V: Param("activation volume", unit="cm^3/mol", bounds=(0, 40)),
    },
    references=("Hirth and Kohlstedt (2003), Geophysical Monograph 138, 83",),
)

obstacle = sympy.Max(1 - (stress / stress_p) ** p_1, 0)

PEIERLS = CreepLaw(
    name="peierls",
    title="dislocation glide over the lattice resistance",
    terms={"glide": A_p * stress**n * sympy.exp(-Q_p * obstacle**q / (GAS_CONSTANT * temperature))},
    params={
        A_p: Param("rate coefficient", unit="1/s", bounds=(1e-12, 1e15), scale="log", off=0.0, widens=True),
        n: Param("stress exponent", bounds=(0, 5), off=0.0),
        Q_p: Param("activation energy at no stress", unit="J/mol", bounds=(5e4, 9e5)),
        stress_p: Param("Peierls stress", unit="MPa", bounds=(1e2, 2e4), scale="log"),
        p_1: Param("inner exponent of the obstacle", bounds=(0.3, 1.0)),
        q: Param("outer exponent of the obstacle", bounds=(1.0, 2.0)),
    },
    references=("Mei et al. (2010)", "Idrissi et al. (2016)"),
)

HIRTH = "Hirth and Kohlstedt (2003), Rheology of the Upper Mantle and the Mantle Wedge, Geophysical Monograph 138, 83"
RYBACKI = "Rybacki, Gottschalk, Wirth and Dresen (2006), J. Geophys. Res. 111 (B3), Table 5, doi:10.1029/2005JB003663"

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

ASPECT = "of https://github.com/geodynamics/aspect, commit bf1b061 (2026)"

OLIVINE_WET = Material(
    name="olivine-wet",
    title="wet olivine, dislocation creep",
    law=WET,
    values={"A_w": 1600.0, "n": 3.5, "r": 1.2, "Q_w": 520e3, "V": 22.0},
    ranges={"temperature": (1173.0, 1173.0), "pressure": (1000.0, 1000.0), "hydrogen": (82423.0, 82423.0)},
    source=f"{HIRTH}, doi:10.1029/138GM06; tests/hk04_olivine_dislocation_hydration_prefactor.prm {ASPECT}",
)

OLIVINE_MEI = Material(
    name="olivine-mei",
    title="olivine at low temperature, glide",
    law=PEIERLS,
    values={"A_p": 1.4e-7, "n": 2.0, "Q_p": 320e3, "stress_p": 5900.0, "p_1": 0.5, "q": 1.0},
    ranges={"stress": (900.0, 1000.0), "temperature": (1073.0, 1073.0)},
    source=f"Mei et al. (2010), flow law in the head of tests/visco_plastic_peierls_mei_exact.prm {ASPECT}",
)

OLIVINE_IDRISSI = Material(
    name="olivine-idrissi",
    title="olivine at low temperature, glide, from tests of single crystals and models",
    law=PEIERLS,
    values={"A_p": 1e6, "n": 0.0, "Q_p": 566e3, "stress_p": 3800.0, "p_1": 0.5, "q": 2.0},
    ranges={"stress": (109.0, 110.0), "temperature": (1073.0, 1073.0)},
    source=f"Idrissi et al. (2016), flow law in the head of tests/visco_plastic_peierls_idrissi_exact.prm {ASPECT}",
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
    return [OLIVINE, OLIVINE_GERYA, OLIVINE_WET, OLIVINE_MEI, OLIVINE_IDRISSI, ANORTHITE]
