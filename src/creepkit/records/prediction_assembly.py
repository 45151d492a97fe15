"""Predictions put together: of single tests, of groups of tests, and of consecutive candidates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.records.history import History
from creepkit.records.prediction import NuisanceValues, Prediction, Status, TimesToStrain


def broadcast_candidates(
    theta: Floats, nuisances: NuisanceValues | None, tests: int
) -> tuple[Floats, dict[str, Floats]]:
    """Return theta (candidates, parameters) and nuisances {kind: (candidates, tests)} with as many candidates each.

    theta : (candidates or 1[, tests], parameters) internal values. nuisances : {kind: (candidates or 1, tests)}.
    """
    values = dict(nuisances or {})
    candidates = max([len(theta), *(len(v) for v in values.values())])
    broadcast = {kind: np.broadcast_to(v, (candidates, tests)) for kind, v in values.items()}
    return np.array(np.broadcast_to(theta, (candidates, *theta.shape[1:]))), broadcast


def values_of_tests(theta: Floats, tests: Sequence[int]) -> Floats:
    """(candidates[, tests], parameters) theta of some of the tests; theta : (candidates[, tests], parameters)."""
    return theta if theta.ndim == 2 else theta[:, tests]


@dataclass(frozen=True, eq=False)
class HistoryPrediction:
    """What a predictor makes of one history, for all candidates.

    values : (candidates, times, outputs), in the units of the outputs; NaN after a candidate's end.
    status : (candidates,) Status. end_times : (candidates,) s, where it ended.
    jacobian : (candidates, times, outputs, parameters) derivatives with respect to theta, or None.
    nuisance_jacobian : {kind: (candidates, times, outputs)} derivatives with respect to the nuisances of this test.
    """

    values: Floats
    status: Ints
    end_times: Floats
    jacobian: Floats | None = None
    nuisance_jacobian: Mapping[str, Floats] = field(default_factory=dict)


def assemble_prediction(
    parts: Sequence[HistoryPrediction], histories: Sequence[History], outputs: tuple[str, ...], candidates: int
) -> Prediction:
    """Return the prediction of all histories, padded with NaN to the longest; parts : one for each history."""
    lengths = np.array([h.times.size for h in histories], dtype=np.int64)
    shape = (candidates, len(histories), int(lengths.max(initial=0)), len(outputs))
    status, end_times = np.zeros(shape[:2], dtype=np.int64), np.zeros(shape[:2])
    for k, part in enumerate(parts):
        status[:, k], end_times[:, k] = part.status, part.end_times
    kinds = parts[0].nuisance_jacobian if parts else ()
    jacobians = [part.jacobian for part in parts if part.jacobian is not None]
    return Prediction(
        values=_padded([part.values for part in parts], shape),
        outputs=outputs,
        lengths=lengths,
        status=status,
        end_times=end_times,
        jacobian=_padded(jacobians, (*shape, jacobians[0].shape[-1])) if jacobians else None,
        times=tuple(h.times for h in histories),
        nuisance_jacobian={kind: _padded([part.nuisance_jacobian[kind] for part in parts], shape) for kind in kinds},
    )


def unpredicted(
    histories: Sequence[History], outputs: tuple[str, ...], candidates: int, status: Status, reason: str
) -> Prediction:
    """Return the prediction of a predictor that refuses: NaN throughout, with one status and the reason."""
    parts = [
        HistoryPrediction(
            np.full((candidates, h.times.size, len(outputs)), np.nan),
            np.full(candidates, int(status)),
            np.zeros(candidates),
        )
        for h in histories
    ]
    return replace(assemble_prediction(parts, histories, outputs, candidates), reason=reason)


def _padded(arrays: Sequence[Floats], shape: tuple[int, ...]) -> Floats:
    """(candidates, tests, times, ...) from one array (candidates, times of the test, ...) a test."""
    padded = np.full(shape, np.nan)
    for k, array in enumerate(arrays):
        padded[:, k, : array.shape[1]] = array
    return padded


TIMES_TO_STRAIN_FILLS = {
    **{"times": np.nan, "log_time_derivatives": np.inf, "rupture_times": np.nan},
    **{"time_jacobian": np.nan, "rupture_jacobian": np.nan},
}
"""What the times to strain of tests hold where they have no frame."""


def concatenated_tests(groups: Sequence[tuple[list[int], Prediction]], histories: Sequence[History]) -> Prediction:
    """One prediction, in the order of the histories, of groups of tests; with the union of outputs."""
    outputs = tuple(dict.fromkeys(name for _, prediction in groups for name in prediction.outputs))
    candidates, longest = len(groups[0][1].values), max(h.times.size for h in histories)
    shape = (candidates, len(histories), longest, len(outputs))
    columns = [[outputs.index(name) for name in prediction.outputs] for _, prediction in groups]

    def gathered(arrays: Sequence[Any], axes: int, fill: float) -> Any:
        """Arrays (candidates, tests[, times[, outputs]], ...) of the groups as one, None where one of them is."""
        if any(array is None for array in arrays):
            return None
        out = np.full((*shape[:axes], *arrays[0].shape[axes:]), fill)
        for (tests, _), array, of_group in zip(groups, arrays, columns, strict=True):
            index = [range(candidates), tests, *(range(size) for size in array.shape[2:3]), of_group]
            out[np.ix_(*index[:axes])] = array
        return out

    predictions = [prediction for _, prediction in groups]
    kinds = {kind for prediction in predictions for kind in prediction.nuisance_jacobian}
    times_to_strain = [prediction.times_to_strain for prediction in predictions]
    whole = None
    if all(times_to_strain):
        arrays = {
            name: gathered([getattr(times, name) for times in times_to_strain], 2 if "rupture" in name else 3, fill)
            for name, fill in TIMES_TO_STRAIN_FILLS.items()
        }
        horizon = np.zeros(len(histories))
        for (tests, _), times in zip(groups, times_to_strain, strict=True):
            horizon[tests] = times.horizon  # type: ignore[union-attr]
        whole = TimesToStrain(horizon=horizon, **arrays)
    return Prediction(
        gathered([p.values for p in predictions], 4, np.nan),
        outputs,
        np.array([h.times.size for h in histories], np.int64),
        gathered([p.status for p in predictions], 2, int(Status.COMPLETE)),
        gathered([p.end_times for p in predictions], 2, np.inf),
        gathered([p.jacobian for p in predictions], 4, np.nan),
        tuple(h.times for h in histories),
        {
            kind: gathered([p.nuisance_jacobian.get(kind, np.zeros_like(p.values)) for p in predictions], 4, 0.0)
            for kind in kinds
        },
        whole,
    )


def concatenated_candidates(parts: Sequence[Prediction]) -> Prediction:
    """The predictions of consecutive candidates as one."""
    names = "values", "status", "end_times"
    arrays: dict[str, Any] = {name: np.concatenate([getattr(p, name) for p in parts]) for name in names}
    jacobians = [part.jacobian for part in parts if part.jacobian is not None]
    return replace(
        parts[0],
        **arrays,
        jacobian=np.concatenate(jacobians) if jacobians else None,
        nuisance_jacobian={
            key: np.concatenate([part.nuisance_jacobian[key] for part in parts]) for key in parts[0].nuisance_jacobian
        },
    )
