"""Simulate the tests of this study: three under constant load, and the one that the study of these proposes.

The law is strain hardening. Rates scatter between test pieces (standard deviation 5 %), each test has a loading strain
of its own, and the extensometer has white noise. To write the files anew::

    python examples/studies/strain_or_time_hardening/make_data.py
"""

import json
from pathlib import Path

import numpy as np

import creepkit as ck

HERE = Path(__file__).parent
HOUR = 3600.0
TRUTH = {"A": 2.5e-18, "n": 4.6, "m": -0.4}
CONSTANT = {"CL-1": 120.0, "CL-2": 150.0, "CL-3": 180.0}  # MPa
STEPPED = {"ST-1": ((0.0, 100.0), (24 * HOUR, 134.0))}  # s, MPa
LONGEST, LARGEST_STRAIN, TEMPERATURE, MODULUS = 72 * HOUR, 0.02, 973.15, 150e3
RATE_SCATTER, LOADING_STRAIN, NOISE, SEED = 0.05, 1e-4, 2e-5, 5


def main() -> None:
    """Write tests/constant/*.csv, tests/stepped/*.csv and truth.json."""
    rng = np.random.default_rng(SEED)
    programs = {name: ("constant", ((0.0, stress),)) for name, stress in CONSTANT.items()}
    programs |= {name: ("stepped", steps) for name, steps in STEPPED.items()}
    for name, (folder, steps) in programs.items():
        times = np.concatenate([np.arange(60.0, HOUR, 60.0), np.arange(HOUR, LONGEST + 1, 600.0)])
        exact = ck.simulate(
            "strain-hardening",
            "uniaxial",
            {**TRUTH, "A": TRUTH["A"] * np.exp(rng.normal(0, RATE_SCATTER))},
            loading=ck.StressSteps(steps, control="load"),
            times=times,
            temperature=TEMPERATURE,
        )
        strain = exact.outputs["strain"]
        last = int(np.searchsorted(strain, LARGEST_STRAIN))
        kept = np.unique(np.geomspace(1, last, 90).astype(int)) - 1
        noisy = strain[kept] + rng.normal(0, LOADING_STRAIN) + rng.normal(0, NOISE, kept.size)
        test = exact.replace(name=name, times=times[kept], outputs={"strain": np.round(noisy, 6)}, source="")
        (HERE / "tests" / folder).mkdir(parents=True, exist_ok=True)
        with ck.overwriting():  # files that version control put there
            ck.write_history(test, HERE / "tests" / folder / f"{name}.csv")
    (HERE / "truth.json").write_text(json.dumps({"law": "strain-hardening", "values": TRUTH}) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
