"""What is unknown about a uniaxial test and changes its simulation: its temperature and its modulus."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.errors import SolveError
from creepkit.records import Effects, History, Prediction, Program
from creepkit.specimens.elastic_part import elastic_strain

if TYPE_CHECKING:
    from creepkit.language import Elastic

KINDS = ("temperature", "modulus")
STEP = 0.1
"""K, of the central difference in temperature."""

Plain = Callable[[Mapping[str, ArrayLike], Sequence[History], bool], Prediction]
"""Predict values and histories, with derivatives or without."""


def predict_with(
    plain: Plain, values: Mapping[str, ArrayLike], histories: Sequence[History], effects: Effects, jacobian: bool
) -> Prediction:
    """Predict with effects, a candidate at a time where they differ from candidate to candidate.

    The derivative to the modulus is exact, that to the temperature a central difference of 0.1 K to each side.
    """
    for kind in effects:
        if kind not in KINDS:
            raise SolveError(f"a uniaxial specimen does not know the nuisance '{kind}'; it knows {' and '.join(KINDS)}")
    rows = max(len(v) for v in effects.values())
    if rows == 1:
        return _of_one(plain, values, histories, {kind: v[0] for kind, v in effects.items()}, jacobian)
    parts = []
    for row in range(rows):
        own = {n: np.broadcast_to(np.asarray(v, float), (rows,))[row] for n, v in values.items()}
        mine = {kind: np.broadcast_to(v, (rows, len(histories)))[row] for kind, v in effects.items()}
        parts.append(_of_one(plain, own, histories, mine, jacobian))
    return _stacked(parts)


def _of_one(
    plain: Plain, values: Mapping[str, ArrayLike], histories: Sequence[History], effects: Mapping[str, Floats],
    jacobian: bool,
) -> Prediction:  # fmt: skip
    nothing = np.zeros(len(histories))
    warmer, stiffer = effects.get("temperature", nothing), effects.get("modulus", nothing)
    found = plain(values, _changed(histories, warmer, stiffer), jacobian)
    if not jacobian:
        return found
    slopes = {}
    if "temperature" in effects:
        up, down = (plain(values, _changed(histories, warmer + s, stiffer), False).values for s in (STEP, -STEP))
        slopes["temperature"] = (up - down) / (2 * STEP)
    if "modulus" in effects:
        slopes["modulus"] = _softening(found, _changed(histories, warmer, stiffer), stiffer)
    return replace(found, effect_jacobian=slopes)


def _changed(histories: Sequence[History], warmer: Floats, stiffer: Floats) -> list[History]:
    """Histories that are so many K warmer, with moduli larger by these shares."""
    changed = []
    for history, T, share in zip(histories, warmer, stiffer, strict=True):
        program = history.temperature_program()
        elastic = None if history.elastic is None else _stiffened(history.elastic, float(share))
        changed.append(history.replace(temperature=Program(program.times, program.values + T), elastic=elastic))
    return changed


def _stiffened(elastic: Elastic, share: float) -> Elastic:
    return replace(elastic, E=elastic.E * (1.0 + share))


def _softening(found: Prediction, histories: Sequence[History], stiffer: Floats) -> Floats:
    """Derivative of the strain to the relative change of the modulus, shaped as the values."""
    slope = np.zeros_like(found.values)
    for k, history in enumerate(histories):
        if history.includes_elastic:
            slope[:, k, : history.times.size, 0] = -elastic_strain(history) / (1.0 + stiffer[k])
    return slope


def _stacked(parts: Sequence[Prediction]) -> Prediction:
    def joined(arrays: Sequence[Floats]) -> Floats:
        return np.concatenate(arrays)

    jacobians = [p.jacobian for p in parts if p.jacobian is not None]
    return replace(
        parts[0],
        values=joined([p.values for p in parts]),
        status=np.concatenate([p.status for p in parts]),
        end_times=joined([p.end_times for p in parts]),
        jacobian=joined(jacobians) if jacobians else None,
        effect_jacobian={kind: joined([p.effect_jacobian[kind] for p in parts]) for kind in parts[0].effect_jacobian},
    )
