"""A surrogate beside data: those set aside in its training, or another data set of the same kind."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from torch import Tensor

from creepkit.dataset.joining import first_difference
from creepkit.dataset.specimen_document import specimen_to_json
from creepkit.errors import DatasetError
from creepkit.surrogate.checkpoint import dataset_fingerprint
from creepkit.surrogate.fitting import output_deviation
from creepkit.surrogate.metrics import PredictionComparison, evaluation_times, comparison_metrics
from creepkit.surrogate.recipe import SurrogateModule, SampleTensors, SurrogateMetadata
from creepkit.surrogate.surrogate import Surrogate
from creepkit.surrogate.trainable import training_split, trainable_samples

if TYPE_CHECKING:
    from creepkit.dataset.dataset import Dataset

EVALUATION_BATCH = 256


@dataclass(frozen=True, eq=False)
class Evaluation:
    """What a surrogate predicts of samples beside what is true, the metrics of it, and the times these look at."""

    comparison: PredictionComparison
    metrics: dict[str, Any]
    times: tuple[float, ...]


def evaluate(surrogate: Surrogate, data: Dataset) -> Evaluation:
    """Compare a surrogate with a data set: with the validation rows where it is the one of its training, else all."""
    data = trainable_samples(data)
    check_same_kind(surrogate.metadata, data)
    provenance = surrogate.metadata.provenance
    samples = surrogate.recipe.sample_tensors(data)
    all_rows = torch.arange(len(data))
    rows, scale = all_rows, output_deviation(samples, all_rows)
    if provenance.get("data") == dataset_fingerprint(data):
        train, rows = training_split(len(data), surrogate.recipe.training, int(provenance["seed"]))
        scale = output_deviation(samples, train)
    comparison = compare_predictions(surrogate.module, samples, data, rows, scale)
    times = evaluation_times(data.grid, float(np.median(comparison.times[:, -1])))
    return Evaluation(comparison, comparison_metrics(comparison, times), times)


def check_same_kind(metadata: SurrogateMetadata, data: Dataset) -> None:
    """DatasetError where a data set is not of the kind that a surrogate was trained on."""
    if not np.array_equal(metadata.grid.values, data.grid.values) or metadata.grid.relative != data.grid.relative:
        raise DatasetError("the data set has another time grid than the one the surrogate was trained on")
    specimens = specimen_to_json(metadata.specimen), specimen_to_json(data.specimen)
    if difference := first_difference(*specimens, "specimen"):
        raise DatasetError(f"the data set is of another specimen than the surrogate: {difference}")
    if metadata.outputs != data.outputs:
        raise DatasetError(f"the data set has the outputs {', '.join(data.outputs)}, not {', '.join(metadata.outputs)}")


@torch.no_grad()
def compare_predictions(module: SurrogateModule, samples: SampleTensors, data: Dataset, rows: Tensor, scale: Tensor) -> PredictionComparison:
    """What a network says of rows of a data set, beside what is true."""
    module.eval()
    parts = [module({name: v[part] for name, v in samples.items()}) for part in torch.split(rows, EVALUATION_BATCH)]
    row_numbers = rows.numpy()
    return PredictionComparison(
        times=np.stack([data.times(int(k)) for k in row_numbers]),
        true=samples["targets"][rows].double().numpy(),
        predicted=torch.cat(parts).double().numpy(),
        mask=samples["mask"][rows].numpy(),
        outputs=data.outputs,
        scale=scale.numpy(),
        index=data.index[row_numbers],
    )
