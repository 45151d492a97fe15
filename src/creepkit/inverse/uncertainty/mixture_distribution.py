"""Mixtures of normal or Student's distributions (Hoeting et al. (1999), Stat. Sci. 14, 382); quantiles by bisection."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr, ndtri, stdtr, stdtrit

from creepkit.arrays import Floats

BISECTIONS = 80
"""Of the interval between the lowest and the highest quantile of the parts: to the last digit."""


NORMAL_FREEDOM = 1e9
"""Degrees of freedom at which Student's distribution is the normal one."""


INTERVAL_PROBABILITIES = (0.5, 0.025, 0.975)


@dataclass(frozen=True, eq=False)
class MixtureDistribution:
    """The parts of a mixture: location, spread and degrees of freedom of each, with its weight.

    weight, degrees_of_freedom : (parts,) -; location, scale : (parts, ...) in the unit of the quantity.
    """

    weight: Floats
    degrees_of_freedom: Floats
    location: Floats
    scale: Floats

    def cumulative(self, x: Floats) -> Floats:
        """(...,) the probability of less than x (...,)."""
        standardised = (x - self.location) / self.scale
        probabilities = ndtr(standardised) if self._is_normal else stdtr(self._freedom, standardised)
        return np.asarray(np.einsum("p,p...->...", self.weight, probabilities), float)

    def quantile(self, probability: float) -> Floats:
        """(...,) by halving, between the lowest and the highest quantile of the parts."""
        standard = ndtri(probability) if self._is_normal else stdtrit(self._freedom, probability)
        quantiles = self.location + self.scale * standard
        lower, upper = quantiles.min(axis=0), quantiles.max(axis=0)
        for _ in range(BISECTIONS):
            midpoint = 0.5 * (lower + upper)
            is_below = self.cumulative(midpoint) < probability
            lower, upper = np.where(is_below, midpoint, lower), np.where(is_below, upper, midpoint)
        return np.asarray(0.5 * (lower + upper), float)

    def interval(self) -> tuple[Floats, Floats, Floats]:
        """Median and 95 % interval, (...,) each."""
        median, low, high = (self.quantile(p) for p in INTERVAL_PROBABILITIES)
        return median, low, high

    @property
    def _is_normal(self) -> bool:
        """Whether every part is normal, whose distribution is computed twenty times faster than Student's."""
        return bool((self.degrees_of_freedom >= NORMAL_FREEDOM).all())

    @property
    def _freedom(self) -> Floats:
        return self.degrees_of_freedom.reshape(-1, *(1 for _ in self.location.shape[1:]))
