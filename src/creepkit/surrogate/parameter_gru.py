"""ParameterGru: the paper's surrogate of one law, and what makes it better at the same size."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np
import torch
from torch import Tensor

from creepkit.arrays import Floats
from creepkit.errors import DatasetError, SurrogateError, nearest
from creepkit.records import Screened
from creepkit.surrogate.course_inputs import CONSTANTS, SERIES, CourseInputs
from creepkit.surrogate.domain import Domain
from creepkit.surrogate.law_inputs import LawInputs
from creepkit.surrogate.parameter_module import Cell, ParameterModule
from creepkit.surrogate.recipe import Module, Progress, Samples, Told, Training

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
    cell: Cell = "gru"
    inputs: tuple[str, ...] = ()
    target: Literal["value", "log"] = "value"
    base: Literal["none", "one-dof"] = "none"
    training: Training = field(default_factory=Training)

    kind: ClassVar[str] = "parameter-gru"

    def __post_init__(self) -> None:
        object.__setattr__(self, "inputs", tuple(self.inputs))
        for name, most in (("hidden", 4096), ("layers", 32)):
            value = getattr(self, name)
            if value != int(value) or not 1 <= value <= most:
                raise SurrogateError(f"ParameterGru: {name} is {value}; allowed are whole numbers from 1 to {most}")
        words = {"cell": ("gru", "lstm"), "target": ("value", "log"), "base": ("none", "one-dof")}
        for name, known in words.items():
            if getattr(self, name) not in known:
                raise SurrogateError(f"ParameterGru: {name} is '{getattr(self, name)}'; allowed are {', '.join(known)}")
        for name in self.inputs:
            if name not in SERIES:
                raise SurrogateError(f"ParameterGru: there is no input '{name}': {nearest(name, SERIES)}")

    # ---- what the trainer asks -------------------------------------------------------------------------------------

    def samples(self, data: Dataset, progress: Progress | None = None) -> Samples:
        """Tensors of a data set: constants, series, targets, mask, base, and "domain" for the guard."""
        law, tests = LawInputs(data.law), self._tests(data)
        mask = np.asarray(np.isfinite(data.values).all(axis=-1))
        constants, series, summary = _of_tests(data, tests, progress)
        rows = law.rows(law.of_table(data.parameters))
        made = {
            "constants": np.concatenate([rows, constants], axis=1),
            "series": series,
            "targets": np.where(mask[..., None], data.values, 0.0),
        }
        if self.base != "none":
            made["base"] = base_of(data, progress)
        found = {name: torch.from_numpy(np.asarray(v, np.float32)) for name, v in made.items()}
        domain = np.concatenate([rows, summary], axis=1)
        return {**found, "mask": torch.from_numpy(mask), "domain": torch.from_numpy(domain)}

    def module(self, data: Dataset, samples: Samples, train: Tensor) -> Module:
        """A fresh network with the scales of the training rows."""
        sizes = samples["constants"].shape[-1], samples["series"].shape[-1], len(data.outputs)
        return self._network(sizes).fitted(samples, train)

    def told(self, data: Dataset, samples: Samples, train: Tensor) -> Told:
        """Scales by name, the domain, and what was constant."""
        tests, law = self._tests(data), LawInputs(data.law)
        names = (*law.names, *tests.constants)
        module = self.module(data, samples, train)
        assert isinstance(module, ParameterModule)
        series = (*tests.series, *(["ln base"] if self.base != "none" else []))
        scaling = {
            "inputs": _pairs(names, module.constants),
            "series": _pairs(series, module.series),
            "outputs": _pairs(data.outputs, module.targets),
        }
        guarded = (*law.names, *tests.domain_names(data.plan(0)))
        still = [n for n, c in zip(names, samples["constants"][train].T, strict=True) if _is_constant(c)]
        still = [n for n in still if not n.endswith(" is off")]
        notes = (f"constant in training, so that nothing is known beyond: {', '.join(still)}",) if still else ()
        domain = Domain.of(guarded, samples["domain"][train].numpy())
        return Told.of(data, scaling=scaling, domain=domain, notes=notes)

    def blank(self, told: Told) -> Module:
        """A network for the weights of a file."""
        series = len(told.scaling["series"]) - (self.base != "none")
        return self._network((len(told.scaling["inputs"]), series, len(told.outputs)))

    def surrogate(self, module: Module, told: Told) -> Surrogate:
        """The network as a predictor."""
        from creepkit.surrogate.parameter_surrogate import ParameterSurrogate

        return ParameterSurrogate(self, module, told)

    # ---- parts -----------------------------------------------------------------------------------------------------

    def series(self, relative: bool) -> tuple[str, ...]:
        """What is seen at each frame."""
        return self.inputs or (SERIES if relative else SERIES[:1])

    def _tests(self, data: Dataset) -> CourseInputs:
        return tests_of(self, data.specimen, data.condition_names, data.grid.relative)

    def _network(self, sizes: tuple[int, int, int]) -> ParameterModule:
        log, based = self.target == "log", self.base != "none"
        return ParameterModule(sizes, self.hidden, self.layers, self.cell, logarithm=log, based=based)


def tests_of(recipe: ParameterGru, specimen: Any, conditions: tuple[str, ...], relative: bool) -> CourseInputs:
    """The inputs that tests give: what of CONSTANTS was varied, and the recipe's series."""
    return CourseInputs(specimen, tuple(n for n in CONSTANTS if n in conditions), recipe.series(relative), relative)


def base_of(data: Dataset, progress: Progress | None = None) -> Floats:
    """(n, frames) what the specimen's stand-in predicts of the first output; its last value after its end."""
    stand_in = stand_in_of(data.specimen)
    base = np.empty(data.values.shape[:2])
    for k in range(len(data)):
        plan = data.plan(k).replace(times=data.times(k))
        found = stand_in.predict(data.law, data.values_of(k), [plan])
        base[k] = held(found.values[0, 0, :, found.outputs.index(data.outputs[0])])
        if progress is not None:
            progress("base", k + 1, len(data), "")
    return base


def stand_in_of(specimen: Any) -> Any:
    """The specimen's cheap stand-in; SurrogateError where it has none."""
    if not isinstance(specimen, Screened):
        raise SurrogateError(f"specimen '{specimen.name}' has no stand-in of one degree of freedom; use base='none'")
    return specimen.screening()


def held(values: Floats) -> Floats:
    """Values (..., frames) with their last finite one in the place of NaN after it, and none below zero."""
    frames = np.where(np.isfinite(values), np.arange(values.shape[-1]), 0)
    last = np.maximum.accumulate(frames, axis=-1)
    return np.nan_to_num(np.maximum(np.take_along_axis(values, last, axis=-1), 0.0), nan=0.0)


def _of_tests(data: Dataset, tests: CourseInputs, progress: Progress | None) -> tuple[Floats, ...]:
    """Constants (n, C), series (n, frames, S) and what the guard sees (n, ...) of all tests."""
    parts = []
    for k in range(len(data)):
        plan, times = data.plan(k), data.times(k)
        parts.append((tests.numbers(plan), tests.over_time(plan, times), tests.domain(plan, times)))
        if progress is not None and (k + 1) % 1000 == 0:
            progress("inputs", k + 1, len(data), "")
    constants, series, summary = (np.stack(part) for part in zip(*parts, strict=True))
    if not np.isfinite(series).all():
        raise DatasetError("the load of some sample of this data set is not a number; the file is damaged")
    return constants, series, summary


def _pairs(names: tuple[str, ...], scale: Any) -> dict[str, list[float]]:
    means, deviations = scale.mean.tolist(), scale.deviation.tolist()
    return {name: [m, d] for name, m, d in zip(names, means, deviations, strict=True)}


def _is_constant(column: Tensor) -> bool:
    known = column[~column.isnan()]
    return not len(known) or bool((known - known[0]).abs().max() <= 1e-6 * known.abs().max())
