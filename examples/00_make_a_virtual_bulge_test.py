r"""Simulate the bulge test of the demo
===================================

How the bulge test that ships with this package was made: a known law, one dimple, and the noise of cameras.

Strain hardening under 8 and then 10 MPa is observed every 150 s. It is simulated with twice as many elements in each
direction, and with finer time steps, than the identification uses. The noise is white, with the standard deviations
measured on real dimples: 1.5 um of the amplitude, 0.02 mm of the width, 0.02 of the shape. To write the test anew::

    python examples/00_make_a_virtual_bulge_test.py [FOLDER]
"""

import json
import sys
from pathlib import Path

import numpy as np

import creepkit as ck

# %%
# The law, the test and the noise
# -------------------------------

LAW = "strain-hardening"
TRUTH = {"A": 4e-16, "n": 4.4, "m": -0.35}
LOADING = ck.PressureJump(P1=8, P2=10, Tj=4 * 3600)  # MPa, MPa, s
TIMES = np.arange(0, 12 * 3600 + 1, 150.0)  # s
NOISE, SEED = {"amplitude": 0.0015, "width": 0.02, "shape": 0.02}, 3  # mm, mm, 1
DECIMALS = {"amplitude": 6, "width": 4, "shape": 4}

# %%
# Simulate, add noise and write
# -----------------------------


def main(folder: Path) -> None:
    """Write virtual_bulge_test.csv and truth.json."""
    rng = np.random.default_rng(SEED)
    fine = ck.specimen("bulge").replace(refinement=2, tolerance=1e-3)
    clean = ck.simulate(
        LAW, fine, TRUTH, loading=LOADING, times=TIMES, temperature=780 + 273.15, elastic=ck.Elastic(E=100e3)
    )
    noisy = {name: values + rng.normal(0, NOISE[name], values.size) for name, values in clean.outputs.items()}
    outputs = {name: np.round(values, DECIMALS[name]) for name, values in noisy.items()}
    test = clean.replace(name="virtual bulge test", outputs=outputs)
    folder.mkdir(parents=True, exist_ok=True)
    with ck.overwriting():  # files that version control put there
        ck.write_history(test, folder / "virtual_bulge_test.csv")
    truth = {"law": LAW, "values": TRUTH, "noise": NOISE, "seed": SEED}
    (folder / "truth.json").write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    folders = [word for word in sys.argv[1:] if word != "--quick"]
    main(Path(folders[0]) if folders else Path("planted_bulge_test"))
