"""Evaluation of the recurrent network of ParameterGru, and of its derivatives, in NumPy and float64.

Derivatives are carried forward with the values: a prediction has hundreds of frames and outputs and a dozen directions,
so that forward mode costs one pass for each direction, and reverse mode one for each frame and output. All directions
share the matrix products of a frame. Arrays of a layer are (frames, 1 + directions, rows, ...): index 0 of the second
axis holds the values, the others their derivatives.

Equations of the cells, of Cho et al. (2014) and Hochreiter and Schmidhuber (1997), in the form of torch.nn:
GRU    r, z = sigmoid(i + h), n = tanh(i_n + r h_n), h' = n + z (h - n)
LSTM   i, f, o = sigmoid(i + h), g = tanh(i_g + h_g), c' = f c + i g, h' = o tanh c'
with i = W_in x + b_in and h = W_hidden h + b_hidden. As sigmoid(x) = (1 + tanh(x/2)) / 2, weights of sigmoid gates are
stored halved, and one tanh serves all gates.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from creepkit.arrays import Floats
from creepkit.errors import SurrogateError

SampleArrays: TypeAlias = dict[str, NDArray[Any]]
"""Arrays whose leading axis is the sample. Always there: "targets" (n, frames, outputs), physical, float32, zero where
there is none; "mask" (n, frames), which frames are data. The rest is the recipe's own: the inputs of its network."""


Weights: TypeAlias = Mapping[str, NDArray[Any]]
"""{name: (...,)} weights and scales of a network, as they stand in its file."""


RecurrentCell = Literal["gru", "lstm"]


GATES = {"gru": 3, "lstm": 4}
"""Gates of a cell: r, z, n; and i, f, g, o, in the order of the rows of their weights."""


HALVED_GATES = {"gru": (0, 1), "lstm": (0, 1, 3)}
"""Those with a sigmoid."""


SCALES = ("constants", "series", "targets")
"""What is standardised."""


FRAMES_IN_BLOCK = 16
"""Frames that all layers go through before the next ones: nothing but states is kept between."""


ROWS_IN_BATCH = 512
"""Rows, times one and the directions, that go through the network together: about what a cache holds."""


@dataclass(frozen=True, eq=False)
class ColumnScale:
    """Standardisation of columns.

    mean, deviation : (columns,) in their units.
    """

    mean: Floats
    deviation: Floats

    def standardised(self, values: Floats) -> Floats:
        """The values without unit, (..., columns); values : (..., columns) in their units."""
        return np.asarray((values - self.mean) / self.deviation)


@dataclass(frozen=True, eq=False)
class RecurrentLayer:
    """Weights of one layer, those of sigmoid gates halved.

    input_weights : (inputs, gates x hidden). hidden_weights : (hidden, gates x hidden). input_bias, hidden_bias :
    (gates x hidden,).
    """

    input_weights: Floats
    hidden_weights: Floats
    input_bias: Floats
    hidden_bias: Floats

    @property
    def hidden(self) -> int:
        """Width."""
        return len(self.hidden_weights)


LayerState = list[Floats]
"""What a layer hands from frame to frame, (1 + directions, rows, hidden) each: h, and c of an LSTM."""


@dataclass(frozen=True, eq=False)
class ParameterNetwork:
    """The trained network: constants and series of tests to outputs in physical units.

    head_weights, head_bias : (hidden, outputs) and (outputs,) of the linear layer behind the recurrent ones.
    constants, series, targets : scales of its inputs and of what it gives. floor, most : of the logarithm of the first
    output (see parameter_network.ParameterModule). logarithm : whether the first output is learnt by its logarithm.
    corrects_base : whether that is the logarithm of its ratio to a base.
    """

    cell: RecurrentCell
    layers: tuple[RecurrentLayer, ...]
    head_weights: Floats
    head_bias: Floats
    constants: ColumnScale
    series: ColumnScale
    targets: ColumnScale
    floor: float
    most: float
    logarithm: bool
    corrects_base: bool

    @classmethod
    def from_weights(
        cls,
        weights: Mapping[str, NDArray[Any]],
        sizes: tuple[int, int, int],
        shape: tuple[RecurrentCell, int, int],
        *,
        logarithm: bool,
        corrects_base: bool,
    ) -> ParameterNetwork:
        """The network of the weights in a file; SurrogateError where their names or shapes are others.

        weights : {name: (...,)} by the names of torch.nn. sizes : numbers of constants, series and outputs. shape : the
        cell, the width and the number of layers.
        """
        (constants, series, outputs), (cell, hidden, depth) = sizes, shape
        series, gates = series + int(corrects_base), GATES[cell] * hidden
        shapes: dict[str, tuple[int, ...]] = {"head.weight": (outputs, hidden), "head.bias": (outputs,)}
        for layer in range(depth):
            shapes[f"network.weight_ih_l{layer}"] = (gates, hidden if layer else constants + series)
            shapes[f"network.weight_hh_l{layer}"] = (gates, hidden)
            shapes[f"network.bias_ih_l{layer}"] = shapes[f"network.bias_hh_l{layer}"] = (gates,)
        for name, columns in zip(SCALES, (constants, series, outputs), strict=True):
            shapes[f"{name}.mean"] = shapes[f"{name}.deviation"] = (columns,)
        shapes |= {"deviation": (outputs,), "spread": (), "floor": (), "most": ()}
        if {name: array.shape for name, array in weights.items()} != shapes:
            raise SurrogateError("its header and its weights do not belong together; train it again")
        arrays = {name: np.asarray(array, float) for name, array in weights.items()}
        return cls(
            cell,
            tuple(_layer(arrays, layer, cell) for layer in range(depth)),
            np.ascontiguousarray(arrays["head.weight"].T),
            arrays["head.bias"],
            **{name: ColumnScale(arrays[f"{name}.mean"], arrays[f"{name}.deviation"]) for name in SCALES},
            floor=float(arrays["floor"]),
            most=float(arrays["most"]),
            logarithm=logarithm or corrects_base,
            corrects_base=corrects_base,
        )

    @property
    def weight_count(self) -> int:
        """Numbers that training fits."""
        layers = (a for w in self.layers for a in (w.input_weights, w.hidden_weights, w.input_bias, w.hidden_bias))
        return sum(array.size for array in (*layers, self.head_weights, self.head_bias))

    def outputs(self, constants: Floats, series: Floats, base: Floats | None = None) -> Floats:
        """(rows, frames, outputs) in physical units.

        constants : (rows, constants), NaN where a coefficient is off. series : (tests, frames, series), those of each
        row in turn: rows are candidates x tests. base : (rows, frames) what is corrected.
        """
        return self.outputs_with_derivatives(constants, series, base)[0]

    def outputs_with_derivatives(
        self, constants: Floats, series: Floats, base: Floats | None = None, directions: Floats | None = None
    ) -> tuple[Floats, Floats]:
        """Outputs (rows, frames, outputs) in physical units, and derivatives (rows, frames, outputs, directions).

        constants : (rows, constants). series : (tests, frames, series). base : (rows, frames); all as for outputs().
        directions : (rows, directions, constants), how constants move; with a base there are none, as that moves too.
        """
        if directions is None:
            directions = np.zeros((len(constants), 0, constants.shape[1]))
        elif self.corrects_base:
            raise SurrogateError("the derivatives of a network that corrects another model are left to differences")
        tests = len(series)
        step = max(1, ROWS_IN_BATCH // ((1 + directions.shape[1]) * tests)) * tests
        values, derivatives = [], []
        for part in (slice(first, first + step) for first in range(0, len(constants), step)):
            base_part = None if base is None else base[part]
            raw = self._standardised_outputs(
                self._constant_inputs(constants[part], directions[part]), self._series_inputs(series, base_part)
            )
            values.append(self._decoded(raw[:, 0], base_part).swapaxes(0, 1))
            slope = self._decoded_derivatives(raw[:, :1])
            derivatives.append(np.moveaxis(raw[:, 1:] * slope, (2, 0, 3, 1), (0, 1, 2, 3)))
        return np.concatenate(values), np.concatenate(derivatives)

    # ---- inputs ------------------------------------------------------------------------------------------------------

    def _constant_inputs(self, constants: Floats, directions: Floats) -> Floats:
        """(1 + directions, rows, constants) standardised; a coefficient that is off stands at zero."""
        standardised = np.nan_to_num(self.constants.standardised(constants), nan=0.0)
        return np.concatenate([standardised[None], np.moveaxis(directions, 1, 0) / self.constants.deviation])

    def _series_inputs(self, series: Floats, base: Floats | None) -> Floats:
        """(frames, tests or rows, series) standardised, with ln of the base where there is one."""
        if self.corrects_base:
            assert base is not None
            candidates = len(base) // len(series)
            log_base = np.log(base + self.floor)[..., None]
            series = np.concatenate([np.tile(series, (candidates, 1, 1)), log_base], axis=-1)
        return self.series.standardised(series).swapaxes(0, 1)

    # ---- layers ------------------------------------------------------------------------------------------------------

    def _standardised_outputs(self, constants: Floats, series: Floats) -> Floats:
        """(frames, 1 + directions, rows, outputs) standardised.

        constants : (1 + directions, rows, constants). series : (frames, tests, series).
        """
        first, (variants, rows, columns) = self.layers[0], constants.shape
        constant_part = _product(constants, first.input_weights[:columns])
        constant_part[0] += first.input_bias
        series_part = _product(series, first.input_weights[columns:])
        repetitions = rows // series.shape[1]
        frames_of_cell: Callable[[RecurrentLayer, Floats, LayerState], Floats]
        frames_of_cell = _gru_frames if self.cell == "gru" else _lstm_frames
        state_count = 1 if self.cell == "gru" else 2
        states = [[np.zeros((variants, rows, w.hidden)) for _ in range(state_count)] for w in self.layers]
        blocks = []
        for start in range(0, len(series), FRAMES_IN_BLOCK):
            block = series_part[start : start + FRAMES_IN_BLOCK]
            inputs = np.tile(constant_part, (len(block), 1, 1, 1))
            inputs[:, 0] += np.tile(block, (1, repetitions, 1))
            values = frames_of_cell(first, inputs, states[0])
            for layer, state in zip(self.layers[1:], states[1:], strict=True):
                inputs = _product(values, layer.input_weights)
                inputs[:, 0] += layer.input_bias
                values = frames_of_cell(layer, inputs, state)
            blocks.append(_product(values, self.head_weights))
        outputs = np.concatenate(blocks)
        outputs[:, 0] += self.head_bias
        return outputs

    # ---- outputs -----------------------------------------------------------------------------------------------------

    def _decoded(self, raw: Floats, base: Floats | None) -> Floats:
        """Physical outputs (frames, rows, outputs) of standardised ones; base : (rows, frames)."""
        outputs = raw * self.targets.deviation + self.targets.mean
        if self.logarithm:
            scale = 1.0 if base is None or not self.corrects_base else base.T + self.floor
            outputs[..., 0] = scale * np.exp(np.minimum(outputs[..., 0], self.most)) - self.floor
        return outputs

    def _decoded_derivatives(self, raw: Floats) -> Floats:
        """Derivative of each physical output to its standardised one, of the shape of raw (..., outputs)."""
        derivatives = np.array(np.broadcast_to(self.targets.deviation, raw.shape))
        if self.logarithm:
            logarithm = raw[..., 0] * self.targets.deviation[0] + self.targets.mean[0]
            derivatives[..., 0] *= np.where(logarithm < self.most, np.exp(np.minimum(logarithm, self.most)), 0.0)
        return derivatives


def _layer(arrays: Mapping[str, Floats], layer: int, cell: RecurrentCell) -> RecurrentLayer:
    """One layer of the weights of a file."""
    hidden = arrays[f"network.weight_hh_l{layer}"].shape[1]
    factor = np.ones((GATES[cell], hidden))
    factor[list(HALVED_GATES[cell])] = 0.5

    def scaled(name: str) -> Floats:
        return np.ascontiguousarray(arrays[f"network.{name}_l{layer}"].T * factor.ravel())

    return RecurrentLayer(scaled("weight_ih"), scaled("weight_hh"), scaled("bias_ih"), scaled("bias_hh"))


def _product(values: Floats, weights: Floats) -> Floats:
    """values (..., inputs) times weights (inputs, outputs) as one matrix product."""
    return np.asarray(values.reshape(-1, len(weights)) @ weights).reshape(*values.shape[:-1], weights.shape[1])


def _gru_frames(layer: RecurrentLayer, inputs: Floats, state: LayerState) -> Floats:
    """(frames, 1 + directions, rows, hidden); `state` is brought to the last frame.

    inputs : (frames, 1 + directions, rows, gates), W_in x + b_in; it is overwritten.
    """
    hidden, result = layer.hidden, np.empty((*inputs.shape[:3], layer.hidden))
    gates = slice(None, 2 * hidden)  # r and z
    h, back = state[0], np.empty(inputs.shape[1:])
    back_rows = back.reshape(-1, inputs.shape[3])
    for k, pre in enumerate(inputs):
        np.matmul(h.reshape(-1, hidden), layer.hidden_weights, out=back_rows)
        back[0] += layer.hidden_bias
        pre[..., gates] += back[..., gates]
        n_back = back[..., 2 * hidden :]
        t = np.tanh(pre[0, :, gates])
        rz = 0.5 + 0.5 * t
        r, z = rz[:, :hidden], rz[:, hidden:]
        n = np.tanh(pre[0, :, 2 * hidden :] + r * n_back[0])
        difference = h[0] - n
        result[k, 0] = n + z * difference
        if len(pre) > 1:
            pre[1:, :, gates] *= 0.5 - 0.5 * t * t
            dr, dz, dn = (pre[1:, :, part * hidden : (part + 1) * hidden] for part in range(3))
            dr *= n_back[0]
            dn += dr
            dn += r * n_back[1:]
            dn *= 1.0 - n * n
            dz *= difference
            dz += dn
            result[k, 1:] = dz + z * (h[1:] - dn)
        h = result[k]
    state[0] = h.copy()
    return result


def _lstm_frames(layer: RecurrentLayer, inputs: Floats, state: LayerState) -> Floats:
    """As _gru_frames, of an LSTM."""
    hidden, result = layer.hidden, np.empty((*inputs.shape[:3], layer.hidden))
    (h, c), back = state, np.empty(inputs.shape[1:])
    back_rows = back.reshape(-1, inputs.shape[3])
    sigmoid = np.ones((4, hidden))
    sigmoid[list(HALVED_GATES["lstm"])] = 0.5
    scale = sigmoid.ravel()
    offset = np.where(scale < 1.0, 0.5, 0.0)
    for k, pre in enumerate(inputs):
        np.matmul(h.reshape(-1, hidden), layer.hidden_weights, out=back_rows)
        pre += back
        pre[0] += layer.hidden_bias
        t = np.tanh(pre[0])
        i, f, g, o = np.split(offset + scale * t, 4, axis=-1)
        memory = np.empty_like(c)
        memory[0] = f * c[0] + i * g
        tanh_memory = np.tanh(memory[0])
        result[k, 0] = o * tanh_memory
        if len(pre) > 1:
            pre[1:] *= scale * (1.0 - t * t)
            di, df, dg, do = np.split(pre[1:], 4, axis=-1)
            memory[1:] = f * c[1:] + df * c[0] + di * g + i * dg
            result[k, 1:] = do * tanh_memory + (o * (1.0 - tanh_memory * tanh_memory)) * memory[1:]
        h, c = result[k], memory
    state[:] = [h.copy(), c]
    return result
