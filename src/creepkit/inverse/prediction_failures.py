"""Candidates of which a predictor says nothing: counted over a search, and the error where the best one is such."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from creepkit.arrays import Bools
from creepkit.errors import FitError
from creepkit.inverse.observation_vector import MINIMUM_RATE_OUTPUT
from creepkit.records import History, Prediction, Status

FAILED = (Status.NOT_CONVERGED, Status.OUTSIDE_CLASS)
"""How tests end that are not predicted, or in part alone."""


def tests_without_prediction(prediction: Prediction, histories: Sequence[History]) -> Bools:
    """(candidates, tests): which tests have frames after the start, none of which has a predicted number.

    Of a test without frames its minimum rate takes their place, where the prediction has it.
    """
    result = np.zeros(prediction.status.shape, bool)
    for k, history in enumerate(histories):
        later = history.times > 0.0
        if later.any() and (history.outputs or MINIMUM_RATE_OUTPUT in prediction.outputs):
            result[:, k] = ~np.isfinite(prediction.values[:, k, : later.size][:, later]).any(axis=(1, 2))
    return result


def candidates_without_prediction(prediction: Prediction, histories: Sequence[History]) -> Bools:
    """(candidates,): of which no test has a predicted number, nor a time of rupture."""
    missing = tests_without_prediction(prediction, histories).all(axis=1)
    if prediction.times_to_strain is not None:
        missing &= ~np.isfinite(prediction.times_to_strain.rupture_times).any(axis=1)
    return np.asarray(missing)


class PredictionFailures:
    """How many candidates were tried, and how those ended of which nothing was predicted."""

    def __init__(self) -> None:
        self.tried, self.by_status = 0, Counter[Status]()

    def record(self, prediction: Prediction, histories: Sequence[History]) -> None:
        """Count the candidates of a prediction; one counts with the status of its first test."""
        self.tried += len(prediction.status)
        for status in prediction.status[candidates_without_prediction(prediction, histories), 0]:
            self.by_status[Status(int(status))] += 1

    def check(self, prediction: Prediction, histories: Sequence[History], law: str) -> None:
        """FitError where none of the candidates of a prediction, the best ones, has a number; law : its name."""
        missing = candidates_without_prediction(prediction, histories)
        if not missing.all():
            return
        failed = self.by_status.total()
        counts = ", ".join(f"{count} {_ending(status)}" for status, count in self.by_status.most_common())
        if failed < self.tried:
            which = f"nothing is predicted at the best of {self.tried} candidates, as at {failed} of them"
        else:
            which = f"none of {self.tried} candidates could be predicted"
        remedy = prediction.reason or "simulate one of them to see why, then change bounds, loads or units"
        raise FitError(f"law '{law}': {which}: {counts}; {remedy}")


def _ending(status: Status) -> str:
    return f"{status.text} without any number" if status is Status.COMPLETE else status.text
