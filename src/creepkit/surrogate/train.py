"""train: a data set and a recipe become a surrogate; interrupted, the same call goes on."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from torch import Tensor

from creepkit.errors import SurrogateError
from creepkit.surrogate import files
from creepkit.surrogate.checkpoint import Checkpoint, call_of
from creepkit.surrogate.evaluation import compared
from creepkit.surrogate.fitting import Fit, deviation
from creepkit.surrogate.metrics import chosen_times, metrics_of
from creepkit.surrogate.recipe import Progress, Recipe, Samples, Told, Training
from creepkit.surrogate.surrogate import Surrogate, load
from creepkit.surrogate.trainable import split, trainable

if TYPE_CHECKING:
    from creepkit.dataset.dataset import Dataset


def train(
    data: Dataset,
    recipe: Recipe,
    *,
    to: str | Path | None = None,
    seed: int = 0,
    training: Training | None = None,
    device: str = "auto",
    progress: Progress | None = None,
) -> Surrogate:
    """Train a network on the accepted samples of a data set and return it as a predictor.

    to : file to write. A checkpoint lies beside it while the training goes on: the same call continues from there, and
        to the last bit as if nothing had happened on a CPU; where the file is there already, it is returned.
    seed : of the split into training and validation rows, the first weights and the order of rows.
    training : in the place of the recipe's own. device : "auto" (a GPU where there is one), "cpu", "cuda".
    progress : called with (task, epochs done, epochs in all, note); the note says Eq. (4) of the validation rows.
    """
    recipe = recipe if training is None else replace(recipe, training=training)  # type: ignore[type-var]
    place, path, data = _device(device), None if to is None else Path(to), trainable(data)
    call = call_of(data, recipe, seed)
    if path is not None and path.exists():
        return _finished(path, call)
    samples = recipe.samples(data, progress)
    rows = split(len(data), recipe.training, seed)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        module, told = recipe.module(data, samples, rows[0]), recipe.told(data, samples, rows[0])
    fit, checkpoint = Fit(module, samples, rows, recipe.training, seed, place), Checkpoint(path, call)
    checkpoint.restore(fit)
    fit.run(checkpoint.save, progress)
    module = module.cpu().eval()
    module.load_state_dict(fit.best)
    made = recipe.surrogate(module, _trained(told, data, samples, rows, fit, call))
    if path is not None:
        made.save(path)
        checkpoint.remove()
    return made


def _trained(
    told: Told, data: Dataset, samples: Samples, rows: tuple[Tensor, Tensor], fit: Fit, call: dict[str, Any]
) -> Told:
    """What the surrogate is told, with how its training went."""
    found = compared(fit.module, samples, data, rows[1], deviation(samples, rows[0]))
    times = chosen_times(data.grid, float(np.median(found.times[:, -1])))
    provenance = {
        **call,
        "creepkit": version("creepkit"),
        "torch": torch.__version__,
        "device": fit.device.type,
        "training_rows": len(rows[0]),
        "validation_rows": len(rows[1]),
        "epochs": fit.epochs,
        "best_epoch": int(np.argmin(fit.curves["validation"])) + 1,
        "data_set": dict(data.provenance),
        "when": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    return replace(told, metrics=metrics_of(found, times), curves=fit.curves, provenance=provenance)


def _finished(path: Path, call: dict[str, Any]) -> Surrogate:
    """The surrogate that the same call has written; SurrogateError where something else lies there."""
    _, header = files.read(path)
    before = header.get("provenance", {})
    if any(before.get(name) != value for name, value in call.items()):
        raise SurrogateError(f"{path}: another surrogate is there already; remove it or choose another name")
    return load(path)


def _device(name: str) -> torch.device:
    if name == "auto":
        return torch.device("cuda" if torch.cuda.is_available() else "cpu")
    if name not in ("cpu", "cuda") or (name == "cuda" and not torch.cuda.is_available()):
        there = "auto, cpu and cuda" if torch.cuda.is_available() else "auto and cpu (torch sees no GPU)"
        raise SurrogateError(f"device '{name}' is not there; allowed are {there}")
    return torch.device(name)
