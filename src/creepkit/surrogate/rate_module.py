"""The network of RateNet: at every node, by how much the one-degree-of-freedom model is wrong there."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from creepkit.surrogate.recipe import Module, Samples

BASE = ("elastic", "creep", "width", "shape")
"""Columns of "base", what is corrected: mm, mm, mm and a number."""
GROWTH, SHAPE = 0.1, 0.05
"""What 1 out of the network stands for: in ln of the creep deflection, and in mm of width or in shape."""
AMPLITUDE_ERROR, SHAPE_ERROR, FLOOR = 0.01, 0.07, 0.01
"""Errors that count alike in training: relative to the amplitude plus a floor (mm, twice what cameras resolve), and of
width (mm) or shape.
"""
_FARTHEST = 6.0
"""Standard deviations that the network looks at."""


class RateModule(Module):
    """Layers of SiLU on standardised inputs; its last layer starts at zero, so that training begins at the base."""

    mean: Tensor
    deviation: Tensor

    def __init__(self, inputs: int, hidden: int, layers: int) -> None:
        super().__init__()
        self.register_buffer("mean", torch.zeros(inputs))
        self.register_buffer("deviation", torch.ones(inputs))
        widths = [inputs, *[hidden] * layers]
        parts: list[nn.Module] = []
        for k in range(layers):
            parts += [nn.Linear(widths[k], widths[k + 1]), nn.SiLU()]
        self.last = nn.Linear(widths[-1], 3)
        nn.init.zeros_(self.last.weight)
        nn.init.zeros_(self.last.bias)
        self.layers = nn.Sequential(*parts)

    def fitted(self, samples: Samples, train: Tensor) -> RateModule:
        """Itself, with scales of the nodes of the training rows."""
        seen = samples["inputs"][train][samples["nodes"][train]].double()
        self.mean.copy_(seen.mean(dim=0))
        self.deviation.copy_(seen.std(dim=0).clamp(min=1e-4))
        return self

    def at_nodes(self, inputs: Tensor, base: Tensor) -> Tensor:
        """Amplitude, width and shape, (rows, nodes, 3), from inputs and what is corrected (rows, nodes, 4)."""
        inputs = inputs.to(self.last.weight.dtype)
        said = self.last(self.layers(((inputs - self.mean) / self.deviation).clamp(-_FARTHEST, _FARTHEST)))
        elastic, creep, width, shape = base.unbind(dim=-1)
        amplitude = elastic + creep * torch.exp(GROWTH * said[..., 0])
        return torch.stack([amplitude, width + SHAPE * said[..., 1], shape + SHAPE * said[..., 2]], dim=-1)

    def slopes(self, inputs: Tensor, base: Tensor, moved: Tensor, base_moved: Tensor) -> Tensor:
        """Derivatives of `at_nodes`, (directions, rows, nodes, 3), along those of what it is given."""
        kind = self.last.weight.dtype
        seen = (inputs.to(kind) - self.mean) / self.deviation
        along = moved.to(kind) * ((seen.abs() < _FARTHEST) / self.deviation)
        seen = seen.clamp(-_FARTHEST, _FARTHEST)
        for layer in self.layers:
            if isinstance(layer, nn.Linear):
                seen, along = layer(seen), along @ layer.weight.T
            else:
                bent = torch.sigmoid(seen)
                seen, along = seen * bent, along * (bent * (1.0 + seen * (1.0 - bent)))
        said, along = self.last(seen), along @ self.last.weight.T
        growth = torch.exp(GROWTH * said[..., 0])
        elastic, creep, width, shape = base_moved.unbind(dim=-1)
        amplitude = elastic + growth * (creep + base[..., 1] * GROWTH * along[..., 0])
        return torch.stack([amplitude, width + SHAPE * along[..., 1], shape + SHAPE * along[..., 2]], dim=-1)

    def forward(self, batch: Samples) -> Tensor:
        """(rows, frames, 3) at the times of the data."""
        return batch["frames"] @ self.at_nodes(batch["inputs"], batch["base"])

    def loss(self, batch: Samples) -> Tensor:
        """Mean square of the errors over those that count alike."""
        return self._misfit(self(batch), batch)

    def judged(self, batch: Samples) -> tuple[Tensor, Tensor]:
        """Loss and outputs."""
        shown = self(batch)
        return self._misfit(shown, batch), shown

    def _misfit(self, shown: Tensor, batch: Samples) -> Tensor:
        true, seen = batch["targets"], batch["mask"].to(shown.dtype)
        error = shown - true
        scale = torch.full_like(error, SHAPE_ERROR)
        scale[..., 0] = AMPLITUDE_ERROR * (true[..., 0] + FLOOR)
        return (((error / scale) ** 2).sum(dim=-1) * seen).sum() / seen.sum().clamp(min=1.0)
