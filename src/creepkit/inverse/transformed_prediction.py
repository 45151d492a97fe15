"""Nuisances that a predictor need not know: other programs of a history, and a law with rate factors in time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.prediction_concatenation import concatenated_candidates, concatenated_tests
from creepkit.inverse.rate_nuisances import law_with_rate_factors, rate_parameters
from creepkit.language import CreepLaw
from creepkit.records import (
    PROGRAM_NUISANCES,
    RATE_NUISANCES,
    History,
    NuisanceValues,
    Prediction,
    Predictor,
    broadcast_candidates,
    kind_and_start,
    predict_with,
    with_program_nuisances,
)

TRANSFORMING_NUISANCES = (*PROGRAM_NUISANCES, *RATE_NUISANCES)
"""Kinds that every predictor follows as other histories, or by another law."""


def predict_transformed(
    predictor: Predictor,
    law: CreepLaw,
    theta: Floats,
    histories: Sequence[History],
    nuisances: NuisanceValues,
    transformed: NuisanceValues,
    sensitivities: bool,
) -> Prediction:
    """Predict other histories, by a law with rate factors, in place of the nuisances `transformed`.

    theta : (candidates, parameters) internal values. Consecutive candidates with the same programs are one batch.
    """
    if max(len(values) for values in transformed.values()) > 1:
        theta, everything = broadcast_candidates(theta, {**nuisances, **transformed}, len(histories))
        nuisances, transformed = ({key: everything[key] for key in part} for part in (nuisances, transformed))
        joint = np.stack([*transformed.values()], axis=-1).reshape(len(theta), -1)
        first_of_batch = [0, *(np.flatnonzero((np.diff(joint, axis=0) != 0.0).any(axis=1)) + 1), len(theta)]
        if len(first_of_batch) > 2:
            batches = [slice(first, end) for first, end in pairwise(first_of_batch)]
            return concatenated_candidates(
                [
                    predict_transformed(
                        predictor,
                        law,
                        theta[batch],
                        histories,
                        {key: values[batch] for key, values in nuisances.items()},
                        {key: values[batch][:1] for key, values in transformed.items()},
                        sensitivities,
                    )
                    for batch in batches
                ]
            )
    values_of_tests = [{key: float(values[0, k]) for key, values in transformed.items()} for k in range(len(histories))]
    changed = [with_program_nuisances(h, values) for h, values in zip(histories, values_of_tests, strict=True)]
    keys = tuple(key for key in transformed if kind_and_start(key)[0] in RATE_NUISANCES)
    if not keys:
        return plain_prediction(predictor, law, theta, changed, nuisances, sensitivities)
    rates = np.array([[values[key] for key in keys] for values in values_of_tests])
    return _predict_with_rate_factors(predictor, law, theta, changed, nuisances, (keys, rates), sensitivities)


def _predict_with_rate_factors(
    predictor: Predictor,
    law: CreepLaw,
    theta: Floats,
    histories: Sequence[History],
    nuisances: NuisanceValues,
    rate_factors: tuple[tuple[str, ...], Floats],
    sensitivities: bool,
) -> Prediction:
    """Predict by a law with rate factors; tests with the same factors are one batch.

    theta : (candidates, parameters) internal values. rate_factors : keys, and their values (tests, keys).
    """
    keys, rates = rate_factors
    extended_law = law_with_rate_factors(law, keys)
    parameters, scales = rate_parameters(keys, rates, histories)
    groups = []
    for row in np.unique(parameters, axis=0):
        tests = [int(k) for k in np.flatnonzero((parameters == row).all(axis=1))]
        extended_theta = np.concatenate([theta, np.tile(row, (len(theta), 1))], axis=1)
        prediction = plain_prediction(
            predictor,
            extended_law,
            extended_theta,
            [histories[k] for k in tests],
            {key: values[:, tests] for key, values in nuisances.items()},
            sensitivities,
        )
        if prediction.jacobian is not None:
            by_parameter, by_rate = np.split(prediction.jacobian, [theta.shape[1]], axis=-1)
            slopes = {key: by_rate[..., k] * scales[tests, k, None, None] for k, key in enumerate(keys)}
            merged = {**prediction.nuisance_jacobian, **slopes}
            prediction = replace(prediction, jacobian=by_parameter, nuisance_jacobian=merged)
        groups.append((tests, prediction))
    return groups[0][1] if len(groups) == 1 else concatenated_tests(groups, histories)


def plain_prediction(
    predictor: Predictor,
    law: CreepLaw,
    theta: Floats,
    histories: Sequence[History],
    nuisances: NuisanceValues,
    sensitivities: bool,
) -> Prediction:
    """The predictor's own prediction, checked; theta : (candidates, parameters) internal values."""
    return predict_with(predictor, law, theta, histories, nuisances=nuisances, sensitivities=sensitivities)
