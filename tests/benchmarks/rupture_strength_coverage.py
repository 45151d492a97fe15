"""Coverage of the bounds of rupture strength: planted tests of three methods with heats and run-outs.

    python tests/benchmarks/rupture_strength_coverage.py [--sets 200] [--write]

Each simulated set has tests at 550, 600 and 650 °C of 20 to 10,000 h, planted by the method named; log10 of times
scatters between heats as the table says, and by 0.08 between tests of a heat; tests are stopped at a given time. The
table gives the share of sets whose 95 % bounds of the mean strength at 600 °C hold the planted one, and the share of
new heats, and of tests of new heats, inside theirs. The planted method is fitted alone; "average" fits all three. A
share of 95 % of n sets has a standard error of 22 % / sqrt(n).
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
from creepkit.rupture_assessment.methods import METHODS
from creepkit.rupture_assessment.observed_tests import rupture_tests
from creepkit.rupture_assessment.strength import strength_estimates

sys.path.insert(0, str(Path(__file__).parents[1]))
from helpers.planted_rupture import larson_miller, manson_haferd, orr_sherby_dorn, planted

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

FIRST_SEED = 83_000

PLANTED = {
    "larson-miller": (larson_miller, 2),
    "orr-sherby-dorn": (orr_sherby_dorn, 2),
    "manson-haferd": (manson_haferd, 1),
}
"""{method: mean log10 h at log10 MPa and K, degree of its stress function}."""

FEW_TESTS = tuple((0, count, np.inf, 0.0) for count in (6, 10))
"""Of one heat, without run-outs, assessed by the average: so few tests do not say which method holds."""

RUNS = (
    *(("larson-miller", case, False) for case in CASES),
    ("larson-miller", CASES[1], True),
    *((name, case, True) for case in FEW_TESTS for name in PLANTED),
    *((name, case, False) for name in ("orr-sherby-dorn", "manson-haferd") for case in CASES[:2]),
)
"""Method planted, case, and whether the average is asked in the place of that method."""


def own_strength(mean, target, shift):
    """MPa at which log10 of the time of a heat or test with a factor 10^shift is the target."""
    x = np.linspace(0.0, 3.0, 3001)
    times = mean(x, TEMPERATURE)
    return 10.0 ** np.interp(-(target - np.asarray(shift)), -times, x)


def by_average(tests):
    """Strengths at HOURS, and the share of run-outs."""
    assessment = ck.rupture(tests, hours=HOURS, temperatures=[TEMPERATURE])
    return assessment.strengths_at(TEMPERATURE, hours=HOURS), float(assessment.tests.censored.mean())


def by_method(tests, method, degree):
    """The same without the checks, which fit every method twice more."""
    observed, _, _ = rupture_tests(tests)
    at = conditions_of(observed, no_tensile_strength)
    fit = fit_method(METHODS[method], observed, at, degree=degree, fixed={}, level=0.95)
    strengths = strength_estimates(
        [(fit, 1.0)], fit.name, observed, no_tensile_strength, hours=HOURS, temperature=TEMPERATURE, level=0.95
    )
    return strengths, float(observed.censored.mean())


def no_tensile_strength(temperature):
    return np.full(np.shape(temperature), np.nan)


def coverage(seed, method, case, average):
    """Whether the bounds of the mean hold, and the shares of heats and tests held, at each time; run-outs."""
    heats, count, end, between = case
    mean, degree = PLANTED[method]
    tests = planted(mean, seed=seed, count=count, heats=heats, scatter=WITHIN, between=between, end=end)
    strengths, run_outs = by_average(tests) if average else by_method(tests, method, degree)
    rng = np.random.default_rng([seed, 1])
    heat_shift = between * rng.standard_normal(400)
    shifts = {"mean": np.zeros(1), "heat": heat_shift, "test": heat_shift + WITHIN * rng.standard_normal(400)}
    held = []
    for hours, strength in zip(HOURS, strengths, strict=True):
        for of, shift in shifts.items():
            own = own_strength(mean, np.log10(hours), shift)
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
    page.table("planted", "fitted", "heats", "between heats", "tests", "stopped at, h", "run-outs, %", *heads, "sets")
    with ProcessPoolExecutor(options.jobs) as pool:
        for k, (method, case, average) in enumerate(RUNS):
            seeds = range(FIRST_SEED + 1000 * k, FIRST_SEED + 1000 * k + options.sets)
            made = pool.map(partial(coverage, method=method, case=case, average=average), seeds)
            rows, stopped = zip(*made, strict=True)
            progress(f"{case}, {method}{', average' if average else ''}")
            heats, count, end, between = case
            page.row(
                method,
                "average" if average else method,
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
