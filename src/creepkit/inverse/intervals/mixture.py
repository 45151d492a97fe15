"""Intervals over laws: each law of a ranking with its weight and its own posterior, together.

What is asked (ln of a rate, a local exponent) is normal, or Student's where the scatter is poorly known, under each
law; over all laws it has the distribution sum_i w_i F_i, whose quantiles are found by halving. Which law holds is part
of what is not known: intervals of the best law alone, as if it were the only one, are too narrow (Hoeting et al.
(1999), Stat. Sci. 14, 382).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.stats import t as student

from creepkit.arrays import ArrayLike, Floats
from creepkit.errors import FitError
from creepkit.inverse.identification import Identification
from creepkit.inverse.intervals.quantities import CoordinateFunction, local_exponent, log_rate
from creepkit.inverse.uncertainty import delta_method

BISECTIONS = 80
"""Of the interval between the lowest and the highest quantile of the parts: to the last digit."""
NORMAL_FREEDOM = 1e9
"""Degrees of freedom at which Student's distribution is the normal one."""
INTERVAL_PROBABILITIES = (0.5, 0.025, 0.975)


@dataclass(frozen=True, eq=False)
class MixtureDistribution:
    """The parts of a mixture: location, spread and degrees of freedom of each, with its weight.

    weight, freedom : (parts,); middle, sd : (parts, ...).
    """

    weight: Floats
    degrees_of_freedom: Floats
    location: Floats
    scale: Floats

    def cumulative(self, x: Floats) -> Floats:
        """(...,) the probability of less than x (...,)."""
        probabilities = student.cdf((x - self.location) / self.scale, self._freedom)
        return np.asarray(np.einsum("p,p...->...", self.weight, probabilities), float)

    def quantile(self, probability: float) -> Floats:
        """(...,) by halving, between the lowest and the highest quantile of the parts."""
        quantiles = self.location + self.scale * student.ppf(probability, self._freedom)
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
    def _freedom(self) -> Floats:
        return self.degrees_of_freedom.reshape(-1, *(1 for _ in self.location.shape[1:]))


class WeightedFit(Protocol):
    """One law of a ranking: its identification and its weight."""

    @property
    def fit(self) -> Identification:
        """The identification."""
        ...

    @property
    def weight(self) -> float:
        """Its share of belief."""
        ...


class WeightedLaws(Protocol):
    """A ranking."""

    @property
    def laws(self) -> Sequence[WeightedFit]:
        """Its laws."""
        ...


@dataclass(frozen=True, eq=False)
class ModelAverage:
    """Laws with weights that add up to one, each with its own posterior."""

    fits: tuple[Identification, ...]
    weights: tuple[float, ...]

    def __post_init__(self) -> None:
        if not self.fits or len(self.fits) != len(self.weights):
            raise FitError(f"a mixture needs as many laws as weights, found {len(self.fits)} and {len(self.weights)}")
        total = float(sum(self.weights))
        if min(self.weights) < 0 or not (np.isfinite(total) and total > 0):
            raise FitError(f"the weights of a mixture must not be negative, nor all zero; found {self.weights}")
        object.__setattr__(self, "weights", tuple(float(w) / total for w in self.weights))

    @classmethod
    def from_ranking(cls, source: WeightedLaws | Identification) -> ModelAverage:
        """The laws of a ranking; a single identification is a mixture of one."""
        if isinstance(source, Identification):
            return cls((source,), (1.0,))
        weighted = [r for r in source.laws if r.weight > 0]
        return cls(tuple(r.fit for r in weighted), tuple(r.weight for r in weighted))

    def rate(
        self, stress: ArrayLike, temperature: ArrayLike | None = None, *, strain: ArrayLike | None = None,
        time: ArrayLike | None = None,
    ) -> tuple[Floats, Floats, Floats]:  # fmt: skip
        """Median creep rate over the laws, 1/s, with its 95 % interval: (rate, low, high).

        stress MPa, temperature K; what is not given is that of the best law's reference point.
        """
        distribution = self.distribution(log_rate, stress, temperature, strain, time)
        median, low, high = (np.exp(v) for v in distribution.interval())
        return median, low, high

    def local_exponent(
        self, stress: ArrayLike, temperature: ArrayLike | None = None, *, strain: ArrayLike | None = None,
        time: ArrayLike | None = None,
    ) -> tuple[Floats, Floats, Floats]:  # fmt: skip
        """Median local stress exponent over the laws, with its 95 % interval."""
        return self.distribution(local_exponent, stress, temperature, strain, time).interval()

    def distribution(
        self, quantity: Callable[..., CoordinateFunction], stress: ArrayLike, temperature: ArrayLike | None,
        strain: ArrayLike | None, time: ArrayLike | None,
    ) -> MixtureDistribution:  # fmt: skip
        """The distribution under each law of what(coordinates, stress, temperature, strain, time), at one point."""
        reference = self.fits[0].reference
        point = [
            default if given is None else given
            for given, default in ((temperature, reference.temperature), (strain, reference.strain), (time, reference.time))
        ]
        normals = [_normal_under_law(fit, quantity(fit.coordinates, stress, *point)) for fit in self.fits]
        location, scale = (np.stack([each[k] for each in normals]) for k in (0, 1))
        return MixtureDistribution(np.array(self.weights), degrees_of_freedom(self.fits), location, scale)

    def __str__(self) -> str:
        reference = self.fits[0].reference
        rate, low, high = (float(v) for v in self.rate(reference.stress))
        exponent, exponent_low, exponent_high = (float(v) for v in self.local_exponent(reference.stress))
        names = ", ".join(f"{fit.law.name} ({w:.2g})" for fit, w in zip(self.fits, self.weights, strict=True))
        return (
            f"over the laws {names}: rate at {reference.stress:.4g} MPa, {reference.temperature:.0f} K {rate:.3g} "
            f"[{low:.3g}, {high:.3g}] 1/s, local stress exponent {exponent:.3g} [{exponent_low:.3g}, {exponent_high:.3g}]"
        )


def degrees_of_freedom(fits: Sequence[Identification]) -> Floats:
    """(fits,) degrees of freedom of their intervals."""
    return np.array([min(max(fit.freedom, 1.0), NORMAL_FREEDOM) for fit in fits])


def _normal_under_law(fit: Identification, function: CoordinateFunction) -> tuple[Floats, Floats]:
    """Value and standard deviation under one law; never quite zero, so that a mixture of certainties has quantiles."""
    middle, sd = delta_method(function, fit.u, fit.covariance)
    return middle, np.maximum(sd, 1e-12 * np.maximum(np.abs(middle), 1.0))
