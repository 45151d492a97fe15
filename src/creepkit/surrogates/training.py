"""Training of surrogates: epochs of Adam, checkpoints from which a training goes on, and size studies (Fig. S7).

Every epoch has its own random seed, derived from the seed of the training and the epoch number, so that a training
resumed from a checkpoint gives the same result.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from importlib.metadata import version
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.optim.lr_scheduler import ReduceLROnPlateau

from creepkit.arrays import Floats, Ints
from creepkit.checked_arguments import checked
from creepkit.dataset.dataset import Dataset, first_difference
from creepkit.dataset.storage import read_dataset
from creepkit.errors import SurrogateError
from creepkit.files.json_documents import as_read_back
from creepkit.files.safetensors_files import read_safetensors, write_safetensors
from creepkit.jobs.progress import ProgressCallback
from creepkit.surrogates.evaluation import (
    dataset_fingerprint,
    evaluate_rows,
    output_deviation,
    trainable_samples,
    training_split,
)
from creepkit.surrogates.network_evaluation import SampleArrays, Weights
from creepkit.surrogates.parameter_gru import NetworkSizes, ParameterGru, Training
from creepkit.surrogates.parameter_network import ParameterModule, SampleTensors, sample_tensors, weights_of
from creepkit.surrogates.surrogate import CHECKPOINT, Surrogate, load_surrogate

LEAST_LEARNING_RATE = 1e-8
"""To which a plateau lowers it."""


def epochs_since_best(losses: Sequence[float]) -> int:
    """Epochs since the lowest loss; 0 when the last was the lowest."""
    finite = [loss if math.isfinite(loss) else math.inf for loss in losses]
    return len(finite) - 1 - finite.index(min(finite)) if finite else 0


VALIDATION_BATCH = {"cpu": 256, "cuda": 1024}
"""Rows in a batch without gradients: as many as a cache holds, and as fill a GPU."""


class NetworkTraining:
    """A network between epochs.

    rows : positions (rows,) of the training and of the validation rows.
    curves : {"loss": of training rows during the epoch, "validation": of those set aside after it, "rse": Eq. (4) of
        the latter, "rate": Adam's}, a number each epoch. best : weights of the epoch with the lowest validation loss.
    """

    def __init__(
        self,
        module: ParameterModule,
        samples: SampleArrays,
        rows: tuple[Ints, Ints],
        training: Training,
        seed: int,
        device: torch.device,
    ) -> None:
        self.module, self.device = module.to(device), device
        self.samples = {name: tensor.to(device) for name, tensor in sample_tensors(samples).items()}
        self.train, self.validation = (torch.from_numpy(part).to(device) for part in rows)
        self.training, self.seed = training, seed
        self.adam = torch.optim.Adam(module.parameters(), lr=training.first_rate, fused=True)
        self.plateau = ReduceLROnPlateau(self.adam, patience=training.patience, min_lr=LEAST_LEARNING_RATE)
        self.curves: dict[str, list[float]] = {"loss": [], "validation": [], "rse": [], "rate": []}
        self.best = self._weights()
        self._scale = torch.from_numpy(output_deviation(samples, rows[0])).to(device)
        self._total_squares = self._validation_squares()

    @property
    def epochs(self) -> int:
        """Epochs that are done."""
        return len(self.curves["loss"])

    @property
    def finished(self) -> bool:
        """Whether all epochs are done, or enough of them were of no use."""
        patience = self.training.early_stop
        stalled = patience is not None and epochs_since_best(self.curves["validation"]) >= patience
        return self.epochs >= self.training.epochs or stalled

    def run(self, after_epoch: Callable[[NetworkTraining], None], progress: ProgressCallback | None) -> None:
        """Go through the epochs that are left; `after` is called with the fit when one is done."""
        while not self.finished:
            self.epoch()
            after_epoch(self)
            if progress is not None:
                note = f"loss {self.curves['rse'][-1]:.3g}, best {min(self.curves['rse']):.3g}"
                done = self.training.epochs if self.finished else self.epochs
                progress("epochs", done, self.training.epochs, note)

    def epoch(self) -> None:
        """One pass over the training rows, then the loss of the validation rows."""
        loss, rate = self._train_epoch()
        validation, rse = self.validate()
        if not (math.isfinite(loss) and math.isfinite(validation)):
            raise SurrogateError(
                f"the training diverged in epoch {self.epochs + 1}: its loss is not a finite number; lower the rate "
                f"({self.training.first_rate:g}) or limit the gradient with clip=1"
            )
        if validation < min(self.curves["validation"], default=math.inf):
            self.best = self._weights()
        for name, value in (("loss", loss), ("validation", validation), ("rse", rse), ("rate", rate)):
            self.curves[name].append(value)
        if self.training.schedule == "plateau":
            self.plateau.step(validation)

    def _train_epoch(self) -> tuple[float, float]:
        """The mean loss of the batches, and the rate at the beginning."""
        devices, rates = [self.device] if self.device.type == "cuda" else [], []
        total = torch.zeros((), dtype=torch.float64, device=self.device)
        self.module.train()
        with torch.random.fork_rng(devices=devices):
            torch.manual_seed(int(np.random.SeedSequence((self.seed, self.epochs)).generate_state(1)[0]))
            order = self.train[torch.randperm(len(self.train)).to(self.device)]
            batches = torch.split(order, self.training.batch)
            for k, rows in enumerate(batches):
                if self.training.schedule == "cosine":
                    done = (self.epochs + k / len(batches)) / self.training.epochs
                    self.adam.param_groups[0]["lr"] = self.training.first_rate * 0.5 * (1.0 + math.cos(math.pi * done))
                rates.append(float(self.adam.param_groups[0]["lr"]))
                total += self._step(rows) * len(rows)
        return float(total) / len(order), rates[0]

    def _step(self, rows: Tensor) -> Tensor:
        self.adam.zero_grad()
        loss = self.module.loss(_batch(self.samples, rows))
        loss.backward()  # type: ignore[no-untyped-call]
        if self.training.clip is not None:
            torch.nn.utils.clip_grad_norm_(self.module.parameters(), self.training.clip)
        self.adam.step()
        return loss.detach().double()

    @torch.no_grad()
    def validate(self) -> tuple[float, float]:
        """The module's loss, and Eq. (4), of the validation rows."""
        self.module.eval()
        total = torch.zeros((), dtype=torch.float64, device=self.device)
        squares = torch.zeros((), dtype=torch.float64, device=self.device)
        for rows in self._validation_batches():
            batch = _batch(self.samples, rows)
            loss, predicted = self.module.loss_and_outputs(batch)
            total += loss.double() * len(rows)
            errors = (predicted - batch["targets"]).double() / self._scale
            squares += torch.where(batch["mask"][..., None], errors, 0.0).square().sum()
        return float(total) / len(self.validation), float(squares) / self._total_squares

    @torch.no_grad()
    def best_outputs(self) -> Floats:
        """(validation rows, frames, outputs) in physical units, of the best weights, which the module has from now."""
        self.module.load_state_dict(self.best)
        self.module.eval()
        predicted = [self.module(_batch(self.samples, rows)).cpu() for rows in self._validation_batches()]
        return torch.cat(predicted).double().numpy()

    def _validation_batches(self) -> tuple[Tensor, ...]:
        return torch.split(self.validation, VALIDATION_BATCH[self.device.type])

    def _validation_squares(self) -> float:
        """Squared deviations of the validation rows from their mean at each time."""
        targets = self.samples["targets"][self.validation].double()
        mask = self.samples["mask"][self.validation][..., None]
        mean = torch.where(mask, targets, 0.0).sum(dim=0) / mask.sum(dim=0).clamp(min=1)
        return max(float(torch.where(mask, (targets - mean) / self._scale, 0.0).square().sum()), 1e-300)

    def _weights(self) -> dict[str, Tensor]:
        return {name: tensor.detach().cpu().clone() for name, tensor in self.module.state_dict().items()}

    # ---- between runs ----------------------------------------------------------------------------------------------

    def state(self) -> Weights:
        """{name: (...,)} all arrays that going on needs: weights, the best ones, Adam's moments."""
        tensors = {f"module/{name}": tensor for name, tensor in self._weights().items()}
        tensors |= {f"best/{name}": tensor for name, tensor in self.best.items()}
        for number, moments in self.adam.state_dict()["state"].items():
            tensors |= {f"adam/{number}/{name}": torch.as_tensor(value).cpu() for name, value in moments.items()}
        return weights_of(tensors)

    def restore(self, arrays: Weights, curves: dict[str, list[float]]) -> None:
        """Go back to where `state` was asked; arrays : {name: (...,)} what it gave."""
        tensors = {name: torch.from_numpy(array) for name, array in arrays.items()}
        self.module.load_state_dict(_with_prefix(tensors, "module/"))
        self.best = _with_prefix(tensors, "best/")
        moments: dict[int, dict[str, Any]] = {}
        for name, tensor in _with_prefix(tensors, "adam/").items():
            number, _, moment = name.partition("/")
            moments.setdefault(int(number), {})[moment] = tensor
        self.adam.load_state_dict({**self.adam.state_dict(), "state": moments})
        self.curves = {name: list(values) for name, values in curves.items()}
        for loss in self.curves["validation"] if self.training.schedule == "plateau" else ():
            self.plateau.step(loss)


def _batch(samples: SampleTensors, rows: Tensor) -> SampleTensors:
    return {name: tensor[rows] for name, tensor in samples.items()}


def _with_prefix(tensors: dict[str, Tensor], prefix: str) -> dict[str, Tensor]:
    return {name.removeprefix(prefix): tensor for name, tensor in tensors.items() if name.startswith(prefix)}


def training_request(data: Dataset, recipe: ParameterGru, seed: int) -> dict[str, Any]:
    """What was asked for, as JSON-able data: the same call goes on where it was interrupted."""
    config: Any = asdict(recipe)
    request: dict[str, Any] = as_read_back(
        {"data": dataset_fingerprint(data), "kind": recipe.kind, "recipe": config, "seed": seed}
    )
    return request


@dataclass(frozen=True)
class Checkpoint:
    """Where a training leaves what it needs to go on; without a path it leaves nothing. request : what was asked."""

    path: Path | None
    request: dict[str, Any]

    def save(self, fit: NetworkTraining) -> None:
        """Leave a fit as it is, in the place of what was left before."""
        if self.path is not None:
            header = {"call": self.request, "curves": fit.curves}
            write_safetensors(self.path, fit.state(), header, CHECKPOINT, internal=True)

    def restore(self, fit: NetworkTraining) -> None:
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
            fit.restore(tensors, header["curves"])
        except (KeyError, RuntimeError, ValueError, TypeError, AttributeError):
            raise SurrogateError(f"{self.path}: this checkpoint is damaged; remove it to begin again") from None


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
    checkpoint = Checkpoint(None if path is None else path.with_name(f"{path.name}.checkpoint"), request)
    checkpoint.restore(fit)
    fit.run(checkpoint.save, progress)
    scale = output_deviation(samples, rows[0])
    metrics = evaluate_rows(fit.best_outputs(), samples, data, rows[1], scale).metrics
    provenance = _provenance(data, rows, fit, request)
    metadata = replace(metadata, metrics=metrics, curves=fit.curves, provenance=provenance)
    result = Surrogate(recipe, weights_of(fit.best), metadata)
    if path is not None:
        result.save(path)
        path.with_name(f"{path.name}.checkpoint").unlink(missing_ok=True)
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


def size_study(
    data: Dataset,
    recipe: ParameterGru,
    sizes: NetworkSizes,
    *,
    to: str | Path,
    seed: int = 0,
    device: str = "auto",
    progress: ProgressCallback | None = None,
) -> dict[str, Surrogate]:
    """{file: network} of every combination, each trained to a file in the folder `to`; those that are there are read.

    Every training is evaluated on the same rows, a share of the whole data set that none of them learns from.
    """
    data, folder = trainable_samples(data), Path(to)
    training_count = len(training_split(len(data), recipe.training, seed)[0])
    counts = [*sizes.samples] or [training_count]
    # an error now, not after hours of training
    training_split(len(data), replace(recipe.training, samples=max(counts)), seed)
    folder.mkdir(parents=True, exist_ok=True)
    widths = sizes.layers or (recipe.layers,), sizes.hidden or (recipe.hidden,)
    combinations = list(product(*widths, counts))
    models = {}
    for k, (layers, hidden, count) in enumerate(combinations):
        training = replace(recipe.training, samples=count)
        variant = replace(recipe, layers=layers, hidden=hidden, training=training)
        path = folder / f"gru-{hidden}x{layers}-{count}.safetensors"
        named_progress = _with_task_name(progress, f"{k + 1} of {len(combinations)}, {path.stem}")
        models[path.name] = train(data, variant, to=path, seed=seed, device=device, progress=named_progress)
    return models


def _with_task_name(progress: ProgressCallback | None, name: str) -> ProgressCallback | None:
    if progress is None:
        return None
    return lambda task, done, total, note: progress(f"{name}, {task}", done, total, note)


def size_study_to_json(models: Mapping[str, Surrogate]) -> list[dict[str, Any]]:
    """Of each training its sizes, Eq. (4) of the validation rows at the best epoch and all others, and its file."""
    rows = []
    for file, model in models.items():
        metadata, source = model.metadata, model.metadata.provenance
        rows.append({
            "hidden": model.recipe.hidden,
            "layers": model.recipe.layers,
            "samples": source["training_rows"],
            "weight_count": model.weight_count,
            "loss": metadata.metrics["loss"],
            "training": metadata.curves["loss"][source["best_epoch"] - 1],
            "epochs": source["epochs"],
            "best_epoch": source["best_epoch"],
            "outputs": {name: errors["rse"] for name, errors in metadata.metrics["outputs"].items()},
            "losses": metadata.curves["rse"],
            "file": file,
        })  # fmt: skip
    return rows
