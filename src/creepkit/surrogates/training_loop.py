"""Training of a network: the learning-rate schedule, and epochs of Adam.

Every epoch has its own random seed, derived from the seed of the training and the epoch number, so that a training
resumed from a checkpoint gives the same result.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor

from creepkit.arrays import Ints
from creepkit.errors import SurrogateError
from creepkit.surrogates.parameter_network import ParameterModule, SampleTensors, sample_tensors, weights_of
from creepkit.surrogates.recipe import ProgressCallback, SampleArrays, Training, Weights
from creepkit.surrogates.training_rows import output_deviation

PLATEAU_THRESHOLD = 1e-4
"""Relative fall of a loss that counts as one, and DROP what the rate falls to: torch's ReduceLROnPlateau, unset in the
paper."""


PLATEAU_FACTOR = 0.1


LEAST_LEARNING_RATE = 1e-8


def learning_rate(training: Training, losses: Sequence[float], epoch_fraction: float = 0.0) -> float:
    """The rate in the epoch that follows these validation losses; epoch_fraction : of its batches that are done."""
    if training.schedule == "constant":
        return training.rate
    if training.schedule == "cosine":
        done = (len(losses) + epoch_fraction) / training.epochs
        return training.rate * 0.5 * (1.0 + math.cos(math.pi * min(done, 1.0)))
    rate, best, stalled_epochs = training.rate, math.inf, 0
    for loss in losses:
        better = loss < best * (1.0 - PLATEAU_THRESHOLD)
        best, stalled_epochs = (loss, 0) if better else (best, stalled_epochs + 1)
        if stalled_epochs > training.patience:
            stalled_epochs = 0
            if rate - max(rate * PLATEAU_FACTOR, LEAST_LEARNING_RATE) > LEAST_LEARNING_RATE:
                rate = max(rate * PLATEAU_FACTOR, LEAST_LEARNING_RATE)
    return rate


def epochs_since_best(losses: Sequence[float]) -> int:
    """Epochs since the lowest loss; 0 when the last was the lowest."""
    finite = [loss if math.isfinite(loss) else math.inf for loss in losses]
    return len(finite) - 1 - finite.index(min(finite)) if finite else 0


VALIDATION_BATCH = 256
"""Rows in a batch without gradients."""


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
        self.adam = torch.optim.Adam(module.parameters(), lr=training.rate)
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
                f"({self.training.rate:g}) or limit the gradient with clip=1"
            )
        if validation < min(self.curves["validation"], default=math.inf):
            self.best = self._weights()
        for name, value in (("loss", loss), ("validation", validation), ("rse", rse), ("rate", rate)):
            self.curves[name].append(value)

    def _train_epoch(self) -> tuple[float, float]:
        """The mean loss of the batches, and the rate at the beginning."""
        settings, losses, initial_rate = (
            self.training,
            self.curves["validation"],
            learning_rate(self.training, self.curves["validation"]),
        )
        devices = [self.device] if self.device.type == "cuda" else []
        total = torch.zeros((), dtype=torch.float64, device=self.device)
        self.module.train()
        with torch.random.fork_rng(devices=devices):
            torch.manual_seed(int(np.random.SeedSequence((self.seed, self.epochs)).generate_state(1)[0]))
            order = self.train[torch.randperm(len(self.train)).to(self.device)]
            batches = torch.split(order, settings.batch)
            for k, rows in enumerate(batches):
                self.adam.param_groups[0]["lr"] = learning_rate(settings, losses, k / len(batches))
                total += self._step(rows) * len(rows)
        return float(total) / len(order), initial_rate

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
        for rows in torch.split(self.validation, VALIDATION_BATCH):
            batch = _batch(self.samples, rows)
            loss, predicted = self.module.loss_and_outputs(batch)
            total += loss.double() * len(rows)
            errors = (predicted - batch["targets"]).double() / self._scale
            squares += torch.where(batch["mask"][..., None], errors, 0.0).square().sum()
        return float(total) / len(self.validation), float(squares) / self._total_squares

    def _validation_squares(self) -> float:
        """Squared deviations of the validation rows from their mean at each time."""
        targets, mask = (
            self.samples["targets"][self.validation].double(),
            self.samples["mask"][self.validation][..., None],
        )
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


def _batch(samples: SampleTensors, rows: Tensor) -> SampleTensors:
    return {name: tensor[rows] for name, tensor in samples.items()}


def _with_prefix(tensors: dict[str, Tensor], prefix: str) -> dict[str, Tensor]:
    return {name.removeprefix(prefix): tensor for name, tensor in tensors.items() if name.startswith(prefix)}
