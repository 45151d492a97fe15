"""Bounds of the unknowns: conditioned coordinates of a law within its own bounds and near the measured creep rate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from creepkit.arrays import Floats
from creepkit.inverse.coordinates import LARGEST_EXPONENT, Coordinates
from creepkit.inverse.nuisance_parameters import NuisanceParameters
from creepkit.language import CreepLaw

LOG_RATE_BOUNDS = (-12.0, 6.0)
"""Bounds of the log rate of a term, or of an internal variable, about the measured one: at 1e-5 of the data it is
absent, at 400 times it is wrong."""


EXPONENT_SAMPLES = 256
"""Points within the bounds of the parameters at which the range of local exponents is evaluated."""


@dataclass(frozen=True)
class Bounds:
    """Bounds of the unknowns of a least-squares problem, and the scale on which a search steps.

    lower, upper : (unknowns,) in the units of the unknowns, of u or of x = (u, e).
    """

    lower: Floats
    upper: Floats

    @classmethod
    def from_law(cls, law: CreepLaw, coordinates: Coordinates, log_rate: float, log_internal_rate: float) -> Bounds:
        """The bounds of a law's conditioned coordinates u, with log rates within LOG_RATE_BOUNDS of the measured ones.

        log_rate : ln of the measured strain rate in 1/s; log_internal_rate : ln of one over the duration of a test in
            1/s, about which the rates of internal variables lie.
        """
        lower, upper = law.internal_bounds
        for local_exponent in coordinates.exponents:
            sampled = lower + qmc.Sobol(lower.size, seed=0).random(EXPONENT_SAMPLES) * (upper - lower)
            exponents = coordinates.u(sampled)[:, local_exponent.position]
            exponents = exponents[np.isfinite(exponents)]
            lower[local_exponent.position], upper[local_exponent.position] = (
                float(exponents.min()),
                float(max(min(exponents.max(), LARGEST_EXPONENT), exponents.min() + 1.0)),
            )
        for k in coordinates.term_rates:
            lower[k], upper[k] = log_rate + LOG_RATE_BOUNDS[0], log_rate + LOG_RATE_BOUNDS[1]
        for k in coordinates.state_rates:
            lower[k], upper[k] = log_internal_rate + LOG_RATE_BOUNDS[0], log_internal_rate + LOG_RATE_BOUNDS[1]
        return cls(lower, upper)

    def with_nuisances(self, nuisances: NuisanceParameters) -> Bounds:
        """Those of x = (u, e): bounds of u, then the limits of the nuisance parameters."""
        count = nuisances.size
        return Bounds(
            np.concatenate([self.lower, nuisances.low[:count]]), np.concatenate([self.upper, nuisances.high[:count]])
        )

    def of(self, positions: Sequence[int]) -> Bounds:
        """The bounds of some of the unknowns."""
        index = np.asarray(positions, np.int64)
        return Bounds(self.lower[index], self.upper[index])

    def clip(self, u: Floats) -> Floats:
        """(..., unknowns) the nearest points within the bounds; u : (..., unknowns)."""
        return np.clip(u, self.lower, self.upper)

    @property
    def width(self) -> Floats:
        """(unknowns,) upper less lower bound."""
        return self.upper - self.lower

    @property
    def centre(self) -> Floats:
        """(unknowns,) half way between the bounds."""
        return 0.5 * (self.lower + self.upper)
