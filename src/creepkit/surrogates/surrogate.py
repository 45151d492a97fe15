"""Surrogates: trained networks as predictors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.errors import SurrogateError
from creepkit.files.safetensors_files import write_safetensors
from creepkit.presentation import Presentable
from creepkit.records import (
    History,
    HistoryPrediction,
    NuisanceValues,
    Prediction,
    Predictor,
    Specimen,
    Status,
    SupportsReducedOrderModel,
    SupportsRefinement,
    assemble_prediction,
    broadcast_candidates,
    check_nuisances,
    unpredicted,
)
from creepkit.surrogates.parameter_gru import ParameterGru
from creepkit.surrogates.parameter_inputs import (
    LawInputs,
    LoadHistoryInputs,
    base_model,
    complete_parameters,
    hold_last_value,
    zero_coefficients,
)
from creepkit.surrogates.recipe import SampleArrays, SurrogateMetadata, Weights
from creepkit.surrogates.tested_histories import (
    check_history,
    interpolation_weights,
    observation_derivative,
    observed_outputs,
    prediction_frames,
)
from creepkit.surrogates.weight_files import CODEC, SURROGATE

if TYPE_CHECKING:
    from creepkit.language import CreepLaw


@dataclass(frozen=True, eq=False)
class SurrogateHeader:
    """What the file of a surrogate says beside the weights."""

    kind: Literal["parameter-gru"]
    recipe: ParameterGru
    metadata: SurrogateMetadata


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

    def network_arguments(self) -> tuple[Floats, Floats, Floats | None]:
        """Constants (rows, columns), series (tests, frames, series), base (rows, frames); rows: candidates x tests."""
        count, tests = self.constants.shape[:2]
        rows = np.repeat(self.law_rows, tests, axis=0)
        constants = np.concatenate([rows, self.constants.reshape(count * tests, -1)], axis=1)
        return constants, self.series, None if self.base is None else self.base.reshape(count * tests, -1)


class Surrogate(Presentable, text="reports.surrogate:surrogate_text"):
    """A trained network in the place of a specimen; a records.Predictor.

    It predicts at the frames of its training, and between them linearly in time. recipe, weights, metadata : what it
    was trained as, the arrays of its network, and what is known of its training.
    """

    def __init__(self, recipe: ParameterGru, weights: Weights, metadata: SurrogateMetadata) -> None:
        self.recipe, self.weights, self.metadata = recipe, weights, metadata
        self.network = recipe.network(weights, metadata)

    @property
    def name(self) -> str:
        """Which kind of surrogate it is, and of what."""
        return f"{self.recipe.kind} of {self.specimen.name}"

    @property
    def title(self) -> str:
        """One line for people."""
        return f"{self.specimen.title}, by a network ({self.recipe.kind}) trained on law '{self.metadata.law.name}'"

    @property
    def specimen(self) -> Specimen:
        """The specimen whose outputs it predicts."""
        return self.metadata.specimen

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of what is predicted."""
        return self.metadata.outputs

    @property
    def nuisances(self) -> tuple[str, ...]:
        """The nuisances whose inputs were varied."""
        return self._history_inputs.nuisances

    def outside_class(self, law: CreepLaw) -> str:
        """Why it does not predict a law, in a sentence; "" where it does."""
        try:
            zero_coefficients(self.metadata.law, law)
        except SurrogateError as error:
            return str(error)
        return ""

    def predict(
        self,
        law: CreepLaw,
        theta: Floats,
        histories: Sequence[History],
        *,
        nuisances: NuisanceValues | None = None,
        sensitivities: bool = False,
    ) -> Prediction:
        """Predict each history's outputs at its times; see records.Predictor. theta : (candidates, parameters).

        A row outside the domain of the training has its values all the same, and Status.OUTSIDE_DOMAIN. A law outside
        the class of the training has Status.OUTSIDE_CLASS, a `reason`, and NaN: nothing bounds the error there.
        """
        for history in histories:
            check_history(self.metadata, history)
        check_nuisances(nuisances or (), self.nuisances, "this surrogate", SurrogateError)
        reason = self.outside_class(law)
        if reason:
            candidates = len(broadcast_candidates(theta, nuisances, len(histories))[0])
            remedy = f"simulate it with the specimen '{self.specimen.name}' itself"
            return unpredicted(histories, self.outputs, candidates, Status.OUTSIDE_CLASS, f"{reason}; {remedy}")
        return self._predict(law, theta, histories, nuisances, sensitivities)

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
        directions = self._directions(query, positions) if sensitivities and self.recipe.base == "none" else None
        rows, row_derivatives = self.network.outputs_with_derivatives(*query.network_arguments(), directions)
        shape = query.constants.shape[:2]
        outputs = rows.reshape(*shape, *rows.shape[1:])
        derivatives = None if directions is None else row_derivatives.reshape(*shape, *row_derivatives.shape[1:])
        status = self._status(query, histories, frames)
        parts = []
        for k, history in enumerate(histories):
            test_derivatives = None if derivatives is None else derivatives[:, k]
            part = self._history_prediction(history, frames[k], outputs[:, k], test_derivatives, tuple(nuisances))
            parts.append(replace(part, status=status[:, k]))
        return assemble_prediction(parts, histories, self.outputs, len(complete_theta))

    def predict_samples(self, samples: SampleArrays) -> Floats:
        """(rows, frames, outputs) of the network for samples of its recipe, in physical units."""
        arrays = {name: np.asarray(samples[name], float) for name in ("constants", "series", "base") if name in samples}
        return self.network.outputs(arrays["constants"], arrays["series"], arrays.get("base"))

    @property
    def weight_count(self) -> int:
        """Numbers that its training fitted."""
        return self.network.weight_count

    @property
    def error(self) -> dict[str, float]:
        """{output: standard deviation of its error}, in the output's unit, from the validation rows.

        1.25 times the mean absolute error, that of a Gaussian: rare large errors would widen every interval.
        """
        outputs = self.metadata.metrics.get("outputs", {})
        return {name: 1.2533 * float(errors["mae"]) for name, errors in outputs.items() if "mae" in errors}

    def reduced_order_model(self) -> Predictor:
        """A model for global searches: that of the specimen, if it has one, else the network itself."""
        if isinstance(self.specimen, SupportsReducedOrderModel):
            return self.specimen.reduced_order_model()
        return self

    @property
    def tolerances(self) -> Mapping[str, float]:
        """Relative standard deviations of lengths that nobody measured better: those of the specimen."""
        return getattr(self.specimen, "tolerances", {})

    def refined(self) -> Predictor:
        """What it stands for: the specimen itself, on the finer discretisation where it has one."""
        return self.specimen.refined() if isinstance(self.specimen, SupportsRefinement) else self.specimen

    def reference_stress(self, history: History) -> Floats:
        """The reference von Mises stresses, (levels,) MPa: the specimen's, or those that are prescribed."""
        specimen_stress = getattr(self.specimen, "reference_stress", None)
        if specimen_stress is not None:
            return np.asarray(specimen_stress(history))
        levels = np.unique(history.loading.program().values)
        return np.asarray(levels[levels > 0])

    @property
    def file_header(self) -> dict[str, Any]:
        """Everything that a file says beside the weights."""
        header: dict[str, Any] = CODEC.to_json(SurrogateHeader(self.recipe.kind, self.recipe, self.metadata))
        return header

    def save(self, path: str | Path) -> Path:
        """Write the weights with their header."""
        return write_safetensors(path, self.weights, self.file_header, SURROGATE)

    def __repr__(self) -> str:
        return f"<Surrogate: {self.title}>"

    # ---- inputs of the network ----------------------------------------------------------------------------------

    @cached_property
    def _history_inputs(self) -> LoadHistoryInputs:
        return self.recipe.history_inputs(self.specimen, self.metadata.conditions, self.metadata.grid.relative)

    @cached_property
    def _law_inputs(self) -> LawInputs:
        return LawInputs(self.metadata.law)

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
        """(candidates, tests, frames) what the model that is corrected predicts of the first output."""
        tests = [h.replace(times=t, outputs={}, standard_deviation={}) for h, t in zip(histories, frames, strict=True)]
        prediction = base_model(self.specimen, self.recipe.base).predict(
            self.metadata.law, theta, tests, nuisances=nuisances
        )
        return hold_last_value(prediction.values[..., prediction.outputs.index(self.outputs[0])])

    # ---- outputs ---------------------------------------------------------------------------------------------------

    def _directions(self, query: NetworkQuery, positions: Sequence[int]) -> Floats:
        """(rows, directions, constants): how inputs move with parameters at `positions`, then with the nuisances."""
        (count, tests, constants), columns = query.constants.shape, query.law_rows.shape[1]
        directions = np.zeros((count * tests, len(positions) + len(query.derivatives), columns + constants))
        law_derivatives = self._law_inputs.derivatives(query.theta)[:, :, list(positions)]
        directions[:, : len(positions), :columns] = np.repeat(np.swapaxes(law_derivatives, 1, 2), tests, axis=0)
        for k, constant_derivatives in enumerate(query.derivatives.values()):
            directions[:, len(positions) + k, columns:] = constant_derivatives.reshape(count * tests, -1)
        return directions

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
        outside = self.metadata.domain.outside(self._domain_inputs(query, histories, frames))
        return np.where(outside, int(Status.OUTSIDE_DOMAIN), int(Status.COMPLETE)).astype(np.int64)

    def _domain_inputs(self, query: NetworkQuery, histories: Sequence[History], frames: Sequence[Floats]) -> Floats:
        """(candidates, tests, inputs) of the applicability domain."""
        count, tests, constants = query.constants.shape
        pairs = zip(histories, frames, strict=True)
        test_rows = np.array([[*self._history_inputs.domain_inputs(*pair).values()] for pair in pairs])
        test_summary = np.broadcast_to(test_rows[None, :, constants:], (count, tests, test_rows.shape[1] - constants))
        rows = np.broadcast_to(query.law_rows[:, None], (count, tests, query.law_rows.shape[1]))
        return np.concatenate([rows, query.constants, test_summary], axis=2)
