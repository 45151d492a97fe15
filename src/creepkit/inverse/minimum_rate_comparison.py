"""Minimum creep rates of tests with intervals, predicted and beside what was measured."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.composite_predictor import predict_with_sensitivities
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.duration import compares_minimum_rate
from creepkit.inverse.goodness_of_fit import RateComparison
from creepkit.inverse.minimum_rates import with_minimum_rates
from creepkit.inverse.noise_model import NoiseModel
from creepkit.inverse.observation_vector import MINIMUM_RATE_OUTPUT
from creepkit.inverse.uncertainty.log_values import LogValues, misfit_variance
from creepkit.inverse.uncertainty.rate_scatter import RateScatter
from creepkit.records import History, Predictor


def compare_minimum_rates(
    coordinates: Coordinates,
    u: Floats,
    scatter: RateScatter,
    noise_model: NoiseModel,
    histories: Sequence[History],
    predictor: Predictor,
) -> list[RateComparison | None]:
    """Measured against predicted, for every history; None where no minimum rate is compared.

    u : (parameters,) conditioned coordinates.
    """
    compared = [k for k, history in enumerate(histories) if compares_minimum_rate(history)]
    comparisons: list[RateComparison | None] = [None] * len(histories)
    if not compared:
        return comparisons
    tests, theta, law = [histories[k] for k in compared], coordinates.theta(u)[None], coordinates.law
    prediction = predict_with_sensitivities(predictor, law, theta[0], tests, {})
    prediction = with_minimum_rates(prediction, predictor, law, theta, tests, sensitivities=True)
    assert prediction.jacobian is not None
    rates, by_parameter = prediction.values[0, :, 0, -1], prediction.jacobian[0, :, 0, -1]
    creeps = np.isfinite(rates) & (rates > 0)
    rates = np.where(creeps, rates, np.nan)
    by_parameter = np.nan_to_num(by_parameter / rates[:, None])
    effects = np.ones(len(tests))
    if len(coordinates.coefficients) == len(law.terms) + len(law.states):
        effects = by_parameter[:, list(coordinates.coefficients)].sum(axis=1)
    logarithms = LogValues(np.log(np.where(creeps, rates, 1.0)), by_parameter, effects)
    ends = logarithms.intervals(coordinates, u, scatter, tests, misfit_variance(noise_model, MINIMUM_RATE_OUTPUT))
    low, high = (np.where(creeps, np.exp(end), np.nan) for end in ends)
    for k, history, rate, least, most in zip(compared, tests, rates, low, high, strict=True):
        assert history.minimum_rate is not None
        comparisons[k] = RateComparison(history.minimum_rate, float(rate), float(least), float(most))
    return comparisons
