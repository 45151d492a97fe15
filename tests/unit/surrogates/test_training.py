"""Training: bit-identical when resumed, returned when done, and one sentence for each data set that is too small."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from creepkit.dataset.dataset import Dataset
from creepkit.errors import DatasetError, SurrogateError
from creepkit.surrogates.evaluation import (
    PredictionComparison,
    comparison_metrics,
    dataset_fingerprint,
    evaluate,
    relative_squared_error,
)
from creepkit.surrogates.parameter_gru import ParameterGru, Training
from creepkit.surrogates.surrogate import load_surrogate
from creepkit.surrogates.training import epochs_since_best, train
from helpers.mistakes import said_otherwise
from helpers.planted_datasets import bars
from helpers.written_files import names_in

SMALL = ParameterGru(hidden=8, layers=1, training=Training(epochs=6, batch=16, rate=1e-2))


pytestmark = pytest.mark.usefixtures("one_torch_thread")


@pytest.fixture(scope="module")
def data() -> Dataset:
    return bars()


class Interrupted(Exception):
    pass


def stop_at(epoch: int):
    def progress(task: str, done: int, total: int, note: str) -> None:
        if (task, done) == ("epochs", epoch):
            raise Interrupted

    return progress


def test_resumed_is_bit_for_bit_uninterrupted(data: Dataset, tmp_path: Path) -> None:
    whole = train(data, SMALL, seed=3)
    path = tmp_path / "m.safetensors"
    for epoch in (2, 3, 5):
        with pytest.raises(Interrupted):
            train(data, SMALL, to=path, seed=3, progress=stop_at(epoch))
        assert not path.exists()
    resumed = train(data, SMALL, to=path, seed=3)
    assert resumed.metadata.curves == whole.metadata.curves
    pairs = zip(resumed.weights.values(), whole.weights.values(), strict=True)
    assert all(np.array_equal(a, b) for a, b in pairs)
    assert names_in(tmp_path) == ["m.safetensors"]


def test_what_is_done_is_returned_and_what_is_another_is_kept(data: Dataset, tmp_path: Path) -> None:
    path = tmp_path / "m.safetensors"
    once = train(data, SMALL, to=path, seed=3)
    stamp = path.stat().st_mtime_ns
    again = train(data, SMALL, to=path, seed=3)
    assert path.stat().st_mtime_ns == stamp
    assert again.metadata.curves == once.metadata.curves
    with pytest.raises(SurrogateError, match="another surrogate is there already; remove it or choose another name"):
        train(data, SMALL, to=path, seed=4)


def test_the_rate_grows_with_the_batch_unless_it_is_given(data: Dataset) -> None:
    for training, rate in (
        (Training(epochs=1, batch=64), 1e-3),
        (Training(epochs=1, batch=1024, schedule="cosine"), 8e-3),
        (Training(epochs=1, batch=1024, rate=2e-4), 2e-4),
        (Training(epochs=1, batch=100_000), 1e-2),
    ):
        assert train(data, SMALL, training=training).metadata.curves["rate"] == [pytest.approx(rate, rel=1e-12)]


def test_early_stop_and_the_best_epoch(data: Dataset) -> None:
    model = train(data, SMALL, training=Training(epochs=50, rate=0.5, schedule="constant", early_stop=3))
    losses, known = model.metadata.curves["validation"], model.metadata.provenance
    assert known["epochs"] == len(losses) < 50
    assert epochs_since_best(losses) == 3
    assert known["best_epoch"] == int(np.argmin(losses)) + 1
    assert model.metadata.metrics["loss"] == pytest.approx(
        model.metadata.curves["rse"][known["best_epoch"] - 1], rel=1e-5
    )


def test_training_learns_and_the_file_holds_the_same_network(data: Dataset, tmp_path: Path) -> None:
    model = train(data, SMALL, to=tmp_path / "m.safetensors", training=Training(epochs=40, rate=2e-2, batch=16))
    assert model.metadata.metrics["loss"] < 0.25
    judged = evaluate(load_surrogate(tmp_path / "m.safetensors"), data)
    assert judged.metrics == evaluate(model, data).metrics
    # by torch on the device of the training, and by NumPy, both in single precision
    by_numpy, by_torch = (metrics["outputs"]["strain"] for metrics in (judged.metrics, model.metadata.metrics))
    assert by_numpy == pytest.approx(by_torch, rel=2e-5)
    assert judged.metrics["loss"] == pytest.approx(model.metadata.metrics["loss"], rel=2e-5)
    assert len(judged.comparison.true) == round(0.2 * len(data))
    assert judged.times == (6250.0, 18750.0, 31250.0)


def test_frames_that_are_not_numbers_teach_nothing(data: Dataset) -> None:
    values = data.values.copy()
    values[::2, 7:] = np.nan
    short = replace(data, values=values)
    model = train(short, SMALL)
    assert math.isfinite(model.metadata.metrics["loss"])


def test_samples_that_were_rejected_teach_nothing(data: Dataset) -> None:
    reasons = np.zeros(len(data), np.int64)
    reasons[20:] = 2
    model = train(replace(data, reasons=reasons), SMALL)
    assert model.metadata.provenance["training_rows"] + model.metadata.provenance["validation_rows"] == 20
    reasons[9:] = -1
    with pytest.raises(
        DatasetError, match="a data set with 9 accepted samples of 96 is too small to train on; 10 are the least"
    ):
        train(replace(data, reasons=reasons), SMALL)


def test_fingerprints_see_what_can_be_learnt(data: Dataset) -> None:
    values = data.values.copy()
    values[3, 4] += 1e-4
    assert dataset_fingerprint(replace(data, values=values)) != dataset_fingerprint(data)
    assert dataset_fingerprint(replace(data, provenance={})) == dataset_fingerprint(data)


def test_settings_that_make_no_sense_and_a_device_that_is_not_there(data: Dataset) -> None:
    mistakes = [
        (lambda: Training(epochs=0), "epochs is 0"),
        (lambda: Training(batch=2.5), "batch is 2.5"),
        (lambda: Training(schedule="step"), "schedule is 'step'; allowed is 'plateau', 'cosine' or 'constant'"),
        (lambda: Training(rate=0.0), "rate is 0.0; allowed is a number above 0"),
        (lambda: Training(validation=1.0), "validation is 1.0"),
        (lambda: ParameterGru(hidden=0), "hidden is 0"),
        (lambda: ParameterGru(target="sqrt"), "target is 'sqrt'; allowed is 'value' or 'log'"),
        (lambda: train(data, SMALL, device="tpu"), "device 'tpu' is not there; allowed are auto"),
    ]
    assert not said_otherwise(mistakes)


# ---- metrics ---------------------------------------------------------------------------------------------------------

# Metrics against numbers worked out by hand, and what Eq. (4) is.


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


def test_at_a_time_between_frames_values_are_linear_and_short_histories_are_left_out() -> None:
    true = np.array([[[0.0], [1.0], [2.0]], [[5.0], [6.0], [7.0]]])
    mask = np.array([[True, True, True], [True, True, False]])
    found = compared(true, true + 1.0, mask)
    assert found.at_time(150.0)[0] == pytest.approx(np.array([[1.5]]))
    assert found.at_time(50.0)[1] == pytest.approx(np.array([[1.5], [6.5]]))


def test_the_largest_error_of_each_history_and_what_has_no_number() -> None:
    true = np.zeros((4, 3, 1))
    predicted = true.copy()
    predicted[2, 1], predicted[0, 2] = -3.0, 1.0
    found = comparison_metrics(compared(true, predicted))["outputs"]["a"]
    assert found["largest_median"] == 0.5
    assert found["r2"] is None  # the truth does not vary, and JSON has no NaN
