"""Training of surrogates: train, resume from a checkpoint, and size studies (Fig. S7 of the paper)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from importlib.metadata import version
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import torch

from creepkit.arrays import Ints
from creepkit.checked_arguments import checked
from creepkit.dataset.dataset import Dataset, first_difference
from creepkit.dataset.storage import read_dataset
from creepkit.errors import SurrogateError
from creepkit.files.json_documents import as_read_back
from creepkit.files.safetensors_files import read_safetensors, write_safetensors
from creepkit.surrogates.evaluation import evaluate_rows
from creepkit.surrogates.loading import load_surrogate
from creepkit.surrogates.network_evaluation import RecurrentCell
from creepkit.surrogates.parameter_gru import NetworkSizes, ParameterGru
from creepkit.surrogates.parameter_network import sample_tensors, weights_of
from creepkit.surrogates.recipe import ProgressCallback, Training
from creepkit.surrogates.surrogate import Surrogate
from creepkit.surrogates.training_loop import NetworkTraining
from creepkit.surrogates.training_rows import dataset_fingerprint, output_deviation, trainable_samples, training_split
from creepkit.surrogates.weight_files import CHECKPOINT


def training_request(data: Dataset, recipe: ParameterGru, seed: int) -> dict[str, Any]:
    """What was asked for, as JSON-able data: the same call goes on where it was interrupted."""
    config: Any = asdict(recipe)
    request: dict[str, Any] = as_read_back(
        {"data": dataset_fingerprint(data), "kind": recipe.kind, "recipe": config, "seed": seed}
    )
    return request


class Checkpoint:
    """Where a training leaves what it needs to go on; without a path it leaves nothing."""

    def __init__(self, result_path: Path | None, request: Mapping[str, Any]) -> None:
        self.path = None if result_path is None else result_path.with_name(f"{result_path.name}.checkpoint")
        self.request = dict(request)

    def save(self, state_of_training: NetworkTraining) -> None:
        """Leave a fit as it is, in the place of what was left before."""
        if self.path is not None:
            header = {"call": self.request, "curves": state_of_training.curves}
            write_safetensors(self.path, state_of_training.state(), header, CHECKPOINT, internal=True)

    def restore(self, state_of_training: NetworkTraining) -> None:
        """Bring a fresh fit to where the same call was interrupted, if it was."""
        if self.path is None or not self.path.exists():
            return
        tensors, header = read_safetensors(self.path, CHECKPOINT)
        if header.get("call") != self.request:
            difference = first_difference(header.get("call"), self.request, "")
            raise SurrogateError(
                f"{self.path}: left by another training (there and here {difference}); finish that one, remove the "
                "file, or choose another name"
            )
        try:
            state_of_training.restore(tensors, header["curves"])
        except (KeyError, RuntimeError, ValueError, TypeError, AttributeError):
            raise SurrogateError(f"{self.path}: this checkpoint is damaged; remove it to begin again") from None

    def remove(self) -> None:
        """The training is done and its file written."""
        if self.path is not None:
            self.path.unlink(missing_ok=True)


@checked
def train(
    data: Dataset | str | Path,
    recipe: ParameterGru,
    *,
    to: str | Path | None = None,
    seed: int = 0,
    training: Training | None = None,
    device: str = "auto",
    progress: ProgressCallback | None = None,
) -> Surrogate:
    """Train a network on a data set, or its file, and return it as a predictor: identify(..., using=it).

    recipe : ParameterGru(), the recurrent network of the law of the data, with its settings.
    to : file to write. A checkpoint lies beside it while the training goes on: the same call continues from there, on
        a CPU to the last bit as if nothing had happened; where the file is there already, it is returned.
    seed : of the split into training and validation rows, the first weights and the order of rows.
    training : epochs, rate and so on in the place of the recipe's. device : "auto" (a GPU where there is one), "cpu".
    progress : called with (task, epochs done, epochs in all, note); the note says Eq. (4) of the validation rows.
    """
    if isinstance(data, (str, Path)):
        data = read_dataset(data)
    recipe = recipe if training is None else replace(recipe, training=training)
    torch_device, path, data = _device(device), None if to is None else Path(to), trainable_samples(data)
    request = training_request(data, recipe, seed)
    if path is not None and path.exists():
        return _load_finished(path, request)
    samples = recipe.sample_arrays(data, progress)
    rows = training_split(len(data), recipe.training, seed)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        tensors, train_rows = sample_tensors(samples), torch.from_numpy(rows[0])
        module = recipe.module(data, tensors, train_rows)
    metadata = recipe.metadata(data, tensors, train_rows, module)
    fit = NetworkTraining(module, samples, rows, recipe.training, seed, torch_device)
    checkpoint = Checkpoint(path, request)
    checkpoint.restore(fit)
    fit.run(checkpoint.save, progress)
    weights = weights_of(fit.best)
    trained, scale = Surrogate(recipe, weights, metadata), output_deviation(samples, rows[0])
    metrics = evaluate_rows(trained, samples, data, rows[1], scale).metrics
    provenance = _provenance(data, rows, fit, request)
    metadata = replace(metadata, metrics=metrics, curves=fit.curves, provenance=provenance)
    result = Surrogate(recipe, weights, metadata)
    if path is not None:
        result.save(path)
        checkpoint.remove()
    return result


def _provenance(
    data: Dataset, rows: tuple[Ints, Ints], fit: NetworkTraining, request: dict[str, Any]
) -> dict[str, Any]:
    """What was asked for, by what and how it was trained."""
    return {
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


def _load_finished(path: Path, request: dict[str, Any]) -> Surrogate:
    """The surrogate that the same call has written; SurrogateError where something else lies there."""
    finished = load_surrogate(path)
    provenance = finished.metadata.provenance
    if any(provenance.get(name) != value for name, value in request.items()):
        raise SurrogateError(f"{path}: another surrogate is there already; remove it or choose another name")
    return finished


def _device(name: str) -> torch.device:
    if name == "auto":
        return torch.device("cuda" if torch.cuda.is_available() else "cpu")
    if name not in ("cpu", "cuda") or (name == "cuda" and not torch.cuda.is_available()):
        available = "auto, cpu and cuda" if torch.cuda.is_available() else "auto and cpu (torch sees no GPU)"
        raise SurrogateError(f"device '{name}' is not there; allowed are {available}")
    return torch.device(name)


@dataclass(frozen=True)
class SizeStudyResult:
    """One training of a sweep.

    cell, hidden, layers, samples : what was varied; samples are those learnt from.
    weight_count : numbers that were fitted. loss : Eq. (4) of the validation rows at the best epoch.
    training : the loss of the training rows in that epoch. outputs : {output: its RSE}. losses : Eq. (4) of each epoch.
    """

    cell: RecurrentCell
    hidden: int
    layers: int
    samples: int
    weight_count: int
    loss: float
    training: float
    epochs: int
    best_epoch: int
    outputs: dict[str, float]
    losses: tuple[float, ...]
    file: str

    @property
    def label(self) -> str:
        """In words."""
        return f"{self.cell} {self.hidden} x {self.layers}, {self.samples} samples"


def size_study(
    data: Dataset,
    recipe: ParameterGru,
    sizes: NetworkSizes,
    *,
    to: str | Path,
    seed: int = 0,
    device: str = "auto",
    progress: ProgressCallback | None = None,
) -> list[SizeStudyResult]:
    """Train every combination, each to a file of its own in the folder `to`; those that are there already are read.

    Every training is evaluated on the same rows, a share of the whole data set that none of them learns from.
    """
    data, folder = trainable_samples(data), Path(to)
    training_count = len(training_split(len(data), recipe.training, seed)[0])
    counts = [*sizes.samples] or [training_count]
    # an error now, not after hours of training
    training_split(len(data), replace(recipe.training, samples=max(counts)), seed)
    folder.mkdir(parents=True, exist_ok=True)
    cells, layers, hidden = (
        sizes.cells or (recipe.cell,),
        sizes.layers or (recipe.layers,),
        sizes.hidden or (recipe.hidden,),
    )
    combinations = list(product(cells, layers, hidden, counts))
    results = []
    for k, (cell, depth, size, count) in enumerate(combinations):
        settings = replace(recipe.training, samples=count)
        variant = replace(recipe, cell=cell, layers=depth, hidden=size, training=settings)
        path = folder / f"{cell}-{size}x{depth}-{count}.safetensors"
        named_progress = _with_task_name(progress, f"{k + 1} of {len(combinations)}, {path.stem}")
        model = train(data, variant, to=path, seed=seed, device=device, progress=named_progress)
        results.append(_study_result(model, variant, count, path))
    return results


def _with_task_name(progress: ProgressCallback | None, name: str) -> ProgressCallback | None:
    if progress is None:
        return None
    return lambda task, done, total, note: progress(f"{name}, {task}", done, total, note)


def _study_result(model: Surrogate, recipe: ParameterGru, count: int, path: Path) -> SizeStudyResult:
    metadata, provenance = model.metadata, model.metadata.provenance
    best = int(provenance["best_epoch"])
    return SizeStudyResult(
        cell=recipe.cell,
        hidden=recipe.hidden,
        layers=recipe.layers,
        samples=count,
        weight_count=model.weight_count,
        loss=float(metadata.metrics["loss"]),
        training=float(metadata.curves["loss"][best - 1]),
        epochs=int(provenance["epochs"]),
        best_epoch=best,
        outputs={name: float(errors["rse"]) for name, errors in metadata.metrics["outputs"].items()},
        losses=tuple(metadata.curves["rse"]),
        file=path.name,
    )
