"""Simulate the tests of this study: a plate of 25 dimples, five of each of five alloys, under one gas pressure.

The dimples of an alloy differ in thickness, so that one pressure makes five stresses; after an hour the pressure is
raised. Finite elements of a finer mesh than identifications use, and noise as of measured profiles. Four
alloys harden with strain, each with exponents of its own, and one obeys Norton's law. To write the files anew::

    python examples/studies/plate_of_dimples/make_data.py
"""

import json
from pathlib import Path

import numpy as np

import creepkit as ck

HERE = Path(__file__).parent
TRUTH = {
    "A1": ("strain-hardening", {"A": 2.2e-14, "n": 3.3, "m": -0.33}),
    "A2": ("strain-hardening", {"A": 2.0e-15, "n": 3.7, "m": -0.4}),
    "A3": ("strain-hardening", {"A": 2.4e-15, "n": 4.0, "m": -0.2}),
    "A4": ("norton", {"A": 3.2e-15, "n": 4.3}),
    "A5": ("strain-hardening", {"A": 1.0e-16, "n": 4.6, "m": -0.25}),
}
THICKNESSES = (0.46, 0.48, 0.50, 0.52, 0.54)  # mm, at the apex
LOADING = ck.PressureJump(P1=8, P2=10, Tj=3600.0)  # MPa, s
TIMES = np.concatenate([np.arange(200.0, 3600.0, 400.0), np.arange(3600.0, 3 * 3600.0 + 1, 900.0)])
TEMPERATURE, ELASTIC = 1073.15, ck.Elastic(E=150e3)
NOISE, SEED = {"amplitude": 1.5e-3, "width": 0.02, "shape": 0.02}, 1


def main() -> None:
    """Write tests/*.csv, one file a dimple, and truth.json."""
    rng = np.random.default_rng(SEED)
    specimen = ck.specimen("bulge").replace(refinement=2.0, tolerance=1e-3)
    (HERE / "tests").mkdir(exist_ok=True)
    for alloy, (law, values) in TRUTH.items():
        for number, thickness in enumerate(THICKNESSES, 1):
            name, measured = f"{alloy}-{number}", thickness + round(rng.normal(0, 0.002), 3)
            exact = ck.simulate(
                law,
                specimen.replace(apex_thickness=measured),
                values,
                loading=LOADING,
                times=TIMES,
                temperature=TEMPERATURE,
                elastic=ELASTIC,
            )
            outputs = {
                key: np.round(row + rng.normal(0, NOISE[key], row.size), 5) for key, row in exact.outputs.items()
            }
            test = exact.replace(name=name, alloy=alloy, outputs=outputs, source="", standard_deviation=NOISE)
            with ck.overwriting():  # files that version control put there
                ck.write_history(test, HERE / "tests" / f"{name}.csv")
    truth = {alloy: {"law": law, "values": values} for alloy, (law, values) in TRUTH.items()}
    (HERE / "truth.json").write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
