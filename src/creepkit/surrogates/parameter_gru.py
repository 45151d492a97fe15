"""ParameterGru: the surrogate of one law as in the paper, with optional improvements, and its predictor."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np
import torch
from torch import Tensor

from creepkit.arrays import Floats, Ints
from creepkit.errors import SurrogateError, nearest
from creepkit.records import (
    History,
    HistoryPrediction,
    NuisanceValues,
    Prediction,
    Specimen,
    Status,
    assemble_prediction,
    broadcast_candidates,
)
from creepkit.surrogates.applicability_domain import ApplicabilityDomain
from creepkit.surrogates.law_class import LawClass
from creepkit.surrogates.parameter_inputs import (
    CONSTANT_INPUTS,
    SERIES_INPUTS,
    LawInputs,
    LoadHistoryInputs,
    base_outputs,
    complete_parameters,
    hold_last_value,
    load_history_arrays,
    reduced_order_model_of,
    zero_coefficients,
)
from creepkit.surrogates.parameter_network import ParameterModule, RecurrentCell, recurrent_with_derivatives
from creepkit.surrogates.recipe import ProgressCallback, SampleTensors, SurrogateMetadata, SurrogateModule, Training
from creepkit.surrogates.surrogate import (
    Surrogate,
    interpolation_weights,
    observation_derivative,
    observed_outputs,
    prediction_frames,
)

if TYPE_CHECKING:
    from creepkit.dataset.dataset import Dataset
    from creepkit.language import CreepLaw


@dataclass(frozen=True)
class ParameterGru:
    """A recurrent network whose inputs are a law's parameters and the load: the paper's, at its defaults.

    hidden, layers, cell : of the network; cell "gru" or "lstm".
    inputs : inputs at each frame, of "load" (at the frame, all that the paper uses), "mean_load" (since the
        frame before: it tells when between two frames the load jumped), "time" and "step". () is "load" alone, and for
        grids that stretch with the test "load", "mean_load", "time" and "step".
    target : "value" of the first output, or its "log".
    base : "none"; or "one-dof": the specimen's reduced-order model predicts the first output, and the network corrects
        the logarithm of it. Derivatives are then left to differences.
    """

    hidden: int = 128
    layers: int = 3
    cell: RecurrentCell = "gru"
    inputs: tuple[str, ...] = ()
    target: Literal["value", "log"] = "value"
    base: Literal["none", "one-dof"] = "none"
    training: Training = field(default_factory=Training)

    kind: ClassVar[str] = "parameter-gru"

    def __post_init__(self) -> None:
        object.__setattr__(self, "inputs", tuple(self.inputs))
        for name, largest in (("hidden", 4096), ("layers", 32)):
            value = getattr(self, name)
            if value != int(value) or not 1 <= value <= largest:
                raise SurrogateError(f"ParameterGru: {name} is {value}; allowed are whole numbers from 1 to {largest}")
        choices = {"cell": ("gru", "lstm"), "target": ("value", "log"), "base": ("none", "one-dof")}
        for name, allowed in choices.items():
            if getattr(self, name) not in allowed:
                raise SurrogateError(
                    f"ParameterGru: {name} is '{getattr(self, name)}'; allowed are {', '.join(allowed)}"
                )
        for name in self.inputs:
            if name not in SERIES_INPUTS:
                raise SurrogateError(f"ParameterGru: there is no input '{name}': {nearest(name, SERIES_INPUTS)}")

    # ---- for the training ------------------------------------------------------------------------------------------

    def law_class(self, law: CreepLaw) -> LawClass:
        """The law of the data, and its reductions: its parameters are the inputs."""
        return LawClass.of_law(law)

    def sample_tensors(self, data: Dataset, progress: ProgressCallback | None = None) -> SampleTensors:
        """Tensors of a data set: constants, series, targets, mask, base, and "domain" for the applicability domain."""
        law, history_inputs = LawInputs(data.law), self._history_inputs(data)
        mask = np.asarray(np.isfinite(data.values).all(axis=-1))
        constants, series, domain_rows = load_history_arrays(data, history_inputs, progress)
        rows = law.input_rows(data.law.to_internal(data.parameters))
        arrays = {
            "constants": np.concatenate([rows, constants], axis=1),
            "series": series,
            "targets": np.where(mask[..., None], data.values, 0.0),
        }
        if self.base != "none":
            arrays["base"] = base_outputs(data, progress)
        tensors = {name: torch.from_numpy(np.asarray(v, np.float32)) for name, v in arrays.items()}
        domain = np.concatenate([rows, domain_rows], axis=1)
        return {**tensors, "mask": torch.from_numpy(mask), "domain": torch.from_numpy(domain)}

    def module(self, data: Dataset, samples: SampleTensors, train: Tensor) -> SurrogateModule:
        """A fresh network with the scales of the training rows; train : (rows,) their positions."""
        sizes = samples["constants"].shape[-1], samples["series"].shape[-1], len(data.outputs)
        return self._network(sizes).with_scales(samples, train)

    def metadata(self, data: Dataset, samples: SampleTensors, train: Tensor) -> SurrogateMetadata:
        """Scales by name, the domain, and what was constant; train : (rows,) positions of training rows."""
        history_inputs, law = self._history_inputs(data), LawInputs(data.law)
        names = (*law.names, *history_inputs.constants)
        module = self.module(data, samples, train)
        assert isinstance(module, ParameterModule)
        series = (*history_inputs.series, *(["ln base"] if self.base != "none" else []))
        scaling = {
            "inputs": _scale_pairs(names, module.constants),
            "series": _scale_pairs(series, module.series),
            "outputs": _scale_pairs(data.outputs, module.targets),
        }
        domain_names = (*law.names, *history_inputs.domain_names(data.planned_test(0)))
        constant_names = [n for n, c in zip(names, samples["constants"][train].T, strict=True) if _is_constant(c)]
        constant_names = [n for n in constant_names if not n.endswith(" is off")]
        notes = (
            (f"constant in training, so that nothing is known beyond: {', '.join(constant_names)}",)
            if constant_names
            else ()
        )
        domain = ApplicabilityDomain.from_rows(domain_names, samples["domain"][train].numpy())
        return SurrogateMetadata.from_dataset(data, scaling=scaling, domain=domain, notes=notes)

    def empty_module(self, metadata: SurrogateMetadata) -> SurrogateModule:
        """A network for the weights of a file."""
        series = len(metadata.scaling["series"]) - (self.base != "none")
        return self._network((len(metadata.scaling["inputs"]), series, len(metadata.outputs)))

    def surrogate(self, module: SurrogateModule, metadata: SurrogateMetadata) -> Surrogate:
        """The network as a predictor."""
        return ParameterSurrogate(self, module, metadata)

    # ---- parts -----------------------------------------------------------------------------------------------------

    def series_inputs(self, relative: bool) -> tuple[str, ...]:
        """What is seen at each frame."""
        return self.inputs or (SERIES_INPUTS if relative else SERIES_INPUTS[:1])

    def history_inputs(self, specimen: Specimen, conditions: tuple[str, ...], relative: bool) -> LoadHistoryInputs:
        """The inputs that tests give: which of CONSTANT_INPUTS varied in training, and the series."""
        constants = tuple(name for name in CONSTANT_INPUTS if name in conditions)
        return LoadHistoryInputs(specimen, constants, self.series_inputs(relative), relative)

    def _history_inputs(self, data: Dataset) -> LoadHistoryInputs:
        return self.history_inputs(data.specimen, data.condition_names, data.grid.relative)

    def _network(self, sizes: tuple[int, int, int]) -> ParameterModule:
        log, based = self.target == "log", self.base != "none"
        return ParameterModule(sizes, self.hidden, self.layers, self.cell, logarithm=log, corrects_base=based)


def _scale_pairs(names: tuple[str, ...], scale: Any) -> dict[str, list[float]]:
    means, deviations = scale.mean.tolist(), scale.deviation.tolist()
    return {name: [m, d] for name, m, d in zip(names, means, deviations, strict=True)}


def _is_constant(column: Tensor) -> bool:
    finite = column[~column.isnan()]
    return not len(finite) or bool((finite - finite[0]).abs().max() <= 1e-6 * finite.abs().max())


NUISANCE_OF_INPUT = {"modulus": "modulus", "apex_thickness": "thickness", "temperature": "temperature"}
"""{input: the nuisance that changes it}."""


BATCH_NUMBERS = 2**24
"""Numbers in the inputs of a batch."""


@dataclass(frozen=True, eq=False)
class NetworkQuery:
    """Inputs of the network for candidates x tests.

    theta : (candidates, parameters) internal values. law_rows : (candidates, columns) of the law, as network inputs.
    constants : (candidates, tests, constants). series : (tests, frames, series). base : (candidates, tests, frames).
    derivatives : {nuisance: (candidates, tests, constants)} of the constants.
    """

    theta: Floats
    law_rows: Floats
    constants: Floats
    series: Floats
    base: Floats | None
    derivatives: Mapping[str, Floats]

    def batch(self, candidates: slice) -> SampleTensors:
        """Some candidates, each with every test: inputs of the module, a row for each pair."""
        constants = self.constants[candidates]
        count, tests = constants.shape[:2]
        rows = np.repeat(self.law_rows[candidates], tests, axis=0)
        arrays = {
            "constants": np.concatenate([rows, constants.reshape(count * tests, -1)], axis=1),
            "series": np.tile(self.series, (count, 1, 1)),
        }
        if self.base is not None:
            arrays["base"] = self.base[candidates].reshape(count * tests, -1)
        return {name: torch.from_numpy(np.array(array)) for name, array in arrays.items()}


class ParameterSurrogate(Surrogate):
    """The network on the frames it was trained at, and between them linear in time."""

    recipe: ParameterGru

    @property
    def nuisances(self) -> tuple[str, ...]:  # type: ignore[override]
        """The nuisances whose inputs were varied."""
        return tuple(NUISANCE_OF_INPUT[name] for name in self._history_inputs.constants)

    def outside_class(self, law: CreepLaw) -> str:
        """Why it does not predict a law, in a sentence; "" where it does."""
        try:
            zero_coefficients(self.metadata.law, law)
        except SurrogateError as error:
            return str(error)
        return ""

    def _predict(
        self,
        law: CreepLaw,
        theta: Floats,
        histories: Sequence[History],
        nuisances: NuisanceValues | None,
        sensitivities: bool,
    ) -> Prediction:
        """Predict each history's outputs at its times; theta : (candidates, parameters)."""
        complete_theta = complete_parameters(self.metadata.law, law, theta)
        complete_theta, nuisances = broadcast_candidates(complete_theta, nuisances, len(histories))
        frames = prediction_frames(self.metadata.grid, histories)
        query = self._query(complete_theta, histories, frames, nuisances)
        positions = [self.metadata.law.names.index(name) for name in law.names]
        outputs = self._values(query)
        derivatives = self._derivatives(query, positions) if sensitivities and self.recipe.base == "none" else None
        status = self._status(query, histories, frames)
        parts = []
        for k, history in enumerate(histories):
            test_derivatives = None if derivatives is None else derivatives[:, k]
            part = self._history_prediction(history, frames[k], outputs[:, k], test_derivatives, tuple(nuisances))
            parts.append(replace(part, status=status[:, k]))
        return assemble_prediction(parts, histories, self.outputs, len(complete_theta))

    # ---- inputs of the network ----------------------------------------------------------------------------------

    @cached_property
    def _history_inputs(self) -> LoadHistoryInputs:
        return self.recipe.history_inputs(self.specimen, self.metadata.conditions, self.metadata.grid.relative)

    @cached_property
    def _law_inputs(self) -> LawInputs:
        return LawInputs(self.metadata.law)

    @cached_property
    def _double_precision(self) -> ParameterModule:
        """The network in float64: derivatives by differences need the digits."""
        module = copy.deepcopy(self.module).double()
        assert isinstance(module, ParameterModule)
        return module

    def _query(
        self, theta: Floats, histories: Sequence[History], frames: Sequence[Floats], nuisances: NuisanceValues
    ) -> NetworkQuery:
        perturbed = [
            self._history_inputs.with_nuisances(h, {kind: v[:, k] for kind, v in nuisances.items()}, len(theta))
            for k, h in enumerate(histories)
        ]
        return NetworkQuery(
            theta=theta,
            law_rows=self._law_inputs.input_rows(theta),
            constants=np.stack([numbers for numbers, _ in perturbed], axis=1),
            series=np.stack([self._history_inputs.series_values(h, t) for h, t in zip(histories, frames, strict=True)]),
            base=self._base(theta, histories, frames, nuisances) if self.recipe.base != "none" else None,
            derivatives={kind: np.stack([slopes[kind] for _, slopes in perturbed], axis=1) for kind in nuisances},
        )

    def _base(
        self, theta: Floats, histories: Sequence[History], frames: Sequence[Floats], nuisances: NuisanceValues
    ) -> Floats:
        """(candidates, tests, frames) what the specimen's reduced-order model predicts of the first output."""
        tests = [h.replace(times=t, outputs={}) for h, t in zip(histories, frames, strict=True)]
        prediction = reduced_order_model_of(self.specimen).predict(self.metadata.law, theta, tests, nuisances=nuisances)
        return hold_last_value(prediction.values[..., prediction.outputs.index(self.outputs[0])])

    # ---- outputs ---------------------------------------------------------------------------------------------------

    @torch.no_grad()
    def _values(self, query: NetworkQuery) -> Floats:
        """(candidates, tests, frames, outputs)."""
        width = 4 * self._double_precision.network.hidden_size
        parts = [self._double_precision(query.batch(part)).numpy() for part in _batches(query, width)]
        return np.concatenate(parts).reshape(*query.constants.shape[:2], *parts[0].shape[1:])

    @torch.no_grad()
    def _derivatives(self, query: NetworkQuery, positions: Sequence[int]) -> Floats:
        """(candidates, tests, frames, outputs, directions): to the parameters at `positions`, then to the nuisances."""
        width = (len(positions) + len(query.derivatives)) * self._double_precision.network.hidden_size * 4
        parts = [self._batch_derivatives(query, part, positions) for part in _batches(query, width)]
        return np.concatenate(parts).reshape(*query.constants.shape[:2], *parts[0].shape[1:])

    def _batch_derivatives(self, query: NetworkQuery, candidates: slice, positions: Sequence[int]) -> Floats:
        network = self._double_precision
        inputs = network.standardised_inputs(query.batch(candidates))
        columns, tests = query.law_rows.shape[1], query.constants.shape[1]
        directions_in = np.zeros((len(inputs), len(positions) + len(query.derivatives), inputs.shape[2]))
        law_derivatives = np.repeat(
            self._law_inputs.derivatives(query.theta[candidates])[:, :, list(positions)], tests, axis=0
        )
        directions_in[:, : len(positions), :columns] = np.swapaxes(law_derivatives, 1, 2)
        constant_columns = slice(columns, columns + query.constants.shape[2])
        for k, constant_derivatives in enumerate(query.derivatives.values()):
            directions_in[:, len(positions) + k, constant_columns] = constant_derivatives[candidates].reshape(
                len(inputs), -1
            )
        directions_in[:, :, : constant_columns.stop] /= network.constants.deviation.numpy()
        directions = torch.from_numpy(directions_in)[:, :, None].expand(-1, -1, inputs.shape[1], -1)
        state, state_derivatives = recurrent_with_derivatives(network.network, inputs, directions)
        derivatives = network.decoded_derivatives(network.head(state))[:, None] * (
            state_derivatives @ network.head.weight.T
        )
        return derivatives.movedim(1, -1).numpy()

    def _history_prediction(
        self, history: History, frames: Floats, outputs: Floats, derivatives: Floats | None, nuisances: tuple[str, ...]
    ) -> HistoryPrediction:
        """One history at its times, as its instrument shows it.

        frames : (frames,) s. outputs : (candidates, frames, outputs). derivatives : (candidates, frames, outputs,
        parameters and then nuisances), or None.
        """
        weights = interpolation_weights(frames, history.times)
        interpolated = np.einsum("tf,cfo->cto", weights, outputs)
        jacobian, nuisance_jacobian = None, {}
        if derivatives is not None:
            slope = observation_derivative(self.specimen, history, interpolated)[..., None]
            shown = np.einsum("tf,cfod->ctod", weights, derivatives) * slope
            count = shown.shape[-1] - len(nuisances)
            jacobian = shown[..., :count]
            nuisance_jacobian = {kind: shown[..., count + k] for k, kind in enumerate(nuisances)}
        return HistoryPrediction(
            values=observed_outputs(self.specimen, history, interpolated),
            status=np.zeros(len(outputs), dtype=np.int64),
            end_times=np.full(len(outputs), history.times[-1]),
            jacobian=jacobian,
            nuisance_jacobian=nuisance_jacobian,
        )

    def _status(self, query: NetworkQuery, histories: Sequence[History], frames: Sequence[Floats]) -> Ints:
        """(candidates, tests): complete, or outside the domain."""
        outside = np.zeros(query.constants.shape[:2], bool)
        if self.metadata.domain is not None:
            outside = self.metadata.domain.outside(self._domain_inputs(query, histories, frames))
        return np.where(outside, int(Status.OUTSIDE_DOMAIN), int(Status.COMPLETE)).astype(np.int64)

    def _domain_inputs(self, query: NetworkQuery, histories: Sequence[History], frames: Sequence[Floats]) -> Floats:
        """(candidates, tests, inputs) of the applicability domain."""
        count, tests, constants = query.constants.shape
        test_rows = np.stack([self._history_inputs.domain_inputs(h, t) for h, t in zip(histories, frames, strict=True)])
        test_summary = np.broadcast_to(test_rows[None, :, constants:], (count, tests, test_rows.shape[1] - constants))
        rows = np.broadcast_to(query.law_rows[:, None], (count, tests, query.law_rows.shape[1]))
        return np.concatenate([rows, query.constants, test_summary], axis=2)


def _batches(query: NetworkQuery, width: int) -> list[slice]:
    """Candidates in groups whose largest tensors are not too large."""
    count, tests = query.constants.shape[:2]
    step = max(1, BATCH_NUMBERS // (tests * query.series.shape[1] * width))
    return [slice(first, first + step) for first in range(0, count, step)]
