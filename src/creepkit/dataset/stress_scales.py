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
from creepkit.dataset.coefficients import Part
from creepkit.dataset.looks import Looks
from creepkit.language import CreepLaw, Param

RATIOS = (0.05, 4.0)
STEEPEST = 12.0
"""Largest local stress exponent."""
CELLS = 32
"""Into which the range of a ratio is cut to see where it may lie."""


def scales_of(law: CreepLaw) -> tuple[int, ...]:
    """Positions of the parameters in MPa."""
    return tuple(k for k, param in enumerate(law.params.values()) if param.unit == "MPa")


def draw_scales(
    law: CreepLaw, parts: Sequence[Part], theta: Floats, unit: Floats, rates: Floats, looks: Looks
) -> Floats:
    """Return theta with its stress scales drawn, one after another.

    unit : (rows, scales) coordinates from 0 to 1. rates : (rows, parts) ln of the wanted rates, -inf: off.
    """
    drawn, table = np.array(theta), list(law.params.values())
    spans = {k: _Span.of(table[k], looks.middle) for k in scales_of(law)}
    for (k, span), u in zip(spans.items(), unit.T, strict=True):
        drawn[:, k] = span.at(u[:, None])[:, 0]
    for (k, span), u in zip(spans.items(), unit.T, strict=True):
        allowed = np.ones((len(u), CELLS), bool)
        for part, wanted in zip(parts, rates.T, strict=True):
            if k in part.positions:
                many = np.repeat(drawn[:, None, :], CELLS, axis=1)
                many[..., k] = span.at((np.arange(CELLS) + 0.5) / CELLS)
                allowed &= _allowed(law, part, many, wanted, looks) | np.isneginf(wanted)[:, None]
        drawn[:, k] = span.at(_among(allowed, u)[:, None])[:, 0]
    return drawn


@dataclass(frozen=True, eq=False)
class _Span:
    """The range of one parameter's ratio that keeps it within its bounds; all but `param` (rows, 1)."""

    param: Param
    stress: Floats
    low: Floats
    high: Floats

    @classmethod
    def of(cls, param: Param, stress: Floats) -> _Span:
        least, most = stress / param.bounds[1], stress / max(param.bounds[0], 1e-30)
        low = np.clip(RATIOS[0], least, most)
        high = np.maximum(low, np.minimum(RATIOS[1], most))
        return cls(param, stress[:, None], low[:, None], high[:, None])

    def at(self, unit: Floats) -> Floats:
        """The internal parameter at coordinates from 0 to 1 of the range, (rows, coordinates)."""
        value = np.clip(self.stress / (self.low + unit * (self.high - self.low)), *self.param.bounds)
        return np.asarray(np.log(value) if self.param.scale == "log" else value)


def _allowed(law: CreepLaw, part: Part, theta: Floats, wanted: Floats, looks: Looks) -> Bools:
    """Where a part has a stress exponent and a coefficient that will do, (rows, cells)."""
    theta[..., part.coefficient] = 0.0
    coefficient = (wanted[:, None] - part.ln_rate(theta, looks)) / part.slope
    low, high = np.log(list(law.params.values())[part.coefficient].bounds)
    exponent = local_exponent(part, theta, looks)
    return np.asarray((exponent > 0) & (exponent <= STEEPEST) & (coefficient >= low) & (coefficient <= high))


def local_exponent(part: Part, theta: Floats, looks: Looks) -> Floats:
    """d ln f / d ln stress of a part, by a difference of 2 %."""
    up, down = (part.ln_rate(theta, looks, factor) for factor in (1.01, 1 / 1.01))
    return np.asarray((up - down) / (2 * np.log(1.01)))


def _among(allowed: Bools, u: Floats) -> Floats:
    """Coordinates from 0 to 1 that are uniform over the allowed cells; over all where none is."""
    weights = np.where(allowed.any(axis=1, keepdims=True), allowed, True).astype(float)
    sums = np.cumsum(weights, axis=1)
    target = u * sums[:, -1]
    cell = np.minimum((sums <= target[:, None]).sum(axis=1), CELLS - 1)
    inside = np.clip(target - (np.take_along_axis(sums, cell[:, None], axis=1)[:, 0] - 1.0), 0.0, 1.0)
    return np.asarray((cell + inside) / CELLS)
