"""Laws recovered from planted bending tests: coverage of 95 % intervals, and errors of rates, over planted specimens.

    python tests/benchmarks/bending_recovery.py [--specimens 20] [--write]

Each planted specimen is an alloy of which five beams are tested in three-point bending at 120 to 300 N and 1000 K. The
data come from another discretisation: 24 stations of 40 fibres by the midpoint rule in half a beam, integrated by an
explicit Runge-Kutta method of scipy. Noise of 0.002 mm is added, and the height of each beam differs from its nominal
4 mm by 0.5 % (one standard deviation), which the identification is not given: height is a nuisance parameter. The
tables give the share of specimens whose 95 % interval holds the planted value, and the error of the rate at 60 MPa.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from measured import Page, arguments, progress

import creepkit as ck

sys.path.insert(0, str(Path(__file__).parents[2] / "plugins" / "creepkit-specimens"))
sys.path.insert(0, str(Path(__file__).parents[2] / "plugins" / "creepkit-specimens" / "tests"))
from beam_tests import planted
from creepkit_specimens.bending import ThreePointBend

FORCES = (120.0, 160.0, 200.0, 250.0, 300.0)
"""N."""
TIMES = np.geomspace(3600.0, 3.6e6, 30)
"""s."""
STRESS, STRAIN = 60.0, 0.005
"""MPa; strain at which the rate of a hardening law is compared."""
LAWS = ("norton", "strain-hardening")


def planted_values(law: str, rng: np.random.Generator) -> dict[str, float]:
    """Values whose rate at 60 MPa, and 0.5 % strain, lies from 3e-9 to 3e-8 a second."""
    n, rate = rng.uniform(2.0, 6.0), 3e-9 * 10 ** rng.uniform(0.0, 1.0)
    if law == "norton":
        return {"A": rate / STRESS**n, "n": n}
    m = rng.uniform(-0.8, -0.3)
    return {"A": rate / (STRESS**n * STRAIN**m), "n": n, "m": m}


def log_rate(values: dict[str, float]) -> float:
    """ln of the rate at 60 MPa and 0.5 % strain, 1/s."""
    return float(np.log(values["A"]) + values["n"] * np.log(STRESS) + values.get("m", 0.0) * np.log(STRAIN))


def recovered(law: str, seed: int) -> tuple[list[bool], float]:
    """Whether each parameter's interval holds its planted value, and the error of the ln of the rate."""
    values = planted_values(law, np.random.default_rng(1000 + seed))
    tests = planted(values, FORCES, TIMES, seed, strain_power=values.get("m", 0.0))
    fit = ck.identify(law, tests, ThreePointBend(), starts=2, nuisances=["height"], seed=seed)
    found = {estimate.name: estimate.value for estimate in fit.estimates}
    held = [bool(estimate.low <= values[estimate.name] <= estimate.high) for estimate in fit.estimates]
    return held, log_rate(found) - log_rate(values)


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--specimens", type=int, default=20)
    options = parser.parse_args()
    page = Page("bending_recovery", __doc__)
    page.table("law", "parameter", "share inside the 95 % interval, %", "specimens")
    errors = {}
    for law in LAWS:
        rows = []
        for seed in range(options.specimens):
            rows.append(recovered(law, seed))
            progress(f"{law}: {seed + 1} of {options.specimens} planted specimens")
        for name, share in zip(ck.law(law).names, np.mean([held for held, _ in rows], axis=0), strict=True):
            page.row(law, name, f"{100 * share:.0f}", len(rows))
        errors[law] = np.abs([error for _, error in rows])
    page.table("law", "median error of the rate at 60 MPa, %", "90 % of the errors below, %")
    for law, own in errors.items():
        page.row(law, f"{100 * np.median(own):.2f}", f"{100 * np.quantile(own, 0.9):.2f}")
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
