"""Coverage of rates where tests are off by what is usual, or their noise is not white: by each of the two weights.

    python tests/benchmarks/usual_errors.py [--campaigns 40] [--cases NAME ...] [--write]

Bars by closed forms (see planted_creep_tests) at three temperatures, rates of tests scattering by 3 % and strains by
5e-5. Temperatures are off by 3 K and loads by 1 % (one standard deviation), in each test by itself or in all alike; or
the strains have a further error of 1e-4, autocorrelated over a tenth of the frames, or one of 5e-5 that has Student's t
of three degrees of freedom. Columns: the share of 95 % intervals that hold the planted value, of all parameters, of the
rate amid the tests and at 0.8 of the lowest stress (strain 0.01), of the time to rupture there; in brackets those of
intervals that take the tests as exact (usual_errors="none"); median half width of ln of the middle rate.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

from typing import NamedTuple

import numpy as np
import planted_creep_tests as bars
from measured import Page, arguments, progress

import creepkit as ck
from creepkit.errors import CreepkitError
from creepkit.records import constant_stress

KELVIN, LOAD, SCATTER = 3.0, 0.01, 0.03
MIDDLE, LOW, T = 53.0, 32.0, 1000.0


class Case(NamedTuple):
    """A kind of campaign; errors : of tests, none, own or common; noise : white, correlated or heavy-tailed."""

    law: str
    tests: int
    errors: str = "none"
    noise: str = "white"

    @property
    def title(self):
        """In words."""
        off = {"none": "exact", "own": "each off by itself", "common": "all off alike"}[self.errors]
        return f"{self.law}, {self.tests} tests, {off}, {self.noise} noise"


CASES = {
    f"{law[:2]}-{count}-{errors}-{noise}": Case(law, count, errors, noise)
    for law, counts in ((bars.HARDENING, (3, 6, 12)), (bars.OMEGA, (4, 8)))
    for count in counts
    for errors, noise in [*((e, "white") for e in ("none", "own", "common")), ("none", "correlated"), ("none", "t3")]
    if noise == "white" or count in (6, 8)
}


def planted(case, seed):
    """The alloy and its tests."""
    rng = np.random.default_rng([seed, *map(ord, f"{case.law}{case.tests}{case.errors}")])
    alloy, tests = bars.drawn_alloy(case.law, rng), []
    shared = rng.standard_normal(2)
    for k in range(case.tests):
        stress, temperature = bars.CONDITIONS[k % len(bars.CONDITIONS)]
        off = {"none": np.zeros(2), "own": rng.standard_normal(2), "common": shared}[case.errors]
        true = (stress * (1 + LOAD * off[0]), temperature + KELVIN * off[1])
        factors = bars.Factors(SCATTER * rng.standard_normal(), SCATTER * rng.standard_normal())
        test = bars.planted_bar(f"bar {k}", alloy, true, factors, rng)
        size = test.times.size
        if case.noise == "correlated":
            lags = np.abs(np.subtract.outer(np.arange(size), np.arange(size)))
            root = np.linalg.cholesky(np.exp(-10.0 * lags / size) + 1e-9 * np.eye(size))
            noise = 2.0 * bars.NOISE * root @ rng.standard_normal(size)
        else:
            noise = bars.NOISE * rng.standard_t(3, size) if case.noise == "t3" else 0.0
        loading = constant_stress(float(stress), bars.CONTROL[case.law])
        outputs = {"strain": test.outputs["strain"] + noise}
        tests.append(test.replace(loading=loading, temperature=float(temperature), outputs=outputs))
    return alloy, tests


def held(alloy, fit):
    """Whether intervals hold: parameters (mean), both rates, life; and the half width of ln of the middle rate."""
    parameters = float(np.mean([e.low <= alloy.values[e.name] <= e.high for e in fit.estimates]))
    rates = [fit.rate(s, T, strain=0.01, warn=False) for s in (MIDDLE, LOW)]
    law = ck.lower(fit.law, "numpy")
    truths = [float(law.rate(alloy.values, stress=s, strain=0.01, temperature=T)) for s in (MIDDLE, LOW)]
    inside = [float(low <= truth <= high) for truth, (_, low, high) in zip(truths, rates, strict=True)]
    life = np.nan
    if alloy.name == bars.OMEGA:
        _, low, high = fit.rupture_time(LOW, T, test_scatter=False, warn=False)
        life = float(low <= alloy.life(LOW, T) <= high)
    return [parameters, *inside, life, float(np.log(rates[0][2] / rates[0][0]))]


def main():
    """Run all cases."""
    parser = arguments(__doc__)
    parser.add_argument("--campaigns", type=int, default=40)
    parser.add_argument("--cases", nargs="+", default=list(CASES), choices=CASES)
    options = parser.parse_args()
    page = Page("usual_errors", __doc__)
    heads = ("parameters", "rate amid the tests", "rate at 0.8 of the lowest stress", "time to rupture there")
    page.table("tests", "weights", "campaigns (failed)", *heads, "half width")
    for name in options.cases:
        case = CASES[name]
        for weights in ("equal", "likelihood"):
            rows, failed = [], 0
            for seed in range(options.campaigns):
                alloy, tests = planted(case, seed)
                try:
                    fit = ck.identify(alloy.law, tests, starts=1, weights=weights)
                    rows.append([held(alloy, fit), held(alloy, fit.by_tests_alone)])
                except CreepkitError as error:
                    progress(f"{name}: {error}")
                    failed += 1
            found = np.array(rows)
            cells = [
                "-" if np.isnan(found[:, 0, k]).any() else f"{found[:, 0, k].mean():.2f} [{found[:, 1, k].mean():.2f}]"
                for k in range(4)
            ]
            width = f"{np.median(found[:, 0, 4]):.3f} [{np.median(found[:, 1, 4]):.3f}]"
            page.row(case.title, weights, f"{len(rows)} ({failed})", *cells, width)
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
