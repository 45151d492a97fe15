"""Exported stress updates run by FElupe, beside creepkit and the closed form of a thick tube.

    python tests/benchmarks/felupe_update.py [--python PYTHON] [--write]

Each law is exported with `ck.export(law, "numpy-update")` and called by `felupe.MaterialStrain` at small strains. A bar
of eight hexahedra is stretched by 0.06 % in 10 s and held for 28 h: its stress, beside creepkit's specimen in
relaxation. A quarter of a plate with a hole, 1 mm to 2 mm, of bilinear elements in plane strain, creeps by Norton's law
(A = 1e-10) under a pressure of 5 MPa in the hole until its stresses are steady: hoop less radial stress at all points,
beside the closed form (2/n) p (b/r)^(2/n)/((b/a)^(2/n) - 1). Differences are the largest, in percent; iterations are
Newton's, an increment. Needs FElupe 11.3 (on PyPI), here or in the Python of the option.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

from measured import Page, arguments

import creepkit as ck

E, NU, KELVIN = 150e3, 0.3, 1073.15
HELD, STRAIN = 1e5, 6e-4
LAWS: dict[str, dict[str, float]] = {
    "norton": dict(A=1e-14, n=4.0),
    "strain-hardening": dict(A=1e-18, n=4.0, m=-0.6),
    "kachanov-rabotnov": dict(A=1e-14, n=4.0, B=6e-14, chi=4.0, phi=3.0, alpha=0.3, m=0.0),
}


def relaxed(name: str) -> float:
    """creepkit's own stress of the bar, MPa."""
    loading = ck.StrainSteps(((0.0, STRAIN),), ramp=10.0)
    specimen = ck.specimen("relaxation").replace(tolerance=1e-9)
    run = ck.simulate(
        ck.law(name),
        specimen,
        LAWS[name],
        loading=loading,
        times=[10.0 + HELD],
        elastic=ck.Elastic(E=E),
        temperature=KELVIN,
    )
    return float(run.outputs["stress"][-1])


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--python", type=Path, default=Path(sys.executable), help="one that has FElupe")
    options = parser.parse_args()
    page = Page("felupe_update", __doc__)
    with tempfile.TemporaryDirectory() as folder:

        def run(kind: str, name: str, *numbers: float, **values: float) -> dict[str, float]:
            file = Path(folder) / "law.py"
            ck.export(name, "numpy-update", LAWS[name] | values, elastic=ck.Elastic(E=E, nu=NU), to=file, force=True)
            models = Path(__file__).with_name("felupe_models.py")
            command = [options.python, models, json.dumps([kind, str(file), *numbers])]
            done = subprocess.run(command, capture_output=True, text=True)
            if done.returncode:
                raise SystemExit(done.stderr[-2000:])
            return dict(json.loads(done.stdout.splitlines()[-1]))

        page.table(
            "law", "bar, creepkit, MPa", *(f"FElupe, {n} increments: difference, % (iterations)" for n in (10, 40, 160))
        )
        for name in LAWS:
            own = relaxed(name)
            found = [run("bar", name, n) for n in (10, 40, 160)]
            page.row(
                name, f"{own:.6g}", *(f"{100 * (f['value'] / own - 1):.4f} ({f['iterations']:.1f})" for f in found)
            )
        page.table("plate with a hole, elements", *(f"{n} increments: difference, % (iterations)" for n in (10, 40)))
        for elements in (8, 16, 24):
            plate = [run("tube", "norton", n, elements, LAWS["norton"]["n"], A=1e-10) for n in (10, 40)]
            page.row(elements**2, *(f"{f['value']:.3f} ({f['iterations']:.1f})" for f in plate))
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
