"""The recurrent network of a law packed for a page, for any specimen that a data set was made of."""

from __future__ import annotations

from typing import Any

from creepkit.app.packed_arrays import packed
from creepkit.errors import SurrogateError
from creepkit.records import dimensions_of
from creepkit.surrogates.network_evaluation import RecurrentLayer
from creepkit.surrogates.parameter_inputs import LawInputs
from creepkit.surrogates.parameter_surrogate import ParameterSurrogate
from creepkit.surrogates.surrogate import RELATIVE_TOLERANCE


def network_data(surrogate: ParameterSurrogate) -> dict[str, Any]:
    """Return a surrogate of one law as JSON values; weights in single precision.

    SurrogateError for a network that corrects another model, which a page does not have.
    """
    if surrogate.recipe.base != "none":
        raise SurrogateError(
            "the network corrects another model, which a page does not have; train one with base='none'"
        )
    metadata, network = surrogate.metadata, surrogate.network
    inputs = surrogate.recipe.history_inputs(surrogate.specimen, metadata.conditions, metadata.grid.relative)
    law_inputs = LawInputs(metadata.law)
    scales = {"constant": network.constants, "series": network.series, "target": network.targets}
    return {
        "law": metadata.law.name,
        "specimen": metadata.specimen.name,
        "outputs": [str(name) for name in metadata.outputs],
        "parameters": [
            {"name": name, "scale": param.scale, "switchable": k in law_inputs.switchable}
            for k, (name, param) in enumerate(metadata.law.table.items())
        ],
        "constants": [*inputs.constants],
        "defaults": {length.name: float(length.default) for length in dimensions_of(metadata.specimen)},
        "series": [*inputs.series],
        "grid": {
            "values": metadata.grid.values.tolist(), "relative": metadata.grid.relative, "rounding": RELATIVE_TOLERANCE,
        },
        "cell": network.cell,
        "hidden": network.layers[0].hidden,
        "logarithm": network.logarithm,
        "floor": network.floor,
        "most": network.most,
        "layers": [_layer(layer) for layer in network.layers],
        "arrays": {
            "headWeights": packed(network.head_weights, "float32"),
            "headBias": packed(network.head_bias, "float64"),
            **{f"{name}Mean": packed(scale.mean, "float64") for name, scale in scales.items()},
            **{f"{name}Deviation": packed(scale.deviation, "float64") for name, scale in scales.items()},
        },
    }  # fmt: skip


def _layer(layer: RecurrentLayer) -> dict[str, dict[str, str]]:
    return {
        "inputWeights": packed(layer.input_weights, "float32"),
        "hiddenWeights": packed(layer.hidden_weights, "float32"),
        "inputBias": packed(layer.input_bias, "float32"),
        "hiddenBias": packed(layer.hidden_bias, "float32"),
    }
