"""Bounds of the unknowns of a search."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from creepkit.arrays import Floats
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.effects import NuisanceParameters
from creepkit.inverse.local_exponents import LARGEST_EXPONENT
from creepkit.language import CreepLaw

LOG_RATE_BOUNDS = (-12.0, 6.0)
"""Bounds of the log rate of a term, or of an internal variable, about the measured one: at 1e-5 of the data it is
absent, at 400 times it is wrong."""


EXPONENT_SAMPLES = 256
"""Draws from the bounds that show where local exponents lie."""


@dataclass(frozen=True)
class Bounds:
    """Bounds of the unknowns of a search, (unknowns,) each, and the scale on which it steps."""

    lower: Floats
    upper: Floats

    @classmethod
    def from_law(cls, law: CreepLaw, coordinates: Coordinates, log_rate: float, log_internal_rate: float) -> Bounds:
        """The law's bounds, with rates within RATE_WINDOW of the measured ones.

        log_rate : of strain; log_pace : ln of one over the life of a test, that of internal variables.
        """
        lower, upper = (np.array([p.to_internal(p.bounds[index]) for p in law.params.values()], float) for index in (0, 1))
        for local_exponent in coordinates.exponents:
            sampled = lower + qmc.Sobol(lower.size, seed=0).random(EXPONENT_SAMPLES) * (upper - lower)
            exponents = coordinates.u(sampled)[:, local_exponent.position]
            exponents = exponents[np.isfinite(exponents)]
            lower[local_exponent.position], upper[local_exponent.position] = float(exponents.min()), float(max(min(exponents.max(), LARGEST_EXPONENT), exponents.min() + 1.0))
        for k in coordinates.term_rates:
            lower[k], upper[k] = log_rate + LOG_RATE_BOUNDS[0], log_rate + LOG_RATE_BOUNDS[1]
        for k in coordinates.state_rates:
            lower[k], upper[k] = log_internal_rate + LOG_RATE_BOUNDS[0], log_internal_rate + LOG_RATE_BOUNDS[1]
        return cls(lower, upper)

    def with_nuisances(self, nuisances: NuisanceParameters) -> Bounds:
        """The box of x = (u, e), with the limits of the unknowns of tests."""
        count = nuisances.size
        return Bounds(np.concatenate([self.lower, nuisances.low[:count]]), np.concatenate([self.upper, nuisances.high[:count]]))

    def clip(self, u: Floats) -> Floats:
        """The nearest point inside."""
        return np.clip(u, self.lower, self.upper)

    @property
    def width(self) -> Floats:
        """high - low."""
        return self.upper - self.lower

    @property
    def centre(self) -> Floats:
        """Half way."""
        return 0.5 * (self.lower + self.upper)
