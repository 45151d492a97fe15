"""The loop of a training: epochs of Adam, judged on rows that are set aside, the best weights kept.

Every epoch has a seed of its own, made of the training's seed and the epoch's number, so that a training that goes on
from a checkpoint does what it would have done.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from torch import Tensor

from creepkit.errors import SurrogateError
from creepkit.surrogate.recipe import SurrogateModule, ProgressCallback, SampleTensors, Training
from creepkit.surrogate.schedule import learning_rate, epochs_since_best

VALIDATION_BATCH = 256
"""Rows in a batch without gradients."""


class NetworkTraining:
    """A network between epochs.

    curves : {"loss": of training rows during the epoch, "validation": of those set aside after it, "rse": Eq. (4) of
        the latter, "rate": Adam's}, a number each epoch. best : weights of the epoch with the lowest validation loss.
    """

    def __init__(
        self, module: SurrogateModule, samples: SampleTensors, rows: tuple[Tensor, Tensor], training: Training, seed: int,
        device: torch.device,
    ) -> None:  # fmt: skip
        self.module, self.device = module.to(device), device
        self.samples = {name: tensor.to(device) for name, tensor in samples.items()}
        self.train, self.validation = (part.to(device) for part in rows)
        self.training, self.seed = training, seed
        self.adam = torch.optim.Adam(module.parameters(), lr=training.rate)
        self.curves: dict[str, list[float]] = {"loss": [], "validation": [], "rse": [], "rate": []}
        self.best = self._weights()
        self._scale = output_deviation(self.samples, self.train)
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
        """One pass over the training rows, then a look at the others."""
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
        settings, losses, initial_rate = self.training, self.curves["validation"], learning_rate(self.training, self.curves["validation"])
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
        targets, mask = self.samples["targets"][self.validation].double(), self.samples["mask"][self.validation][..., None]
        mean = torch.where(mask, targets, 0.0).sum(dim=0) / mask.sum(dim=0).clamp(min=1)
        return max(float(torch.where(mask, (targets - mean) / self._scale, 0.0).square().sum()), 1e-300)

    def _weights(self) -> dict[str, Tensor]:
        return {name: tensor.detach().cpu().clone() for name, tensor in self.module.state_dict().items()}

    # ---- between runs ----------------------------------------------------------------------------------------------

    def state(self) -> dict[str, Tensor]:
        """All tensors that going on needs: weights, the best ones, Adam's moments."""
        tensors = {f"module/{name}": tensor for name, tensor in self._weights().items()}
        tensors |= {f"best/{name}": tensor for name, tensor in self.best.items()}
        for number, moments in self.adam.state_dict()["state"].items():
            tensors |= {f"adam/{number}/{name}": torch.as_tensor(value).cpu() for name, value in moments.items()}
        return tensors

    def restore(self, tensors: dict[str, Tensor], curves: dict[str, list[float]]) -> None:
        """Go back to where `state` was asked."""
        self.module.load_state_dict(_with_prefix(tensors, "module/"))
        self.best = _with_prefix(tensors, "best/")
        moments: dict[int, dict[str, Any]] = {}
        for name, tensor in _with_prefix(tensors, "adam/").items():
            number, _, moment = name.partition("/")
            moments.setdefault(int(number), {})[moment] = tensor
        self.adam.load_state_dict({**self.adam.state_dict(), "state": moments})
        self.curves = {name: list(values) for name, values in curves.items()}


def output_deviation(samples: SampleTensors, rows: Tensor) -> Tensor:
    """Standard deviation of each output over the frames of these rows, (outputs,) float64."""
    target_rows = samples["targets"][rows][samples["mask"][rows]].double()
    standard_deviation = target_rows.std(dim=0, correction=0)
    return torch.where(standard_deviation > 0, standard_deviation, 1.0)


def _batch(samples: SampleTensors, rows: Tensor) -> SampleTensors:
    return {name: tensor[rows] for name, tensor in samples.items()}


def _with_prefix(tensors: dict[str, Tensor], prefix: str) -> dict[str, Tensor]:
    return {name.removeprefix(prefix): tensor for name, tensor in tensors.items() if name.startswith(prefix)}
