"""Bayesian model averaging: intervals over the laws of a ranking.

A quantity (ln of a rate, a local exponent) is normal, or Student's t, under each law; over all laws it has the
distribution sum_i w_i F_i, whose quantiles are found by bisection (Hoeting et al. (1999), Stat. Sci. 14, 382).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.errors import FitError
from creepkit.inverse.evidence import evidence_weights
from creepkit.inverse.identification import Identification
from creepkit.inverse.uncertainty.laplace_approximation import NORMAL_QUANTILE, delta_method
from creepkit.inverse.uncertainty.mixture_distribution import NORMAL_FREEDOM, MixtureDistribution
from creepkit.inverse.uncertainty.quantities import (
    CoordinateFunction,
    Interval,
    PointQuantity,
    RateStatements,
    log_rate,
)
from creepkit.language import CreepLaw
from creepkit.records import History
from creepkit.records.presentable import Presentable


class WeightedLaws(Protocol):
    """A ranking."""

    @property
    def laws(self) -> Sequence[Any]:
        """Its laws, each with `fit`, its identification, and `excess` of the criterion."""
        ...


@dataclass(frozen=True, eq=False)
class ModelAverage(RateStatements, Presentable):
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
        """The laws of a ranking; a single identification is a mixture of one.

        Each has its own weight: laws that are one function over the tests may differ beyond them.
        """
        if isinstance(source, Identification):
            return cls((source,), (1.0,))
        weights = evidence_weights([r.excess for r in source.laws])[1]
        weighted = [(r.fit, float(weight)) for r, weight in zip(source.laws, weights, strict=True) if weight > 0]
        return cls(*zip(*weighted, strict=True))

    @property
    def ranges(self) -> Mapping[str, tuple[float, float]]:  # type: ignore[override]
        """That the tests cover, as of an Identification."""
        return self.fits[0].ranges

    @property
    def stated_laws(self) -> tuple[CreepLaw, ...]:
        """The laws of the mixture."""
        return tuple(fit.law for fit in self.fits)

    def forecast(self, tests: History | Sequence[History], *, level: float = 0.95, **options: Any) -> Any:
        """What tests will show, over the laws, so that bands hold the doubt about the law; as creepkit.forecast()."""
        from creepkit.forecasts.forecast import forecast

        return forecast(self, tests, level=level, **options)

    def interval_at(self, quantity: PointQuantity, point: Mapping[str, ArrayLike | None]) -> Interval:
        """Median and 95 % interval over the laws; point : {name: (...,) or None for the best law's reference}."""
        reference = self.fits[0].reference
        point = {name: getattr(reference, name) if value is None else value for name, value in point.items()}
        functions = [quantity(fit.coordinates, **point) for fit in self.fits]
        normals = [_normal_under_law(fit, function) for fit, function in zip(self.fits, functions, strict=True)]
        location, scale = (np.stack([each[k] for each in normals]) for k in (0, 1))
        if quantity is log_rate:
            at = np.asarray(point["stress"], float), np.asarray(point["temperature"], float)
            misses = [f.misfit_half_widths(g, *at) / NORMAL_QUANTILE for f, g in zip(self.fits, functions, strict=True)]
            scale = np.stack([np.hypot(own, more) for own, more in zip(scale, misses, strict=True)])
        freedom = np.full(len(self.fits), NORMAL_FREEDOM)
        return MixtureDistribution(np.array(self.weights), freedom, location, scale).interval()

    shown_by = "inference.model_average_text"


def _normal_under_law(fit: Identification, function: CoordinateFunction) -> tuple[Floats, Floats]:
    """Value and standard deviation under one law; never quite zero, so that a mixture of certainties has quantiles."""
    if fit.samples is not None:
        _, low, high = fit.interval_of(function)
        middle, sd = 0.5 * (low + high), 0.5 * (high - low) / NORMAL_QUANTILE
    else:
        middle, sd = delta_method(function, fit.u, fit.covariance)
    return middle, np.maximum(sd, 1e-12 * np.maximum(np.abs(middle), 1.0))
