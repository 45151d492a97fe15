"""What is unknown about a test of a bar or a point and changes its simulation: its temperature and its modulus."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.errors import SolveError
from creepkit.records import Effects, History, Prediction, Program

if TYPE_CHECKING:
    from creepkit.language import Elastic

KINDS = ("temperature", "modulus")
STEPS = {"temperature": 0.1, "modulus": 1e-3}
"""Of central differences: K, and relative."""

Plain = Callable[[Mapping[str, ArrayLike], Sequence[History], bool], Prediction]
"""Predict values and histories, with derivatives or without."""
Softening = Callable[[Prediction, Sequence[History], Floats], Floats | None]
"""Derivative of the values to the relative change of the modulus; None where it is not known exactly."""


def predict_with(
    plain: Plain,
    values: Mapping[str, ArrayLike],
    histories: Sequence[History],
    effects: Effects | None,
    jacobian: bool,
    *,
    softening: Softening | None = None,
    specimen: str = "uniaxial",
) -> Prediction:
    """Predict with effects, if there are any, a candidate at a time where they differ from candidate to candidate.

    Derivatives are central differences, of 0.1 K and of a thousandth of the modulus to each side, but for that to the
    modulus where `softening` gives it.
    """
    if not effects:
        return plain(values, histories, jacobian)
    for kind in effects:
        if kind not in KINDS:
            known = " and ".join(KINDS)
            raise SolveError(f"a {specimen} specimen does not know the nuisance '{kind}'; it knows {known}")
    rows = max(len(v) for v in effects.values())
    if rows == 1:
        return _of_one(plain, values, histories, {kind: v[0] for kind, v in effects.items()}, jacobian, softening)
    parts = []
    for row in range(rows):
        own = {n: np.broadcast_to(np.asarray(v, float), (rows,))[row] for n, v in values.items()}
        mine = {kind: np.broadcast_to(v, (rows, len(histories)))[row] for kind, v in effects.items()}
        parts.append(_of_one(plain, own, histories, mine, jacobian, softening))
    return _stacked(parts)


def _of_one(
    plain: Plain, values: Mapping[str, ArrayLike], histories: Sequence[History], effects: Mapping[str, Floats],
    jacobian: bool, softening: Softening | None,
) -> Prediction:  # fmt: skip
    found = plain(values, _changed(histories, effects), jacobian)
    if not jacobian:
        return found
    slopes = {}
    for kind in effects:
        exact = softening if kind == "modulus" else None
        slope = None if exact is None else exact(found, _changed(histories, effects), effects[kind])
        if slope is not None:
            slopes[kind] = slope
            continue
        ends = (_changed(histories, {**effects, kind: effects[kind] + s}) for s in (STEPS[kind], -STEPS[kind]))
        up, down = (plain(values, moved, False).values for moved in ends)
        slopes[kind] = (up - down) / (2 * STEPS[kind])
    return replace(found, effect_jacobian=slopes)


def _changed(histories: Sequence[History], effects: Mapping[str, Floats]) -> list[History]:
    """Histories that are so many K warmer, with moduli larger by these shares."""
    nothing = np.zeros(len(histories))
    warmer, stiffer = effects.get("temperature", nothing), effects.get("modulus", nothing)
    changed = []
    for history, T, share in zip(histories, warmer, stiffer, strict=True):
        program = history.temperature_program()
        elastic = None if history.elastic is None else _stiffened(history.elastic, float(share))
        changed.append(history.replace(temperature=Program(program.times, program.values + T), elastic=elastic))
    return changed


def _stiffened(elastic: Elastic, share: float) -> Elastic:
    return replace(elastic, E=elastic.E * (1.0 + share))


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
