"""Make the bulge test of `creepkit demo`: a planted law, one dimple, and the noise of cameras.

Run it to write it anew:  python examples/00_make_a_virtual_bulge_test.py FOLDER
Strain hardening, 8 then 10 MPa, observed every 150 s; simulated on twice as many elements each way, and in finer
steps, than the identification will use. The noise is white, with the standard deviations measured on real dimples:
1.5 um of the amplitude, 0.02 mm of the width, 0.02 of the shape.
"""

import json
import sys
from pathlib import Path

import numpy as np

import creepkit as ck
from creepkit.readers.history_csv import write_history

LAW = "strain-hardening"
TRUTH = {"A": 4e-16, "n": 4.4, "m": -0.35}
LOADING = ck.PressureJump(P1=8, P2=10, Tj=4 * 3600)
TIMES = np.arange(0, 12 * 3600 + 1, 150.0)
NOISE, SEED = {"amplitude": 0.0015, "width": 0.02, "shape": 0.02}, 3
ROUNDED = {"amplitude": 6, "width": 4, "shape": 4}


def main(folder: Path) -> None:
    """Write virtual_bulge_test.csv and truth.json."""
    rng = np.random.default_rng(SEED)
    fine = ck.specimen("bulge").replace(refinement=2, tolerance=1e-3)
    clean = ck.simulate(
        LAW, fine, TRUTH, loading=LOADING, times=TIMES, temperature=780 + 273.15, elastic=ck.Elastic(E=100e3)
    )
    noisy = {name: values + rng.normal(0, NOISE[name], values.size) for name, values in clean.outputs.items()}
    outputs = {name: np.round(values, ROUNDED[name]) for name, values in noisy.items()}
    test = clean.replace(name="virtual bulge test", outputs=outputs)
    folder.mkdir(parents=True, exist_ok=True)
    write_history(test, folder / "virtual_bulge_test.csv")
    truth = {"law": LAW, "values": TRUTH, "noise": NOISE, "seed": SEED}
    (folder / "truth.json").write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path("planted"))
