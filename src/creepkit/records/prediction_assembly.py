"""What predictors share: matching candidates with nuisance parameters, and assembly of predictions of single tests."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.errors import CreepkitError, SolveError
from creepkit.records.history import History
from creepkit.records.prediction import NuisanceValues, Prediction, Status


def check_nuisances(
    nuisances: Iterable[str], known: Sequence[str], predictor: str, error: type[CreepkitError] = SolveError
) -> None:
    """Raise `error` where the predictor does not know a kind of nuisance; predictor : in words, "a bulge specimen"."""
    for kind in nuisances:
        if kind not in known:
            names = ", ".join(known) or "none"
            raise error(f"{predictor} does not know the nuisance '{kind}'; it knows {names}")


def broadcast_candidates(
    theta: Floats, nuisances: NuisanceValues | None, tests: int
) -> tuple[Floats, dict[str, Floats]]:
    """Return theta (candidates, parameters) and nuisances {kind: (candidates, tests)} with as many candidates each.

    theta : (candidates or 1, parameters) internal values. nuisances : {kind: (candidates or 1, tests)}.
    """
    values = dict(nuisances or {})
    candidates = max([len(theta), *(len(v) for v in values.values())])
    broadcast = {kind: np.broadcast_to(v, (candidates, tests)) for kind, v in values.items()}
    return np.array(np.broadcast_to(theta, (candidates, theta.shape[1]))), broadcast


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
