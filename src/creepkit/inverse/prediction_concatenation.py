"""Predictions of groups of tests, and of consecutive candidates, as one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from creepkit.records import History, Prediction, Status, TimesToStrain


def concatenated_tests(groups: Sequence[tuple[list[int], Prediction]], histories: Sequence[History]) -> Prediction:
    """One prediction, in the order of the histories, of groups of tests; with the union of outputs."""
    outputs = tuple(dict.fromkeys(name for _, found in groups for name in found.outputs))
    candidates, longest = len(groups[0][1].values), max(h.times.size for h in histories)
    shape = (candidates, len(histories), longest, len(outputs))
    values, status = np.full(shape, np.nan), np.full(shape[:2], int(Status.COMPLETE))
    end_times = np.full(shape[:2], np.inf)
    differentiable = all(found.jacobian is not None for _, found in groups)
    jacobian = None
    kinds = {kind for _, found in groups for kind in found.nuisance_jacobian}
    nuisance_jacobian = {kind: np.zeros(shape) for kind in kinds}
    for tests, found in groups:
        columns = [outputs.index(name) for name in found.outputs]
        index = np.ix_(range(candidates), tests, range(found.values.shape[2]), columns)
        values[index] = found.values
        status[:, tests], end_times[:, tests] = found.status, found.end_times
        for kind, sensitivity in found.nuisance_jacobian.items():
            nuisance_jacobian[kind][index] = sensitivity
        if differentiable and found.jacobian is not None:
            jacobian = np.full((*shape, found.jacobian.shape[-1]), np.nan) if jacobian is None else jacobian
            jacobian[index] = found.jacobian
    lengths = np.array([h.times.size for h in histories], np.int64)
    times = tuple(h.times for h in histories)
    return Prediction(
        values,
        outputs,
        lengths,
        status,
        end_times,
        jacobian,
        times,
        nuisance_jacobian,
        _concatenated_times(groups, shape),
    )


def _concatenated_times(groups: Sequence[tuple[list[int], Prediction]], shape: tuple[int, ...]) -> TimesToStrain | None:
    """The times to strain of groups as one, if they have any; shape : (candidates, tests, times, outputs)."""
    groups_with_times = [
        (tests, prediction.times_to_strain) for tests, prediction in groups if prediction.times_to_strain is not None
    ]
    if len(groups_with_times) < len(groups):
        return None

    def gathered(name: str, axes: int, fill: float) -> Any:
        arrays = [getattr(times_to_strain, name) for _, times_to_strain in groups_with_times]
        if any(array is None for array in arrays):
            return None
        out = np.full((*shape[:axes], *arrays[0].shape[axes:]), fill)
        for (tests, _), array in zip(groups_with_times, arrays, strict=True):
            if axes == 3:
                out[:, tests, : array.shape[2]] = array
            else:
                out[:, tests] = array
        return out

    horizon = np.zeros(shape[1])
    for tests, times_to_strain in groups_with_times:
        horizon[tests] = times_to_strain.horizon
    return TimesToStrain(
        gathered("times", 3, np.nan),
        gathered("log_time_derivatives", 3, np.inf),
        gathered("rupture_times", 2, np.nan),
        horizon,
        gathered("time_jacobian", 3, np.nan),
        gathered("rupture_jacobian", 2, np.nan),
    )


def concatenated_candidates(parts: Sequence[Prediction]) -> Prediction:
    """The predictions of consecutive candidates as one."""
    jacobians = [part.jacobian for part in parts if part.jacobian is not None]
    return replace(
        parts[0],
        values=np.concatenate([part.values for part in parts]),
        status=np.concatenate([part.status for part in parts]),
        end_times=np.concatenate([part.end_times for part in parts]),
        jacobian=np.concatenate(jacobians) if jacobians else None,
        nuisance_jacobian={
            key: np.concatenate([part.nuisance_jacobian[key] for part in parts]) for key in parts[0].nuisance_jacobian
        },
    )
