"""Least squares of equal weights or one likelihood: coverage, error and recovery on planted creep curves.

    python tests/benchmarks/weights.py [--sets 40] [--write]

Sets of simulated creep tests of bars are identified with weights="noise" and weights="likelihood". Rates scatter by
15 % between tests, strains have noise of 2e-5. Columns: the share of 95 % intervals that hold the planted value, of all
parameters, of the rate in the middle of the tests' stresses, of the rate at 0.8 of the lowest stress and of the time to
rupture there; rms error and median half width of the middle rate's logarithm. The second table ranks four laws by each.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from measured import Page, arguments, progress
from public_calls import rupture_times

import creepkit as ck
from creepkit.errors import CreepkitError
from creepkit.records import History, StressSteps, constant_stress

sys.path.insert(0, str(Path(__file__).parents[1]))
from helpers.planted_bars import END, SPL, bars
from helpers.rupture_tests import BAR, OMEGA, SCATTER, campaign

HARDENING = ck.law("strain-hardening")
RIVALS = ("norton", "strain-hardening", "time-hardening", "hyperbolic-sine")
METHODS = ("noise", "likelihood")
MIDDLE_STRAIN = 0.01
AUTOCORRELATED_NOISE = 1e-4
OMEGA_VALUES = {"A": 1e-16, "n": 4.0, "m": 20.0}
SEARCH = {"starts": 2, "sobol_points": 32, "frames": 30}


class Case(NamedTuple):
    """A kind of set; correlated : strains have a further error of 1e-4, autocorrelated over a fifth of the frames."""

    name: str
    stresses: tuple[float, ...]
    rupture: bool = False
    correlated: bool = False


CASES = (
    Case("strain hardening, 8 tests", (35, 40, 45, 50, 55, 60, 40, 55)),
    Case("strain hardening, 8 tests, autocorrelated noise", (35, 40, 45, 50, 55, 60, 40, 55), correlated=True),
    Case("strain hardening, 3 tests", (40, 50, 60)),
    Case("MPC Omega to rupture, 8 tests, 2 stopped", (60, 70, 80, 95, 110, 60, 80, 110), rupture=True),
    Case("MPC Omega to rupture, 3 tests", (60, 80, 110), rupture=True),
)


def planted_tests(case, seed):
    """A set of tests; every other one of a hardening law has its stress raised by a quarter in the middle."""
    if case.rupture:
        return campaign(OMEGA, OMEGA_VALUES, case.stresses, seed, stopped=(0, 6) if len(case.stresses) > 3 else ())
    rng, tests = np.random.default_rng(seed), []
    for k, stress in enumerate(case.stresses):
        values = {**SPL, "A": SPL["A"] * np.exp(SCATTER["rate"] * rng.standard_normal())}
        steps = ((0.0, stress), (0.5 * END, 1.25 * stress))[: 1 + k % 2]
        (test,) = bars(HARDENING, values, [StressSteps(steps, "stress")], seed=1000 * seed + k)
        if case.correlated:
            frames = np.arange(test.times.size)
            covariance = np.exp(-np.abs(frames[:, None] - frames) / (frames.size / 5))
            factor = np.linalg.cholesky(covariance + 1e-10 * np.eye(frames.size))
            error = AUTOCORRELATED_NOISE * factor @ rng.standard_normal(frames.size)
            test = test.replace(outputs={"strain": test.outputs["strain"] + error})
        tests.append(test.replace(name=f"bar {k}"))
    return tests


def held(case, fit):
    """Whether the intervals hold: the parameters' (their mean), both rates, the life; the error and half width."""
    law, values = (OMEGA, OMEGA_VALUES) if case.rupture else (HARDENING, SPL)
    parameters = float(np.mean([e.low <= values[e.name] <= e.high for e in fit.estimates]))
    points = (float(np.sqrt(min(case.stresses) * max(case.stresses))), 0.8 * min(case.stresses))
    inside, results = [], []
    for stress in points:
        truth = float(ck.lower(law, "numpy").rate(values, stress=stress, strain=MIDDLE_STRAIN))
        rate, low, high = (float(v) for v in fit.rate(stress, strain=MIDDLE_STRAIN))
        inside.append(low < truth < high)
        results.append((np.log(rate / truth), 0.5 * np.log(high / low)))
    life = np.nan
    if case.rupture:
        plan = History("plan", np.array([1e9]), {}, constant_stress(points[1]), 1000.0)
        _, low, high = fit.rupture_time(points[1], 1000.0, test_scatter=False)
        life = float(low < rupture_times(BAR, law, values, [plan])[0] < high)
    return [parameters, *inside, life, *results[0]]


def identify(law, tests, weights):
    """The identification, or None where it failed."""
    try:
        return ck.identify(law, tests, BAR, weights=weights, **SEARCH)
    except CreepkitError as error:
        progress(f"{weights}: {error}")
        return None


def percent(values):
    return "-" if np.isnan(values).all() else f"{100 * np.nanmean(values):.0f}"


def main():
    parser = arguments(__doc__)
    parser.add_argument("--sets", type=int, default=40)
    options = parser.parse_args()
    page = Page("weights", __doc__)
    page.heading("Values and intervals")
    page.table(
        "tests", "weights", "failed", "parameters, %", "rate in the middle, %", "rate at 0.8 of the lowest stress, %",
        "time to rupture there, %", "rms error of ln rate", "half width of ln rate", "sets",
    )  # fmt: skip
    for case in CASES:
        law = OMEGA if case.rupture else HARDENING
        sets = [planted_tests(case, 100 + seed) for seed in range(options.sets)]
        for weights in METHODS:
            fits = [identify(law, tests, weights) for tests in sets]
            rows = np.array([held(case, fit) for fit in fits if fit is not None])
            error, width = f"{np.sqrt(np.mean(rows[:, 4] ** 2)):.3f}", f"{np.median(rows[:, 5]):.3f}"
            shares = [percent(rows[:, k]) for k in range(4)]
            page.row(case.name, weights, fits.count(None), *shares, error, width, len(sets))
    page.heading("Which law")
    page.table("tests", "weights", "planted law decisive, %", "another law decisive, %", "planted law first, %", "sets")
    for case in (case for case in CASES if not case.rupture):
        sets = [planted_tests(case, 100 + seed) for seed in range(options.sets)]
        for weights in METHODS:
            outcomes = []
            for tests in sets:
                fits = [identify(ck.law(name), tests, weights) for name in RIVALS]
                ranking = ck.rank([fit for fit in fits if fit is not None])
                first, decisive = ranking.best.law.name == HARDENING.name, ranking.verdict.startswith("decisive")
                outcomes.append((decisive and first, decisive and not first, first))
            page.row(case.name, weights, *(percent(np.array(o, float)) for o in zip(*outcomes, strict=True)), len(sets))
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
