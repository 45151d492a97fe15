"""Recurrent layers with exact derivatives forward in time: what each output does when an input moves.

torch differentiates a recurrent layer backwards, once for each output and frame. A fit needs all of them for a dozen
inputs, so the derivatives are carried forward beside the values: one more row of the same products for each input.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

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


def _recurrent_layer(cell: object, values: Tensor, w_in: Tensor, w_hidden: Tensor, b_in: Tensor, b_hidden: Tensor) -> Tensor:
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
