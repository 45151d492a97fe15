"""Bands of a curve from draws: pointwise, and simultaneous, which holds a whole curve with the stated probability.

With m the median of the draws at a time and l, h the ends of the pointwise band there, the simultaneous band is
m - c (m - l) to m + c (h - m), c being the quantile of the largest excess of a draw over all times (Montiel Olea and
Plagborg-Moller (2019), J. Appl. Econom. 34, 1).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from creepkit.arrays import Floats
from creepkit.inverse.output_transforms import OutputTransform

MOST_ALIVE = 0.5
"""Share of the draws that must last to a time for a band of an output that says nothing after the end of a test."""


@dataclass(frozen=True, eq=False)
class Band:
    """A band about a curve, in the output's unit: infinite above where draws have ruptured.

    median, low, high : (times,) pointwise, of measured values. lowest, highest : (times,) simultaneous.
    """

    median: Floats
    low: Floats
    high: Floats
    lowest: Floats
    highest: Floats


def band_of_draws(
    values: Floats, noise: Floats, transform: OutputTransform, level: float, rng: np.random.Generator, *, grows: bool
) -> Band:
    """The band of draws of a curve, to which white noise is added.

    values : (draws, times) in the output's unit. noise : (times,) standard deviation in the transformed output.
    grows : whether a curve that has ended counts as infinitely large.
    """
    alive = np.isfinite(values)
    transformed = transform.forward(np.where(alive, values, 0.0))
    transformed = np.where(alive, transformed, np.inf if grows else np.nan)
    enough = alive.mean(axis=0) >= MOST_ALIVE
    probabilities = (0.5 - 0.5 * level, 0.5, 0.5 + 0.5 * level)
    low, median, high = _quantiles(transformed, probabilities, grows=grows)
    quantile = float(norm.ppf(0.5 + 0.5 * level))
    with np.errstate(invalid="ignore"):
        below = np.hypot(median - low, quantile * noise)
        above = np.hypot(high - median, quantile * noise)
    noisy = transformed + noise * rng.standard_normal(transformed.shape)
    factor = _simultaneous_factor(noisy, median, below, above, level)
    usable = np.isfinite(median) if grows else enough & np.isfinite(median)

    def outputs(g: Floats) -> Floats:
        finite = np.isfinite(g)
        return np.where(
            usable,
            np.where(finite, transform.inverse(np.where(finite, g, 0.0)), np.where(g > 0, np.inf, np.nan)),
            np.nan,
        )

    ends = (median, median - below, median + above, median - factor * below, median + factor * above)
    return Band(*(outputs(g) for g in ends))


def _quantiles(values: Floats, probabilities: tuple[float, ...], *, grows: bool) -> list[Floats]:
    """(times,) each; of values (draws, times) that may be infinite, or, where curves that ended do not count, NaN."""
    if grows:
        ordered = np.sort(values, axis=0)
        positions = [p * (len(values) - 1) for p in probabilities]
        result = []
        for position in positions:
            lower, upper = ordered[int(np.floor(position))], ordered[int(np.ceil(position))]
            share = position - np.floor(position)
            finite = np.isfinite(lower) & np.isfinite(upper)
            blend = np.where(finite, lower, 0.0) * (1 - share) + np.where(finite, upper, 0.0) * share
            result.append(np.where(finite, blend, upper))
        return result
    counted = np.isfinite(values).any(axis=0)
    filled = np.where(counted, values, 0.0)
    return [np.where(counted, q, np.nan) for q in np.nanquantile(filled, probabilities, axis=0)]


def _simultaneous_factor(values: Floats, median: Floats, below: Floats, above: Floats, level: float) -> float:
    """The factor on half widths (times,) at which `level` of the draws (draws, times) are inside at all times."""
    counted = np.isfinite(median) & (below > 0) & (above > 0)
    if not counted.any():
        return 1.0
    with np.errstate(invalid="ignore"):
        deviation = values[:, counted] - median[counted]
        excess = np.where(deviation > 0, deviation / above[counted], -deviation / below[counted])
    excess = np.where(np.isfinite(above[counted]) | (deviation <= 0), excess, 0.0)
    largest = np.nan_to_num(excess, nan=0.0).max(axis=1)
    return max(1.0, float(np.quantile(largest, level, method="higher")))
