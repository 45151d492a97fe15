"""A surrogate beside data: those set aside in its training, or another data set of the same kind."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from torch import Tensor

from creepkit.dataset.joining import first_difference
from creepkit.dataset.specimen_document import specimen_document
from creepkit.errors import DatasetError
from creepkit.surrogate.checkpoint import fingerprint
from creepkit.surrogate.fitting import deviation
from creepkit.surrogate.metrics import Compared, chosen_times, metrics_of
from creepkit.surrogate.recipe import Module, Samples, Told
from creepkit.surrogate.surrogate import Surrogate
from creepkit.surrogate.trainable import split, trainable

if TYPE_CHECKING:
    from creepkit.dataset.dataset import Dataset

AT_ONCE = 256


@dataclass(frozen=True, eq=False)
class Evaluation:
    """What a surrogate predicts of samples beside what is true, the metrics of it, and the times these look at."""

    found: Compared
    metrics: dict[str, Any]
    times: tuple[float, ...]


def evaluate(surrogate: Surrogate, data: Dataset) -> Evaluation:
    """Compare a surrogate with a data set: with the validation rows where it is the one of its training, else all."""
    data = trainable(data)
    check_same(surrogate.told, data)
    known = surrogate.told.provenance
    samples = surrogate.recipe.samples(data)
    everything = torch.arange(len(data))
    rows, scale = everything, deviation(samples, everything)
    if known.get("data") == fingerprint(data):
        train, rows = split(len(data), surrogate.recipe.training, int(known["seed"]))
        scale = deviation(samples, train)
    found = compared(surrogate.module, samples, data, rows, scale)
    times = chosen_times(data.grid, float(np.median(found.times[:, -1])))
    return Evaluation(found, metrics_of(found, times), times)


def check_same(told: Told, data: Dataset) -> None:
    """DatasetError where a data set is not of the kind that a surrogate was trained on."""
    if not np.array_equal(told.grid.values, data.grid.values) or told.grid.relative != data.grid.relative:
        raise DatasetError("the data set has another time grid than the one the surrogate was trained on")
    specimens = specimen_document(told.specimen), specimen_document(data.specimen)
    if difference := first_difference(*specimens, "specimen"):
        raise DatasetError(f"the data set is of another specimen than the surrogate: {difference}")
    if told.outputs != data.outputs:
        raise DatasetError(f"the data set has the outputs {', '.join(data.outputs)}, not {', '.join(told.outputs)}")


@torch.no_grad()
def compared(module: Module, samples: Samples, data: Dataset, rows: Tensor, scale: Tensor) -> Compared:
    """What a network says of rows of a data set, beside what is true."""
    module.eval()
    parts = [module({name: v[part] for name, v in samples.items()}) for part in torch.split(rows, AT_ONCE)]
    numbers = rows.numpy()
    return Compared(
        times=np.stack([data.times(int(k)) for k in numbers]),
        true=samples["targets"][rows].double().numpy(),
        predicted=torch.cat(parts).double().numpy(),
        mask=samples["mask"][rows].numpy(),
        outputs=data.outputs,
        scale=scale.numpy(),
        index=data.index[numbers],
    )
