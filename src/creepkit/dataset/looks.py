"""Where the rate of a test is looked at: at some times from its start to its end, in the middle of equal spans."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from creepkit.arrays import Floats, Ints
from creepkit.dataset.term_rates import RateArguments, ln_rate
from creepkit.language import CreepLaw, time

POINT_COUNT = 12
POINT_FRACTIONS = (np.arange(POINT_COUNT) + 0.5) / POINT_COUNT
"""Of the end of the test."""

REFERENCE_STRAIN = 0.01
"""At which rates are stated, as in the paper's criteria 1 and 2."""


@dataclass(frozen=True, eq=False)
class RateEvaluationPoints:
    """stress : (rows, looks) MPa, or (rows, 1) where it stays. times : (rows, looks) s. temperature : (rows,) K."""

    stress: Floats
    times: Floats
    temperature: Floats

    def arguments(self, axes: int = 0, *, one_time: bool = False, factor: float = 1.0) -> RateArguments:
        """The point with `axes` more axes between rows and looks; timeless : one look will do where stress stays."""
        times = self.times[:, :1] if one_time else self.times
        columns = (factor * self.stress, times, self.temperature[:, None])
        stress, seconds, temperature = (v.reshape(v.shape[0], *[1] * axes, v.shape[1]) for v in columns)
        return RateArguments(stress, REFERENCE_STRAIN, seconds, temperature)

    def rows(self, rows: Ints) -> RateEvaluationPoints:
        """Some of the rows."""
        return RateEvaluationPoints(self.stress[rows], self.times[rows], self.temperature[rows])

    @property
    def end_times(self) -> Floats:
        """When the tests end, (rows,) s."""
        return np.asarray(self.times[:, -1] / POINT_FRACTIONS[-1])

    def midpoint_arguments(self, axes: int = 0) -> RateArguments:
        """The point at the middle stress, half way in time, with `axes` axes after the rows."""
        shape = (len(self.times), *[1] * axes)
        stress, seconds, temperature = (v.reshape(shape) for v in (self.mean_stress, 0.5 * self.end_times, self.temperature))
        return RateArguments(stress, REFERENCE_STRAIN, seconds, temperature)

    @property
    def mean_stress(self) -> Floats:
        """The geometric mean of the stresses, (rows,) MPa."""
        return np.asarray(np.exp(np.log(self.stress).mean(axis=1)))


def mean_ln_rate(law: CreepLaw, theta: Floats, points: RateEvaluationPoints, stress_factor: float = 1.0) -> Floats:
    """ln of the mean rate over a test, 1/s, (rows, ...).

    theta : (rows, ..., parameters) internal. factor : on the stresses.
    """
    arguments = points.arguments(theta.ndim - 2, one_time=not law.uses(time), factor=stress_factor)
    ln_rates = ln_rate(law, theta[..., None, :], arguments)
    return np.asarray(logsumexp(ln_rates, axis=-1) - np.log(ln_rates.shape[-1]))
