"""Where the rate of a test is looked at: at some times from its start to its end, in the middle of equal spans."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from creepkit.arrays import Floats, Ints
from creepkit.dataset.term_rates import Point, ln_rate
from creepkit.language import CreepLaw, time

COUNT = 12
SHARES = (np.arange(COUNT) + 0.5) / COUNT
"""Of the end of the test."""

STRAIN = 0.01
"""At which rates are stated, as in the paper's criteria 1 and 2."""


@dataclass(frozen=True, eq=False)
class Looks:
    """stress : (rows, looks) MPa, or (rows, 1) where it stays. times : (rows, looks) s. temperature : (rows,) K."""

    stress: Floats
    times: Floats
    temperature: Floats

    def point(self, axes: int = 0, *, timeless: bool = False, factor: float = 1.0) -> Point:
        """The point with `axes` more axes between rows and looks; timeless : one look will do where stress stays."""
        times = self.times[:, :1] if timeless else self.times
        given = (factor * self.stress, times, self.temperature[:, None])
        stress, seconds, warmth = (v.reshape(v.shape[0], *[1] * axes, v.shape[1]) for v in given)
        return Point(stress, STRAIN, seconds, warmth)

    def rows(self, chosen: Ints) -> Looks:
        """Some of the rows."""
        return Looks(self.stress[chosen], self.times[chosen], self.temperature[chosen])

    @property
    def ends(self) -> Floats:
        """When the tests end, (rows,) s."""
        return np.asarray(self.times[:, -1] / SHARES[-1])

    def middle_point(self, axes: int = 0) -> Point:
        """The point at the middle stress, half way in time, with `axes` axes after the rows."""
        shape = (len(self.times), *[1] * axes)
        stress, seconds, warmth = (v.reshape(shape) for v in (self.middle, 0.5 * self.ends, self.temperature))
        return Point(stress, STRAIN, seconds, warmth)

    @property
    def middle(self) -> Floats:
        """The geometric mean of the stresses, (rows,) MPa."""
        return np.asarray(np.exp(np.log(self.stress).mean(axis=1)))


def mean_ln_rate(law: CreepLaw, theta: Floats, looks: Looks, factor: float = 1.0) -> Floats:
    """ln of the mean rate over a test, 1/s, (rows, ...).

    theta : (rows, ..., parameters) internal. factor : on the stresses.
    """
    point = looks.point(theta.ndim - 2, timeless=not law.uses(time), factor=factor)
    found = ln_rate(law, theta[..., None, :], point)
    return np.asarray(logsumexp(found, axis=-1) - np.log(found.shape[-1]))
