"""Minimum rates and rupture times that contradict one another by a law, judged by their own scatter.

No noise of a rupture time is known, and often none of a minimum rate; what is known is how they scatter about the law.
With y the logarithms of predicted over measured values, of a test the difference of the two so that a factor on its
rate drops out, a law that is right leaves y without a mean and without a trend over stress and temperature. The sums of
squares with and without a constant, ln stress and 1/T are compared by an F test. An identification takes some of that
regression away already, so that a right law is rejected less often than the level says.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import f

from creepkit.arrays import Floats
from creepkit.records import History

if TYPE_CHECKING:
    from creepkit.inverse.goodness_of_fit import RateComparison, RuptureComparison

SIGNIFICANCE = 0.003
"""p-value below which they contradict one another, as for adequacy."""

FEWEST_VALUES = 5
"""Tests that are judged; and as many as the regression has columns, and three more."""

NOTEWORTHY_RATIO = 1.25
"""Of the means of predicted over measured: less is said to be a trend."""

SMALLEST_P_VALUE = 1e-12
"""That is shown."""


@dataclass(frozen=True)
class ContradictingValues:
    """What a law cannot explain together.

    tests : how many are judged. rate_ratio, time_ratio : geometric means of predicted over measured minimum rates and
    rupture times of the tests that state them. scatter : of one test, as a factor (one standard deviation of ln).
    p_value : of as much by chance.
    """

    tests: int
    rate_ratio: float
    time_ratio: float
    scatter: float
    p_value: float

    def __str__(self) -> str:
        chance = f"p < {SMALLEST_P_VALUE:g}" if self.p_value < SMALLEST_P_VALUE else f"p = {self.p_value:.1g}"
        judged = f"{self.tests} tests that scatter by a factor of {self.scatter:.3g}, {chance}"
        means = f"{self.rate_ratio:.2g} of minimum rates and {self.time_ratio:.2g} of rupture times"
        product = abs(np.log(self.rate_ratio * self.time_ratio))
        trend = "" if product > np.log(NOTEWORTHY_RATIO) else ", and their ratio changes with stress or temperature"
        return (
            "minimum creep rates and rupture times contradict one another by this law: predicted over measured is "
            f"{means} in the mean{trend} ({judged})"
        )


def contradicting_values(
    histories: Sequence[History], values: Sequence[tuple[RuptureComparison | None, RateComparison | None]]
) -> ContradictingValues | None:
    """The contradiction between the minimum rates and the rupture times of tests without frames; None where none is.

    values : end and minimum rate of each history, measured and predicted; run-outs and ends that were not compared are
    not judged. Where fewer than FEWEST_VALUES tests state both, rates are judged by themselves, and so are times.
    """
    rates = np.array([np.nan if r is None else _log(r.ratio) for _, r in values])
    times = np.array(
        [
            np.nan if e is None or e.censored or not e.used or h.outputs else _log(e.ratio)
            for h, (e, _) in zip(histories, values, strict=True)
        ]
    )
    if not (np.isfinite(rates).any() and np.isfinite(times).any()):
        return None
    both = rates + times
    judged = [both] if np.isfinite(both).sum() >= FEWEST_VALUES else [rates, times]
    results = [result for y in judged if (result := _regression(histories, y)) is not None]
    if not results:
        return None
    count, scatter, p_value = min(results, key=lambda result: result[2])
    p_value = min(1.0, p_value * len(results))
    if p_value >= SIGNIFICANCE:
        return None
    rate_ratio, time_ratio = (float(np.exp(y[np.isfinite(y)].mean())) for y in (rates, times))
    return ContradictingValues(count, rate_ratio, time_ratio, float(np.exp(scatter)), p_value)


def _log(ratio: float) -> float:
    """ln of a ratio; NaN of one that is infinite, as of a rupture that is never predicted."""
    return float(np.log(ratio)) if np.isfinite(ratio) and ratio > 0 else float("nan")


def _regression(histories: Sequence[History], y: Floats) -> tuple[int, float, float] | None:
    """How many values, their scatter about a constant and trends, and the p-value of these; None of too few values."""
    known = np.flatnonzero(np.isfinite(y))
    tests = [histories[int(k)] for k in known]
    columns = [np.ones(known.size)]
    for x in (
        np.log([float(np.abs(h.loading.program().values).max()) for h in tests]),
        1.0 / np.array([h.mean_temperature for h in tests]),
    ):
        if known.size and np.ptp(x) > 1e-3 * np.abs(x).max():
            columns.append((x - x.mean()) / x.std())
    design = np.stack(columns, axis=1)
    freedom = known.size - design.shape[1]
    if known.size < FEWEST_VALUES or freedom < 3:
        return None
    left = y[known] - design @ np.linalg.lstsq(design, y[known], rcond=None)[0]
    variance = max(float((left**2).sum()) / freedom, 1e-12)
    explained = float((y[known] ** 2).sum() - (left**2).sum()) / design.shape[1]
    return known.size, float(np.sqrt(variance)), float(f.sf(explained / variance, design.shape[1], freedom))
