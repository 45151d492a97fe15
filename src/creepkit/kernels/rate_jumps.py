"""Jumps of a creep rate along a ray of points, such as growing stress: found by bisection, told from steep slopes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Floats

RAY_INTERVALS = 256


BISECTIONS = 36
"""After which an interval of the ray is shorter than 1e-11 of its place."""


LARGEST_CHANGE = 1e-3
"""Of the rate over such an interval, relative to the rate within a per cent of it; more is a jump."""


@dataclass(frozen=True)
class RateJump:
    """Where on a ray the rate jumps; before, after : ln rate on either side."""

    place: float
    before: float
    after: float


def find_rate_jump(log_rate: Callable[[Floats], Floats], low: float, high: float) -> RateJump | None:
    """The largest jump of a rate over a ray, or None where it is continuous.

    log_rate : function of places (n,) along the ray, above zero, giving ln rate (n,); NaN where the law does not hold.
    """
    grid = np.geomspace(low, high, RAY_INTERVALS + 1)
    left, right = grid[:-1].copy(), grid[1:].copy()
    at_left, at_right = log_rate(left), log_rate(right)
    for _ in range(BISECTIONS):
        middle = np.sqrt(left * right)
        at_middle = log_rate(middle)
        larger = _change(at_left, at_middle) >= _change(at_middle, at_right)
        left, at_left = np.where(larger, left, middle), np.where(larger, at_left, at_middle)
        right, at_right = np.where(larger, middle, right), np.where(larger, at_middle, at_right)
    nearby = np.fmax(log_rate(0.99 * left), log_rate(1.01 * right))
    with np.errstate(invalid="ignore", over="ignore"):
        size = np.abs(np.exp(at_right - nearby) - np.exp(at_left - nearby))
    size = np.where(np.isfinite(size), size, 0.0)
    worst = int(np.argmax(size))
    if not size[worst] > LARGEST_CHANGE:
        return None
    return RateJump(float(left[worst]), float(at_left[worst]), float(at_right[worst]))


def _change(first: Floats, second: Floats) -> Floats:
    """How much a rate changes, relative to the larger; -1 where it is not known."""
    with np.errstate(invalid="ignore", over="ignore"):
        change = -np.expm1(-np.abs(first - second))
    return np.where(np.isfinite(change), change, -1.0)
