"""Exported creep laws run by CalculiX, beside creepkit's own solver.

    python tests/benchmarks/verify_export.py [LAW ...] [--cetol 1e-4 1e-5] [--keep FOLDER] [--write]

Each law is exported with `ck.export(law, "calculix")`, compiled by gfortran and preloaded before CalculiX 2.20, built
from Debian's source. One element in tension follows steps of stress for 12 h (compared: creep strain), and the dimple
is bulged for 12 h (compared: apex displacement, mm). CalculiX is backward Euler: two values of its tolerance cetol give
its limit of small increments, on the same mesh. Differences are the largest from 10 min on, in percent of the last
value of that limit; increments of CalculiX stand in brackets.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from calculix import TIMES, Result, Stopped, difference, run
from calculix_deck import Deck, UserLaw, extrapolated
from calculix_source import built, compiled
from measured import Page, arguments

import creepkit as ck
from creepkit.arrays import Floats
from creepkit.fem.mesh import Mesh
from creepkit.language import CreepLaw, Elastic
from creepkit.records import PressureJump, Program, RecordedLoading
from creepkit.specimens.bulge.specimen import Bulge

E, NU = 150e3, 0.3
KELVIN = 1073.15

LAWS = {
    "norton": dict(A=2e-12, n=3.0),
    "drifting-exponent": dict(A=5e-13, n_0=3.3, n_inf=3.1, C=0.6, tau_d=7800.0, tau_r=4700.0, m=-0.1),
    "combined": dict(A_1=1e-8, n_1=2.0, B=60.0, A_2=3e-13, n_2=3.0, m_1=-0.2, A_3=1e-11, n_3=3.0, m_2=-0.4),
    "logarithmic": dict(A=4e-12, n=3.0, e_0=0.1),
    "norton x arrhenius": dict(A=1e-12, n=3.0, Q=3e5),
    "kachanov-rabotnov": dict(A=1e-12, n=3.0, B=6e-14, chi=4.0, phi=3.0),
}
"""Values of each law. Of the last three, two come from plugins, and one is used 50 K above its T_ref."""


def law_of(name: str) -> CreepLaw:
    """The law of a name of LAWS; damage by the von Mises stress, for CREEP knows no other."""
    isothermal, _, temperature_form = name.partition(" x ")
    law = ck.law(isothermal)
    if "alpha" in law.names:
        law = law.fix(alpha=0.0, m=0.0)
    return law.times(ck.arrhenius(T_ref=1023.15)) if temperature_form else law


@dataclass(frozen=True)
class Case:
    """A law with its values and the shared library of its export."""

    name: str
    law: CreepLaw
    values: dict[str, float]
    library: Path


def exported_case(name: str, folder: Path) -> Case:
    """Export and compile one law."""
    law = law_of(name)
    text = ck.export(ck.law_with_values(law, LAWS[name], notes=["for the verification against CalculiX"]), "calculix")
    return Case(name, law, LAWS[name], compiled(text, folder, name.replace(" ", "_").replace("-", "_")))


STRESS = Program(
    np.array([0.0, 5.0, 14400.0, 14405.0, 28800.0, 28805.0, 43200.0]),
    np.array([0.0, 60.0, 60.0, 75.0, 75.0, 50.0, 50.0]),
)
"""MPa over s: tension in three steps, with ramps of 5 s."""

BULGE = PressureJump(8.0, 10.0, 14400.0)


def bar() -> Mesh:
    """One element of 1 mm x 1 mm about the axis, held below and pulled above."""
    corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
    middles = [(0.5, 0.0), (1.0, 0.5), (0.5, 1.0), (0.0, 0.5)]
    nodes = np.array(corners + middles)
    held = np.zeros((8, 2), bool)
    held[[0, 1, 4], 1] = True
    return Mesh(nodes, np.arange(8)[None], held, np.array([[2, 6, 3]]), np.array([3, 6, 2]))


def element(case: Case, cetols: list[float], program: Path) -> tuple[Floats, list[tuple[Floats, Result]]]:
    """Creep strain of a bar, (times,): creepkit's, and CalculiX's for each cetol."""
    pull = Program(STRESS.times, -STRESS.values)
    deck = Deck(bar(), E, NU, UserLaw(KELVIN), pull, TIMES, np.array([3]), first=1e-3, large=False)
    runs = [run(replace(deck, cetol=cetol), program, case.library) for cetol in cetols]
    loading = RecordedLoading(STRESS, "stress", control="stress")
    bar_test = ck.specimen("uniaxial").replace(tolerance=1e-9)
    own = ck.simulate(case.law, bar_test, case.values, loading=loading, times=TIMES, temperature=KELVIN)
    elastic = STRESS.at(TIMES) / E
    return own.outputs["strain"], [(r.displacements[:, 0, 1] - elastic, r) for r in runs]


def dimple(case: Case, cetols: list[float], program: Path) -> tuple[Floats, list[tuple[Floats, Result]]]:
    """Apex displacement of the true dimple, (times,) mm: creepkit's, and CalculiX's for each cetol."""
    specimen = Bulge()
    mesh = specimen.geometry.mesh(1.0)
    deck = Deck(mesh, E, NU, UserLaw(KELVIN), BULGE.program(), TIMES, mesh.top[:1])
    runs = [run(replace(deck, cetol=cetol), program, case.library) for cetol in cetols]
    own = ck.simulate(
        case.law, specimen, case.values, loading=BULGE, times=TIMES, temperature=KELVIN, elastic=Elastic(E=E, nu=NU)
    )
    return own.displacement(radius=0.0), [(r.displacements[:, 0, 1], r) for r in runs]


SPECIMENS = {"one element": element, "dimple": dimple}


def cells(case: Case, specimen: str, cetols: list[float], program: Path) -> list[str]:
    """One row of the table."""
    own, theirs = SPECIMENS[specimen](case, cetols, program)
    (coarse, few), (fine, many) = theirs[-2:]
    limit = extrapolated(coarse, fine, (few.increments, many.increments))
    return [
        case.name,
        specimen,
        f"{own[-1]:.6g}",
        f"{limit[-1]:.6g}",
        *(f"{difference(values, limit):.3f} ({result.increments})" for values, result in theirs),
        f"{difference(own, limit):.3f}",
    ]


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("laws", nargs="*", default=list(LAWS), help="some of: " + ", ".join(LAWS))
    parser.add_argument("--cetol", nargs="+", type=float, default=[1e-4, 1e-5])
    parser.add_argument("--keep", type=Path, help="keep the exported files and libraries in this folder")
    options = parser.parse_args()
    unknown = [name for name in options.laws if name not in LAWS]
    if unknown or len(set(options.cetol)) < 2:
        parser.error(f"no law is called {', '.join(unknown)}" if unknown else "two values of cetol are needed")
    cetols = sorted(options.cetol, reverse=True)
    program = built()
    page = Page("verify_export", __doc__)
    heads = [f"CalculiX, cetol {c:g}: difference, % (increments)" for c in cetols]
    page.table("law", "specimen", "creepkit at 12 h", "CalculiX, limit at 12 h", *heads, "creepkit: difference, %")
    with tempfile.TemporaryDirectory() as scratch:
        folder = options.keep or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        for name in options.laws:
            case = exported_case(name, folder)
            for specimen in SPECIMENS:
                try:
                    page.row(*cells(case, specimen, cetols, program))
                except Stopped as stopped:
                    page.row(name, specimen, str(stopped), *[""] * (len(cetols) + 2))
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
