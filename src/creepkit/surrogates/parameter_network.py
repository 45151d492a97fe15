"""The network of ParameterGru as training fits it, in torch, and the standardisation of its inputs.

What is trained predicts without torch; see network_evaluation.
"""

from __future__ import annotations

from typing import TypeAlias

import torch
from torch import Tensor, nn

from creepkit.surrogates.network_evaluation import SampleArrays, Weights

SampleTensors: TypeAlias = dict[str, Tensor]
"""recipe.SampleArrays as tensors."""


def sample_tensors(samples: SampleArrays) -> SampleTensors:
    """The same numbers as tensors."""
    return {name: torch.from_numpy(array) for name, array in samples.items()}


def weights_of(tensors: dict[str, Tensor]) -> Weights:
    """{name: (...,)} arrays of the state of a module; tensors : {name: (...,)}."""
    return {name: tensor.detach().cpu().numpy() for name, tensor in tensors.items()}


CONSTANT_TOLERANCE = 1e-6
"""A standard deviation below this share of the largest value is rounding: the column is constant."""


class Standardisation(nn.Module):
    """Standardises the last axis; its scales are buffers, float64, saved with the weights.

    mean, deviation : (columns,) of the training rows.
    A column that is constant in training is only shifted: its standardised value is zero, and the applicability
    domain refuses others.
    """

    mean: Tensor
    deviation: Tensor

    def __init__(self, columns: int) -> None:
        """A scale that changes nothing."""
        super().__init__()
        self.register_buffer("mean", torch.zeros(columns).double())
        self.register_buffer("deviation", torch.ones(columns).double())

    @classmethod
    def from_rows(cls, values: Tensor, mask: Tensor | None = None) -> Standardisation:
        """The scale of columns; NaN counts nowhere.

        values : (..., columns). mask : (...,) which rows count.
        """
        rows = (values[mask] if mask is not None else values.reshape(-1, values.shape[-1])).double()
        mean = torch.nan_to_num(rows.nanmean(dim=0), nan=0.0)
        deviation = torch.nan_to_num((rows - mean).square().nanmean(dim=0).sqrt(), nan=0.0)
        constant = deviation <= CONSTANT_TOLERANCE * torch.nan_to_num(rows, nan=0.0).abs().amax(dim=0)
        scale = cls(rows.shape[-1])
        scale.mean, scale.deviation = mean, torch.where(constant, 1.0, deviation)
        return scale

    def forward(self, values: Tensor) -> Tensor:
        """The values (..., columns), standardised."""
        return (values - self.mean.to(values.dtype)) / self.deviation.to(values.dtype)

    def inverse(self, values: Tensor) -> Tensor:
        """Physical values, (..., columns), of standardised values (..., columns)."""
        return values * self.deviation.to(values.dtype) + self.mean.to(values.dtype)


LOG_FLOOR = 0.01
"""Share of the median of an output that is added to it before its logarithm is taken: it may begin at zero."""


LARGEST_LOG_EXCESS = 2.0
"""By how much (of ln) a prediction may exceed the largest value of the training: an exponential must not overflow."""


class ParameterModule(nn.Module):
    """Standardised constants and series into recurrent layers, and a linear layer to standardised outputs.

    Its samples are "constants" (n, C), NaN where a coefficient is off, and "series" (n, frames, S).

    deviation : (outputs,) of the training rows, in physical units. spread, floor, most : (...) scalars, the mean square
    of the training rows, the floor of the logarithm, and its greatest value.

    The loss is Eq. (4) as surrogates.evaluation reads it, divided by the mean square of the training rows, so that
    batches add up to it. Where the first output is learnt by its logarithm, half of the loss is that, and half the mean
    square of what the network itself gives, standardised: Eq. (4) alone ignores histories of little creep.
    """

    deviation: Tensor
    spread: Tensor
    floor: Tensor
    most: Tensor

    def __init__(self, sizes: tuple[int, int, int], hidden: int, layers: int, *, logarithm: bool) -> None:
        super().__init__()
        constants, series, outputs = sizes
        self.logarithm = logarithm
        self.network = nn.GRU(constants + series, hidden, layers, batch_first=True)
        self.head = nn.Linear(hidden, outputs)
        self.constants, self.series, self.targets = map(Standardisation, sizes)
        self.register_buffer("deviation", torch.ones(outputs, dtype=torch.float64))
        for name in ("spread", "floor", "most"):
            self.register_buffer(name, torch.ones((), dtype=torch.float64))

    def with_scales(self, samples: SampleTensors, train: Tensor) -> ParameterModule:
        """The same network with the scales of the training rows train (n,)."""
        rows = {name: tensor[train] for name, tensor in samples.items()}
        mask, targets = rows["mask"], rows["targets"]
        data = targets[mask].double()
        self.deviation = Standardisation.from_rows(data).deviation
        mean = torch.where(mask[..., None], targets, 0.0).double().sum(dim=0) / mask.sum(dim=0).clamp(min=1)[:, None]
        squares = ((targets.double() - mean) / self.deviation).square()
        spread = torch.where(mask[..., None], squares, 0.0).sum() / mask.sum()
        self.spread = torch.where(spread > 0, spread, 1.0)
        first = data[:, 0].abs()
        self.floor = (LOG_FLOOR * first[first > 0].median()) if (first > 0).any() else torch.ones(()).double()
        self.constants = Standardisation.from_rows(rows["constants"])
        self.series = Standardisation.from_rows(rows["series"])
        encoded = self._encoded(rows)
        self.targets = Standardisation.from_rows(encoded, mask)
        self.most = encoded[mask][:, 0].max().double() + LARGEST_LOG_EXCESS
        return self

    def forward(self, batch: SampleTensors) -> Tensor:
        """(rows, frames, outputs) in physical units."""
        return self.decoded(self.standardised_outputs(self.standardised_inputs(batch)))

    def standardised_inputs(self, batch: SampleTensors) -> Tensor:
        """(rows, frames, inputs) standardised; a coefficient that is off stands at zero."""
        constants = torch.nan_to_num(self.constants(batch["constants"]), nan=0.0)
        series = self.series(batch["series"])
        return torch.cat([constants[:, None].expand(-1, series.shape[1], -1), series], dim=-1)

    def standardised_outputs(self, inputs: Tensor) -> Tensor:
        """(rows, frames, outputs) standardised, of inputs (rows, frames, inputs), in their precision.

        Under autocast the layers alone are in less.
        """
        return self.head(self.network(inputs)[0]).to(inputs.dtype)  # type: ignore[no-any-return]

    def decoded(self, raw: Tensor) -> Tensor:
        """Physical outputs (rows, frames, outputs) of standardised ones, raw (rows, frames, outputs)."""
        outputs = self.targets.inverse(raw)
        if not self.logarithm:
            return outputs
        first = torch.exp(torch.minimum(outputs[..., 0], self.most.to(raw.dtype)))
        return torch.cat([(first - self.floor.to(raw.dtype))[..., None], outputs[..., 1:]], dim=-1)

    def loss(self, batch: SampleTensors) -> Tensor:
        """A number: see the class."""
        return self.loss_and_outputs(batch)[0]

    def loss_and_outputs(self, batch: SampleTensors) -> tuple[Tensor, Tensor]:
        """The loss, a number, and the outputs (rows, frames, outputs)."""
        raw, mask = self.standardised_outputs(self.standardised_inputs(batch)), batch["mask"]
        outputs, count = self.decoded(raw), mask.sum()
        errors = (outputs - batch["targets"]) / self.deviation.to(outputs.dtype)
        loss = _masked_squares(errors, mask) / (count * self.spread.to(outputs.dtype))
        if self.logarithm:
            standardised_errors = raw - self.targets(self._encoded(batch))
            loss = 0.5 * (loss + _masked_squares(standardised_errors, mask) / (count * raw.shape[-1]))
        return loss, outputs

    def _encoded(self, batch: SampleTensors) -> Tensor:
        """What the network is to give, before it is standardised."""
        targets = batch["targets"]
        if not self.logarithm:
            return targets
        floor = self.floor.to(targets.dtype)
        first = torch.log(torch.maximum(targets[..., 0] + floor, 1e-3 * floor))
        return torch.cat([first[..., None], targets[..., 1:]], dim=-1)


def _masked_squares(values: Tensor, mask: Tensor) -> Tensor:
    return torch.where(mask[..., None], values, 0.0).square().sum()
