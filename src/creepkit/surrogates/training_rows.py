"""Rows of a data set for training and for validation, the fingerprint of the data, and the scale of Eq. (4)."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.errors import DatasetError
from creepkit.files.json_documents import canonical_json
from creepkit.registry.specimen_documents import specimen_to_json
from creepkit.surrogates.recipe import SampleArrays, Training

if TYPE_CHECKING:
    from creepkit.dataset.dataset import Dataset


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
