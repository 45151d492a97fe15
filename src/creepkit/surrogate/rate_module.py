"""The network of RateNet: at every node, by how much the one-degree-of-freedom model is wrong there."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from creepkit.surrogate.recipe import SurrogateModule, SampleTensors

BASE_COLUMNS = ("elastic", "creep", "width", "shape")
"""Columns of "base", what is corrected: mm, mm, mm and a number."""
CREEP_CORRECTION_SCALE, SHAPE_CORRECTION_SCALE = 0.1, 0.05
"""What 1 out of the network stands for: in ln of the creep deflection, and in mm of width or in shape."""
AMPLITUDE_ERROR, SHAPE_ERROR, AMPLITUDE_FLOOR = 0.01, 0.07, 0.01
"""Errors that count alike in training: relative to the amplitude plus a floor (mm, twice what cameras resolve), and of
width (mm) or shape.
"""
_LARGEST_INPUT = 6.0
"""Standard deviations that the network looks at."""


class RateModule(SurrogateModule):
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

    def with_scales(self, samples: SampleTensors, train: Tensor) -> RateModule:
        """Itself, with scales of the nodes of the training rows."""
        rows = samples["inputs"][train][samples["nodes"][train]].double()
        self.mean.copy_(rows.mean(dim=0))
        self.deviation.copy_(rows.std(dim=0).clamp(min=1e-4))
        return self

    def at_nodes(self, inputs: Tensor, base: Tensor) -> Tensor:
        """Amplitude, width and shape, (rows, nodes, 3), from inputs and what is corrected (rows, nodes, 4)."""
        inputs = inputs.to(self.last.weight.dtype)
        correction = self.last(self.layers(((inputs - self.mean) / self.deviation).clamp(-_LARGEST_INPUT, _LARGEST_INPUT)))
        elastic, creep, width, shape = base.unbind(dim=-1)
        amplitude = elastic + creep * torch.exp(CREEP_CORRECTION_SCALE * correction[..., 0])
        return torch.stack([amplitude, width + SHAPE_CORRECTION_SCALE * correction[..., 1], shape + SHAPE_CORRECTION_SCALE * correction[..., 2]], dim=-1)

    def derivatives(self, inputs: Tensor, base: Tensor, input_directions: Tensor, base_directions: Tensor) -> Tensor:
        """Derivatives of `at_nodes`, (directions, rows, nodes, 3), along those of what it is given."""
        dtype = self.last.weight.dtype
        values = (inputs.to(dtype) - self.mean) / self.deviation
        derivatives = input_directions.to(dtype) * ((values.abs() < _LARGEST_INPUT) / self.deviation)
        values = values.clamp(-_LARGEST_INPUT, _LARGEST_INPUT)
        for layer in self.layers:
            if isinstance(layer, nn.Linear):
                values, derivatives = layer(values), derivatives @ layer.weight.T
            else:
                activation = torch.sigmoid(values)
                values, derivatives = values * activation, derivatives * (activation * (1.0 + values * (1.0 - activation)))
        correction, derivatives = self.last(values), derivatives @ self.last.weight.T
        creep_factor = torch.exp(CREEP_CORRECTION_SCALE * correction[..., 0])
        elastic, creep, width, shape = base_directions.unbind(dim=-1)
        amplitude = elastic + creep_factor * (creep + base[..., 1] * CREEP_CORRECTION_SCALE * derivatives[..., 0])
        return torch.stack([amplitude, width + SHAPE_CORRECTION_SCALE * derivatives[..., 1], shape + SHAPE_CORRECTION_SCALE * derivatives[..., 2]], dim=-1)

    def forward(self, batch: SampleTensors) -> Tensor:
        """(rows, frames, 3) at the times of the data."""
        return batch["frames"] @ self.at_nodes(batch["inputs"], batch["base"])

    def loss(self, batch: SampleTensors) -> Tensor:
        """Mean square of the errors over those that count alike."""
        return self._mean_square_error(self(batch), batch)

    def loss_and_outputs(self, batch: SampleTensors) -> tuple[Tensor, Tensor]:
        """Loss and outputs."""
        outputs = self(batch)
        return self._mean_square_error(outputs, batch), outputs

    def _mean_square_error(self, outputs: Tensor, batch: SampleTensors) -> Tensor:
        targets, mask = batch["targets"], batch["mask"].to(outputs.dtype)
        error = outputs - targets
        scale = torch.full_like(error, SHAPE_ERROR)
        scale[..., 0] = AMPLITUDE_ERROR * (targets[..., 0] + AMPLITUDE_FLOOR)
        return (((error / scale) ** 2).sum(dim=-1) * mask).sum() / mask.sum().clamp(min=1.0)
