"""Make the curves of `creepkit demo`: a planted law, nine tests, and what real tests add to it.

Run it to write them anew:  python examples/make_planted_curves.py FOLDER
Strain hardening with an Arrhenius factor; each test has its own rate (10 % scatter), its own loading strain and
white noise of the extensometer, drawn from one seed.
"""

import json
import sys
from pathlib import Path

import numpy as np

import creepkit as ck
from creepkit.readers.writing import write_history

TRUTH = {"A": 4.0e-14, "n": 4.2, "m": -0.35, "Q": 340e3}
T_REF = 800 + 273.15
CONDITIONS = {750: (90, 120, 150), 800: (60, 80, 110), 850: (40, 55, 75)}
RATE_SCATTER, LOADING_STRAIN, NOISE, SEED = 0.10, 1.5e-4, 2e-5, 7


def main(folder: Path) -> None:
    """Write one CSV a test, and truth.json."""
    law = ck.law("strain-hardening").times(ck.arrhenius(T_ref=T_REF))
    specimen = ck.specimen("uniaxial")
    rng = np.random.default_rng(SEED)
    folder.mkdir(parents=True, exist_ok=True)
    for celsius, stresses in CONDITIONS.items():
        for stress in stresses:
            own = {**TRUTH, "A": TRUTH["A"] * np.exp(rng.normal(0, RATE_SCATTER))}
            times = np.concatenate([[0.0], np.geomspace(60, 3.6e6, 2000)])
            clean = ck.simulate(law, specimen, own, loading=ck.constant_stress(stress), times=times, temperature=celsius + 273.15)
            strain = clean.outputs["strain"]
            end = times[: strain.size][strain < 0.03][-1]
            kept = np.unique(np.searchsorted(times[: strain.size], np.geomspace(60, end, 60)))
            noisy = strain[kept] + rng.normal(0, LOADING_STRAIN) + rng.normal(0, NOISE, kept.size)
            name = f"planted_{celsius}C_{stress}MPa"
            test = clean.replace(name=name, times=np.round(times[kept], 1), outputs={"strain": np.round(noisy, 7)}, source="")
            write_history(test, folder / f"{name}.csv")
    truth = {"law": "strain-hardening", "T_ref": T_REF, "values": TRUTH, "rate_scatter": RATE_SCATTER}
    (folder / "truth.json").write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path("planted"))
