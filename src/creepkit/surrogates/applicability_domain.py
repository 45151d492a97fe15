"""The applicability domain of a surrogate: how far inputs lie from the training rows.

A row of inputs is inside when each stands within the range of the training rows (with a margin) and the row lies no
farther from their middle than the farthest training row as the others see it: Mahalanobis distance, whose
leave-one-out value has a closed form. The range catches one input that leaves its range, the distance a combination
that never occurred (a coefficient and an exponent that between them make no creep). What never varied in training may
not vary at all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from creepkit.arrays import ArrayLike, Bools, Floats
from creepkit.errors import SurrogateError

DEFAULT_MARGIN = 0.01
"""Share of an input's range by which it may leave it, unless more is forgiven."""


LEAST_VARIANCE = 1e-9
"""Variance of a standardised direction below which it never varied."""


@dataclass(frozen=True, eq=False)
class ApplicabilityDomain:
    """Where training rows lie.

    names : of the inputs. low, high : (inputs,) their ranges, in their units. margin : (inputs,) share of its range by
    which an input may leave it. mean, scale : (inputs,) their mean and standard deviation. whitening : (inputs,
    directions), from standardised inputs to independent ones. limit : largest Mahalanobis distance inside.
    """

    names: tuple[str, ...]
    low: Floats
    high: Floats
    margin: Floats
    mean: Floats
    scale: Floats
    whitening: Floats
    limit: float

    def __post_init__(self) -> None:
        inputs = len(self.names)
        vectors = (self.low, self.high, self.margin, self.mean, self.scale)
        if any(v.shape != (inputs,) for v in vectors) or self.whitening.shape[:1] != (inputs,):
            raise SurrogateError(f"the domain of a surrogate: its arrays do not belong to {inputs} inputs; train again")
        numbers = (*vectors, self.whitening, np.asarray(self.limit))
        ordered = (self.low <= self.high).all() and (self.scale > 0).all() and (self.margin >= 0).all()
        if any(np.isnan(one).any() for one in numbers) or not ordered or not self.limit > 0:
            raise SurrogateError(
                "the domain of a surrogate: a number is missing, a range not from low to high, or a scale, margin or "
                "limit not above zero, so that nothing would lie outside; train again"
            )

    @classmethod
    def from_rows(cls, names: Sequence[str], rows: Floats, margin: ArrayLike = DEFAULT_MARGIN) -> ApplicabilityDomain:
        """The domain of training rows (n, inputs); NaN, an input that is not there, counts nowhere.

        margin : number or (inputs,).
        """
        rows = np.array(rows, float)
        finite = np.isfinite(rows)
        rows[:, ~finite.any(axis=0)] = 0.0
        mean, low, high = (f(rows, axis=0) for f in (np.nanmean, np.nanmin, np.nanmax))
        rows = np.where(np.isnan(rows), mean, rows)
        deviation = rows.std(axis=0)
        scale = np.where(deviation > 1e-6 * np.maximum(np.abs(mean), 1e-300), deviation, np.maximum(np.abs(mean), 1.0))
        standard = (rows - mean) / scale
        variance, axes = np.linalg.eigh(np.cov(standard, rowvar=False, ddof=1).reshape(len(names), len(names)))
        whitening = axes / np.sqrt(np.maximum(variance, LEAST_VARIANCE))
        square = ((standard @ whitening) ** 2).sum(axis=1)
        limit = float(np.sqrt(_leave_one_out_distance(square, len(rows)).max()))
        margins = np.broadcast_to(np.asarray(margin, float), low.shape).copy()
        return cls(tuple(names), low, high, margins, mean, scale, whitening, limit)

    def distance(self, rows: Floats) -> Floats:
        """How far rows (..., inputs) lie out, (...): up to 1 is inside; NaN, an input that is not there, is not far."""
        rows = np.where(np.isnan(rows), self.mean, rows)
        mahalanobis = np.sqrt((((rows - self.mean) / self.scale @ self.whitening) ** 2).sum(axis=-1)) / self.limit
        return np.asarray(np.maximum(mahalanobis, 1.0 + (self._excess(rows) - self.margin).max(axis=-1, initial=-1.0)))

    def outside(self, rows: Floats) -> Bools:
        """Which rows (..., inputs) lie outside, (...)."""
        return np.asarray(self.distance(rows) > 1.0)

    def _excess(self, rows: Floats) -> Floats:
        """By what share of its training range each input of rows (..., inputs) leaves it, likewise; negative inside."""
        extent = np.where(self.high > self.low, self.high - self.low, 1e-6 * self.scale)
        return np.asarray(np.maximum(self.low - rows, rows - self.high) / extent)


def _leave_one_out_distance(square: Floats, n: int) -> Floats:
    """Squared distance of each row from the others, given that from all n with their covariance.

    Removing row i moves the mean by (x_i - m)/(n - 1) and the scatter by n/(n - 1) (x_i - m)(x_i - m)'; Sherman and
    Morrison give the rest.
    """
    denominator = (n - 1) - n / (n - 1) * square
    distance_squared = (n / (n - 1)) ** 2 * (n - 2) * square / np.maximum(denominator, 1e-300)
    return np.asarray(np.where(denominator > 1e-9 * n, distance_squared, np.inf))
