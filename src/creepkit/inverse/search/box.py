"""Bounds of the unknowns of a search."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from creepkit.arrays import Floats
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.effects import Unknowns
from creepkit.inverse.local_exponents import LARGEST
from creepkit.language import CreepLaw

RATE_WINDOW = (-12.0, 6.0)
"""Bounds of the log rate of a term, or of an internal variable, about the measured one: at 1e-5 of the data it is
absent, at 400 times it is wrong."""


LOOKED_AT = 256
"""Draws from the bounds that show where local exponents lie."""


@dataclass(frozen=True)
class Box:
    """Bounds of the unknowns of a search, (unknowns,) each, and the scale on which it steps."""

    low: Floats
    high: Floats

    @classmethod
    def of(cls, law: CreepLaw, coordinates: Coordinates, log_rate: float, log_pace: float) -> Box:
        """The law's bounds, with rates within RATE_WINDOW of the measured ones.

        log_rate : of strain; log_pace : ln of one over the life of a test, that of internal variables.
        """
        low, high = (np.array([p.to_internal(p.bounds[end]) for p in law.params.values()], float) for end in (0, 1))
        for local in coordinates.exponents:
            drawn = low + qmc.Sobol(low.size, seed=0).random(LOOKED_AT) * (high - low)
            h = coordinates.u(drawn)[:, local.p]
            h = h[np.isfinite(h)]
            low[local.p], high[local.p] = float(h.min()), float(max(min(h.max(), LARGEST), h.min() + 1.0))
        for k in coordinates.rates:
            low[k], high[k] = log_rate + RATE_WINDOW[0], log_rate + RATE_WINDOW[1]
        for k in coordinates.growths:
            low[k], high[k] = log_pace + RATE_WINDOW[0], log_pace + RATE_WINDOW[1]
        return cls(low, high)

    def beside(self, unknowns: Unknowns) -> Box:
        """The box of x = (u, e), with the limits of the unknowns of tests."""
        n = unknowns.size
        return Box(np.concatenate([self.low, unknowns.low[:n]]), np.concatenate([self.high, unknowns.high[:n]]))

    def clip(self, u: Floats) -> Floats:
        """The nearest point inside."""
        return np.clip(u, self.low, self.high)

    @property
    def width(self) -> Floats:
        """high - low."""
        return self.high - self.low

    @property
    def middle(self) -> Floats:
        """Half way."""
        return 0.5 * (self.low + self.high)
