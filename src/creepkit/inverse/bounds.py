"""Bounds of the unknowns: conditioned coordinates of a law within its own bounds and near the measured creep rate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import qmc

from creepkit.arrays import Floats
from creepkit.inverse.coordinates import LARGEST_EXPONENT, Coordinates
from creepkit.inverse.nuisance_parameters import NuisanceParameters
from creepkit.inverse.uncertainty.laplace_approximation import NORMAL_QUANTILE
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
            lower[local_exponent.position] = exponents.min()
            upper[local_exponent.position] = max(min(exponents.max(), LARGEST_EXPONENT), exponents.min() + 1.0)
        for positions, middle in ((coordinates.term_rates, log_rate), (coordinates.state_rates, log_internal_rate)):
            lower[list(positions)], upper[list(positions)] = (middle + end for end in LOG_RATE_BOUNDS)
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


WIDER_FACTOR, WIDER_SHARE = 100.0, 1.0 / 3.0
"""By what a bound is widened: that of a coefficient, and the larger end of an exponent, by a share of itself."""


MOST_WIDENINGS, NEAR_BOUND = 4, 1e-3
"""How often bounds are widened, and the share of their width within which a value ends at one."""


def widened(law: CreepLaw, theta: Floats) -> CreepLaw | None:
    """The law with wider bounds where an estimate ends at bounds that nobody stated; None where it ends at none.

    theta : (parameters,) internal values. A coefficient may pass both of its bounds, an exponent that of larger size.
    """
    params = dict(law.params)
    for (symbol, param), value in zip(law.params.items(), theta, strict=True):
        low, high = ends = [param.to_internal(bound) for bound in param.bounds]
        margin, bounds = NEAR_BOUND * (high - low), list(param.bounds)
        reached = (value < low + margin, value > high - margin)
        for k, sign in enumerate((-1.0, 1.0)):
            if param.scale == "log" and reached[k]:
                bounds[k] *= WIDER_FACTOR**sign
            elif reached[k] and sign * ends[k] >= max(map(abs, ends)):
                bounds[k] += WIDER_SHARE * bounds[k]
        if param.widens:
            params[symbol] = replace(param, bounds=tuple(np.clip(bounds, *(param.limits or (-np.inf, np.inf)))))
    return replace(law, params=params) if params != dict(law.params) else None


def with_determined(usual: CreepLaw, wider: CreepLaw, theta: Floats, deviations: Floats) -> CreepLaw:
    """The law with those of its wider bounds within which the tests determine a value, and else its usual ones.

    theta, deviations : (parameters,) internal values and their standard deviations within the wider bounds. A 95 %
    interval, not cut at bounds, that is as wide as the usual bounds and holds one of them says less than these do: far
    along a valley of values that describe the tests alike, others are predicted worse.
    """
    params = dict(usual.params)
    for symbol, value, half in zip(usual.params, theta, NORMAL_QUANTILE * deviations, strict=True):
        low, high = (params[symbol].to_internal(bound) for bound in params[symbol].bounds)
        if 2.0 * half < high - low or value - half > high or value + half < low:
            params[symbol] = wider.params[symbol]
    return replace(usual, params=params)


def widened_notes(law: CreepLaw, wider: CreepLaw) -> tuple[str, ...]:
    """How far parameters were sought beyond the bounds of a law, a sentence each; wider : that law as it was fitted."""
    pairs = zip(wider.table.items(), law.params.values(), strict=True)
    return tuple(
        f"{name} was searched from {found.bounds[0]:.3g} to {found.bounds[1]:.3g}, beyond the usual bounds of the law"
        for (name, found), usual in pairs
        if found.bounds != usual.bounds
    )
