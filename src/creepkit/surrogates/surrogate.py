"""Surrogates: trained networks as predictors, their files, and the tests that they apply to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from creepkit.arrays import Floats
from creepkit.checked_arguments import checked
from creepkit.errors import CreepkitError, SurrogateError, nearest
from creepkit.files.json_documents import DocumentFormat
from creepkit.files.reading import FileKind
from creepkit.files.record_codec import RecordCodec, ValueCodec
from creepkit.files.safetensors_files import read_safetensors, write_safetensors
from creepkit.language import CreepLaw
from creepkit.language.law_codec import law_from_json, law_to_json
from creepkit.limits import ANY_NUMBER
from creepkit.records import (
    History,
    HistoryPrediction,
    NuisanceValues,
    Prediction,
    Predictor,
    Specimen,
    Status,
    assemble_prediction,
    dimension_named,
    known_specimens,
    outputs_of,
    unpredicted,
)
from creepkit.records.loading import held_of
from creepkit.records.presentable import Presentable
from creepkit.registry.specimen_documents import specimen_from_json, specimen_to_json
from creepkit.sampling.conditions import TimeGrid, specimen_conditions
from creepkit.surrogates.network_evaluation import Precision, SampleArrays, Weights
from creepkit.surrogates.parameter_gru import (
    ApplicabilityDomain,
    LawInputs,
    LoadHistoryInputs,
    ParameterGru,
    SurrogateMetadata,
    complete_parameters,
    zero_coefficients,
)

if TYPE_CHECKING:
    from creepkit.language import CreepLaw

SURROGATE = DocumentFormat(
    "creepkit-surrogate",
    3,
    FileKind("a surrogate", SurrogateError, "train again or take a copy", maximum_bytes=2**30),
    remedy="train again",
)
"""Eight layers of 2048 units of a GRU take 0.8 GB, and one of the default size 1 MB."""


CHECKPOINT = DocumentFormat(
    "creepkit-training-checkpoint",
    1,
    FileKind("a checkpoint of a training", SurrogateError, "remove it to begin again", maximum_bytes=2**32),
    remedy="remove it to begin again",
)
"""It holds the weights, the best ones, and two moments of each."""


CODEC = RecordCodec(
    values={
        CreepLaw: ValueCodec(law_to_json, law_from_json),
        Specimen: ValueCodec(specimen_to_json, specimen_from_json),
    },
    names={
        "CreepLaw": CreepLaw,
        "Specimen": Specimen,
        "TimeGrid": TimeGrid,
        "ApplicabilityDomain": ApplicabilityDomain,
    },
    default_range=ANY_NUMBER,
)
"""Of recipes, and of what a surrogate knows beside its weights."""


RELATIVE_TOLERANCE = 1e-6


def check_history(metadata: SurrogateMetadata, history: History) -> None:
    """SurrogateError where a history is of another kind of test than those of the training."""
    where, specimen = history.origin, metadata.specimen
    quantity = specimen_conditions(specimen).load.name
    if history.loading.quantity != quantity:
        raise SurrogateError(f"{where}: its {history.loading.quantity} is prescribed; the surrogate knows {quantity}")
    is_stress = quantity == "stress" and held_of(history.loading) == "stress"
    if is_stress and metadata.provenance.get("control", "load") != "stress":
        raise SurrogateError(f"{where}: true stress is held, and the surrogate was trained under held loads")
    last = float(history.times[-1])
    if not metadata.grid.relative and last > metadata.grid.end * (1 + RELATIVE_TOLERANCE):
        raise SurrogateError(
            f"{where}: it lasts {last:g} s, and the surrogate was trained up to {metadata.grid.end:g} s; leave later "
            "frames out or train on longer tests"
        )
    observation = getattr(specimen, "observation", None)
    if observation is not None and history.operator and history.operator != str(observation):
        raise SurrogateError(f"{where}: observed by '{history.operator}'; the surrogate was trained on '{observation}'")
    _check_lengths(where, metadata, history)


def _check_lengths(where: str, metadata: SurrogateMetadata, history: History) -> None:
    """Lengths must be those of the specimen, but for those that the applicability domain checks.

    These are the lengths that were varied, and those that differ from test piece to test piece.
    """
    for name, value in history.geometry.items():
        length = dimension_named(metadata.specimen, name)
        if length is None or length.tolerance > 0.0 or length.name in metadata.conditions:
            continue
        if abs(length.default - value) > RELATIVE_TOLERANCE * length.default:
            raise SurrogateError(f"{where}: {name} is {value:g} mm; the surrogate was trained on {length.default:g} mm")


def prediction_frames(grid: TimeGrid, histories: Sequence[History]) -> list[Floats]:
    """The times (frames,) s of the network for each history: as many for all, as far as the longest needs."""
    if grid.relative:
        return [grid.times(float(h.times[-1])) for h in histories]
    last = max(float(h.times[-1]) for h in histories)
    count = min(int(np.searchsorted(grid.values, last * (1 - RELATIVE_TOLERANCE))) + 1, grid.values.size)
    return [grid.values[:count]] * len(histories)


def interpolation_weights(frames: Floats, times: Floats) -> Floats:
    """(times, frames) weights: linear in time between frames, constant before the first and beyond the last.

    frames : (frames,) s. times : (times,) s.
    """
    position = np.interp(times, frames, np.arange(frames.size, dtype=float))
    below = np.minimum(position.astype(int), frames.size - 1)
    fraction, rows = position - below, np.arange(times.size)
    weights = np.zeros((times.size, frames.size))
    weights[rows, below] = 1.0 - fraction
    weights[rows, np.minimum(below + 1, frames.size - 1)] += fraction
    return weights


def observed_outputs(specimen: Specimen, history: History, values: Floats) -> Floats:
    """What a history's instrument shows, (candidates, times, outputs): of a creep strain, its own measure of strain.

    values : (candidates, times, outputs) of the network.
    """
    observe = _strain_method(specimen, "observed_output")
    return values if observe is None else np.asarray(observe(history, values[..., 0]))[..., None]


def observation_derivative(specimen: Specimen, history: History, values: Floats) -> Floats:
    """Derivative of what is shown to what the network gives, values (candidates, times, outputs); of that shape."""
    derivative = _strain_method(specimen, "output_derivative")
    return np.ones_like(values) if derivative is None else np.asarray(derivative(history, values[..., 0]))[..., None]


def _strain_method(specimen: Specimen, name: str) -> Any:
    """A method of creep strain of a specimen whose only output is a strain; None of others, which show one thing."""
    outputs = outputs_of(specimen)
    only_strain = len(outputs) == 1 and outputs[0].quantity == "strain"
    return getattr(specimen, name, None) if only_strain else None


@dataclass(frozen=True, eq=False)
class SurrogateHeader:
    """What the file of a surrogate says beside the weights."""

    kind: Literal["parameter-gru"]
    recipe: ParameterGru
    metadata: SurrogateMetadata


@dataclass(frozen=True, eq=False)
class NetworkQuery:
    """Inputs of the network for candidates x tests.

    law_rows : (candidates, columns) of the law. constants : (candidates, tests, constants). derivatives : {nuisance:
    (candidates, tests, constants)} of the constants. domain : (candidates, tests, inputs) of the applicability domain.
    """

    law_rows: Floats
    constants: Floats
    derivatives: Mapping[str, Floats]
    domain: Floats

    @classmethod
    def of_tests(
        cls, inputs: LoadHistoryInputs, law_rows: Floats, tests: Sequence[tuple[History, Floats]], moved: NuisanceValues
    ) -> NetworkQuery:
        """The inputs of tests.

        law_rows : (candidates, columns). tests : with frames, (frames,) s, each. moved : their nuisances.
        """
        count = len(law_rows)
        perturbed = [
            inputs.with_nuisances(history, {kind: v[:, k] for kind, v in moved.items()}, count)
            for k, (history, _) in enumerate(tests)
        ]
        constants = np.stack([values for values, _ in perturbed], axis=1)
        derivatives = {kind: np.stack([slopes[kind] for _, slopes in perturbed], axis=1) for kind in moved}
        of_tests = np.array([[*inputs.domain_inputs(*test).values()] for test in tests])[:, constants.shape[2] :]
        rows = np.broadcast_to(law_rows[:, None], (count, len(tests), law_rows.shape[1]))
        domain = [rows, constants, np.broadcast_to(of_tests, (count, *of_tests.shape))]
        return cls(law_rows, constants, derivatives, np.concatenate(domain, axis=2))

    @property
    def rows(self) -> Floats:
        """(candidates x tests, columns + constants) of the network."""
        count, tests, constants = self.constants.shape
        law_rows = np.repeat(self.law_rows, tests, axis=0)
        return np.concatenate([law_rows, self.constants.reshape(count * tests, constants)], axis=1)

    def directions(self, law_derivatives: Floats) -> Floats:
        """(candidates x tests, directions, columns + constants): how inputs move with parameters, then with nuisances.

        law_derivatives : (candidates, columns, parameters).
        """
        (count, tests, constants), (_, columns, parameters) = self.constants.shape, law_derivatives.shape
        directions = np.zeros((count * tests, parameters + len(self.derivatives), columns + constants))
        directions[:, :parameters, :columns] = np.repeat(np.swapaxes(law_derivatives, 1, 2), tests, axis=0)
        for k, slopes in enumerate(self.derivatives.values()):
            directions[:, parameters + k, columns:] = slopes.reshape(count * tests, constants)
        return directions


class Surrogate(Predictor, Presentable):
    """A trained network in the place of a specimen; a records.Predictor.

    It predicts at the frames of its training, and between them linearly in time. recipe, weights, metadata : what it
    was trained as, the arrays of its network, and what is known of its training. precision : of its predictions.
    """

    is_surrogate: ClassVar[bool] = True

    def __init__(
        self, recipe: ParameterGru, weights: Weights, metadata: SurrogateMetadata, precision: Precision = np.float64
    ) -> None:
        self.recipe, self.weights, self.metadata, self.precision = recipe, weights, metadata, precision
        self.network = recipe.network(weights, metadata, precision)

    @property
    def name(self) -> str:  # type: ignore[override]
        """Which kind of surrogate it is, and of what."""
        return f"{self.recipe.kind} of {self.specimen.name}"

    @property
    def title(self) -> str:  # type: ignore[override]
        """One line for people."""
        return f"{self.specimen.title}, by a network ({self.recipe.kind}) trained on law '{self.metadata.law.name}'"

    @property
    def specimen(self) -> Specimen:
        """The specimen whose outputs it predicts."""
        return self.metadata.specimen

    @property
    def outputs(self) -> tuple[str, ...]:  # type: ignore[override]
        """Names of what is predicted."""
        return self.metadata.outputs

    @property
    def nuisances(self) -> tuple[str, ...]:  # type: ignore[override]
        """The nuisances whose inputs were varied."""
        return self._history_inputs.nuisances

    def single_threaded(self) -> Surrogate:
        """The same network in the place of a specimen that starts no threads."""
        specimen: Any = self.specimen.single_threaded()
        return Surrogate(self.recipe, self.weights, replace(self.metadata, specimen=specimen), self.precision)

    def for_search(self) -> Surrogate:
        """The same network in single precision, whose rounding is far below its error."""
        return Surrogate(self.recipe, self.weights, self.metadata, np.float32)

    def outside_class(self, law: CreepLaw) -> str:
        """Why it does not predict a law, in a sentence; "" where it does."""
        try:
            zero_coefficients(self.metadata.law, law)
        except SurrogateError as error:
            return str(error)
        return ""

    def predict_batch(
        self, law: CreepLaw, theta: Floats, histories: Sequence[History], nuisances: NuisanceValues, sensitivities: bool
    ) -> Prediction:
        """Predict each history's outputs at its times; theta : (candidates, parameters) internal values.

        A row outside the domain of the training has its values all the same, and Status.OUTSIDE_DOMAIN. A law outside
        the class of the training has Status.OUTSIDE_CLASS, a `reason`, and NaN: nothing bounds the error there.
        """
        for history in histories:
            check_history(self.metadata, history)
        reason = self.outside_class(law)
        if reason:
            remedy = f"simulate it with the specimen '{self.specimen.name}' itself"
            return unpredicted(histories, self.outputs, len(theta), Status.OUTSIDE_CLASS, f"{reason}; {remedy}")
        theta = complete_parameters(self.metadata.law, law, theta)
        frames = prediction_frames(self.metadata.grid, histories)
        inputs, law_inputs = self._history_inputs, self._law_inputs
        tests = [*zip(histories, frames, strict=True)]
        query = NetworkQuery.of_tests(inputs, law_inputs.input_rows(theta), tests, nuisances)
        directions = None
        if sensitivities:
            positions = [self.metadata.law.names.index(name) for name in law.names]
            directions = query.directions(law_inputs.derivatives(theta)[:, :, positions])
        series = np.stack([inputs.series_values(*test) for test in tests])
        rows, row_derivatives = self.network.outputs_with_derivatives(query.rows, series, directions)
        shape = query.constants.shape[:2]
        outputs, derivatives = (v.reshape(*shape, *v.shape[1:]) for v in (rows, row_derivatives))
        outside = self.metadata.domain.outside(query.domain)
        status = np.where(outside, int(Status.OUTSIDE_DOMAIN), int(Status.COMPLETE)).astype(np.int64)
        parts = []
        for k, (history, times) in enumerate(tests):
            part = self._history_prediction(
                history, times, outputs[:, k], None if directions is None else derivatives[:, k], tuple(nuisances)
            )
            parts.append(replace(part, status=status[:, k]))
        return assemble_prediction(parts, histories, self.outputs, len(theta))

    def predict_samples(self, samples: SampleArrays) -> Floats:
        """(rows, frames, outputs) of the network for samples of its recipe, in physical units."""
        return self.network.outputs(*(np.asarray(samples[name], float) for name in ("constants", "series")))

    @property
    def weight_count(self) -> int:
        """Numbers that its training fitted."""
        return sum(array.size for name, array in self.weights.items() if name.startswith(("network.", "head.")))

    @property
    def error(self) -> dict[str, float]:  # type: ignore[override]
        """{output: standard deviation of its error}, in the output's unit, from the validation rows.

        1.25 times the mean absolute error, that of a Gaussian: rare large errors would widen every interval.
        """
        outputs = self.metadata.metrics.get("outputs", {})
        return {name: 1.2533 * float(errors["mae"]) for name, errors in outputs.items() if "mae" in errors}

    def reduced_order_model(self) -> Predictor:
        """A model for global searches: that of the specimen, if it has one, else the network itself."""
        return self.specimen.reduced_order_model() or self

    def refined(self) -> Predictor:
        """What it stands for: the specimen itself, on the finer discretisation where it has one."""
        return self.specimen.refined() or self.specimen

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

    @cached_property
    def _history_inputs(self) -> LoadHistoryInputs:
        return self.recipe.history_inputs(self.specimen, self.metadata.conditions, self.metadata.grid.relative)

    @cached_property
    def _law_inputs(self) -> LawInputs:
        return LawInputs(self.metadata.law)

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

    shown_by = "surrogate.surrogate_text"


def reduced_order_models() -> dict[str, Predictor]:
    """{name of a surrogate: the reduced-order model of a known specimen}.

    The name is the specimen's `surrogate_name`, by default its own.
    """
    known = {name: (one, one.reduced_order_model()) for name, one in known_specimens().items()}
    return {one.surrogate_name or name: model for name, (one, model) in known.items() if model is not None}


SUFFIX = ".safetensors"


@checked
def surrogate(name_or_path: str | Path) -> Predictor:
    """Return a cheap model that stands for a specimen, by its name or from its file.

    name_or_path : "dimple", the reduced-order model of the default bulge specimen; or the file of a trained network,
        see train().
    """
    text = str(name_or_path)
    if isinstance(name_or_path, str) and not text.endswith(SUFFIX) and text in (named := reduced_order_models()):
        return named[text]
    if not (text.endswith(SUFFIX) or Path(text).exists()):
        choices = nearest(text, reduced_order_models())
        raise SurrogateError(f"no surrogate is called '{text}', and there is no such file; {choices}")
    return load_surrogate(text)


def load_surrogate(path: str | Path) -> Surrogate:
    """Return the surrogate in a file; SurrogateError says what is wrong with any other file."""
    weights, header = read_safetensors(path, SURROGATE)
    try:
        found = CODEC.from_json(SurrogateHeader, header, "its header")
        surrogate = Surrogate(found.recipe, weights, found.metadata)
        infinite = [name for name, one in weights.items() if not np.isfinite(np.asarray(one, dtype=float)).all()]
        if infinite:
            raise SurrogateError(f"its weights '{infinite[0]}' are not finite; train it again")
    except CreepkitError as error:
        raise SurrogateError(str(error) if str(path) in str(error) else f"{path}: {error}") from None
    except (KeyError, TypeError, ValueError, RuntimeError, AttributeError):
        raise SurrogateError(f"{path}: its header and its weights do not belong together; train it again") from None
    return surrogate
