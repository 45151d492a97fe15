r"""Simulate creep curves with a known law
======================================

How the simulated creep curves that ship with this package were made: a known law, nine tests, and what real tests add.

The law is strain hardening times an Arrhenius factor. At constant stress, strain hardening and time hardening give the
same curve; one test of each temperature therefore has a step of stress after 40 h, which tells them apart. Each test
has its own rate (standard deviation 10 %), its own loading strain, and white noise of the extensometer. To write the
curves anew::

    python examples/00_make_planted_curves.py [FOLDER]
"""

import json
import sys
from pathlib import Path

import numpy as np

import creepkit as ck

# %%
# The law, the tests and the noise
# --------------------------------

TRUTH = {"A": 6.0e-17, "n": 4.2, "m": -0.35, "Q": 340e3}
T_REF = 800 + 273.15  # K
STEP = 40 * 3600.0  # s
CONDITIONS = {  # temperature in C: steps (time in s, stress in MPa) of each test
    750: [[(0, 90)], [(0, 130)], [(0, 90), (STEP, 140)]],
    800: [[(0, 60)], [(0, 100)], [(0, 60), (STEP, 95)]],
    850: [[(0, 40)], [(0, 70)], [(0, 40), (STEP, 65)]],
}
RATE_SCATTER, LOADING_STRAIN, NOISE, SEED = 0.10, 1.5e-4, 2e-5, 7

# %%
# Simulate, add scatter and noise, and write
# ------------------------------------------


def main(folder: Path) -> None:
    """Write one CSV file a test, and truth.json."""
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
            kept = np.unique(np.searchsorted(times[: strain.size], np.geomspace(60, end, 60)))
            noisy = strain[kept] + rng.normal(0, LOADING_STRAIN) + rng.normal(0, NOISE, kept.size)
            name = f"planted_{celsius}C_" + "_to_".join(f"{stress}" for _, stress in steps) + "MPa"
            outputs = {"strain": np.round(noisy, 7)}
            test = clean.replace(name=name, times=np.round(times[kept], 1), outputs=outputs, source="")
            with ck.overwriting():  # files that version control put there
                ck.write_history(test, folder / f"{name}.csv")
    truth = {"law": "strain-hardening", "T_ref": T_REF, "values": TRUTH, "rate_scatter": RATE_SCATTER}
    (folder / "truth.json").write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    folders = [word for word in sys.argv[1:] if word != "--quick"]
    main(Path(folders[0]) if folders else Path("planted_creep_curves"))
