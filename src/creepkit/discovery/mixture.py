"""Intervals of numbers over several candidates: the value of the best, the spread of all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import brentq
from scipy.stats import t as student

from creepkit.arrays import Floats

TAIL = 0.025


def mixture_interval(values: Floats, sd: Floats, weights: Floats, freedom: Sequence[float]) -> tuple[float, float]:
    """The 95 % interval of a mixture of Student distributions, (candidates,) each; weights sum to 1."""
    spread, free = np.maximum(sd, 1e-300), np.maximum(np.asarray(freedom, float), 1.0)

    def below(x: float) -> float:
        return float(weights @ student.cdf((x - values) / spread, free))

    reach = student.ppf(1 - TAIL / 100, free) * spread
    ends = float((values - reach).min()), float((values + reach).max())
    low, high = (float(brentq(lambda x, p=p: below(x) - p, *ends)) for p in (TAIL, 1 - TAIL))
    return low, high
