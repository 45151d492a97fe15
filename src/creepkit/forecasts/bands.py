"""Bands of a curve from draws: pointwise, and simultaneous, which holds a whole curve with the stated probability.

With m the median of the draws at a time and l, h the ends of the pointwise band there, the simultaneous band is
m - c (m - l) to m + c (h - m), c being the quantile of the largest excess of a draw over all times (Montiel Olea and
Plagborg-Moller (2019), J. Appl. Econom. 34, 1).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from creepkit.arrays import Bools, Floats
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
    values: Floats,
    times: Floats,
    noise: Floats,
    transform: OutputTransform,
    level: float,
    rng: np.random.Generator,
    *,
    grows: bool,
) -> Band:
    """The band of draws of a curve, to which white noise is added.

    values : (draws, times) in the output's unit. times : (times,) s.
    noise : (times,) standard deviation in the transformed output.
    grows : whether a curve that has ended counts as infinitely large.
    """
    alive = np.isfinite(values)
    transformed = np.where(alive, transform.forward(np.where(alive, values, 0.0)), np.nan)
    if grows:
        transformed = _continued(transformed, times)
    counted = np.isfinite(transformed).any(axis=0)
    probabilities = (0.5 - 0.5 * level, 0.5, 0.5 + 0.5 * level)
    low, median, high = (
        np.where(counted, q, np.nan) for q in np.nanquantile(np.where(counted, transformed, 0.0), probabilities, axis=0)
    )
    quantile = float(norm.ppf(0.5 + 0.5 * level))
    below = np.hypot(median - low, quantile * noise)
    above = np.hypot(high - median, quantile * noise)
    noisy = transformed + noise * rng.standard_normal(transformed.shape)
    factor = _simultaneous_factor(noisy, median, below, above, level)
    enough = alive.mean(axis=0) >= MOST_ALIVE
    largest = np.max(transformed, initial=-np.inf, where=alive)
    first_ended = np.min(transformed, axis=0, initial=np.inf, where=~alive) if grows else np.full(times.size, np.inf)

    def outputs(g: Floats, infinite: Bools) -> Floats:
        usable = np.isfinite(g) & ~infinite & (enough | grows)
        outside = np.where(infinite & grows, np.inf, np.nan)
        return np.where(usable, transform.inverse(np.where(usable, g, 0.0)), outside)

    def lower(g: Floats) -> Floats:
        return outputs(g, (g > largest) & grows)

    def upper(g: Floats) -> Floats:
        return outputs(g, g >= first_ended)

    return Band(
        outputs(median, ~enough & grows),
        lower(median - below),
        upper(median + above),
        lower(median - factor * below),
        upper(median + factor * above),
    )


def _continued(values: Floats, times: Floats) -> Floats:
    """Curves (draws, times), NaN after their ends, continued in ln t with the slope at which such curves end.

    So a curve that ends early is far above one that ends late, and the band of a curve that is still there where most
    have ended has a lower end.
    """
    log_times = np.log(np.maximum(times, 1e-9 * times[-1]))
    alive = np.isfinite(values)
    lasting, frames = alive.any(axis=1), np.arange(times.size)
    last = times.size - 1 - alive[:, ::-1].argmax(axis=1)
    at_end = np.take_along_axis(values, last[:, None], axis=1)
    before = np.take_along_axis(values, np.maximum(last - 1, 0)[:, None], axis=1)
    slopes = (at_end - before)[:, 0] / np.maximum(log_times[last] - log_times[last - 1], 1e-12)
    slopes = slopes[lasting & (last > 0) & (last < times.size - 1)]
    slope = max(float(np.median(slopes)), 0.0) if slopes.size else 0.0
    beyond = at_end + slope * (log_times - log_times[last][:, None])
    continued = np.where(frames > last[:, None], beyond, values)
    if lasting.any() and not lasting.all():
        continued[~lasting] = np.nanmax(continued[lasting], axis=0)
    return continued


def _simultaneous_factor(values: Floats, median: Floats, below: Floats, above: Floats, level: float) -> float:
    """The factor on half widths (times,) at which `level` of the draws (draws, times) are inside at all times."""
    counted = np.isfinite(median) & (below > 0) & (above > 0)
    if not counted.any():
        return 1.0
    deviation = values[:, counted] - median[counted]
    excess = np.where(deviation > 0, deviation / above[counted], -deviation / below[counted])
    largest = np.nan_to_num(excess, nan=0.0).max(axis=1)
    return max(1.0, float(np.quantile(largest, level, method="higher")))
