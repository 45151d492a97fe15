"""Coverage of the 95 % intervals of an identification from loading to rupture: planted MPC Omega tests.

    python tests/benchmarks/rupture_coverage.py [--campaigns 40] [--write]

Each simulated campaign has eight tests at 60 to 110 MPa, two of them stopped at half their life; creep rates scatter by
15 % from test to test, lives by 8 % more. Asked for are the parameters, the rupture time of the law at 50 MPa, below
all tests, and the rupture time of single tests there. The table gives the share of campaigns whose 95 % interval holds
the planted value (of single tests: the mean share of 1,000 drawn tests).
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from measured import Page, arguments, progress
from public_calls import rupture_times

import creepkit as ck
from creepkit.records import History, constant_stress

sys.path.insert(0, str(Path(__file__).parents[1]))
from helpers.rupture_tests import BAR, OMEGA, SCATTER, campaign

VALUES = {"A": 1e-16, "n": 4.0, "m": 20.0}
STRESSES = (60, 70, 80, 95, 110, 60, 80, 110)
PREDICTED_STRESS = 50.0
"""MPa."""


def coverage(seed, true_life):
    """Whether the intervals hold each parameter and the law's rupture time, and the share of single tests held."""
    tests = campaign(OMEGA, VALUES, STRESSES, seed, stopped=(0, 6))
    fit = ck.identify(OMEGA, tests, using=BAR, starts=2, frames=16)
    _, low, high = fit.rupture_time(PREDICTED_STRESS, 1000.0, test_scatter=False)
    spread = np.hypot(SCATTER["rate"], SCATTER["life"])
    lives = true_life * np.exp(spread * np.random.default_rng(seed).standard_normal(1000))
    _, low_of_test, high_of_test = fit.rupture_time(PREDICTED_STRESS, 1000.0)
    held = [e.low <= VALUES[e.name] <= e.high for e in fit.estimates]
    return [*held, bool(low < true_life < high), float(np.mean((low_of_test < lives) & (lives < high_of_test)))]


def main():
    parser = arguments(__doc__)
    parser.add_argument("--campaigns", type=int, default=40)
    options = parser.parse_args()
    page = Page("rupture_coverage", __doc__)
    plan = History("50 MPa", np.array([1e8]), {}, constant_stress(PREDICTED_STRESS), 1000.0)
    true_life = float(rupture_times(BAR, OMEGA, VALUES, [plan])[0])
    rows = []
    for k in range(options.campaigns):
        rows.append(coverage(100 + k, true_life))
        progress(f"{k + 1} of {options.campaigns} campaigns")
    page.table("quantity", "share inside the 95 % interval, %", "campaigns")
    names = [*OMEGA.names, "rupture time of the law, 50 MPa", "rupture time of a single test, 50 MPa"]
    for name, share in zip(names, np.mean(rows, axis=0), strict=True):
        page.row(name, f"{100 * share:.0f}", len(rows))
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
