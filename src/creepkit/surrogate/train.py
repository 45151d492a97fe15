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
from creepkit.surrogate.checkpoint import Checkpoint, training_request
from creepkit.surrogate.evaluation import compare_predictions
from creepkit.surrogate.fitting import NetworkTraining, output_deviation
from creepkit.surrogate.metrics import evaluation_times, comparison_metrics
from creepkit.surrogate.recipe import ProgressCallback, Recipe, SampleTensors, SurrogateMetadata, Training
from creepkit.surrogate.surrogate import Surrogate, load_surrogate
from creepkit.surrogate.trainable import training_split, trainable_samples

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
    progress: ProgressCallback | None = None,
) -> Surrogate:
    """Train a network on the accepted samples of a data set and return it as a predictor.

    to : file to write. A checkpoint lies beside it while the training goes on: the same call continues from there, and
        to the last bit as if nothing had happened on a CPU; where the file is there already, it is returned.
    seed : of the split into training and validation rows, the first weights and the order of rows.
    training : in the place of the recipe's own. device : "auto" (a GPU where there is one), "cpu", "cuda".
    progress : called with (task, epochs done, epochs in all, note); the note says Eq. (4) of the validation rows.
    """
    recipe = recipe if training is None else replace(recipe, training=training)  # type: ignore[type-var]
    torch_device, path, data = _device(device), None if to is None else Path(to), trainable_samples(data)
    request = training_request(data, recipe, seed)
    if path is not None and path.exists():
        return _load_finished(path, request)
    samples = recipe.sample_tensors(data, progress)
    rows = training_split(len(data), recipe.training, seed)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        module, metadata = recipe.module(data, samples, rows[0]), recipe.metadata(data, samples, rows[0])
    fit, checkpoint = NetworkTraining(module, samples, rows, recipe.training, seed, torch_device), Checkpoint(path, request)
    checkpoint.restore(fit)
    fit.run(checkpoint.save, progress)
    module = module.cpu().eval()
    module.load_state_dict(fit.best)
    result = recipe.surrogate(module, _training_metadata(metadata, data, samples, rows, fit, request))
    if path is not None:
        result.save(path)
        checkpoint.remove()
    return result


def _training_metadata(
    metadata: SurrogateMetadata, data: Dataset, samples: SampleTensors, rows: tuple[Tensor, Tensor], fit: NetworkTraining, request: dict[str, Any]
) -> SurrogateMetadata:
    """What the surrogate is told, with how its training went."""
    comparison = compare_predictions(fit.module, samples, data, rows[1], output_deviation(samples, rows[0]))
    times = evaluation_times(data.grid, float(np.median(comparison.times[:, -1])))
    provenance = {
        **request,
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
    return replace(metadata, metrics=comparison_metrics(comparison, times), curves=fit.curves, provenance=provenance)


def _load_finished(path: Path, request: dict[str, Any]) -> Surrogate:
    """The surrogate that the same call has written; SurrogateError where something else lies there."""
    _, header = files.read_safetensors(path)
    provenance = header.get("provenance", {})
    if any(provenance.get(name) != value for name, value in request.items()):
        raise SurrogateError(f"{path}: another surrogate is there already; remove it or choose another name")
    return load_surrogate(path)


def _device(name: str) -> torch.device:
    if name == "auto":
        return torch.device("cuda" if torch.cuda.is_available() else "cpu")
    if name not in ("cpu", "cuda") or (name == "cuda" and not torch.cuda.is_available()):
        available = "auto, cpu and cuda" if torch.cuda.is_available() else "auto and cpu (torch sees no GPU)"
        raise SurrogateError(f"device '{name}' is not there; allowed are {available}")
    return torch.device(name)
