"""Surrogates of a study: trained here, or found by name."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from creepkit.errors import DatasetError, SurrogateError

if TYPE_CHECKING:
    from creepkit.dataset.dataset import Dataset
    from creepkit.surrogate.recipe import ProgressCallback, Recipe, Training
    from creepkit.surrogate.surrogate import Surrogate


def train(
    data: Dataset | str | Path,
    recipe: Recipe,
    *,
    to: str | Path | None = None,
    seed: int = 0,
    training: Training | None = None,
    device: str = "auto",
    progress: ProgressCallback | None = None,
) -> Surrogate:
    """Train a network on a data set, or its file, and return it as a predictor: identify(..., using=it).

    recipe : ParameterGru() for the law of the data, RateNet() for any law.
    to : file to write. Interrupted, the same call goes on where it was; done, it returns what the file holds.
    seed : of the split into training and validation rows, the first weights and the order of rows.
    training : epochs, rate and so on in the place of the recipe's. device : "auto" (a GPU where there is one), "cpu".
    progress : called with (task, epochs done, epochs in all, note); the note says Eq. (4) of the validation rows.
    """
    from creepkit.surrogate.train import train as run

    if isinstance(data, (str, Path)):
        from creepkit.dataset.store import read_dataset

        data = read_dataset(data)
    if not hasattr(data, "accepted"):
        raise DatasetError(f"train() takes a data set or its file, found {type(data).__name__}; generate() makes one")
    if isinstance(recipe, type) or not hasattr(recipe, "samples"):
        found_type = recipe.__name__ if isinstance(recipe, type) else type(recipe).__name__
        raise SurrogateError(f"train() takes a recipe such as ParameterGru(hidden=128, layers=3), found {found_type}")
    return run(data, recipe, to=to, seed=seed, training=training, device=device, progress=progress)


def surrogate(name_or_path: str | Path) -> Surrogate:
    """Return the surrogate of this name that comes with creepkit, such as "dimple", or the one in a file."""
    from creepkit.surrogate.shipped import surrogate_by_name as run

    return run(name_or_path)
