"""Rows of a data set for training and for validation, the fingerprint of the data, and the scale of Eq. (4)."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Bools, Floats, Ints
from creepkit.errors import DatasetError
from creepkit.files.json_documents import canonical_json
from creepkit.registry.specimen_documents import specimen_to_json
from creepkit.sampling.specimen_conditions import MODULUS, TEMPERATURE, SpecimenConditions, specimen_conditions
from creepkit.surrogates.recipe import SampleArrays, Training

if TYPE_CHECKING:
    from creepkit.dataset.dataset import Dataset


LEAST_SAMPLES = 10
"""Samples below which nothing can be learnt and nothing be said of it."""


PLAUSIBLE_RANGES = {MODULUS: (1e3, 2e6), TEMPERATURE: (50.0, 4000.0)}
"""Where conditions lie that are in MPa and K; a modulus in GPa does not."""


PLAUSIBLE_LOADS = {"pressure": (1e-4, 1e4), "stress": (1e-3, 1e5), "strain": (1e-8, 1.0)}
"""Where levels of a load of these quantities lie, MPa and strain."""


PLAUSIBLE_LENGTHS = (1e-3, 1e4)
"""mm."""


def trainable_samples(data: Dataset) -> Dataset:
    """The samples to learn from: accepted ones, each with a history; DatasetError where there are too few."""
    accepted = data.accepted
    if len(accepted) < LEAST_SAMPLES:
        raise DatasetError(
            f"a data set with {len(accepted)} accepted samples of {len(data)} is too small to train on; "
            f"{LEAST_SAMPLES} are the least, generate more"
        )
    _check_units(accepted)
    finite_frames: Bools = np.asarray(np.isfinite(accepted.values).all(axis=-1))
    empty = ~finite_frames.any(axis=1)
    if empty.any():
        first = int(accepted.index[int(np.argmax(empty))])
        raise DatasetError(
            f"sample {first} of the data set is accepted, but no frame of its history is a number (so it is with "
            f"{int(empty.sum())} in all); the file is damaged, generate it again"
        )
    return accepted


def _check_units(data: Dataset) -> None:
    known = specimen_conditions(data.specimen)
    for name, column in zip(data.condition_names, data.conditions.T, strict=True):
        low, high = _plausible_range(known, name)
        if not ((column >= low) & (column <= high)).all():
            raise DatasetError(
                f"condition '{name}' of the data set goes from {column.min():g} to {column.max():g}, which is not in "
                f"{known.unit(name) or 'its unit'}; it was written in another unit or is damaged"
            )
    if not np.isfinite(data.parameters).all():
        raise DatasetError("some parameter of the data set is not a number; the file is damaged, generate it again")


def _plausible_range(known: SpecimenConditions, name: str) -> tuple[float, float]:
    """Lowest and highest value of a condition that its unit makes likely."""
    everything = (0.0, np.inf)
    if name in known.levels:
        return PLAUSIBLE_LOADS.get(known.load.quantity, everything)
    if any(name == length.name for length in known.lengths):
        return PLAUSIBLE_LENGTHS
    return PLAUSIBLE_RANGES.get(name, everything)


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
