"""Rock salt by BGR's power law, and with the pressure solution that is faster at low stress.

PLLC.py prints rates of 67 tests beside the law, which is mostly slower than they: at 60 C within a factor of four, at
25 and 100 C up to six times, and below 1 MPa and at 200 C up to twenty-five times.
"""

import sympy

from creepkit.hookspecs import hookimpl
from creepkit.language import GAS_CONSTANT, CreepLaw, Param, conditions, parameters, stress, temperature
from creepkit.records import Material
from creepkit_materials.forms import at_reference, norton_arrhenius

T_REF = 350.0
"""K."""
DAY = 86400.0
"""s."""

A, n, Q, A_s, Q_s = parameters("A n Q A_s Q_s")
(grain_size,) = conditions("grain_size", unit="um")

SALT = CreepLaw(
    name="salt",
    title="dislocation creep and pressure solution of salt",
    terms={
        "dislocations": A * stress**n * sympy.exp(-Q / (GAS_CONSTANT * temperature)),
        "pressure solution": A_s
        * stress
        / (temperature * grain_size**3)
        * sympy.exp(-Q_s / (GAS_CONSTANT * temperature)),
    },
    params={
        A: Param(
            "rate coefficient of dislocations", unit="1/s", bounds=(1e-12, 1e5), scale="log", off=0.0, widens=True
        ),
        n: Param("stress exponent", bounds=(1, 8)),
        Q: Param("activation energy of dislocations", unit="J/mol", bounds=(1e4, 3e5)),
        A_s: Param(
            "rate coefficient of solution", unit="K um^3/s", bounds=(1e2, 1e16), scale="log", off=0.0, widens=True
        ),
        Q_s: Param("activation energy of solution", unit="J/mol", bounds=(5e3, 1e5)),
    },
    references=("Zill, Wang and Nagel (2022), The Mechanical Behavior of Salt X, doi:10.1201/9781003295808-33",),
)

OGS = "of https://github.com/ufz/ogs"

ROCK_SALT = Material(
    name="rock-salt",
    title="rock salt, dislocation creep and pressure solution",
    law=SALT,
    values={"A": 0.18 / DAY, "n": 5.0, "Q": 54e3, "A_s": 6.5e-5 * 1e18 / DAY, "Q_s": 24.5e3},
    ranges={"stress": (0.1, 20.0), "temperature": (7.8 + 273.15, 200.0 + 273.15), "grain_size": (5e4, 5e4)},
    source=(
        "Zill, Wang and Nagel (2022), The Mechanical Behavior of Salt X, doi:10.1201/9781003295808-33; "
        f"Tests/Data/Mechanics/PLLC/PLLC.py {OGS}"
    ),
    form="2 to 25 times slower than many of the tests that the source compares; grains larger than the usual 1 cm",
)

ROCK_SALT_BGRA = Material(
    name="rock-salt-bgra",
    title="rock salt, BGRa, dislocation creep",
    law=norton_arrhenius(T_REF),
    values={"A": at_reference(0.18 / DAY, 54e3, T_REF), "n": 5.0, "Q": 54e3},
    ranges={"temperature": (0.0 + 273.15, 100.0 + 273.15), "stress": (5.0, 20.0)},
    source=(
        "Wang (2018), BGRa creep model, section Example, web/content/docs/benchmarks/creepbgra/CreepBRGa.md, and "
        f"Tests/Data/ThermoMechanics/CreepBGRa/Verification/m2_1Dcreep {OGS}"
    ),
)


@hookimpl
def creepkit_materials() -> list[Material]:
    return [ROCK_SALT, ROCK_SALT_BGRA]
