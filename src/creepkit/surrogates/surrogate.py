"""Surrogates: trained networks as predictors, and the check that a history is one they apply to."""

from __future__ import annotations

import warnings
import weakref
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import SurrogateError, SurrogateWarning
from creepkit.presentation import Presentable
from creepkit.records import (
    History,
    NuisanceValues,
    Prediction,
    Predictor,
    Specimen,
    Status,
    SupportsReducedOrderModel,
    SupportsRefinement,
    broadcast_candidates,
    check_nuisances,
    dimension_named,
    outputs_of,
    unpredicted,
)
from creepkit.sampling.conditions import TimeGrid
from creepkit.sampling.specimen_conditions import specimen_conditions
from creepkit.surrogates.recipe import ProgressCallback, SampleArrays, SurrogateMetadata, Training, Weights
from creepkit.surrogates.weight_files import CODEC, write_weights

if TYPE_CHECKING:
    from torch import Tensor

    from creepkit.dataset.dataset import Dataset
    from creepkit.language import CreepLaw
    from creepkit.surrogates.parameter_network import ParameterModule, SampleTensors


RELATIVE_TOLERANCE = 1e-6


def check_applicable(
    metadata: SurrogateMetadata, histories: Sequence[History], nuisances: Iterable[str], known_nuisances: Sequence[str]
) -> None:
    """SurrogateError where a history, or an explicit nuisance, is none that the surrogate knows."""
    for history in histories:
        check_history(metadata, history)
    check_nuisances(nuisances, known_nuisances, "this surrogate", SurrogateError)


def warn_of_unknown_domain(surrogate: Surrogate) -> None:
    """SurrogateWarning, once for each surrogate, where it does not say where its training rows lie."""
    if surrogate not in _WARNED:
        _WARNED.add(surrogate)
        warnings.warn(
            f"{surrogate.title}: its file states no domain, so that answers far from its training are not recognised; "
            "train it again, or confirm what is found by the specimen itself",
            SurrogateWarning,
            stacklevel=2,
        )


_WARNED: weakref.WeakSet[Surrogate] = weakref.WeakSet()


def check_history(metadata: SurrogateMetadata, history: History) -> None:
    """SurrogateError where a history is of another kind of test than those of the training."""
    where, specimen = history.origin, metadata.specimen
    quantity = specimen_conditions(specimen).load.name
    if history.loading.quantity != quantity:
        raise SurrogateError(f"{where}: its {history.loading.quantity} is prescribed; the surrogate knows {quantity}")
    control = getattr(history.loading, "control", None)
    if control not in (None, "load") and quantity == "stress" and metadata.provenance.get("control", "load") != control:
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


class Surrogate(Presentable, ABC, text="reports.surrogate:surrogate_text"):
    """A trained network in the place of a specimen; a records.Predictor.

    recipe, weights, metadata : what it was trained as, the arrays of its network, and what is known of its training.
    """

    nuisances: tuple[str, ...] = ()
    """Kinds of explicit nuisances that predict() understands."""

    def __init__(self, recipe: Recipe, weights: Weights, metadata: SurrogateMetadata) -> None:
        self.recipe, self.weights, self.metadata = recipe, weights, metadata

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

    @abstractmethod
    def outside_class(self, law: CreepLaw) -> str:
        """Why it does not predict a law, in a sentence; "" where it does."""

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
        check_applicable(self.metadata, histories, nuisances or (), self.nuisances)
        reason = self.outside_class(law)
        if reason:
            candidates = len(broadcast_candidates(theta, nuisances, len(histories))[0])
            remedy = f"simulate it with the specimen '{self.specimen.name}' itself"
            return unpredicted(histories, self.outputs, candidates, Status.OUTSIDE_CLASS, f"{reason}; {remedy}")
        return self._predict(law, theta, histories, nuisances, sensitivities)

    @abstractmethod
    def _predict(
        self,
        law: CreepLaw,
        theta: Floats,
        histories: Sequence[History],
        nuisances: NuisanceValues | None,
        sensitivities: bool,
    ) -> Prediction:
        """As predict(), of a law and of histories that were checked."""

    @abstractmethod
    def predict_samples(self, samples: SampleArrays) -> Floats:
        """(rows, frames, outputs) of the network for samples of its recipe, in physical units."""

    @property
    @abstractmethod
    def weight_count(self) -> int:
        """Numbers that its training fitted."""

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
        recipe, metadata = CODEC.to_json(self.recipe), CODEC.to_json(self.metadata)
        return {"kind": self.recipe.kind, "recipe": recipe, "metadata": metadata}

    def save(self, path: str | Path) -> Path:
        """Write the weights with their header."""
        return write_weights(path, self.weights, self.file_header)

    def __repr__(self) -> str:
        return f"<Surrogate: {self.title}>"


class Recipe(Protocol):
    """A frozen record of what is trained: its fields are plain numbers and words, and make the recipe again."""

    kind: ClassVar[str]
    """The word for it in files; RECIPE_CLASSES of surrogates.loading says where the class is."""

    @property
    def training(self) -> Training:
        """How it is trained, unless train() is given other settings; a field."""
        ...

    def sample_arrays(self, data: Dataset, progress: ProgressCallback | None = None) -> SampleArrays:
        """The arrays of a data set; DatasetError where it cannot be learnt from."""
        ...

    def module(self, data: Dataset, samples: SampleTensors, train: Tensor) -> ParameterModule:
        """A fresh network for these data; its scales are those of the training rows, train (rows,), alone."""
        ...

    def metadata(self, data: Dataset, samples: SampleTensors, train: Tensor) -> SurrogateMetadata:
        """What the data say of a surrogate before its training: scaling, domain and notes among it; train : (rows,)."""
        ...

    def surrogate(self, weights: Weights, metadata: SurrogateMetadata) -> Surrogate:
        """The trained network as a predictor; SurrogateError where the weights are not those of such a network."""
        ...
