"""Evaluation of surrogates against data: Eq. (4) of the paper, MSE, MAE, R2, and the largest errors of whole histories.

Eq. (4): O^i is the vector of outputs at the i-th time, each divided by its standard deviation over the training rows;
its mean is taken over samples at the i-th time; squares are summed over samples, times and outputs, numerator and
denominator separately. Frames after the end of a history are excluded. For a single output at a single time it is 1 -
R2.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.arrays import Bools, Floats, Ints
from creepkit.dataset.dataset import Dataset, first_difference
from creepkit.errors import DatasetError
from creepkit.files.json_documents import canonical_json
from creepkit.files.record_codec import record_to_json
from creepkit.registry.specimen_documents import specimen_to_json
from creepkit.surrogates.network_evaluation import SampleArrays
from creepkit.surrogates.parameter_gru import SurrogateMetadata, Training
from creepkit.surrogates.surrogate import Surrogate

if TYPE_CHECKING:
    from creepkit.sampling.conditions import TimeGrid

LEAST_SAMPLES = 10
"""Samples below which nothing can be learnt and nothing be said of it."""


def trainable_samples(data: Dataset) -> Dataset:
    """The samples to learn from: accepted ones, each with a history; DatasetError where there are too few."""
    accepted = data.accepted
    if len(accepted) < LEAST_SAMPLES:
        raise DatasetError(
            f"a data set with {len(accepted)} accepted samples of {len(data)} is too small to train on; "
            f"{LEAST_SAMPLES} are the least, generate more"
        )
    return accepted


def training_split(count: int, training: Training, seed: int) -> tuple[Ints, Ints]:
    """Positions (rows,) of training and of validation rows, in the order of the data; the seed draws the latter."""
    order = np.random.default_rng(seed).permutation(count)
    validation_count = min(max(round(training.validation * count), 1), count - 1)
    training_rows = np.sort(order[validation_count:])
    if training.samples is not None and training.samples > len(training_rows):
        raise DatasetError(
            f"there are not {training.samples} samples to learn from: the data set has {count} accepted ones, of which "
            f"{validation_count} are set aside; ask for {len(training_rows)} at most or generate more"
        )
    return training_rows[: training.samples], np.sort(order[:validation_count])


def output_deviation(samples: SampleArrays, rows: Ints) -> Floats:
    """Standard deviation of each output over the frames of rows (n,), (outputs,)."""
    deviation = np.asarray(samples["targets"][rows][samples["mask"][rows]], float).std(axis=0)
    return np.where(deviation > 0, deviation, 1.0)


def dataset_fingerprint(data: Dataset) -> str:
    """Identity of what can be learnt from a data set: 16 hexadecimal digits."""
    document = [data.law.fingerprint, specimen_to_json(data.specimen), data.grid.relative, data.outputs]
    digest = hashlib.sha256(canonical_json([*document, data.parameter_names, data.condition_names]))
    for array in (data.grid.values, data.parameters, data.conditions, data.values):
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()[:16]


PAPER_EVALUATION_TIMES = (7_500.0, 22_500.0, 37_500.0)
"""s, of Fig. 4; tests of other lengths are evaluated at the same shares of their end as of twelve hours."""


PAPER_TEST_DURATION = 43_200.0


@dataclass(frozen=True, eq=False)
class PredictionComparison:
    """What a network predicts of samples, and what is true.

    times : (n, frames) s. true, predicted : (n, frames, outputs). mask : (n, frames) which frames are data.
    scale : (outputs,) standard deviation of each over the training rows. index : (n,) the samples' numbers in their
    design.
    """

    times: Floats
    true: Floats
    predicted: Floats
    mask: Bools
    outputs: tuple[str, ...]
    scale: Floats
    index: Ints

    def at_time(self, time: float) -> tuple[Floats, Floats]:
        """True and predicted outputs, (samples, outputs), of samples that last until a time; linear between frames."""
        last = np.where(self.mask, self.times, -np.inf).max(axis=1)
        rows = [k for k in np.flatnonzero(last >= time) if self.times[k, self.mask[k]][0] <= time]
        values = [
            np.stack([_interpolated(time, self.times[k], v[k], self.mask[k]) for k in rows])
            if rows
            else np.zeros((0, len(self.outputs)))
            for v in (self.true, self.predicted)
        ]
        return values[0], values[1]

    def largest_errors(self) -> Floats:
        """(n, outputs) largest absolute error of each history."""
        return np.asarray(np.where(self.mask[..., None], np.abs(self.predicted - self.true), 0.0).max(axis=1))


def _interpolated(time: float, times: Floats, values: Floats, mask: Bools) -> Floats:
    return np.array([np.interp(time, times[mask], column[mask]) for column in values.T])


def relative_squared_error(true: Floats, predicted: Floats, mask: Bools, scale: Floats | None = None) -> float:
    """Eq. (4) over the outputs together.

    true, predicted : (n, frames, outputs). mask : (n, frames) which frames are data. scale : (outputs,).
    """
    scale = np.ones(true.shape[-1]) if scale is None else scale
    mean = np.where(mask[..., None], true, 0.0).sum(axis=0) / np.maximum(mask.sum(axis=0), 1)[:, None]
    error_squares, deviation_squares = (
        np.where(mask[..., None], v / scale, 0.0) ** 2 for v in (predicted - true, true - mean)
    )
    sums = error_squares.sum(axis=(0, 1)).sum(), deviation_squares.sum(axis=(0, 1)).sum()
    return float(sums[0] / sums[1]) if sums[1] > 0 else float("nan")


def error_metrics(true: Floats, predicted: Floats, mask: Bools) -> dict[str, float]:
    """RSE, MSE, MAE and R2 of one output; true, predicted, mask : (n, frames)."""
    residuals, true_values = (predicted - true)[mask], true[mask]
    total_squares = float(((true_values - true_values.mean()) ** 2).sum()) if true_values.size else 0.0
    return {
        "rse": relative_squared_error(true[..., None], predicted[..., None], mask),
        "mse": float((residuals**2).mean()) if true_values.size else float("nan"),
        "mae": float(np.abs(residuals).mean()) if true_values.size else float("nan"),
        "r2": 1.0 - float((residuals**2).sum()) / total_squares if total_squares > 0 else float("nan"),
    }


def comparison_metrics(comparison: PredictionComparison) -> dict[str, Any]:
    """Everything that is stated of a network: {"loss", "outputs", "samples"}; NaN becomes None."""
    largest = comparison.largest_errors()
    outputs = {}
    for k, name in enumerate(comparison.outputs):
        output_metrics = error_metrics(comparison.true[..., k], comparison.predicted[..., k], comparison.mask)
        quantiles = np.quantile(largest[:, k], (0.5, 0.95))
        outputs[name] = {**output_metrics, "largest_median": float(quantiles[0]), "largest_p95": float(quantiles[1])}
    metrics = {
        "loss": relative_squared_error(comparison.true, comparison.predicted, comparison.mask, comparison.scale),
        "samples": len(comparison.true),
        "outputs": outputs,
    }
    result: dict[str, Any] = record_to_json(metrics)
    return result


def evaluation_times(grid: TimeGrid, end: float) -> tuple[float, ...]:
    """The paper's three times where the tests are as long as the paper's, else the same shares of their length."""
    last = end if grid.relative else float(grid.values[-1])
    if np.isclose(last, PAPER_TEST_DURATION):
        return PAPER_EVALUATION_TIMES
    return tuple(float(f"{time / PAPER_TEST_DURATION * last:.4g}") for time in PAPER_EVALUATION_TIMES)


EVALUATION_BATCH = 256


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Predictions of a surrogate beside the truth, their metrics, and the times at which those are evaluated."""

    comparison: PredictionComparison
    metrics: dict[str, Any]
    times: tuple[float, ...]


def evaluate(surrogate: Surrogate, data: Dataset) -> Evaluation:
    """Compare a surrogate with a data set: with the validation rows where it is the one of its training, else all."""
    data = trainable_samples(data)
    check_same_kind(surrogate.metadata, data)
    provenance = surrogate.metadata.provenance
    samples = surrogate.recipe.sample_arrays(data)
    all_rows = np.arange(len(data))
    rows, scale = all_rows, output_deviation(samples, all_rows)
    if provenance.get("data") == dataset_fingerprint(data):
        train, rows = training_split(len(data), surrogate.recipe.training, int(provenance["seed"]))
        scale = output_deviation(samples, train)
    network = surrogate.for_search()
    parts = np.split(rows, range(EVALUATION_BATCH, len(rows), EVALUATION_BATCH))
    predicted = [network.predict_samples({name: array[part] for name, array in samples.items()}) for part in parts]
    return evaluate_rows(np.concatenate(predicted), samples, data, rows, scale)


def check_same_kind(metadata: SurrogateMetadata, data: Dataset) -> None:
    """DatasetError where a data set is not of the kind that a surrogate was trained on."""
    if not np.array_equal(metadata.grid.values, data.grid.values) or metadata.grid.relative != data.grid.relative:
        raise DatasetError("the data set has another time grid than the one the surrogate was trained on")
    specimens = specimen_to_json(metadata.specimen), specimen_to_json(data.specimen)
    if difference := first_difference(*specimens, "specimen"):
        raise DatasetError(f"the data set is of another specimen than the surrogate: {difference}")
    if metadata.outputs != data.outputs:
        raise DatasetError(f"the data set has the outputs {', '.join(data.outputs)}, not {', '.join(metadata.outputs)}")


def evaluate_rows(predicted: Floats, samples: SampleArrays, data: Dataset, rows: Ints, scale: Floats) -> Evaluation:
    """What a network predicts for rows (n,) of a data set, predicted (n, frames, outputs), beside what is true.

    scale : (outputs,).
    """
    comparison = PredictionComparison(
        times=np.stack([data.times(int(k)) for k in rows]),
        true=np.asarray(samples["targets"][rows], float),
        predicted=predicted,
        mask=samples["mask"][rows],
        outputs=data.outputs,
        scale=scale,
        index=data.index[rows],
    )
    times = evaluation_times(data.grid, float(np.median(comparison.times[:, -1])))
    return Evaluation(comparison, comparison_metrics(comparison), times)
