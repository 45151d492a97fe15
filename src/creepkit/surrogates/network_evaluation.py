"""Evaluation of the recurrent network of ParameterGru, and of its derivatives, in NumPy.

Derivatives are carried forward with the values: a prediction has hundreds of frames and outputs and a dozen directions,
so that forward mode costs one pass for each direction, and reverse mode one for each frame and output. All directions
share the matrix products of a frame. Arrays of a layer are (frames, 1 + directions, rows, ...): index 0 of the second
axis holds the values, the others their derivatives.

Equations of the gated recurrent unit of Cho et al. (2014) in the form of torch.nn.GRU,

    r, z = sigmoid(i + h), n = tanh(i_n + r h_n), h' = n + z (h - n)

with i = W_in x + b_in and h = W_hidden h + b_hidden. As sigmoid(x) = (1 + tanh(x/2)) / 2, weights of the gates r and z
are stored halved, and tanh serves all three. Both biases of these gates are one.

The recurrence is in double precision, which fits need, or in single, whose outputs differ by some 1e-6 of them, far
less than a network errs, in less than half the time.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from creepkit.arrays import Floats
from creepkit.errors import SurrogateError

SampleArrays: TypeAlias = dict[str, NDArray[Any]]
"""Arrays whose leading axis is the sample. Always there: "targets" (n, frames, outputs), physical, float32, zero where
there is none; "mask" (n, frames), which frames are data. The rest is the recipe's own: the inputs of its network."""


Weights: TypeAlias = Mapping[str, NDArray[Any]]
"""{name: (...,)} weights and scales of a network, as they stand in its file."""


Precision: TypeAlias = type[np.float64] | type[np.float32]


HALVED = np.array([0.5, 0.5, 1.0])
"""Factors on the weights of the gates r, z and n, in the order of their rows."""


SCALES = ("constants", "series", "targets")
"""What is standardised."""


FRAMES_IN_BLOCK = 4
"""Frames that all layers go through before the next ones: nothing but states is kept between."""


ROWS_IN_BATCH = 256
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

    input_weights : (inputs, gates x hidden). hidden_weights : (hidden, gates x hidden). input_bias : (gates x hidden,),
    with the hidden bias of r and z. hidden_bias : (hidden,) of n.
    """

    input_weights: Floats
    hidden_weights: Floats
    input_bias: Floats
    hidden_bias: Floats

    @property
    def hidden(self) -> int:
        """Width."""
        return len(self.hidden_weights)


@dataclass(frozen=True, eq=False)
class ParameterNetwork:
    """The trained network: constants and series of tests to outputs in physical units.

    head_weights, head_bias : (hidden, outputs) and (outputs,) of the linear layer behind the recurrent ones.
    constants, series, targets : scales of its inputs and of what it gives. floor, most : of the logarithm of the first
    output (see parameter_network.ParameterModule). logarithm : whether the first output is learnt by its logarithm.
    """

    layers: tuple[RecurrentLayer, ...]
    head_weights: Floats
    head_bias: Floats
    constants: ColumnScale
    series: ColumnScale
    targets: ColumnScale
    floor: float
    most: float
    logarithm: bool

    @classmethod
    def from_weights(
        cls,
        weights: Weights,
        sizes: tuple[int, int, int],
        shape: tuple[int, int],
        *,
        logarithm: bool,
        precision: Precision = np.float64,
    ) -> ParameterNetwork:
        """The network of the weights in a file; SurrogateError where their names or shapes are others.

        weights : {name: (...,)} by the names of torch.nn. sizes : numbers of constants, series and outputs. shape : the
        width and the number of layers. precision : of the recurrence.
        """
        (constants, series, outputs), (hidden, depth) = sizes, shape
        gates = HALVED.size * hidden
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
            tuple(_layer(arrays, layer, precision) for layer in range(depth)),
            np.ascontiguousarray(arrays["head.weight"].T, precision),
            arrays["head.bias"],
            **{name: ColumnScale(arrays[f"{name}.mean"], arrays[f"{name}.deviation"]) for name in SCALES},
            floor=float(arrays["floor"]),
            most=float(arrays["most"]),
            logarithm=logarithm,
        )

    def outputs(self, constants: Floats, series: Floats) -> Floats:
        """(rows, frames, outputs) in physical units.

        constants : (rows, constants), NaN where a coefficient is off. series : (tests, frames, series), those of each
        row in turn: rows are candidates x tests.
        """
        return self.outputs_with_derivatives(constants, series)[0]

    def outputs_with_derivatives(
        self, constants: Floats, series: Floats, directions: Floats | None = None
    ) -> tuple[Floats, Floats]:
        """Outputs (rows, frames, outputs) in physical units, and derivatives (rows, frames, outputs, directions).

        constants : (rows, constants). series : (tests, frames, series); as for outputs().
        directions : (rows, directions, constants), how constants move.
        """
        if directions is None:
            directions = np.zeros((len(constants), 0, constants.shape[1]))
        tests, frames = len(series), self.series.standardised(series).swapaxes(0, 1)
        step = max(1, ROWS_IN_BATCH // ((1 + directions.shape[1]) * tests)) * tests
        values, derivatives = [], []
        for part in (slice(first, first + step) for first in range(0, len(constants), step)):
            raw = self._standardised_outputs(self._constant_inputs(constants[part], directions[part]), frames)
            values.append(self._decoded(raw[:, 0]).swapaxes(0, 1))
            slope = self._decoded_derivatives(raw[:, :1])
            derivatives.append(np.moveaxis(raw[:, 1:] * slope, (2, 0, 3, 1), (0, 1, 2, 3)))
        return np.concatenate(values), np.concatenate(derivatives)

    def _constant_inputs(self, constants: Floats, directions: Floats) -> Floats:
        """(1 + directions, rows, constants) standardised; a coefficient that is off stands at zero."""
        standardised = np.nan_to_num(self.constants.standardised(constants), nan=0.0)
        return np.concatenate([standardised[None], np.moveaxis(directions, 1, 0) / self.constants.deviation])

    def _standardised_outputs(self, constants: Floats, series: Floats) -> Floats:
        """(frames, 1 + directions, rows, outputs) standardised.

        constants : (1 + directions, rows, constants). series : (frames, tests, series).
        """
        first, (variants, rows, columns) = self.layers[0], constants.shape
        precision, tests = first.input_weights.dtype, series.shape[1]
        constant_part = _product(constants.astype(precision), first.input_weights[:columns])
        constant_part[0] += first.input_bias
        series_part = _product(series.astype(precision), first.input_weights[columns:])
        states = [np.zeros((variants, rows, w.hidden), precision) for w in self.layers]
        blocks = []
        for start in range(0, len(series), FRAMES_IN_BLOCK):
            block = series_part[start : start + FRAMES_IN_BLOCK]
            inputs = np.repeat(constant_part[None], len(block), axis=0)
            inputs[:, 0].reshape(len(block), rows // tests, tests, -1)[...] += block[:, None]
            values = _frames(first, inputs, states[0])
            for layer, state in zip(self.layers[1:], states[1:], strict=True):
                inputs = _product(values, layer.input_weights)
                inputs[:, 0] += layer.input_bias
                values = _frames(layer, inputs, state)
            blocks.append(_product(values, self.head_weights))
        outputs = np.concatenate(blocks).astype(float)
        outputs[:, 0] += self.head_bias
        return outputs

    def _decoded(self, raw: Floats) -> Floats:
        """Physical outputs (frames, rows, outputs) of standardised ones."""
        outputs = raw * self.targets.deviation + self.targets.mean
        if self.logarithm:
            outputs[..., 0] = np.exp(np.minimum(outputs[..., 0], self.most)) - self.floor
        return outputs

    def _decoded_derivatives(self, raw: Floats) -> Floats:
        """Derivative of each physical output to its standardised one, of the shape of raw (..., outputs)."""
        derivatives = np.array(np.broadcast_to(self.targets.deviation, raw.shape))
        if self.logarithm:
            logarithm = raw[..., 0] * self.targets.deviation[0] + self.targets.mean[0]
            derivatives[..., 0] *= np.where(logarithm < self.most, np.exp(np.minimum(logarithm, self.most)), 0.0)
        return derivatives


def _layer(arrays: Mapping[str, Floats], layer: int, precision: Precision) -> RecurrentLayer:
    """One layer of the weights of a file."""
    hidden = arrays[f"network.weight_hh_l{layer}"].shape[1]
    factor = np.repeat(HALVED, hidden)

    def scaled(name: str) -> Floats:
        return np.asarray(arrays[f"network.{name}_l{layer}"].T * factor)

    def stored(array: Floats) -> NDArray[Any]:
        return np.ascontiguousarray(array, precision)

    input_bias, hidden_bias = scaled("bias_ih"), scaled("bias_hh")
    input_bias[: 2 * hidden] += hidden_bias[: 2 * hidden]
    weights = stored(scaled("weight_ih")), stored(scaled("weight_hh"))
    return RecurrentLayer(*weights, stored(input_bias), stored(hidden_bias[2 * hidden :]))


def _product(values: Floats, weights: Floats) -> Floats:
    """values (..., inputs) times weights (inputs, outputs) as one matrix product."""
    return np.asarray(values.reshape(-1, len(weights)) @ weights).reshape(*values.shape[:-1], weights.shape[1])


def _frames(layer: RecurrentLayer, inputs: Floats, state: Floats) -> Floats:
    """(frames, 1 + directions, rows, hidden); `state` is brought to the last frame.

    inputs : (frames, 1 + directions, rows, gates), W_in x + b_in; it is overwritten. state : (1 + directions, rows,
    hidden) h.
    """
    hidden, result = layer.hidden, np.empty((*inputs.shape[:3], layer.hidden), inputs.dtype)
    h, back = state, np.empty(inputs.shape[1:], inputs.dtype)
    back_rows, n_back = back.reshape(-1, inputs.shape[3]), back[..., 2 * hidden :]
    for k, pre in enumerate(inputs):
        np.matmul(h.reshape(-1, hidden), layer.hidden_weights, out=back_rows)
        n_back[0] += layer.hidden_bias
        pre[..., : 2 * hidden] += back[..., : 2 * hidden]
        t = np.tanh(pre[0, :, : 2 * hidden])
        rz = np.multiply(t, 0.5, out=pre[0, :, : 2 * hidden])
        rz += 0.5
        r, z, n = (pre[0, :, part * hidden : (part + 1) * hidden] for part in range(3))
        n += r * n_back[0]
        np.tanh(n, out=n)
        difference = h[0] - n
        np.multiply(z, difference, out=result[k, 0])
        result[k, 0] += n
        if len(pre) > 1:
            pre[1:, :, : 2 * hidden] *= 0.5 - 0.5 * t * t
            dr, dz, dn = (pre[1:, :, part * hidden : (part + 1) * hidden] for part in range(3))
            dr *= n_back[0]
            dn += dr
            dn += r * n_back[1:]
            dn *= 1.0 - n * n
            dz *= difference
            dz += dn
            result[k, 1:] = dz + z * (h[1:] - dn)
        h = result[k]
    state[:] = h
    return result
