"""Predicted values that tests have one of, by their logarithms: rupture times and minimum rates, with intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.noise_model import NoiseModel
from creepkit.inverse.uncertainty.mixture_distribution import NORMAL_FREEDOM, MixtureDistribution
from creepkit.inverse.uncertainty.rate_scatter import RateScatter
from creepkit.records import History


@dataclass(frozen=True, eq=False)
class LogValues:
    """Logarithms of predicted values, one a test.

    values : (tests,) -. by_parameter : (tests, parameters) derivatives to the internal parameters.
    rate_effects : (tests,) derivatives to ln of a factor on all rates of the test.
    """

    values: Floats
    by_parameter: Floats
    rate_effects: Floats

    def intervals(
        self,
        coordinates: Coordinates,
        u: Floats,
        scatter: RateScatter,
        histories: Sequence[History],
        misfit: float | None,
    ) -> tuple[Floats, Floats]:
        """Lower and upper ends of 95 % intervals, (tests,) each.

        By the delta method, over the posterior distribution of the scatter between tests. u : (parameters,) conditioned
        coordinates. misfit : variance of a single value beside its rate, added with the scatter of rates; None for
        intervals of the law alone.
        """
        posterior, locations, variances = scatter.posterior, [], []
        parts = [scatter.joint(sd) for sd in posterior.sd]
        for k, history in enumerate(histories):
            test = scatter.new_test(history)
            row = np.zeros(scatter.joint_design.shape[1])
            row[: u.size] = self.by_parameter[k] @ coordinates.jacobian(u)
            row[[*test.known.values()]] = self.rate_effects[k] if misfit is not None else 0.0
            own = scatter.own_variance(test, posterior.sd) * self.rate_effects[k] ** 2 + (misfit or 0.0)
            locations.append([row @ mean for mean, _ in parts])
            by_law = np.array([row @ covariance @ row for _, covariance in parts])
            variances.append(by_law + own if misfit is not None else by_law)
        mixture = MixtureDistribution(
            posterior.weight,
            np.full(posterior.weight.size, NORMAL_FREEDOM),
            self.values + np.array(locations).T,
            np.sqrt(np.maximum(np.array(variances).T, 1e-20)),
        )
        low, high = (mixture.quantile(probability) for probability in (0.025, 0.975))
        return low, high


def misfit_variance(noise_model: NoiseModel, output: str) -> float:
    """Variance of ln of a single value beside that of the rate of its test."""
    return float(noise_model[output].misfit ** 2) if output in noise_model.outputs else 0.0
