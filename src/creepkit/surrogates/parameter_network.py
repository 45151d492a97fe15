"""The recurrent network of ParameterGru, and its forward-mode derivatives.

torch differentiates recurrent layers backwards, once for each output and frame. A fit needs the derivatives to a
dozen inputs at all frames, so they are carried forward with the values.
"""

from __future__ import annotations

from typing import Literal

import torch
from torch import Tensor, nn

from creepkit.surrogates.recipe import SampleTensors, Standardisation, SurrogateModule

RecurrentCell = Literal["gru", "lstm"]


LOG_FLOOR = 0.01
"""Share of the median of an output that is added to it before its logarithm is taken: it may begin at zero."""


LARGEST_LOG_EXCESS = 2.0
"""By how much (of ln) a prediction may exceed the largest value of the training: an exponential must not overflow."""


class ParameterModule(SurrogateModule):
    """Standardised constants and series into recurrent layers, and a linear layer to standardised outputs.

    Its samples are "constants" (n, C), NaN where a coefficient is off; "series" (n, frames, S); and "base" (n, frames)
    where the first output is predicted as a correction, ln of the ratio, of that base.

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

    def __init__(
        self,
        sizes: tuple[int, int, int],
        hidden: int,
        layers: int,
        cell: RecurrentCell,
        *,
        logarithm: bool,
        corrects_base: bool,
    ) -> None:
        super().__init__()
        constants, series, outputs = sizes
        self.logarithm, self.corrects_base = logarithm or corrects_base, corrects_base
        kind = nn.GRU if cell == "gru" else nn.LSTM
        self.network = kind(constants + series + int(corrects_base), hidden, layers, batch_first=True)
        self.head = nn.Linear(hidden, outputs)
        self.constants, self.series = (
            Standardisation.identity(constants),
            Standardisation.identity(series + int(corrects_base)),
        )
        self.targets = Standardisation.identity(outputs)
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
        self.series = Standardisation.from_rows(self._series(rows))
        encoded = self._encoded(rows)
        self.targets, self.most = (
            Standardisation.from_rows(encoded, mask),
            encoded[mask][:, 0].max().double() + LARGEST_LOG_EXCESS,
        )
        return self

    def forward(self, batch: SampleTensors) -> Tensor:
        """(rows, frames, outputs) in physical units."""
        return self.decoded(self.standardised_outputs(self.standardised_inputs(batch)), batch.get("base"))

    def standardised_inputs(self, batch: SampleTensors) -> Tensor:
        """(rows, frames, inputs) standardised; a coefficient that is off stands at zero."""
        constants = torch.nan_to_num(self.constants(batch["constants"]), nan=0.0)
        series = self.series(self._series(batch))
        return torch.cat([constants[:, None].expand(-1, series.shape[1], -1), series], dim=-1)

    def standardised_outputs(self, inputs: Tensor) -> Tensor:
        """(rows, frames, outputs) standardised, of inputs (rows, frames, inputs)."""
        return self.head(self.network(inputs)[0])  # type: ignore[no-any-return]

    def decoded(self, raw: Tensor, base: Tensor | None) -> Tensor:
        """Physical outputs (rows, frames, outputs) of standardised ones.

        raw : (rows, frames, outputs). base : (rows, frames) what is corrected, or None.
        """
        outputs = self.targets.inverse(raw)
        if not self.logarithm:
            return outputs
        first = torch.exp(torch.minimum(outputs[..., 0], self.most.to(raw.dtype)))
        floor = self.floor.to(raw.dtype)
        scale = 1.0 if base is None or not self.corrects_base else base + floor
        return torch.cat([(scale * first - floor)[..., None], outputs[..., 1:]], dim=-1)

    def decoded_derivatives(self, raw: Tensor) -> Tensor:
        """(rows, frames, outputs) derivative of physical outputs to standardised ones, raw (rows, frames, outputs)."""
        derivatives = self.targets.deviation.to(raw.dtype).expand_as(raw)
        if not self.logarithm:
            return derivatives
        log_output = self.targets.inverse(raw)[..., 0]
        inside = (log_output < self.most) * torch.exp(torch.minimum(log_output, self.most.to(raw.dtype)))
        return torch.cat([(inside * derivatives[..., 0])[..., None], derivatives[..., 1:]], dim=-1)

    def loss(self, batch: SampleTensors) -> Tensor:
        """A number: see the class."""
        return self.loss_and_outputs(batch)[0]

    def loss_and_outputs(self, batch: SampleTensors) -> tuple[Tensor, Tensor]:
        """The loss, a number, and the outputs (rows, frames, outputs)."""
        raw, mask = self.standardised_outputs(self.standardised_inputs(batch)), batch["mask"]
        outputs, count = self.decoded(raw, batch.get("base")), mask.sum()
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
        first = torch.log((targets[..., 0] + floor).clamp(min=1e-3 * float(floor)))
        if self.corrects_base:
            first = first - torch.log(batch["base"] + floor)
        return torch.cat([first[..., None], targets[..., 1:]], dim=-1)

    def _series(self, batch: SampleTensors) -> Tensor:
        if not self.corrects_base:
            return batch["series"]
        base = torch.log(batch["base"] + self.floor.to(batch["base"].dtype))
        return torch.cat([batch["series"], base[..., None]], dim=-1)


def _masked_squares(values: Tensor, mask: Tensor) -> Tensor:
    return torch.where(mask[..., None], values, 0.0).square().sum()


ValuesAndDerivatives = tuple[Tensor, Tensor]
"""Values (rows, ...) and their derivatives (rows, directions, ...)."""


def recurrent_with_derivatives(network: nn.GRU | nn.LSTM, inputs: Tensor, directions: Tensor) -> ValuesAndDerivatives:
    """Outputs of a stack of layers, (rows, frames, hidden), and derivatives, (rows, directions, frames, hidden).

    inputs : (rows, frames, inputs). directions : (rows, directions, frames, inputs), how inputs move.
    """
    cell = _gru_step if isinstance(network, nn.GRU) else _lstm_step
    values = torch.cat([inputs[:, None], directions], dim=1)
    for layer in range(network.num_layers):
        weights = [getattr(network, f"{name}_l{layer}") for name in ("weight_ih", "weight_hh", "bias_ih", "bias_hh")]
        values = _recurrent_layer(cell, values, *weights)
    return values[:, 0], values[:, 1:]


def _recurrent_layer(
    cell: object, values: Tensor, w_in: Tensor, w_hidden: Tensor, b_in: Tensor, b_hidden: Tensor
) -> Tensor:
    """One layer over all frames; (rows, 1 + directions, frames, inputs), the value first."""
    input_part = values @ w_in.T
    input_part[:, 0] += b_in
    rows, width, frames, hidden = *values.shape[:3], w_hidden.shape[1]
    state, memory = (values.new_zeros(rows, width, hidden) for _ in range(2))
    states = []
    for k in range(frames):
        hidden_part = state @ w_hidden.T
        hidden_part[:, 0] += b_hidden
        state, memory = cell(input_part[:, :, k], hidden_part, state, memory)  # type: ignore[operator]
        states.append(state)
    return torch.stack(states, dim=2)


def _gru_step(input_part: Tensor, hidden_part: Tensor, state: Tensor, memory: Tensor) -> ValuesAndDerivatives:
    """r, z = sigmoid(i + b), n = tanh(i_n + r b_n), h' = (1 - z) n + z h."""
    r_in, z_in, n_in = input_part.chunk(3, dim=-1)
    r_back, z_back, n_back = hidden_part.chunk(3, dim=-1)
    r, z = _sigmoid(r_in + r_back), _sigmoid(z_in + z_back)
    n = _tanh(n_in + _product(r, n_back))
    return n + _product(z, state - n), memory


def _lstm_step(input_part: Tensor, hidden_part: Tensor, state: Tensor, memory: Tensor) -> ValuesAndDerivatives:
    """i, f, o = sigmoid, g = tanh; c' = f c + i g, h' = o tanh c'."""
    i, f, g, o = (input_part + hidden_part).chunk(4, dim=-1)
    memory = _product(_sigmoid(f), memory) + _product(_sigmoid(i), _tanh(g))
    return _product(_sigmoid(o), _tanh(memory)), memory


# ---- functions of values that carry their derivatives, (rows, 1 + directions, hidden) --------------------------------


def _sigmoid(x: Tensor) -> Tensor:
    value = torch.sigmoid(x[:, :1])
    return torch.cat([value, value * (1.0 - value) * x[:, 1:]], dim=1)


def _tanh(x: Tensor) -> Tensor:
    value = torch.tanh(x[:, :1])
    return torch.cat([value, (1.0 - value * value) * x[:, 1:]], dim=1)


def _product(a: Tensor, b: Tensor) -> Tensor:
    return torch.cat([a[:, :1] * b[:, :1], a[:, 1:] * b[:, :1] + a[:, :1] * b[:, 1:]], dim=1)
