"""Coverage of the bounds of rupture strength: planted Larson-Miller tests with heats and run-outs.

    python tests/benchmarks/rupture_strength_coverage.py [--sets 200] [--write]

Each simulated set has tests at 550, 600 and 650 °C of 20 to 10,000 h in the mean, planted by Larson-Miller's method
with C = 20 and a quadratic of log stress; log10 of times scatters between heats as the table says, and by 0.08 between
tests of a heat; tests are stopped at a given time (run-outs). Asked for are the strengths at 600 °C and 1e4 and 1e5 h.
The table gives the share of sets whose 95 % bounds of the mean hold the planted strength, and the mean share of 400
drawn new heats, and of 400 drawn tests of new heats, whose own strength lies within theirs; wherever a bound is missing
it counts as infinite. "Larson-Miller" fits that method with a quadratic alone, "average" all three methods with
polynomials of degree 1 to 3. A share of sets has a standard error of 2.2 % with 100 sets, 1.5 % with 200.
"""

from __future__ import annotations

import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
from measured import Page, arguments, progress

import creepkit as ck
from creepkit.rupture_assessment.fitting import conditions_of, fit_method
from creepkit.rupture_assessment.methods import LARSON_MILLER
from creepkit.rupture_assessment.observed_tests import rupture_tests
from creepkit.rupture_assessment.strength import strength_estimates

sys.path.insert(0, str(Path(__file__).parents[1]))
from helpers.planted_rupture import larson_miller, planted

TEMPERATURE = 873.15
HOURS = (1e4, 1e5)
WITHIN = 0.08
CASES = (
    (12, 60, 4000.0, 0.1),
    (6, 36, 4000.0, 0.1),
    (0, 24, 4000.0, 0.0),
    (12, 60, np.inf, 0.15),
    (6, 36, np.inf, 0.15),
    (4, 24, np.inf, 0.15),
)
"""Heats (0: one), tests, hours at which tests are stopped, and the scatter between heats."""

FIRST_SEED = 21_000

AVERAGED_CASES = CASES[1:2]


def own_strength(target, shift):
    """MPa at which log10 of the time of a heat or test with a factor 10^shift is the target."""
    x = np.linspace(0.0, 3.0, 3001)
    times = larson_miller(x, TEMPERATURE)
    return 10.0 ** np.interp(-(target - np.asarray(shift)), -times, x)


def by_average(tests):
    """Strengths at HOURS, and the share of run-outs."""
    assessment = ck.rupture(tests, hours=HOURS, temperatures=[TEMPERATURE])
    return assessment.strengths_at(TEMPERATURE, hours=HOURS), float(assessment.tests.censored.mean())


def by_larson_miller(tests):
    """The same without the checks, which fit every method twice more."""
    observed, _, _ = rupture_tests(tests)
    at = conditions_of(observed, no_tensile_strength)
    fit = fit_method(LARSON_MILLER, observed, at, degree=2, distribution="lognormal", fixed={}, level=0.95)
    strengths = strength_estimates(
        [(fit, 1.0)], fit.name, observed, no_tensile_strength, hours=HOURS, temperature=TEMPERATURE, level=0.95
    )
    return strengths, float(observed.censored.mean())


def no_tensile_strength(temperature):
    return np.full(np.shape(temperature), np.nan)


def coverage(case, seed, average):
    """Whether the bounds of the mean hold, and the shares of heats and tests held, at each time; run-outs."""
    heats, count, end, between = case
    tests = planted(larson_miller, seed=seed, count=count, heats=heats, scatter=WITHIN, between=between, end=end)
    strengths, run_outs = (by_average if average else by_larson_miller)(tests)
    rng = np.random.default_rng([seed, 1])
    heat_shift = between * rng.standard_normal(400)
    shifts = {"mean": np.zeros(1), "heat": heat_shift, "test": heat_shift + WITHIN * rng.standard_normal(400)}
    held = []
    for hours, strength in zip(HOURS, strengths, strict=True):
        for of, shift in shifts.items():
            own = own_strength(np.log10(hours), shift)
            low, high = getattr(strength, f"bounds_of_{of}")
            inside = (own >= (0.0 if low is None else low)) & (own <= (np.inf if high is None else high))
            held.append(float(inside.mean()))
    return held, run_outs


def main():
    parser = arguments(__doc__)
    parser.add_argument("--sets", type=int, default=200)
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    options = parser.parse_args()
    page = Page("rupture_strength_coverage", __doc__)
    heads = [f"{what}, {hours:g} h, %" for hours in HOURS for what in ("mean", "new heat", "one test")]
    page.table("fitted", "heats", "between heats", "tests", "stopped at, h", "run-outs, %", *heads, "sets")
    with ProcessPoolExecutor(options.jobs) as pool:
        for average, case in [*((False, case) for case in CASES), *((True, case) for case in AVERAGED_CASES)]:
            made = pool.map(partial(coverage, case, average=average), range(FIRST_SEED, FIRST_SEED + options.sets))
            rows, stopped = zip(*made, strict=True)
            progress(f"{case}, {'average' if average else 'Larson-Miller'}")
            heats, count, end, between = case
            page.row(
                "average" if average else "Larson-Miller",
                heats or "one",
                between if heats else "",
                count,
                "never" if np.isinf(end) else f"{end:g}",
                f"{100 * np.mean(stopped):.0f}",
                *(f"{100 * share:.1f}" for share in np.mean(rows, axis=0)),
                options.sets,
            )
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
