"""ParameterGru: the paper's surrogate of one law, and what makes it better at the same size."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np
import torch
from torch import Tensor

from creepkit.arrays import Floats
from creepkit.errors import DatasetError, SurrogateError, nearest
from creepkit.records import SupportsReducedOrderModel
from creepkit.surrogate.course_inputs import CONSTANT_INPUTS, SERIES_INPUTS, LoadHistoryInputs
from creepkit.surrogate.domain import ApplicabilityDomain
from creepkit.surrogate.law_inputs import LawInputs
from creepkit.surrogate.parameter_module import RecurrentCell, ParameterModule
from creepkit.surrogate.recipe import SurrogateModule, ProgressCallback, SampleTensors, SurrogateMetadata, Training

if TYPE_CHECKING:
    from creepkit.dataset.dataset import Dataset
    from creepkit.surrogate.surrogate import Surrogate


@dataclass(frozen=True)
class ParameterGru:
    """A recurrent network that sees a law's parameters and the load: the paper's, at its defaults.

    hidden, layers, cell : of the network; cell "gru" or "lstm".
    inputs : what is seen at each frame, of "load" (at the frame, all that the paper's sees), "mean_load" (since the
        frame before: it tells when between two frames the load jumped), "time" and "step". () is "load" alone, and for
        grids that stretch with the test "load", "mean_load", "time" and "step".
    target : "value" of the first output, or its "log".
    base : "none"; or "one-dof": the specimen's cheap stand-in predicts the first output, and the network corrects the
        logarithm of it. Derivatives are then left to differences.
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
                raise SurrogateError(f"ParameterGru: {name} is '{getattr(self, name)}'; allowed are {', '.join(allowed)}")
        for name in self.inputs:
            if name not in SERIES_INPUTS:
                raise SurrogateError(f"ParameterGru: there is no input '{name}': {nearest(name, SERIES_INPUTS)}")

    # ---- what the trainer asks -------------------------------------------------------------------------------------

    def sample_tensors(self, data: Dataset, progress: ProgressCallback | None = None) -> SampleTensors:
        """Tensors of a data set: constants, series, targets, mask, base, and "domain" for the guard."""
        law, history_inputs = LawInputs(data.law), self._history_inputs(data)
        mask = np.asarray(np.isfinite(data.values).all(axis=-1))
        constants, series, domain_rows = _test_inputs(data, history_inputs, progress)
        rows = law.input_rows(law.internal_rows(data.parameters))
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
        """A fresh network with the scales of the training rows."""
        sizes = samples["constants"].shape[-1], samples["series"].shape[-1], len(data.outputs)
        return self._network(sizes).with_scales(samples, train)

    def metadata(self, data: Dataset, samples: SampleTensors, train: Tensor) -> SurrogateMetadata:
        """Scales by name, the domain, and what was constant."""
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
        notes = (f"constant in training, so that nothing is known beyond: {', '.join(constant_names)}",) if constant_names else ()
        domain = ApplicabilityDomain.from_rows(domain_names, samples["domain"][train].numpy())
        return SurrogateMetadata.from_dataset(data, scaling=scaling, domain=domain, notes=notes)

    def empty_module(self, metadata: SurrogateMetadata) -> SurrogateModule:
        """A network for the weights of a file."""
        series = len(metadata.scaling["series"]) - (self.base != "none")
        return self._network((len(metadata.scaling["inputs"]), series, len(metadata.outputs)))

    def surrogate(self, module: SurrogateModule, metadata: SurrogateMetadata) -> Surrogate:
        """The network as a predictor."""
        from creepkit.surrogate.parameter_surrogate import ParameterSurrogate

        return ParameterSurrogate(self, module, metadata)

    # ---- parts -----------------------------------------------------------------------------------------------------

    def series_inputs(self, relative: bool) -> tuple[str, ...]:
        """What is seen at each frame."""
        return self.inputs or (SERIES_INPUTS if relative else SERIES_INPUTS[:1])

    def _history_inputs(self, data: Dataset) -> LoadHistoryInputs:
        return load_history_inputs(self, data.specimen, data.condition_names, data.grid.relative)

    def _network(self, sizes: tuple[int, int, int]) -> ParameterModule:
        log, based = self.target == "log", self.base != "none"
        return ParameterModule(sizes, self.hidden, self.layers, self.cell, logarithm=log, corrects_base=based)


def load_history_inputs(recipe: ParameterGru, specimen: Any, conditions: tuple[str, ...], relative: bool) -> LoadHistoryInputs:
    """The inputs that tests give: what of CONSTANTS was varied, and the recipe's series."""
    return LoadHistoryInputs(specimen, tuple(n for n in CONSTANT_INPUTS if n in conditions), recipe.series_inputs(relative), relative)


def base_outputs(data: Dataset, progress: ProgressCallback | None = None) -> Floats:
    """(n, frames) what the specimen's stand-in predicts of the first output; its last value after its end."""
    reduced_model = screening_model_of(data.specimen)
    base = np.empty(data.values.shape[:2])
    for k in range(len(data)):
        plan = data.planned_test(k).replace(times=data.times(k))
        prediction = reduced_model.predict(data.law, data.values_of(k), [plan])
        base[k] = hold_last_value(prediction.values[0, 0, :, prediction.outputs.index(data.outputs[0])])
        if progress is not None:
            progress("base", k + 1, len(data), "")
    return base


def screening_model_of(specimen: Any) -> Any:
    """The specimen's cheap stand-in; SurrogateError where it has none."""
    if not isinstance(specimen, SupportsReducedOrderModel):
        raise SurrogateError(f"specimen '{specimen.name}' has no stand-in of one degree of freedom; use base='none'")
    return specimen.reduced_order_model()


def hold_last_value(values: Floats) -> Floats:
    """Values (..., frames) with their last finite one in the place of NaN after it, and none below zero."""
    frames = np.where(np.isfinite(values), np.arange(values.shape[-1]), 0)
    last_finite = np.maximum.accumulate(frames, axis=-1)
    return np.nan_to_num(np.maximum(np.take_along_axis(values, last_finite, axis=-1), 0.0), nan=0.0)


def _test_inputs(data: Dataset, history_inputs: LoadHistoryInputs, progress: ProgressCallback | None) -> tuple[Floats, ...]:
    """Constants (n, C), series (n, frames, S) and what the guard sees (n, ...) of all tests."""
    parts = []
    for k in range(len(data)):
        plan, times = data.planned_test(k), data.times(k)
        parts.append((history_inputs.constant_values(plan), history_inputs.series_values(plan, times), history_inputs.domain_inputs(plan, times)))
        if progress is not None and (k + 1) % 1000 == 0:
            progress("inputs", k + 1, len(data), "")
    constants, series, domain_rows = (np.stack(part) for part in zip(*parts, strict=True))
    if not np.isfinite(series).all():
        raise DatasetError("the load of some sample of this data set is not a number; the file is damaged")
    return constants, series, domain_rows


def _scale_pairs(names: tuple[str, ...], scale: Any) -> dict[str, list[float]]:
    means, deviations = scale.mean.tolist(), scale.deviation.tolist()
    return {name: [m, d] for name, m, d in zip(names, means, deviations, strict=True)}


def _is_constant(column: Tensor) -> bool:
    finite = column[~column.isnan()]
    return not len(finite) or bool((finite - finite[0]).abs().max() <= 1e-6 * finite.abs().max())
