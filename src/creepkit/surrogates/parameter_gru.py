"""ParameterGru: the recipe of the surrogate of one law as in the paper, its training, and what a surrogate knows.

A row of inputs is inside the applicability domain when each stands within the range of the training rows (with a
margin) and the row lies no farther from their middle than the farthest training row as the others see it: Mahalanobis
distance, whose leave-one-out value has a closed form. The range catches one input that leaves its range, the distance a
combination that never occurred (a coefficient and an exponent that between them make no creep). What never varied in
training may not vary at all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from creepkit import limits
from creepkit.arrays import ArrayLike, Bools, Floats
from creepkit.checked_arguments import checked
from creepkit.errors import SurrogateError
from creepkit.jobs.progress import ProgressCallback as ProgressCallback
from creepkit.options import Options, option
from creepkit.records import Specimen
from creepkit.surrogates.network_evaluation import ParameterNetwork, SampleArrays, Weights
from creepkit.surrogates.parameter_inputs import (
    SERIES_INPUTS,
    LawInputs,
    LoadHistoryInputs,
    constant_inputs,
    load_history_arrays,
)

if TYPE_CHECKING:
    from torch import Tensor

    from creepkit.dataset.dataset import Dataset
    from creepkit.language import CreepLaw
    from creepkit.sampling.conditions import TimeGrid
    from creepkit.surrogates.parameter_network import ParameterModule, SampleTensors

DEFAULT_MARGIN = 0.01
"""Share of an input's range by which it may leave it, unless more is forgiven."""


LEAST_VARIANCE = 1e-9
"""Variance of a standardised direction below which it never varied."""


@dataclass(frozen=True, eq=False)
class ApplicabilityDomain:
    """Where training rows lie.

    names : of the inputs. low, high : (inputs,) their ranges, in their units. margin : (inputs,) share of its range by
    which an input may leave it. mean, scale : (inputs,) their mean and standard deviation. whitening : (inputs,
    directions), from standardised inputs to independent ones. limit : largest Mahalanobis distance inside.
    """

    names: tuple[str, ...]
    low: Floats
    high: Floats
    margin: Floats
    mean: Floats
    scale: Floats
    whitening: Floats
    limit: float

    def __post_init__(self) -> None:
        inputs = len(self.names)
        vectors = (self.low, self.high, self.margin, self.mean, self.scale)
        if any(v.shape != (inputs,) for v in vectors) or self.whitening.shape[:1] != (inputs,):
            raise SurrogateError(f"the domain of a surrogate: its arrays do not belong to {inputs} inputs; train again")
        numbers = (*vectors, self.whitening, np.asarray(self.limit))
        ordered = (self.low <= self.high).all() and (self.scale > 0).all() and (self.margin >= 0).all()
        if any(np.isnan(one).any() for one in numbers) or not ordered or not self.limit > 0:
            raise SurrogateError(
                "the domain of a surrogate: a number is missing, a range not from low to high, or a scale, margin or "
                "limit not above zero, so that nothing would lie outside; train again"
            )

    @classmethod
    def from_rows(cls, names: Sequence[str], rows: Floats, margin: ArrayLike = DEFAULT_MARGIN) -> ApplicabilityDomain:
        """The domain of training rows (n, inputs); NaN, an input that is not there, counts nowhere.

        margin : number or (inputs,).
        """
        rows = np.array(rows, float)
        finite = np.isfinite(rows)
        rows[:, ~finite.any(axis=0)] = 0.0
        mean, low, high = (f(rows, axis=0) for f in (np.nanmean, np.nanmin, np.nanmax))
        rows = np.where(np.isnan(rows), mean, rows)
        deviation = rows.std(axis=0)
        scale = np.where(deviation > 1e-6 * np.maximum(np.abs(mean), 1e-300), deviation, np.maximum(np.abs(mean), 1.0))
        standard = (rows - mean) / scale
        variance, axes = np.linalg.eigh(np.cov(standard, rowvar=False, ddof=1).reshape(len(names), len(names)))
        whitening = axes / np.sqrt(np.maximum(variance, LEAST_VARIANCE))
        square = ((standard @ whitening) ** 2).sum(axis=1)
        limit = float(np.sqrt(_leave_one_out_distance(square, len(rows)).max()))
        margins = np.broadcast_to(np.asarray(margin, float), low.shape).copy()
        return cls(tuple(names), low, high, margins, mean, scale, whitening, limit)

    def distance(self, rows: Floats) -> Floats:
        """How far rows (..., inputs) lie out, (...): up to 1 is inside; NaN, an input that is not there, is not far."""
        rows = np.where(np.isnan(rows), self.mean, rows)
        mahalanobis = np.sqrt((((rows - self.mean) / self.scale @ self.whitening) ** 2).sum(axis=-1)) / self.limit
        return np.asarray(np.maximum(mahalanobis, 1.0 + (self._excess(rows) - self.margin).max(axis=-1, initial=-1.0)))

    def outside(self, rows: Floats) -> Bools:
        """Which rows (..., inputs) lie outside, (...)."""
        return np.asarray(self.distance(rows) > 1.0)

    def _excess(self, rows: Floats) -> Floats:
        """By what share of its training range each input of rows (..., inputs) leaves it, likewise; negative inside."""
        extent = np.where(self.high > self.low, self.high - self.low, 1e-6 * self.scale)
        return np.asarray(np.maximum(self.low - rows, rows - self.high) / extent)


def _leave_one_out_distance(square: Floats, n: int) -> Floats:
    """Squared distance of each row from the others, given that from all n with their covariance.

    Removing row i moves the mean by (x_i - m)/(n - 1) and the scatter by n/(n - 1) (x_i - m)(x_i - m)'; Sherman and
    Morrison give the rest.
    """
    denominator = (n - 1) - n / (n - 1) * square
    distance_squared = (n / (n - 1)) ** 2 * (n - 2) * square / np.maximum(denominator, 1e-300)
    return np.asarray(np.where(denominator > 1e-9 * n, distance_squared, np.inf))


@checked
@dataclass(frozen=True)
class Training(Options, title="settings of a training", error=SurrogateError, prefix="training: "):
    """How a network is trained: with Adam, on batches of whole histories.

    epochs : passes over the training rows. batch : histories in a step. rate : Adam's, at the beginning.
    schedule : of the rate: "constant"; "cosine", down to zero at the last epoch; "plateau", a tenth of it whenever the
        validation loss has not fallen by a ten-thousandth for `patience` epochs, as the paper has it.
    early_stop : stop when the validation loss has not fallen for so many epochs; None goes to the end.
    clip : largest norm of the gradient; None leaves it alone.
    validation : share of the rows that are set aside, drawn by the seed. samples : rows of the others that are learnt
    from, the first so many; None takes them all. The rows set aside are the same for every number of samples.
    """

    epochs: int = option(500, "Passes over the training rows.", limits.EPOCHS)
    batch: int = option(64, "Histories in a step.", limits.BATCH)
    rate: float = option(1e-3, "Rate of Adam at the beginning.", limits.LEARNING_RATE)
    schedule: Literal["plateau", "cosine", "constant"] = option("plateau", "Of the rate.")
    patience: int = option(15, "Epochs without gain after which a plateau lowers the rate.", limits.EPOCHS)
    early_stop: int | None = option(None, "Stop after so many epochs without gain.", limits.EPOCHS)
    clip: float | None = option(None, "Largest norm of the gradient.", limits.LARGEST_GRADIENT)
    validation: float = option(0.2, "Share of the rows that are set aside.", limits.numbers(0.001, 0.999))
    samples: int | None = option(None, "Rows of the others that are learnt from, the first so many.", limits.SAMPLES)


@dataclass(frozen=True, eq=False)
class SurrogateMetadata:
    """What a surrogate knows beside its weights; all of it stands in the header of its file.

    law, specimen, outputs, grid : of the data set; a surrogate of one law predicts that law.
    parameters, conditions : names of the data set's columns.
    scaling : {input: (mean, standard deviation)}, and of outputs, for people to read; the module holds its own.
    domain : where the training rows lie, in the inputs that the recipe names.
    metrics : of the validation rows (see surrogates.evaluation). curves : {name: one number an epoch}.
    provenance : versions, seed, fingerprints, counts, when.
    notes : limitations, a sentence each.
    """

    law: CreepLaw
    specimen: Specimen
    outputs: tuple[str, ...]
    grid: TimeGrid
    parameters: tuple[str, ...]
    conditions: tuple[str, ...]
    domain: ApplicabilityDomain
    scaling: Mapping[str, Any] = field(default_factory=dict)
    metrics: Mapping[str, Any] = field(default_factory=dict)
    curves: Mapping[str, list[float]] = field(default_factory=dict)
    provenance: Mapping[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @classmethod
    def from_dataset(cls, data: Dataset, **fields: Any) -> SurrogateMetadata:
        """The metadata of a data set; fields : the other fields."""
        return cls(
            law=data.law,
            specimen=data.specimen,
            outputs=data.outputs,
            grid=data.grid,
            parameters=data.parameter_names,
            conditions=data.condition_names,
            **fields,
        )


@checked
@dataclass(frozen=True)
class ParameterGru(Options, title="settings of a network", error=SurrogateError, prefix="ParameterGru: "):
    """A recurrent network whose inputs are a law's parameters and the load: the paper's, at its defaults.

    Its input at each frame is the load there, all that the paper uses; for grids that stretch with the test also the
    mean load since the frame before, which tells when between two frames the load jumped, the time and the step.

    hidden, layers : of the network. target : "value" of the first output, or its "log".
    """

    hidden: int = option(128, "Units of a layer.", limits.HIDDEN)
    layers: int = option(3, "Layers.", limits.LAYERS)
    target: Literal["value", "log"] = option("value", "Of the first output.")
    training: Training = field(default_factory=Training)

    kind: ClassVar[Literal["parameter-gru"]] = "parameter-gru"

    def sample_arrays(self, data: Dataset, progress: ProgressCallback | None = None) -> SampleArrays:
        """Arrays of a data set: constants, series, targets, mask, and "domain" for the applicability domain."""
        law, history_inputs = LawInputs(data.law), self._history_inputs(data)
        mask = np.asarray(np.isfinite(data.values).all(axis=-1))
        constants, series, domain_rows = load_history_arrays(data, history_inputs, progress)
        rows = law.input_rows(data.law.to_internal(data.parameters))
        arrays = {
            "constants": np.concatenate([rows, constants], axis=1),
            "series": series,
            "targets": np.where(mask[..., None], data.values, 0.0),
        }
        single = {name: np.asarray(v, np.float32) for name, v in arrays.items()}
        return {**single, "mask": mask, "domain": np.concatenate([rows, domain_rows], axis=1)}

    def module(self, data: Dataset, samples: SampleTensors, train: Tensor) -> ParameterModule:
        """A fresh network with the scales of the training rows; train : (rows,) their positions."""
        from creepkit.surrogates.parameter_network import ParameterModule

        sizes = samples["constants"].shape[-1], samples["series"].shape[-1], len(data.outputs)
        network = ParameterModule(sizes, self.hidden, self.layers, logarithm=self.target == "log")
        return network.with_scales(samples, train)

    def metadata(
        self, data: Dataset, samples: SampleTensors, train: Tensor, module: ParameterModule
    ) -> SurrogateMetadata:
        """Scales by name, the domain, and what was constant; train : (rows,) positions of training rows."""
        history_inputs, law = self._history_inputs(data), LawInputs(data.law)
        names = (*law.names, *history_inputs.constants)
        scaling = {
            "inputs": _scale_pairs(names, module.constants),
            "series": _scale_pairs(history_inputs.series, module.series),
            "outputs": _scale_pairs(data.outputs, module.targets),
        }
        domain_names = (*law.names, *history_inputs.domain_inputs(data.planned_test(0), data.times(0)))
        columns = zip(names, samples["constants"][train].T, strict=True)
        constant = ", ".join(n for n, column in columns if _is_constant(column) and not n.endswith(" is off"))
        notes = (f"constant in training, so that nothing is known beyond: {constant}",) if constant else ()
        domain = ApplicabilityDomain.from_rows(domain_names, samples["domain"][train].numpy())
        return SurrogateMetadata.from_dataset(data, scaling=scaling, domain=domain, notes=notes)

    def network(self, weights: Weights, metadata: SurrogateMetadata) -> ParameterNetwork:
        """The trained network; SurrogateError where the weights are not those of this recipe."""
        sizes = len(metadata.scaling["inputs"]), len(metadata.scaling["series"]), len(metadata.outputs)
        return ParameterNetwork.from_weights(weights, sizes, (self.hidden, self.layers), logarithm=self.target == "log")

    def history_inputs(self, specimen: Specimen, conditions: tuple[str, ...], relative: bool) -> LoadHistoryInputs:
        """The inputs that tests give: modulus, lengths and temperature that varied in training, and the series."""
        constants = constant_inputs(specimen, conditions)
        return LoadHistoryInputs(specimen, constants, SERIES_INPUTS if relative else SERIES_INPUTS[:1], relative)

    def _history_inputs(self, data: Dataset) -> LoadHistoryInputs:
        return self.history_inputs(data.specimen, data.condition_names, data.grid.relative)


def _scale_pairs(names: tuple[str, ...], scale: Any) -> dict[str, list[float]]:
    means, deviations = scale.mean.tolist(), scale.deviation.tolist()
    return {name: [m, d] for name, m, d in zip(names, means, deviations, strict=True)}


def _is_constant(column: Tensor) -> bool:
    finite = column[~column.isnan()]
    return not len(finite) or bool((finite - finite[0]).abs().max() <= 1e-6 * finite.abs().max())


@dataclass(frozen=True)
class NetworkSizes(Options, title="sizes of networks", error=SurrogateError):
    """Values to be combined in a size study; what is () stays as the recipe has it.

    samples : numbers of samples to learn from.
    """

    layers: tuple[int, ...] = option((), "Numbers of layers.", limits.LAYERS)
    hidden: tuple[int, ...] = option((), "Units of a layer.", limits.HIDDEN)
    samples: tuple[int, ...] = option((), "Numbers of samples to learn from; all by default.", limits.SAMPLES)
