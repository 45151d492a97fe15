"""Predictions of one candidate in one test at a time: what a specimen responds, in threads, and put together."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace

import numpy as np

from creepkit.arrays import Floats, usable_cores
from creepkit.records import History, HistoryPrediction, NuisanceValues, Prediction, Status, assemble_prediction


@dataclass(frozen=True, eq=False)
class TestResponse:
    """One candidate in one test.

    values : (times, outputs), NaN after the end. end_time : s. reason : of an early end, in words.
    jacobian : (times, outputs, parameters) derivatives to the internal parameters, or None.
    nuisances : {key: (times, outputs)} those to the nuisances. outputs : of this test; () for all.
    """

    __test__ = False  # not a test case, whatever its name says to pytest

    values: Floats
    status: Status
    end_time: float
    reason: str = ""
    jacobian: Floats | None = None
    nuisances: Mapping[str, Floats] = field(default_factory=dict)
    outputs: tuple[str, ...] = ()


Respond = Callable[[Floats, int, Mapping[str, float]], TestResponse]
"""Of internal values (parameters,), the position of a test, and its nuisances {key: value}."""


def predict_separately(
    respond: Respond,
    theta: Floats,
    histories: Sequence[History],
    nuisances: NuisanceValues,
    outputs: tuple[str, ...],
    threads: int | None = 1,
) -> Prediction:
    """The prediction of all candidates in all tests.

    theta : (candidates[, tests], parameters) internal values. nuisances : {key: (candidates, tests)}. threads : that
    respond, None for one on each core.
    """

    def row(task: tuple[int, int]) -> TestResponse:
        k, c = task
        values = theta[c] if theta.ndim == 2 else theta[c, k]
        return respond(values, k, {key: float(each[c, k]) for key, each in nuisances.items()})

    rows = _in_threads(row, [(k, c) for k in range(len(histories)) for c in range(len(theta))], threads)
    parts = [_of_test(rows[k * len(theta) : (k + 1) * len(theta)], outputs) for k in range(len(histories))]
    reason = next((one.reason for one in rows if one.reason), "")
    return replace(assemble_prediction(parts, histories, outputs, len(theta)), reason=reason)


def _of_test(rows: Sequence[TestResponse], outputs: tuple[str, ...]) -> HistoryPrediction:
    """All candidates in one test; NaN for outputs of other tests."""
    columns = [outputs.index(name) for name in rows[0].outputs or outputs]

    def gathered(arrays: Sequence[Floats]) -> Floats:
        """(candidates, times, outputs, ...) of one array (times, outputs, ...) of each candidate."""
        own = np.array(arrays)
        out = np.full((*own.shape[:2], len(outputs), *own.shape[3:]), np.nan)
        out[:, :, columns] = own
        return out

    jacobians = [row.jacobian for row in rows if row.jacobian is not None]
    return HistoryPrediction(
        gathered([row.values for row in rows]),
        np.array([int(row.status) for row in rows], np.int64),
        np.array([row.end_time for row in rows]),
        gathered(jacobians) if jacobians else None,
        {key: gathered([row.nuisances[key] for row in rows]) for key in rows[0].nuisances},
    )


def _in_threads(
    run: Callable[[tuple[int, int]], TestResponse], tasks: Sequence[tuple[int, int]], threads: int | None
) -> list[TestResponse]:
    """The results of tasks in their order."""
    workers = min(threads or usable_cores(), len(tasks))
    if workers <= 1:
        return [run(task) for task in tasks]
    pool = ThreadPoolExecutor(workers)
    try:
        return list(pool.map(run, tasks))
    finally:
        pool.shutdown(cancel_futures=True)  # an interrupt waits for the simulations that run, not for the others
