"""Inputs and network of RateNet: rate features along the path of the reduced-order model, and its correction.

Times, rates and stresses enter as ratios only, so that inputs do not depend on the length of the test or the units of
the law.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from creepkit.specimens.bulge.reduced_order.step_equations import TRAJECTORY_COLUMNS
from creepkit.surrogates.parameter_network import SampleTensors, SurrogateModule

FEATURE_START = len(TRAJECTORY_COLUMNS)
"""First column of the features in a trajectory."""


LOCAL_INPUTS = (
    "ln P/E",
    "log10 age",
    "ln D",
    "ln D/D_elastic",
    "stress exponent",
    "strain exponent",
    "fast",
    "slow",
    "ln multiplier",
    "log10 strain/(rate time)",
    "apex thickness",
)
"""What is known at a node beside the features; see TRAJECTORY_COLUMNS for what they are made of."""


MEMORY_STRAIN = 1.0
"""Elastic strains of creep over which a stress field loses its history: the decay of the exponential means."""


_LOAD, _AGE, _DEFLECTION, _TINY = 1e-6, 1e-3, 1e-4, 1e-12
"""Floors: P/E; creep strain over elastic strain; mm, a tenth of a micron; mm or strain."""


_LARGEST_EXPONENT = 20.0
"""Exponents are bent towards it."""


def input_names(features: int) -> tuple[str, ...]:
    """The inputs in their order: at the node, the mean over the creep so far, and features in a fading mean."""
    local_names = (*(f"feature {k + 1}" for k in range(features)), *LOCAL_INPUTS)
    return (*local_names, *(f"mean {n}" for n in local_names), *(f"fading {n}" for n in local_names[:features]))


def network_inputs(trajectory: Tensor, thickness: Tensor) -> Tensor:
    """(rows, nodes, inputs) of the network.

    trajectory : (rows, nodes, columns). thickness : (rows,) mm, of the apex.
    """
    return with_running_means(trajectory, local_inputs(trajectory, thickness))


def with_running_means(trajectory: Tensor, local_values: Tensor) -> Tensor:
    """(rows, nodes, inputs): what is known at each node alone, and running means of it.

    trajectory : (rows, nodes, columns). local_values : (rows, nodes, features + LOCAL).
    """
    features = trajectory.shape[-1] - FEATURE_START
    creep_increments = torch.diff(
        _column(trajectory, "creep"), dim=1, prepend=torch.zeros_like(trajectory[:, :1, 0])
    ).clamp(min=_TINY)
    mean = (local_values * creep_increments[..., None]).cumsum(dim=1) / creep_increments.cumsum(dim=1)[..., None]
    return torch.cat(
        [local_values, mean, _exponential_means(local_values[..., :features], _column(trajectory, "age"))], dim=-1
    )


def local_inputs(trajectory: Tensor, thickness: Tensor) -> Tensor:
    """(rows, nodes, features + LOCAL) what is known at each node alone.

    trajectory : (rows, nodes, columns). thickness : (rows,) mm, of the apex.
    """

    def column(name: str) -> Tensor:
        return _column(trajectory, name)

    amplitude, elastic = column("amplitude"), column("elastic")
    strain_ratio = torch.log10((column("strain") + _TINY) / (column("time") + 1.0)) - column("log_rate")
    columns = (
        torch.log(column("pressure") / column("modulus") + _LOAD),
        torch.log10(column("age") + _AGE),
        torch.log(amplitude + _DEFLECTION),
        torch.log((amplitude + _DEFLECTION) / (elastic + _DEFLECTION)),
        _saturated(column("exponent"), _LARGEST_EXPONENT),
        _saturated(column("hardening"), _LARGEST_EXPONENT),
        column("fast"),
        column("slow"),
        column("log_multiplier"),
        _saturated(strain_ratio, 3.0),
        thickness[:, None].expand_as(amplitude),
    )
    return torch.cat([trajectory[..., FEATURE_START:], torch.stack(columns, dim=-1)], dim=-1)


def _column(trajectory: Tensor, name: str) -> Tensor:
    return trajectory[..., TRAJECTORY_COLUMNS.index(name)]


def _saturated(x: Tensor, largest: float) -> Tensor:
    """x for small ones, never beyond the largest."""
    return x / torch.sqrt(1.0 + (x / largest) ** 2)


def _exponential_means(features: Tensor, age: Tensor) -> Tensor:
    """Exponential means of features that decay over an elastic strain of creep: m_k = l_k m_{k-1} + (1 - l_k) f_k.

    Spans of 1, 2, 4 ... steps are joined until each reaches back to the first node.
    """
    decay = torch.exp(-torch.diff(age, dim=1).clamp(min=0.0) / MEMORY_STRAIN)[..., None]
    decay = torch.cat([torch.zeros_like(decay[:, :1]), decay], dim=1)
    means, span = (1.0 - decay) * features, 1
    while span < features.shape[1]:
        combined = torch.addcmul(means[:, span:], decay[:, span:], means[:, :-span])
        means = torch.cat([means[:, :span], combined], dim=1)
        decay = torch.cat([decay[:, :span], decay[:, span:] * decay[:, :-span]], dim=1)
        span *= 2
    return means


BASE_COLUMNS = ("elastic", "creep", "width", "shape")
"""Columns of "base", what is corrected: mm, mm, mm and a number."""


CREEP_CORRECTION_SCALE, SHAPE_CORRECTION_SCALE = 0.1, 0.05
"""What 1 out of the network stands for: in ln of the creep deflection, and in mm of width or in shape."""


AMPLITUDE_ERROR, SHAPE_ERROR, AMPLITUDE_FLOOR = 0.01, 0.07, 0.01
"""Errors that count alike in training: relative to the amplitude plus a floor (mm, twice what cameras resolve), and of
width (mm) or shape.
"""


_LARGEST_INPUT = 6.0
"""Standard deviations to which inputs are limited."""


class RateModule(SurrogateModule):
    """Layers of SiLU on standardised inputs; its last layer starts at zero, so that training begins at the base.

    mean, deviation : (inputs,) of the training rows.
    """

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
        """Itself, with scales of the nodes of the training rows train (n,)."""
        rows = samples["inputs"][train][samples["nodes"][train]].double()
        self.mean.copy_(rows.mean(dim=0))
        self.deviation.copy_(rows.std(dim=0).clamp(min=1e-4))
        return self

    def at_nodes(self, inputs: Tensor, base: Tensor) -> Tensor:
        """Amplitude, width and shape, (rows, nodes, 3).

        inputs : (rows, nodes, inputs). base : (rows, nodes, 4) what is corrected.
        """
        inputs = inputs.to(self.last.weight.dtype)
        correction = self.last(
            self.layers(((inputs - self.mean) / self.deviation).clamp(-_LARGEST_INPUT, _LARGEST_INPUT))
        )
        elastic, creep, width, shape = base.unbind(dim=-1)
        amplitude = elastic + creep * torch.exp(CREEP_CORRECTION_SCALE * correction[..., 0])
        return torch.stack(
            [
                amplitude,
                width + SHAPE_CORRECTION_SCALE * correction[..., 1],
                shape + SHAPE_CORRECTION_SCALE * correction[..., 2],
            ],
            dim=-1,
        )

    def derivatives(self, inputs: Tensor, base: Tensor, input_directions: Tensor, base_directions: Tensor) -> Tensor:
        """Derivatives of `at_nodes`, (directions, rows, nodes, 3).

        inputs, base : as there, (rows, nodes, ...). input_directions, base_directions : (directions, rows, nodes, ...).
        """
        dtype = self.last.weight.dtype
        values = (inputs.to(dtype) - self.mean) / self.deviation
        derivatives = input_directions.to(dtype) * ((values.abs() < _LARGEST_INPUT) / self.deviation)
        values = values.clamp(-_LARGEST_INPUT, _LARGEST_INPUT)
        for layer in self.layers:
            if isinstance(layer, nn.Linear):
                values, derivatives = layer(values), derivatives @ layer.weight.T
            else:
                activation = torch.sigmoid(values)
                values, derivatives = (
                    values * activation,
                    derivatives * (activation * (1.0 + values * (1.0 - activation))),
                )
        correction, derivatives = self.last(values), derivatives @ self.last.weight.T
        creep_factor = torch.exp(CREEP_CORRECTION_SCALE * correction[..., 0])
        elastic, creep, width, shape = base_directions.unbind(dim=-1)
        amplitude = elastic + creep_factor * (creep + base[..., 1] * CREEP_CORRECTION_SCALE * derivatives[..., 0])
        return torch.stack(
            [
                amplitude,
                width + SHAPE_CORRECTION_SCALE * derivatives[..., 1],
                shape + SHAPE_CORRECTION_SCALE * derivatives[..., 2],
            ],
            dim=-1,
        )

    def forward(self, batch: SampleTensors) -> Tensor:
        """(rows, frames, 3) at the times of the data."""
        return batch["frames"] @ self.at_nodes(batch["inputs"], batch["base"])

    def loss(self, batch: SampleTensors) -> Tensor:
        """A number: the mean square of the errors at the frames that are data."""
        return self._mean_square_error(self(batch), batch)

    def loss_and_outputs(self, batch: SampleTensors) -> tuple[Tensor, Tensor]:
        """The loss, a number, and the outputs (rows, frames, 3)."""
        outputs = self(batch)
        return self._mean_square_error(outputs, batch), outputs

    def _mean_square_error(self, outputs: Tensor, batch: SampleTensors) -> Tensor:
        targets, mask = batch["targets"], batch["mask"].to(outputs.dtype)
        error = outputs - targets
        scale = torch.full_like(error, SHAPE_ERROR)
        scale[..., 0] = AMPLITUDE_ERROR * (targets[..., 0] + AMPLITUDE_FLOOR)
        return (((error / scale) ** 2).sum(dim=-1) * mask).sum() / mask.sum().clamp(min=1.0)
