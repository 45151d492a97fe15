"""Make the curves of `creepkit demo`: a planted law, nine tests, and what real tests add to it.

Run it to write them anew:  python examples/00_make_planted_curves.py FOLDER
Strain hardening with an Arrhenius factor. At constant stress strain and time hardening are one and the same, so one
test of each temperature has a step of stress after 40 h: that tells them apart. Each test has its own rate (10 %
scatter), its own loading strain and white noise of the extensometer, drawn from one seed.
"""

import json
import sys
from pathlib import Path

import numpy as np

import creepkit as ck
from creepkit.readers.history_csv import write_history

TRUTH = {"A": 6.0e-17, "n": 4.2, "m": -0.35, "Q": 340e3}
T_REF = 800 + 273.15
STEP = 40 * 3600.0
CONDITIONS = {
    750: [[(0, 90)], [(0, 130)], [(0, 90), (STEP, 140)]],
    800: [[(0, 60)], [(0, 100)], [(0, 60), (STEP, 95)]],
    850: [[(0, 40)], [(0, 70)], [(0, 40), (STEP, 65)]],
}
RATE_SCATTER, LOADING_STRAIN, NOISE, SEED = 0.10, 1.5e-4, 2e-5, 7


def main(folder: Path) -> None:
    """Write one CSV a test, and truth.json."""
    law = ck.law("strain-hardening").times(ck.arrhenius(T_ref=T_REF))
    specimen = ck.specimen("uniaxial")
    rng = np.random.default_rng(SEED)
    folder.mkdir(parents=True, exist_ok=True)
    for celsius, stresses in CONDITIONS.items():
        for steps in stresses:
            true_values = {**TRUTH, "A": TRUTH["A"] * np.exp(rng.normal(0, RATE_SCATTER))}
            times = np.concatenate([[0.0], np.geomspace(60, 2e7, 4000)])
            clean = ck.simulate(
                law,
                specimen,
                true_values,
                loading=ck.StressSteps(tuple(steps)),
                times=times,
                temperature=celsius + 273.15,
            )
            strain = clean.outputs["strain"]
            end = times[: strain.size][strain < 0.03][-1]
            indices = np.unique(np.searchsorted(times[: strain.size], np.geomspace(60, end, 60)))
            noisy = strain[indices] + rng.normal(0, LOADING_STRAIN) + rng.normal(0, NOISE, indices.size)
            name = f"planted_{celsius}C_" + "_to_".join(f"{stress}" for _, stress in steps) + "MPa"
            test = clean.replace(
                name=name, times=np.round(times[indices], 1), outputs={"strain": np.round(noisy, 7)}, source=""
            )
            write_history(test, folder / f"{name}.csv")
    truth = {"law": "strain-hardening", "T_ref": T_REF, "values": TRUTH, "rate_scatter": RATE_SCATTER}
    (folder / "truth.json").write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path("planted"))
