"""Outlying tests: rates so far from those of the other tests that scatter between tests does not explain them.

A scatter that is estimated with an outlying test is large enough to hold it; so the others alone say what scatter is.
"""

from __future__ import annotations

import numpy as np
from scipy.stats import t as student

from creepkit.arrays import Bools, Floats

OUTLYING_FACTOR = 2.0
"""On the law's rate; heats of one steel differ by less than that, a load in ksi or a time in minutes by far more."""


OUTSIDE = 4.0
"""Robust standard deviations of ln factors from their median, beyond which a test lies outside of the others."""


SIGNIFICANCE = 0.003
"""p-value of the largest of as many distances by chance, as for the chi-square of an adequacy."""


FEWEST_OTHERS = 4
"""Tests that say how rates scatter."""


SMALLEST_SCATTER = 0.05
"""Of ln rate between well-made tests."""


def outlying_tests(log_factors: Floats) -> Bools:
    """(tests,) which tests lie outside of the others.

    log_factors : (tests,) ln of their factors on the law's rate. Those beyond OUTSIDE robust standard deviations and
    OUTLYING_FACTOR are compared with the mean and the standard deviation of all others: Student's t of a new value, its
    p-value times the number of tests.
    """
    distances = np.abs(log_factors - np.median(log_factors))
    candidates = (distances > OUTSIDE * 1.4826 * float(np.median(distances))) & (distances > np.log(OUTLYING_FACTOR))
    others = log_factors[~candidates]
    if not candidates.any() or others.size < FEWEST_OTHERS:
        return np.zeros(log_factors.size, bool)
    sd = max(float(others.std(ddof=1)), SMALLEST_SCATTER) * np.sqrt(1.0 + 1.0 / others.size)
    p_values = 2.0 * log_factors.size * student.sf(np.abs(log_factors - others.mean()) / sd, others.size - 1)
    return np.asarray(candidates & (p_values < SIGNIFICANCE))
