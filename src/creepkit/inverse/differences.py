"""Derivatives of predictors that know none: central differences, all of them candidates of one batch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.together import predict
from creepkit.language import CreepLaw
from creepkit.records import NuisanceValues, History, Prediction, Predictor

RELATIVE_STEP = 1e-4
"""Of internal parameters (ln of a coefficient, an exponent), relative to the larger of their size and one."""
NUISANCE_STEPS = {"thickness": 1e-3, "window": 1e-2, "modulus": 1e-3, "temperature": 0.1}
"""mm, mm, relative, K: far above what the error of a solver's steps is, and bending outputs by under 1e-6 of them."""


def predict_with_sensitivities(
    predictor: Predictor, law: CreepLaw, theta: Floats, histories: Sequence[History], nuisances: NuisanceValues
) -> Prediction:
    """The prediction of one candidate with its derivatives to parameters and nuisances.

    theta : (parameters,) internal. What the predictor does not differentiate itself comes from differences.
    """
    prediction = predict(predictor, law, author_values(law, theta[None]), histories, jacobian=True, nuisances=nuisances)
    numeric = prediction.jacobian is None
    kinds = [kind for kind in nuisances if kind not in prediction.nuisance_jacobian]
    if not (numeric or kinds):
        return prediction
    steps = RELATIVE_STEP * np.maximum(np.abs(theta), 1.0) if numeric else np.zeros(0)
    nuisance_steps = [NUISANCE_STEPS[kind] for kind in kinds]
    points, shifted_nuisances = _difference_points(theta, steps, nuisances, kinds, nuisance_steps)
    batch = predict(predictor, law, author_values(law, points), histories, nuisances=shifted_nuisances)
    count = len(points) // 2
    differences = batch.values[:count] - batch.values[count:]
    jacobian = np.moveaxis(differences[: steps.size], 0, -1) / (2 * steps) if numeric else None
    nuisance_jacobian = {kind: differences[steps.size + k][None] / (2 * nuisance_steps[k]) for k, kind in enumerate(kinds)}
    return replace(
        prediction,
        jacobian=prediction.jacobian if jacobian is None else jacobian[None],
        nuisance_jacobian={**prediction.nuisance_jacobian, **nuisance_jacobian},
    )


def _difference_points(
    theta: Floats, steps: Floats, nuisances: NuisanceValues, kinds: Sequence[str], nuisance_steps: Sequence[float]
) -> tuple[Floats, dict[str, Floats]]:
    """Candidates one step up, then one step down, in each parameter and then in each effect of all tests at once."""
    count = steps.size + len(kinds)
    points = np.tile(theta, (2 * count, 1))
    for sign, offset in ((1.0, 0), (-1.0, count)):
        points[offset : offset + steps.size] += sign * np.diag(steps)
    shifted_nuisances = {kind: np.tile(values, (2 * count, 1)) for kind, values in nuisances.items()}
    for k, kind in enumerate(kinds):
        shifted_nuisances[kind][steps.size + k] += nuisance_steps[k]
        shifted_nuisances[kind][count + steps.size + k] -= nuisance_steps[k]
    return points, shifted_nuisances


def author_values(law: CreepLaw, theta: Floats) -> dict[str, Floats]:
    """{parameter: (candidates,)} in the author's units, from internal parameters (candidates, parameters)."""
    return {
        name: np.exp(theta[:, k]) if param.scale == "log" else theta[:, k]
        for k, (name, param) in enumerate(law.table.items())
    }
