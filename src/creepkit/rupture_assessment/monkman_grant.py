"""Monkman-Grant's relation: rupture times from minimum creep rates, known or predicted by a rate law."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from creepkit.arrays import Floats, frozen
from creepkit.errors import FitError
from creepkit.records import SECONDS_PER_HOUR
from creepkit.rupture_assessment.fitting import fit_method
from creepkit.rupture_assessment.methods import MINIMUM_RATE, MONKMAN_GRANT, Conditions
from creepkit.rupture_assessment.observed_tests import RuptureTests
from creepkit.rupture_assessment.rupture_fit import RuptureFit, StudentLogTime

UNUSED_ENERGY = 300e3
"""J/mol, of a rate law of tests at one temperature; it is used at that temperature alone."""


@dataclass(frozen=True, eq=False)
class MinimumRateRelation:
    """Rupture times by minimum rates.

    times : log10 t = c - m log10 of the rate, of the tests with both. rates : the rate law, of all tests with a rate.
    Its predictions by stress and temperature take the scatters of rates and of times for independent.
    """

    times: RuptureFit
    rates: RuptureFit

    def log_time(self, at: Conditions, of: str) -> StudentLogTime:
        """Distribution of log10 of a time in hours; by the rate where it is known, else by the rate law."""
        if np.isfinite(at.rate).all():
            return self.times.log_time(at, of)
        log_rate = self.rates.log_time(at, of)
        predicted = replace(at, rate=10.0**log_rate.median / SECONDS_PER_HOUR)
        by_rate = self.times.log_time(predicted, of)
        m = self.times["m"].value
        spread = np.hypot(by_rate.spread, m * log_rate.spread)
        return StudentLogTime(by_rate.median, spread, np.minimum(by_rate.freedom, log_rate.freedom))

    def test_scatter(self, at: Conditions) -> StudentLogTime:
        """Distribution of log10 of the time of one test over the median time of its heat, by its rate."""
        return self.times.test_scatter(at)


def fit_relation(tests: RuptureTests, with_rate: RuptureTests, *, level: float) -> MinimumRateRelation:
    """The relation and its rate law; FitError, in one sentence, where rates are missing or too few."""
    known = np.isfinite(tests.minimum_rate)
    if not known.any():
        raise FitError("no test has a minimum creep rate, which monkman-grant needs; add minimum_rate to the tests")
    both = tests[known]
    times = fit_method(MONKMAN_GRANT, both, _conditions(both), degree=1, fixed={}, level=level)
    log_rates = replace(
        with_rate,
        log_time=frozen(np.log10(with_rate.minimum_rate * SECONDS_PER_HOUR)),
        censored=frozen(np.zeros(len(with_rate)), dtype=bool),
    )
    fixed = {"Q": UNUSED_ENERGY} if with_rate.isothermal else {}
    rates = fit_method(MINIMUM_RATE, log_rates, _conditions(with_rate), degree=1, fixed=fixed, level=level)
    return MinimumRateRelation(times, rates)


LEAST_CURVATURE = 0.01
"""Probability below which rates say that one stress exponent does not hold for all of them."""


def curvature_probability(with_rate: RuptureTests) -> float:
    """Probability of so much curvature of ln rate over ln stress if there were none, by the F test; 1 of few rates."""
    from scipy.stats import f as f_distribution

    x, y = np.log(with_rate.stress), np.log(with_rate.minimum_rate)
    line = [np.ones_like(x), x - x.mean(), *([] if with_rate.isothermal else [1.0 / with_rate.temperature])]
    left = []
    for columns in (line, [*line, (x - x.mean()) ** 2]):
        A = np.stack([column / np.abs(column).max() for column in columns], axis=1)
        if np.linalg.matrix_rank(A) < A.shape[1] or len(y) < A.shape[1] + 2:
            return 1.0
        left.append(float(np.sum((y - A @ np.linalg.lstsq(A, y, rcond=None)[0]) ** 2)))
    freedom = len(y) - len(line) - 1
    return float(f_distribution.sf((left[0] - left[1]) * freedom / max(left[1], 1e-300), 1, freedom))


def _conditions(tests: RuptureTests) -> Conditions:
    unknown: Floats = np.full(len(tests), np.nan)
    return Conditions(tests.stress, tests.temperature, unknown, tests.minimum_rate)
