"""Intervals of numbers over several candidates: the value of the best, the spread of all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import brentq
from scipy.stats import t as student

from creepkit.arrays import Floats

TAIL_PROBABILITY = 0.025


def mixture_interval(values: Floats, standard_deviations: Floats, weights: Floats, degrees_of_freedom: Sequence[float]) -> tuple[float, float]:
    """The 95 % interval of a mixture of Student distributions, (candidates,) each; weights sum to 1."""
    scales, freedom_of_each = np.maximum(standard_deviations, 1e-300), np.maximum(np.asarray(degrees_of_freedom, float), 1.0)

    def below(x: float) -> float:
        return float(weights @ student.cdf((x - values) / scales, freedom_of_each))

    half_widths = student.ppf(1 - TAIL_PROBABILITY / 100, freedom_of_each) * scales
    bracket = float((values - half_widths).min()), float((values + half_widths).max())
    low, high = (float(brentq(lambda x, p=p: below(x) - p, *bracket)) for p in (TAIL_PROBABILITY, 1 - TAIL_PROBABILITY))
    return low, high
