"""A trained ParameterGru as a predictor: candidates and tests in one batch, derivatives carried forward in time."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import torch

from creepkit.arrays import ArrayLike, Floats, Ints
from creepkit.records import NuisanceValues, History, Prediction, Status
from creepkit.surrogate.course_inputs import LoadHistoryInputs
from creepkit.surrogate.law_inputs import LawInputs
from creepkit.surrogate.matching import check_applicable, prediction_frames, observed_outputs, observation_derivative, interpolation_weights
from creepkit.surrogate.parameter_gru import ParameterGru, hold_last_value, screening_model_of, load_history_inputs
from creepkit.surrogate.parameter_module import ParameterModule
from creepkit.surrogate.recipe import SampleTensors
from creepkit.surrogate.recurrent_tangent import recurrent_with_derivatives
from creepkit.surrogate.reduction import complete_parameters
from creepkit.surrogate.surrogate import Surrogate

if TYPE_CHECKING:
    from creepkit.language import CreepLaw

NUISANCE_OF_INPUT = {"modulus": "modulus", "apex_thickness": "thickness", "temperature": "temperature"}
"""{input: the nuisance that moves it}."""
BATCH_NUMBERS = 2**24
"""Numbers in the inputs of a batch."""


@dataclass(frozen=True, eq=False)
class NetworkQuery:
    """What is asked of the network: candidates x tests.

    theta : (candidates, parameters) internal. rows : (candidates, columns) of the law, as the network sees them.
    numbers : (candidates, tests, constants). series : (tests, frames, series). base : (candidates, tests, frames).
    slopes : {effect: (candidates, tests, constants)} derivatives of the numbers.
    """

    theta: Floats
    law_rows: Floats
    constants: Floats
    series: Floats
    base: Floats | None
    derivatives: Mapping[str, Floats]

    def batch(self, candidates: slice) -> SampleTensors:
        """Some candidates, each with every test: what the module eats, a row for each pair."""
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

    def predict(
        self,
        law: CreepLaw,
        values: Mapping[str, ArrayLike],
        histories: Sequence[History],
        *,
        jacobian: bool = False,
        nuisances: NuisanceValues | None = None,
    ) -> Prediction:
        """Predict each history's outputs at its times; see records.Predictor and Surrogate.predict."""
        nuisances = nuisances or {}
        check_applicable(self.metadata, histories, nuisances, self.nuisances)
        parameters = complete_parameters(self.metadata.law, law, values, self._default_values)
        frames = prediction_frames(self.metadata.grid, histories)
        query = self._query(parameters, histories, frames, nuisances)
        positions = [self.metadata.law.names.index(name) for name in law.names]
        outputs = self._values(query)
        derivatives = self._derivatives(query, positions) if jacobian and self.recipe.base == "none" else None
        return self._prediction(query, histories, frames, outputs, derivatives, tuple(nuisances))

    # ---- what the network is asked ---------------------------------------------------------------------------------

    @cached_property
    def _history_inputs(self) -> LoadHistoryInputs:
        return load_history_inputs(self.recipe, self.specimen, self.metadata.conditions, self.metadata.grid.relative)

    @cached_property
    def _law_inputs(self) -> LawInputs:
        return LawInputs(self.metadata.law)

    @cached_property
    def _default_values(self) -> dict[str, float]:
        """Values of parameters whose term is switched off: any will do, the middle of the bounds is inside."""
        return {name: param.center for name, param in self.metadata.law.table.items()}

    @cached_property
    def _double_precision(self) -> ParameterModule:
        """The network in float64: derivatives by differences need the digits."""
        module = copy.deepcopy(self.module).double()
        assert isinstance(module, ParameterModule)
        return module

    def _query(
        self, values: Mapping[str, Any], histories: Sequence[History], frames: Sequence[Floats], nuisances: NuisanceValues
    ) -> NetworkQuery:
        theta = self._law_inputs.internal(values)
        count = max([len(theta), *(len(v) for v in nuisances.values())])
        theta = np.broadcast_to(theta, (count, theta.shape[1]))
        nuisances = {kind: np.broadcast_to(v, (count, len(histories))) for kind, v in nuisances.items()}
        perturbed = [
            self._history_inputs.with_nuisances(h, {kind: v[:, k] for kind, v in nuisances.items()}, count) for k, h in enumerate(histories)
        ]
        return NetworkQuery(
            theta=theta,
            law_rows=self._law_inputs.input_rows(theta),
            constants=np.stack([numbers for numbers, _ in perturbed], axis=1),
            series=np.stack([self._history_inputs.series_values(h, t) for h, t in zip(histories, frames, strict=True)]),
            base=self._base(values, histories, frames, nuisances, count) if self.recipe.base != "none" else None,
            derivatives={kind: np.stack([slopes[kind] for _, slopes in perturbed], axis=1) for kind in nuisances},
        )

    def _base(
        self, values: Mapping[str, Any], histories: Sequence[History], frames: Sequence[Floats], nuisances: NuisanceValues,
        count: int,
    ) -> Floats:  # fmt: skip
        """(candidates, tests, frames) what the specimen's stand-in predicts of the first output."""
        tests = [h.replace(times=t, outputs={}) for h, t in zip(histories, frames, strict=True)]
        prediction = screening_model_of(self.specimen).predict(self.metadata.law, values, tests, nuisances=nuisances)
        first = hold_last_value(prediction.values[..., prediction.outputs.index(self.outputs[0])])
        return np.broadcast_to(first, (count, *first.shape[1:]))

    # ---- what it answers -------------------------------------------------------------------------------------------

    @torch.no_grad()
    def _values(self, query: NetworkQuery) -> Floats:
        """(candidates, tests, frames, outputs)."""
        width = 4 * self._double_precision.network.hidden_size
        parts = [self._double_precision(query.batch(part)).numpy() for part in _batches(query, width)]
        return np.concatenate(parts).reshape(*query.constants.shape[:2], *parts[0].shape[1:])

    @torch.no_grad()
    def _derivatives(self, query: NetworkQuery, positions: Sequence[int]) -> Floats:
        """(candidates, tests, frames, outputs, directions): to the parameters `own`, then to the nuisances."""
        width = (len(positions) + len(query.derivatives)) * self._double_precision.network.hidden_size * 4
        parts = [self._batch_derivatives(query, part, positions) for part in _batches(query, width)]
        return np.concatenate(parts).reshape(*query.constants.shape[:2], *parts[0].shape[1:])

    def _batch_derivatives(self, query: NetworkQuery, candidates: slice, positions: Sequence[int]) -> Floats:
        network = self._double_precision
        inputs = network.standardised_inputs(query.batch(candidates))
        columns, tests = query.law_rows.shape[1], query.constants.shape[1]
        directions_in = np.zeros((len(inputs), len(positions) + len(query.derivatives), inputs.shape[2]))
        law_derivatives = np.repeat(self._law_inputs.derivatives(query.theta[candidates])[:, :, list(positions)], tests, axis=0)
        directions_in[:, : len(positions), :columns] = np.swapaxes(law_derivatives, 1, 2)
        constant_columns = slice(columns, columns + query.constants.shape[2])
        for k, constant_derivatives in enumerate(query.derivatives.values()):
            directions_in[:, len(positions) + k, constant_columns] = constant_derivatives[candidates].reshape(len(inputs), -1)
        directions_in[:, :, : constant_columns.stop] /= network.constants.deviation.numpy()
        directions = torch.from_numpy(directions_in)[:, :, None].expand(-1, -1, inputs.shape[1], -1)
        state, state_derivatives = recurrent_with_derivatives(network.network, inputs, directions)
        derivatives = network.decoded_derivatives(network.head(state))[:, None] * (state_derivatives @ network.head.weight.T)
        return derivatives.movedim(1, -1).numpy()

    def _prediction(
        self, query: NetworkQuery, histories: Sequence[History], frames: Sequence[Floats], outputs: Floats,
        derivatives: Floats | None, nuisance_names: tuple[str, ...],
    ) -> Prediction:  # fmt: skip
        """At the times of the histories, as their instruments show it."""
        lengths = np.array([h.times.size for h in histories], dtype=np.int64)
        shape = (*outputs.shape[:2], int(lengths.max(initial=0)), outputs.shape[3])
        values = np.full(shape, np.nan)
        derivative_array = None if derivatives is None else np.full((*shape, derivatives.shape[-1]), np.nan)
        for k, (history, frame_times) in enumerate(zip(histories, frames, strict=True)):
            weights = interpolation_weights(frame_times, history.times)
            interpolated = np.einsum("tf,cfo->cto", weights, outputs[:, k])
            values[:, k, : lengths[k]] = observed_outputs(self.specimen, history, interpolated)
            if derivative_array is not None and derivatives is not None:
                derivative = np.einsum("tf,cfod->ctod", weights, derivatives[:, k])
                derivative_array[:, k, : lengths[k]] = derivative * observation_derivative(self.specimen, history, interpolated)[..., None]
        count = 0 if derivative_array is None else derivative_array.shape[-1] - len(nuisance_names)
        ends = np.broadcast_to([h.times[-1] for h in histories], outputs.shape[:2]).astype(float)
        return Prediction(
            values=values, outputs=self.outputs, lengths=lengths, status=self._status(query, histories, frames),
            end_times=ends, jacobian=None if derivative_array is None else derivative_array[..., :count],
            times=tuple(h.times for h in histories),
            nuisance_jacobian={} if derivative_array is None else {kind: derivative_array[..., count + k] for k, kind in enumerate(nuisance_names)},
        )  # fmt: skip

    def _status(self, query: NetworkQuery, histories: Sequence[History], frames: Sequence[Floats]) -> Ints:
        """(candidates, tests): complete, or outside the domain."""
        outside = np.zeros(query.constants.shape[:2], bool)
        if self.metadata.domain is not None:
            outside = self.metadata.domain.outside(self._domain_inputs(query, histories, frames))
        return np.where(outside, int(Status.OUTSIDE_DOMAIN), int(Status.COMPLETE)).astype(np.int64)

    def _domain_inputs(self, query: NetworkQuery, histories: Sequence[History], frames: Sequence[Floats]) -> Floats:
        """(candidates, tests, inputs) what the guard sees."""
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
