"""Derivatives of predictors that know none: central differences, all of them candidates of one batch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.together import predict
from creepkit.language import CreepLaw
from creepkit.records import Effects, History, Prediction, Predictor

STEP = 1e-4
"""Of internal parameters (ln of a coefficient, an exponent), relative to the larger of their size and one."""
EFFECT_STEPS = {"thickness": 1e-3, "window": 1e-2, "modulus": 1e-3, "temperature": 0.1}
"""mm, mm, relative, K: far above what the error of a solver's steps is, and bending outputs by under 1e-6 of them."""


def differentiated(
    using: Predictor, law: CreepLaw, theta: Floats, histories: Sequence[History], effects: Effects
) -> Prediction:
    """The prediction of one candidate with its derivatives to parameters and effects.

    theta : (parameters,) internal. What the predictor does not differentiate itself comes from differences.
    """
    found = predict(using, law, author_values(law, theta[None]), histories, jacobian=True, effects=effects)
    numeric = found.jacobian is None
    kinds = [kind for kind in effects if kind not in found.effect_jacobian]
    if not (numeric or kinds):
        return found
    steps = STEP * np.maximum(np.abs(theta), 1.0) if numeric else np.zeros(0)
    shifts = [EFFECT_STEPS[kind] for kind in kinds]
    points, moved = _around(theta, steps, effects, kinds, shifts)
    batch = predict(using, law, author_values(law, points), histories, effects=moved)
    half = len(points) // 2
    change = batch.values[:half] - batch.values[half:]
    slopes = np.moveaxis(change[: steps.size], 0, -1) / (2 * steps) if numeric else None
    own = {kind: change[steps.size + k][None] / (2 * shifts[k]) for k, kind in enumerate(kinds)}
    return replace(
        found,
        jacobian=found.jacobian if slopes is None else slopes[None],
        effect_jacobian={**found.effect_jacobian, **own},
    )


def _around(
    theta: Floats, steps: Floats, effects: Effects, kinds: Sequence[str], shifts: Sequence[float]
) -> tuple[Floats, dict[str, Floats]]:
    """Candidates one step up, then one step down, in each parameter and then in each effect of all tests at once."""
    half = steps.size + len(kinds)
    points = np.tile(theta, (2 * half, 1))
    for sign, first in ((1.0, 0), (-1.0, half)):
        points[first : first + steps.size] += sign * np.diag(steps)
    moved = {kind: np.tile(values, (2 * half, 1)) for kind, values in effects.items()}
    for k, kind in enumerate(kinds):
        moved[kind][steps.size + k] += shifts[k]
        moved[kind][half + steps.size + k] -= shifts[k]
    return points, moved


def author_values(law: CreepLaw, theta: Floats) -> dict[str, Floats]:
    """{parameter: (candidates,)} in the author's units, from internal parameters (candidates, parameters)."""
    return {
        name: np.exp(theta[:, k]) if param.scale == "log" else theta[:, k]
        for k, (name, param) in enumerate(law.table.items())
    }
