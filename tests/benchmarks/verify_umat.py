"""Exported stress updates run by CalculiX as UMAT, beside creepkit's own solver.

    python tests/benchmarks/verify_umat.py [LAW ...] [--longest 150 75] [--write]

Each law is exported with `ck.export(law, "calculix-umat")`, compiled by gfortran and preloaded before CalculiX 2.20,
built from Debian's source, as material ABAQUSNL..., for which CalculiX forms logarithmic strains, or ABAQUS... in the
element, whose strains are small. The element follows steps of tension for 12 h (compared: strain less stress over E),
and the dimple is bulged for 12 h (compared: apex displacement, mm). Two lengths of the longest increment, s, give
CalculiX's limit of small increments, on the same mesh, as its error falls with their square. Differences are the
largest from 10 min on, in percent of the last value of that limit; increments stand in brackets.
"""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from calculix import TIMES, Stopped, difference, run
from calculix_deck import Deck, UserMaterial
from calculix_source import built, compiled
from measured import Page, arguments
from verify_export import BULGE, KELVIN, NU, STRESS, E, bar

import creepkit as ck
from creepkit.arrays import Floats
from creepkit.language import Elastic
from creepkit.records import Program, RecordedLoading
from creepkit.specimens.bulge.specimen import Bulge

LAWS = {
    "norton": dict(A=2e-12, n=3.0),
    "combined": dict(A_1=1e-8, n_1=2.0, B=60.0, A_2=3e-13, n_2=3.0, m_1=-0.2, A_3=1e-11, n_3=3.0, m_2=-0.4),
    "kachanov-rabotnov": dict(A=1e-12, n=3.0, B=6e-14, chi=4.0, phi=3.0, alpha=0.3, m=0.0),
}
"""Values of each law; damage by the largest principal stress, which CREEP is not given."""


def decks(specimen: str) -> tuple[Deck, Floats]:
    """CalculiX's input but for increments, and what is to be taken from its displacements at TIMES, (times,) mm."""
    material = UserMaterial(KELVIN)
    if specimen == "one element":
        pull = Program(STRESS.times, -STRESS.values)
        return Deck(bar(), E, NU, material, pull, TIMES, np.array([3]), first=1e-3, large=False), STRESS.at(TIMES) / E
    mesh = Bulge().geometry.mesh(1.0)
    return Deck(mesh, E, NU, material, BULGE.program(), TIMES, mesh.top[:1]), np.zeros(TIMES.size)


def simulated(specimen: str, law: ck.CreepLaw, values: dict[str, float]) -> Floats:
    """creepkit's own, (times,): creep strain of a bar, or apex displacement, mm."""
    if specimen == "one element":
        loading = RecordedLoading(STRESS, "stress", control="stress")
        test = ck.specimen("uniaxial").replace(tolerance=1e-9)
        return ck.simulate(law, test, values, loading=loading, times=TIMES, temperature=KELVIN).outputs["strain"]
    elastic = Elastic(E=E, nu=NU)
    bulge = ck.simulate(law, Bulge(), values, loading=BULGE, times=TIMES, temperature=KELVIN, elastic=elastic)
    return bulge.displacement(radius=0.0)


def cells(name: str, specimen: str, longest: list[float], program: Path, folder: Path) -> list[str]:
    """One row of the table."""
    law, values = ck.law(name), LAWS[name]
    text = ck.export(law, "calculix-umat", values, elastic=Elastic(E=E, nu=NU))
    library = compiled(text, folder, name.replace("-", "_"))
    deck, offset = decks(specimen)
    deck = replace(deck, creep=UserMaterial(KELVIN, 2 + len(law.states)))
    runs = [run(replace(deck, longest=length), program, library) for length in longest]
    coarse, fine = (result.displacements[:, 0, 1] - offset for result in runs)
    ratio = (longest[0] / longest[1]) ** 2
    limit = (ratio * fine - coarse) / (ratio - 1)
    own = simulated(specimen, law, values)
    theirs = [f"{difference(d, limit):.4f} ({r.increments})" for d, r in zip((coarse, fine), runs, strict=True)]
    return [name, specimen, f"{own[-1]:.6g}", f"{limit[-1]:.6g}", *theirs, f"{difference(own, limit):.4f}"]


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("laws", nargs="*", default=list(LAWS), help="some of: " + ", ".join(LAWS))
    parser.add_argument("--longest", nargs=2, type=float, default=[150.0, 75.0])
    parser.add_argument("--specimens", nargs="*", default=["one element", "dimple"])
    options = parser.parse_args()
    longest = sorted(options.longest, reverse=True)
    program = built()
    page = Page("verify_umat", __doc__)
    heads = [f"CalculiX, at most {length:g} s: difference, % (increments)" for length in longest]
    page.table("law", "specimen", "creepkit at 12 h", "CalculiX, limit at 12 h", *heads, "creepkit: difference, %")
    with tempfile.TemporaryDirectory() as scratch:
        for name in options.laws:
            for specimen in options.specimens:
                try:
                    page.row(*cells(name, specimen, longest, program, Path(scratch)))
                except Stopped as stopped:
                    page.row(name, specimen, str(stopped), *[""] * (len(longest) + 2))
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
