"""The paper's network: a recurrent one that sees the parameters of a law at every frame, and the load there."""

from __future__ import annotations

from typing import Literal

import torch
from torch import Tensor, nn

from creepkit.surrogate.recipe import Module, Samples
from creepkit.surrogate.scaling import Scale

Cell = Literal["gru", "lstm"]

FLOOR = 0.01
"""Share of the median of an output that is added to it before its logarithm is taken: it may begin at zero."""
ROOM = 2.0
"""By how much (of ln) a prediction may exceed the largest value of the training: an exponential must not overflow."""


class ParameterModule(Module):
    """Standardised constants and series into recurrent layers, and a linear layer to standardised outputs.

    samples : "constants" (n, C), NaN where a coefficient is off; "series" (n, frames, S); and "base" (n, frames) where
        the first output is predicted as a correction, ln of the ratio, of that base.

    The loss is Eq. (4) as surrogate.metrics reads it, with the mean square of the training rows below the line, so that
    batches add up to it. Where the first output is learnt by its logarithm, half of the loss is that, and half the mean
    square of what the network itself gives, standardised: Eq. (4) alone is deaf to histories of little creep.
    """

    deviation: Tensor
    spread: Tensor
    floor: Tensor
    most: Tensor

    def __init__(
        self, sizes: tuple[int, int, int], hidden: int, layers: int, cell: Cell, *, logarithm: bool, based: bool
    ) -> None:
        super().__init__()
        constants, series, outputs = sizes
        self.logarithm, self.based = logarithm or based, based
        kind = nn.GRU if cell == "gru" else nn.LSTM
        self.network = kind(constants + series + int(based), hidden, layers, batch_first=True)
        self.head = nn.Linear(hidden, outputs)
        self.constants, self.series = Scale.blank(constants), Scale.blank(series + int(based))
        self.targets = Scale.blank(outputs)
        self.register_buffer("deviation", torch.ones(outputs, dtype=torch.float64))
        for name in ("spread", "floor", "most"):
            self.register_buffer(name, torch.ones((), dtype=torch.float64))

    def fitted(self, samples: Samples, train: Tensor) -> ParameterModule:
        """The same network with the scales of these rows."""
        rows = {name: tensor[train] for name, tensor in samples.items()}
        mask, targets = rows["mask"], rows["targets"]
        data = targets[mask].double()
        self.deviation = Scale.of(data).deviation
        mean = torch.where(mask[..., None], targets, 0.0).double().sum(dim=0) / mask.sum(dim=0).clamp(min=1)[:, None]
        squares = ((targets.double() - mean) / self.deviation).square()
        spread = torch.where(mask[..., None], squares, 0.0).sum() / mask.sum()
        self.spread = torch.where(spread > 0, spread, 1.0)
        first = data[:, 0].abs()
        self.floor = (FLOOR * first[first > 0].median()) if (first > 0).any() else torch.ones(()).double()
        self.constants = Scale.of(rows["constants"])
        self.series = Scale.of(self._series(rows))
        encoded = self._encoded(rows)
        self.targets, self.most = Scale.of(encoded, mask), encoded[mask][:, 0].max().double() + ROOM
        return self

    def forward(self, batch: Samples) -> Tensor:
        """(rows, frames, outputs) in physical units."""
        return self.decoded(self.raw(self.inputs(batch)), batch.get("base"))

    def inputs(self, batch: Samples) -> Tensor:
        """(rows, frames, inputs) standardised; a coefficient that is off stands at zero."""
        constants = torch.nan_to_num(self.constants(batch["constants"]), nan=0.0)
        series = self.series(self._series(batch))
        return torch.cat([constants[:, None].expand(-1, series.shape[1], -1), series], dim=-1)

    def raw(self, inputs: Tensor) -> Tensor:
        """(rows, frames, outputs) standardised."""
        return self.head(self.network(inputs)[0])  # type: ignore[no-any-return]

    def decoded(self, raw: Tensor, base: Tensor | None) -> Tensor:
        """Physical outputs of standardised ones."""
        shown = self.targets.back(raw)
        if not self.logarithm:
            return shown
        first = torch.exp(torch.minimum(shown[..., 0], self.most.to(raw.dtype)))
        floor = self.floor.to(raw.dtype)
        scale = 1.0 if base is None or not self.based else base + floor
        return torch.cat([(scale * first - floor)[..., None], shown[..., 1:]], dim=-1)

    def decoded_slopes(self, raw: Tensor) -> Tensor:
        """(rows, frames, outputs) derivative of physical outputs to standardised ones; without a base."""
        slopes = self.targets.deviation.to(raw.dtype).expand_as(raw)
        if not self.logarithm:
            return slopes
        shown = self.targets.back(raw)[..., 0]
        inside = (shown < self.most) * torch.exp(torch.minimum(shown, self.most.to(raw.dtype)))
        return torch.cat([(inside * slopes[..., 0])[..., None], slopes[..., 1:]], dim=-1)

    def loss(self, batch: Samples) -> Tensor:
        """See the class."""
        return self.judged(batch)[0]

    def judged(self, batch: Samples) -> tuple[Tensor, Tensor]:
        """The loss and the outputs."""
        raw, mask = self.raw(self.inputs(batch)), batch["mask"]
        shown, count = self.decoded(raw, batch.get("base")), mask.sum()
        wrong = (shown - batch["targets"]) / self.deviation.to(shown.dtype)
        loss = _masked_squares(wrong, mask) / (count * self.spread.to(shown.dtype))
        if self.logarithm:
            own = raw - self.targets(self._encoded(batch))
            loss = 0.5 * (loss + _masked_squares(own, mask) / (count * raw.shape[-1]))
        return loss, shown

    def _encoded(self, batch: Samples) -> Tensor:
        """What the network is to give, before it is standardised."""
        targets = batch["targets"]
        if not self.logarithm:
            return targets
        floor = self.floor.to(targets.dtype)
        first = torch.log((targets[..., 0] + floor).clamp(min=1e-3 * float(floor)))
        if self.based:
            first = first - torch.log(batch["base"] + floor)
        return torch.cat([first[..., None], targets[..., 1:]], dim=-1)

    def _series(self, batch: Samples) -> Tensor:
        if not self.based:
            return batch["series"]
        base = torch.log(batch["base"] + self.floor.to(batch["base"].dtype))
        return torch.cat([batch["series"], base[..., None]], dim=-1)


def _masked_squares(values: Tensor, mask: Tensor) -> Tensor:
    return torch.where(mask[..., None], values, 0.0).square().sum()
