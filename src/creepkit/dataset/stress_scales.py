"""Parameters in MPa, such as B of sinh(stress/B), drawn through the ratio of the reference stress to them.

The ratio x is uniform from .05 (a power law) to 4, where the law's local stress exponent at the reference stress is
above zero and at most 12, and the rate coefficient that the wanted rate needs is within its bounds. Of sinh^n the local
exponent is n x coth x, so that what is nearly plastic is left out; of a threshold stress what does not creep at all is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.dataset.coefficients import TermGroup
from creepkit.dataset.looks import RateEvaluationPoints
from creepkit.language import CreepLaw, Param

STRESS_RATIOS = (0.05, 4.0)
LARGEST_STRESS_EXPONENT = 12.0
"""Largest local stress exponent."""
RATIO_INTERVALS = 32
"""Into which the range of a ratio is cut to see where it may lie."""


def stress_scale_positions(law: CreepLaw) -> tuple[int, ...]:
    """Positions of the parameters in MPa."""
    return tuple(k for k, param in enumerate(law.params.values()) if param.unit == "MPa")


def draw_stress_scales(
    law: CreepLaw, groups: Sequence[TermGroup], theta: Floats, unit_coordinates: Floats, ln_rates: Floats, points: RateEvaluationPoints
) -> Floats:
    """Return theta with its stress scales drawn, one after another.

    unit : (rows, scales) coordinates from 0 to 1. rates : (rows, parts) ln of the wanted rates, -inf: off.
    """
    result, parameters = np.array(theta), list(law.params.values())
    ratio_ranges = {k: _RatioRange.from_bounds(parameters[k], points.mean_stress) for k in stress_scale_positions(law)}
    for (k, ratio_range), coordinates in zip(ratio_ranges.items(), unit_coordinates.T, strict=True):
        result[:, k] = ratio_range.internal_value(coordinates[:, None])[:, 0]
    for (k, ratio_range), coordinates in zip(ratio_ranges.items(), unit_coordinates.T, strict=True):
        allowed = np.ones((len(coordinates), RATIO_INTERVALS), bool)
        for group, ln_rate in zip(groups, ln_rates.T, strict=True):
            if k in group.positions:
                trial_theta = np.repeat(result[:, None, :], RATIO_INTERVALS, axis=1)
                trial_theta[..., k] = ratio_range.internal_value((np.arange(RATIO_INTERVALS) + 0.5) / RATIO_INTERVALS)
                allowed &= _allowed(law, group, trial_theta, ln_rate, points) | np.isneginf(ln_rate)[:, None]
        result[:, k] = ratio_range.internal_value(_uniform_over_allowed(allowed, coordinates)[:, None])[:, 0]
    return result


@dataclass(frozen=True, eq=False)
class _RatioRange:
    """The range of one parameter's ratio that keeps it within its bounds; all but `param` (rows, 1)."""

    param: Param
    stress: Floats
    low: Floats
    high: Floats

    @classmethod
    def from_bounds(cls, param: Param, stress: Floats) -> _RatioRange:
        lowest_ratio, highest_ratio = stress / param.bounds[1], stress / max(param.bounds[0], 1e-30)
        low = np.clip(STRESS_RATIOS[0], lowest_ratio, highest_ratio)
        high = np.maximum(low, np.minimum(STRESS_RATIOS[1], highest_ratio))
        return cls(param, stress[:, None], low[:, None], high[:, None])

    def internal_value(self, unit_coordinates: Floats) -> Floats:
        """The internal parameter at coordinates from 0 to 1 of the range, (rows, coordinates)."""
        value = np.clip(self.stress / (self.low + unit_coordinates * (self.high - self.low)), *self.param.bounds)
        return np.asarray(np.log(value) if self.param.scale == "log" else value)


def _allowed(law: CreepLaw, group: TermGroup, theta: Floats, ln_rate: Floats, points: RateEvaluationPoints) -> Bools:
    """Where a part has a stress exponent and a coefficient that will do, (rows, cells)."""
    theta[..., group.coefficient] = 0.0
    ln_coefficient = (ln_rate[:, None] - group.ln_mean_rate(theta, points)) / group.exponent
    low, high = np.log(list(law.params.values())[group.coefficient].bounds)
    exponent = local_stress_exponent(group, theta, points)
    return np.asarray((exponent > 0) & (exponent <= LARGEST_STRESS_EXPONENT) & (ln_coefficient >= low) & (ln_coefficient <= high))


def local_stress_exponent(group: TermGroup, theta: Floats, points: RateEvaluationPoints) -> Floats:
    """d ln f / d ln stress of a part, by a difference of 2 %."""
    ln_rate_above, ln_rate_below = (group.ln_mean_rate(theta, points, factor) for factor in (1.01, 1 / 1.01))
    return np.asarray((ln_rate_above - ln_rate_below) / (2 * np.log(1.01)))


def _uniform_over_allowed(allowed: Bools, coordinates: Floats) -> Floats:
    """Coordinates from 0 to 1 that are uniform over the allowed cells; over all where none is."""
    weights = np.where(allowed.any(axis=1, keepdims=True), allowed, True).astype(float)
    sums = np.cumsum(weights, axis=1)
    target = coordinates * sums[:, -1]
    interval = np.minimum((sums <= target[:, None]).sum(axis=1), RATIO_INTERVALS - 1)
    fraction = np.clip(target - (np.take_along_axis(sums, interval[:, None], axis=1)[:, 0] - 1.0), 0.0, 1.0)
    return np.asarray((interval + fraction) / RATIO_INTERVALS)
