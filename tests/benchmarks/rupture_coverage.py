"""How often 95 % intervals of a whole-life identification hold the truth: planted MPC Omega, 40 simulated campaigns.

    python tests/benchmarks/rupture_coverage.py [--campaigns 40]

Each has eight tests at 60 to 110 MPa, two of them stopped at half their life; rates scatter by 15 %, lives by 8 % more.
Asked are the parameters, the rupture time of the law at 50 MPa, below all tests, and that of single tests there.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

import creepkit as ck
from creepkit.records import History, constant_stress

sys.path.insert(0, str(Path(__file__).parents[1]))
from test_inverse_rupture import BAR, OMEGA, SCATTER, campaign

VALUES = {"A": 1e-16, "n": 4.0, "m": 20.0}
STRESSES = (60, 70, 80, 95, 110, 60, 80, 110)


def one(seed, truth):
    """Which parameters and the law's rupture time their intervals hold, and the share of single tests there."""
    fit = ck.identify(OMEGA, campaign(OMEGA, VALUES, STRESSES, seed, stopped=(0, 6)), using=BAR, starts=2, frames=16)
    _, low, high = fit.rupture_time(50.0, 1000.0, test_scatter=False)
    spread = np.hypot(SCATTER["rate"], SCATTER["life"])
    tests = truth * np.exp(spread * np.random.default_rng(seed).standard_normal(1000))
    _, less, more = fit.rupture_time(50.0, 1000.0)
    held = [e.low <= VALUES[e.name] <= e.high for e in fit.estimates]
    return [*held, bool(low < truth < high), float(np.mean((less < tests) & (tests < more)))]


def main():
    """Print the shares."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--campaigns", type=int, default=40)
    given = parser.parse_args()
    plan = History("50 MPa", np.array([1e8]), {}, constant_stress(50.0), 1000.0)
    truth = float(BAR.predict_to_rupture(OMEGA, OMEGA.to_internal(VALUES), [plan]).life.ruptures[0, 0])
    shares = np.mean([one(100 + k, truth) for k in range(given.campaigns)], axis=0)
    names = [*OMEGA.names, "rupture time of the law", "rupture of a single test"]
    print("; ".join(f"{name} {100 * share:.0f} %" for name, share in zip(names, shares, strict=True)))


if __name__ == "__main__":
    main()
