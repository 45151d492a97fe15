"""Metrics against numbers worked out by hand, and what Eq. (4) is."""

import numpy as np
import pytest

from creepkit.sampling.conditions import TimeGrid
from creepkit.surrogates.evaluation import (
    PAPER_EVALUATION_TIMES,
    PredictionComparison,
    comparison_metrics,
    error_metrics,
    evaluation_times,
    relative_squared_error,
)


def compared(
    true: np.ndarray, predicted: np.ndarray, mask: np.ndarray | None = None, **more: object
) -> PredictionComparison:
    count, frames = true.shape[:2]
    given = {
        "times": np.tile(100.0 * np.arange(frames), (count, 1)),
        "mask": np.ones((count, frames), bool) if mask is None else mask,
        "outputs": tuple("abc"[: true.shape[2]]),
        "scale": np.ones(true.shape[2]),
        "index": 10 + np.arange(count),
    }
    return PredictionComparison(true=true, predicted=predicted, **{**given, **more})


def test_the_mean_over_samples_at_each_time_has_a_loss_of_one() -> None:
    true = np.random.default_rng(0).normal(size=(7, 5, 3))
    mean = np.broadcast_to(true.mean(axis=0), true.shape)
    assert relative_squared_error(true, mean, np.ones((7, 5), bool)) == pytest.approx(1.0, rel=1e-14)
    assert relative_squared_error(true, true, np.ones((7, 5), bool)) == 0.0


def test_a_loss_worked_out_by_hand_with_a_history_that_ends() -> None:
    # at the first time 1 and 3 (mean 2), at the second 10 alone: its history is the only one that lasts
    true = np.array([[[1.0], [10.0]], [[3.0], [0.0]]])
    predicted = true + np.array([[[0.5], [0.5]], [[-0.5], [99.0]]])
    mask = np.array([[True, True], [True, False]])
    assert relative_squared_error(true, predicted, mask) == pytest.approx(3 * 0.25 / (1.0 + 1.0))


def test_outputs_count_in_units_of_their_deviations() -> None:
    true = np.random.default_rng(1).normal(size=(9, 4, 2))
    predicted = true + 0.1
    mask, big = np.ones((9, 4), bool), np.array([1.0, 1000.0])
    alone = relative_squared_error(true, predicted, mask)
    assert relative_squared_error(true * big, predicted * big, mask, big) == pytest.approx(alone, rel=1e-12)


def test_errors_of_one_output() -> None:
    true, predicted = np.array([[0.0], [2.0], [4.0]]), np.array([[0.0], [2.0], [1.0]])
    found = error_metrics(true, predicted, np.ones((3, 1), bool))
    assert found == pytest.approx({"rse": 9 / 8, "mse": 3.0, "mae": 1.0, "r2": 1 - 9 / 8})


def test_at_a_time_between_frames_values_are_linear_and_short_histories_are_left_out() -> None:
    true = np.array([[[0.0], [1.0], [2.0]], [[5.0], [6.0], [7.0]]])
    mask = np.array([[True, True, True], [True, True, False]])
    found = compared(true, true + 1.0, mask)
    assert found.at_time(150.0)[0] == pytest.approx(np.array([[1.5]]))
    assert found.at_time(50.0)[1] == pytest.approx(np.array([[1.5], [6.5]]))


def test_the_worst_samples_come_first_with_their_numbers() -> None:
    true = np.zeros((4, 3, 1))
    predicted = true.copy()
    predicted[2, 1], predicted[0, 2] = -3.0, 1.0
    found = comparison_metrics(compared(true, predicted), (100.0,))
    first, second = found["worst"][:2]
    assert (first["index"], first["error"], first["time"]) == (12, 3.0, 100.0)
    assert (second["index"], second["error"], second["time"]) == (10, 1.0, 200.0)
    assert found["outputs"]["a"]["largest_median"] == 0.5
    assert found["outputs"]["a"]["r2"] is None  # the truth does not vary, and JSON has no NaN


def test_times_looked_at_are_the_papers_or_their_shares() -> None:
    assert evaluation_times(TimeGrid.every(150.0, 43200.0), 0.0) == PAPER_EVALUATION_TIMES == (7500.0, 22500.0, 37500.0)
    shares = evaluation_times(TimeGrid(np.array([0.0, 1.0]), relative=True), 1200.0)
    assert shares == pytest.approx((208.3, 625.0, 1042.0), rel=1e-3)
