"""Recurrent layers with exact derivatives forward in time: what each output does when an input moves.

torch differentiates a recurrent layer backwards, once for each output and frame. A fit needs all of them for a dozen
inputs, so the derivatives are carried forward beside the values: one more row of the same products for each input.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

Both = tuple[Tensor, Tensor]
"""Values (rows, ...) and their derivatives (rows, directions, ...)."""


def recurrent(network: nn.GRU | nn.LSTM, inputs: Tensor, directions: Tensor) -> Both:
    """Outputs of a stack of layers, (rows, frames, hidden), and derivatives, (rows, directions, frames, hidden).

    inputs : (rows, frames, inputs). directions : (rows, directions, frames, inputs), how inputs move.
    """
    cell = _gru if isinstance(network, nn.GRU) else _lstm
    values = torch.cat([inputs[:, None], directions], dim=1)
    for layer in range(network.num_layers):
        weights = [getattr(network, f"{name}_l{layer}") for name in ("weight_ih", "weight_hh", "bias_ih", "bias_hh")]
        values = _layer(cell, values, *weights)
    return values[:, 0], values[:, 1:]


def _layer(cell: object, values: Tensor, w_in: Tensor, w_back: Tensor, b_in: Tensor, b_back: Tensor) -> Tensor:
    """One layer over all frames; (rows, 1 + directions, frames, inputs), the value first."""
    driven = values @ w_in.T
    driven[:, 0] += b_in
    rows, wide, frames, hidden = *values.shape[:3], w_back.shape[1]
    state, memory = (values.new_zeros(rows, wide, hidden) for _ in range(2))
    out = []
    for k in range(frames):
        back = state @ w_back.T
        back[:, 0] += b_back
        state, memory = cell(driven[:, :, k], back, state, memory)  # type: ignore[operator]
        out.append(state)
    return torch.stack(out, dim=2)


def _gru(driven: Tensor, back: Tensor, state: Tensor, memory: Tensor) -> Both:
    """r, z = sigmoid(i + b), n = tanh(i_n + r b_n), h' = (1 - z) n + z h."""
    r_in, z_in, n_in = driven.chunk(3, dim=-1)
    r_back, z_back, n_back = back.chunk(3, dim=-1)
    r, z = _sigmoid(r_in + r_back), _sigmoid(z_in + z_back)
    n = _tanh(n_in + _product(r, n_back))
    return n + _product(z, state - n), memory


def _lstm(driven: Tensor, back: Tensor, state: Tensor, memory: Tensor) -> Both:
    """i, f, o = sigmoid, g = tanh; c' = f c + i g, h' = o tanh c'."""
    i, f, g, o = (driven + back).chunk(4, dim=-1)
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
