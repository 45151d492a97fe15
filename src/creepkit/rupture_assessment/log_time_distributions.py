"""Distributions of log10 of a rupture time at many conditions: Student's, with a Weibull test, and mixtures of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from scipy.special import chdtri, stdtr, stdtrit

from creepkit.arrays import Floats

BISECTIONS = 50
"""Of a bracket some units of log10 wide: to 1e-14."""

NODES = 21
"""Of the quadrature over the normal part of a Weibull test's time."""

WEIBULL_MEDIAN = float(np.log(np.log(2.0)))
"""Of the smallest extreme value."""

_places, _lengths = np.polynomial.legendre.leggauss(15)
CHI_PROBABILITIES, CHI_WEIGHTS = 0.5 * (1.0 + _places), 0.5 * _lengths
"""Of the quadrature over chi^2."""


class LogTimeDistribution(Protocol):
    """Of log10 of a time in hours, at each point."""

    def cumulative(self, log_time: Floats) -> Floats:
        """(points,) probability of less than log_time (points,)."""
        ...

    def quantile(self, probability: float) -> Floats:
        """(points,) the log time that is not reached with a probability."""
        ...


@dataclass(frozen=True, eq=False)
class StudentLogTime:
    """median, spread, freedom : (points,)."""

    median: Floats
    spread: Floats
    freedom: Floats

    def cumulative(self, log_time: Floats) -> Floats:
        """(points,) probability of less than log_time (points,)."""
        return np.asarray(stdtr(self.freedom, (log_time - self.median) / self.spread))

    def quantile(self, probability: float) -> Floats:
        """(points,) the log time that is not reached with a probability."""
        return np.asarray(self.median + self.spread * stdtrit(self.freedom, probability))


@dataclass(frozen=True, eq=False)
class WeibullLogTime:
    """A median that is normal plus a scale times the smallest extreme value about its median.

    All deviations from the median are times sqrt(freedom / chi^2), as in Student's distribution, which this is where
    the extreme value is normal.
    median, spread, freedom : (points,). scale : of log10 of time.
    """

    median: Floats
    spread: Floats
    scale: float
    freedom: Floats

    def cumulative(self, log_time: Floats) -> Floats:
        """(points,) probability of less than log_time (points,)."""
        nodes, weights = np.polynomial.hermite_e.hermegauss(NODES)
        deviation = np.asarray(log_time - self.median)[:, None, None] * self._contractions[:, :, None]
        z = (deviation - self.spread[:, None, None] * nodes) / self.scale + WEIBULL_MEDIAN
        by_chi = -np.expm1(-np.exp(np.clip(z, -700.0, 50.0))) @ (weights / weights.sum())
        return np.asarray(by_chi @ CHI_WEIGHTS)

    @cached_property
    def _contractions(self) -> Floats:
        """(points, nodes) of sqrt(chi^2 / freedom)."""
        return np.asarray(np.sqrt(chdtri(self.freedom[:, None], CHI_PROBABILITIES) / self.freedom[:, None]))

    def quantile(self, probability: float) -> Floats:
        """(points,) the log time that is not reached with a probability."""
        reach = (40.0 * self.scale + 10.0 * self.spread) / self._contractions.min(axis=1)
        return _halved(self, probability, self.median - reach, self.median + reach)


@dataclass(frozen=True, eq=False)
class MixedLogTime:
    """Several distributions with weights that add up to one."""

    parts: Sequence[LogTimeDistribution]
    weights: Sequence[float]

    def cumulative(self, log_time: Floats) -> Floats:
        """(points,) probability of less than log_time (points,)."""
        shares = [w * part.cumulative(log_time) for w, part in zip(self.weights, self.parts, strict=True)]
        return np.asarray(np.sum(shares, axis=0))

    def quantile(self, probability: float) -> Floats:
        """(points,) the log time that is not reached with a probability."""
        quantiles = np.array([part.quantile(probability) for part in self.parts])
        if len(self.parts) == 1:
            return np.asarray(quantiles[0])
        return _halved(self, probability, quantiles.min(axis=0), quantiles.max(axis=0))


def power_of_ten(exponent: float) -> float:
    """10 to a power, infinite where that is beyond a double."""
    return 10.0 ** float(exponent) if exponent < 300.0 else float("inf")


def _halved(distribution: LogTimeDistribution, probability: float, low: Floats, high: Floats) -> Floats:
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        below = distribution.cumulative(middle) < probability
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return np.asarray(0.5 * (low + high))
