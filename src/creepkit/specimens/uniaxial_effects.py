"""What is unknown about a test of a bar or a point and changes its simulation: its temperature and its modulus."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.errors import SolveError
from creepkit.records import NuisanceValues, History, Prediction, Program

if TYPE_CHECKING:
    from creepkit.language import Elastic

NUISANCES = ("temperature", "modulus")
DIFFERENCE_STEPS = {"temperature": 0.1, "modulus": 1e-3}
"""Of central differences: K, and relative."""

PlainPredict = Callable[[Mapping[str, ArrayLike], Sequence[History], bool], Prediction]
"""Predict values and histories, with derivatives or without."""
ModulusDerivative = Callable[[Prediction, Sequence[History], Floats], Floats | None]
"""Derivative of the values to the relative change of the modulus; None where it is not known exactly."""


def predict_with_nuisances(
    predict_plain: PlainPredict,
    values: Mapping[str, ArrayLike],
    histories: Sequence[History],
    nuisances: NuisanceValues | None,
    jacobian: bool,
    *,
    modulus_derivative: ModulusDerivative | None = None,
    specimen: str = "uniaxial",
) -> Prediction:
    """Predict with nuisances, if there are any, a candidate at a time where they differ from candidate to candidate.

    Derivatives are central differences, of 0.1 K and of a thousandth of the modulus to each side, but for that to the
    modulus where `softening` gives it.
    """
    if not nuisances:
        return predict_plain(values, histories, jacobian)
    for kind in nuisances:
        if kind not in NUISANCES:
            known = " and ".join(NUISANCES)
            raise SolveError(f"a {specimen} specimen does not know the nuisance '{kind}'; it knows {known}")
    rows = max(len(v) for v in nuisances.values())
    if rows == 1:
        return _predict_one(predict_plain, values, histories, {kind: v[0] for kind, v in nuisances.items()}, jacobian, modulus_derivative)
    parts = []
    for row in range(rows):
        candidate_values = {n: np.broadcast_to(np.asarray(v, float), (rows,))[row] for n, v in values.items()}
        candidate_nuisances = {kind: np.broadcast_to(v, (rows, len(histories)))[row] for kind, v in nuisances.items()}
        parts.append(_predict_one(predict_plain, candidate_values, histories, candidate_nuisances, jacobian, modulus_derivative))
    return _concatenated(parts)


def _predict_one(
    predict_plain: PlainPredict, values: Mapping[str, ArrayLike], histories: Sequence[History], nuisances: Mapping[str, Floats],
    jacobian: bool, modulus_derivative: ModulusDerivative | None,
) -> Prediction:  # fmt: skip
    result = predict_plain(values, _perturbed_histories(histories, nuisances), jacobian)
    if not jacobian:
        return result
    slopes = {}
    for kind in nuisances:
        exact = modulus_derivative if kind == "modulus" else None
        slope = None if exact is None else exact(result, _perturbed_histories(histories, nuisances), nuisances[kind])
        if slope is not None:
            slopes[kind] = slope
            continue
        ends = (_perturbed_histories(histories, {**nuisances, kind: nuisances[kind] + s}) for s in (DIFFERENCE_STEPS[kind], -DIFFERENCE_STEPS[kind]))
        up, down = (predict_plain(values, moved, False).values for moved in ends)
        slopes[kind] = (up - down) / (2 * DIFFERENCE_STEPS[kind])
    return replace(result, nuisance_jacobian=slopes)


def _perturbed_histories(histories: Sequence[History], nuisances: Mapping[str, Floats]) -> list[History]:
    """Histories that are so many K warmer, with moduli larger by these shares."""
    zeros = np.zeros(len(histories))
    temperature_changes, modulus_changes = nuisances.get("temperature", zeros), nuisances.get("modulus", zeros)
    changed = []
    for history, T, share in zip(histories, temperature_changes, modulus_changes, strict=True):
        program = history.temperature_program()
        elastic = None if history.elastic is None else _with_modulus_change(history.elastic, float(share))
        changed.append(history.replace(temperature=Program(program.times, program.values + T), elastic=elastic))
    return changed


def _with_modulus_change(elastic: Elastic, share: float) -> Elastic:
    return replace(elastic, E=elastic.E * (1.0 + share))


def _concatenated(parts: Sequence[Prediction]) -> Prediction:
    def joined(arrays: Sequence[Floats]) -> Floats:
        return np.concatenate(arrays)

    jacobians = [p.jacobian for p in parts if p.jacobian is not None]
    return replace(
        parts[0],
        values=joined([p.values for p in parts]),
        status=np.concatenate([p.status for p in parts]),
        end_times=joined([p.end_times for p in parts]),
        jacobian=joined(jacobians) if jacobians else None,
        nuisance_jacobian={kind: joined([p.nuisance_jacobian[kind] for p in parts]) for kind in parts[0].nuisance_jacobian},
    )
