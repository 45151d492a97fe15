"""ParameterGru: the recipe of the surrogate of one law as in the paper, its training, and what a surrogate knows.

A row of inputs is inside the applicability domain when each stands within the range of the training rows (with a
margin) and the row lies no farther from their middle than the farthest training row as the others see it: Mahalanobis
distance, whose leave-one-out value has a closed form. The range catches one input that leaves its range, the distance a
combination that never occurred (a coefficient and an exponent that between them make no creep). What never varied in
training may not vary at all.

Its inputs are the law's parameters, the load history and the conditions of a test. Parameters on a log scale enter as
log10. A coefficient that is switched off (0) has a NaN column, standardised to zero, and an indicator column equal to
one. A law that lacks terms of the trained law is predicted with the coefficients of these terms at zero.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from creepkit import limits
from creepkit.arrays import ArrayLike, Bools, Floats
from creepkit.checked_arguments import checked
from creepkit.errors import DatasetError, SurrogateError
from creepkit.jobs.progress import ProgressCallback
from creepkit.kernels.log_form import log_form
from creepkit.language import CreepLaw
from creepkit.options import Options, option
from creepkit.records import Dimension, History, Program, Specimen, dimension_named, dimensions_of
from creepkit.sampling.conditions import MODULUS, TEMPERATURE, TimeGrid
from creepkit.surrogates.network_evaluation import ParameterNetwork, Precision, SampleArrays, Weights

if TYPE_CHECKING:
    from torch import Tensor

    from creepkit.dataset.dataset import Dataset
    from creepkit.language import CreepLaw
    from creepkit.surrogates.parameter_network import ParameterModule, SampleTensors


def constant_inputs(specimen: Specimen, conditions: Sequence[str]) -> tuple[str, ...]:
    """Those conditions of a data set that do not change during a test: modulus (MPa), lengths (mm), temperature (K)."""
    lengths = (length.name for length in dimensions_of(specimen))
    return tuple(name for name in (MODULUS, *lengths, TEMPERATURE) if name in conditions)


SERIES_INPUTS = ("load", "mean_load", "time", "step")
"""Inputs at each frame: the load there and its mean since the frame before, in its unit; log10 of 1 s + the time, and
of 1 s + the time since the frame before."""


TEMPERATURE_STEP = 0.1
"""K, of the central difference of a modulus."""


JUMP_TOLERANCE = 0.02
"""Mean deviation of a load from a jump, over its largest value, that is none."""


LARGEST_TEMPERATURE_CHANGE = 1.0
"""K by which the temperature of a test may drift."""


@dataclass(frozen=True, eq=False)
class LoadHistoryInputs:
    """Inputs that tests of one specimen give.

    constants : those of constant_inputs(), which the data set varied. series : of SERIES_INPUTS, those of the recipe.
    relative : whether frames are at shares of a test's end.
    """

    specimen: Specimen
    constants: tuple[str, ...]
    series: tuple[str, ...]
    relative: bool = False

    def constant_values(self, history: History) -> Floats:
        """(constants,) of one test."""
        return np.array([_constant_input(name, history, self.specimen) for name in self.constants])

    @property
    def nuisances(self) -> tuple[str, ...]:
        """The nuisances that change the constants, in their order; a length goes by its alias where it has one."""
        return tuple(_nuisance_of(name, self.specimen) for name in self.constants)

    def with_nuisances(
        self, history: History, nuisances: Mapping[str, Floats], count: int
    ) -> tuple[Floats, dict[str, Floats]]:
        """(count, constants) of one test, and {kind: (count, constants)} their derivatives; see Nuisance.

        nuisances : {kind: (count,)}.
        """
        values = np.tile(self.constant_values(history), (count, 1))
        derivatives = {kind: np.zeros_like(values) for kind in nuisances}
        position = {name: k for k, name in enumerate(self.constants)}
        for kind, given in nuisances.items():
            length = dimension_named(self.specimen, kind)
            if length is not None:
                values[:, position[length.name]] = given
                derivatives[kind][:, position[length.name]] = 1.0
        change, modulus = nuisances.get(TEMPERATURE), position.get(MODULUS)
        if change is not None:
            values[:, position[TEMPERATURE]] += change
            derivatives[TEMPERATURE][:, position[TEMPERATURE]] = 1.0
        if change is not None and modulus is not None:
            steps = (0.0, -TEMPERATURE_STEP, TEMPERATURE_STEP)
            values[:, modulus], below, above = (_modulus_at(history, change + step) for step in steps)
            derivatives[TEMPERATURE][:, modulus] = (above - below) / (2 * TEMPERATURE_STEP)
        if MODULUS in nuisances and modulus is not None:
            derivatives[MODULUS][:, modulus] = values[:, modulus]
            for array in (values, *(derivatives[kind] for kind in (TEMPERATURE,) if kind in nuisances)):
                array[:, modulus] *= 1.0 + nuisances[MODULUS]
        return values, derivatives

    def series_values(self, history: History, times: Floats) -> Floats:
        """(frames, series) at times (frames,) s."""
        program = imposed_program(history)
        return np.stack([_SERIES_FUNCTIONS[name](program, times) for name in self.series], axis=1)

    def domain_inputs(self, history: History, times: Floats) -> dict[str, float]:
        """Inputs of the applicability domain from a test, by name; times : (frames,) s.

        The constants, and lengths that differ from test piece to test piece also where they did not vary; of the load
        over the frames the value at the first that is loaded, the last, the mean, and how unlike one jump from the
        first to the last it is; and where grids stretch with the test log10 of its end.
        """
        load, quantity = _load_after_start(history, times), history.loading.quantity
        return {
            **dict(zip(self.constants, self.constant_values(history).tolist(), strict=True)),
            **{length.name: length_of(history, length) for length in self._fixed_lengths},
            f"first {quantity}": load[0],
            f"last {quantity}": load[-1],
            f"mean {quantity}": load.mean(),
            f"{quantity} unlike one jump": _deviation_from_jump(load),
            **({"log10 end_time": np.log10(times[-1])} if self.relative else {}),
        }

    @property
    def _fixed_lengths(self) -> tuple[Dimension, ...]:
        """Lengths that have a tolerance, and that the data set did not vary."""
        stated = dimensions_of(self.specimen)
        return tuple(length for length in stated if length.tolerance > 0.0 and length.name not in self.constants)


def _nuisance_of(name: str, specimen: Specimen) -> str:
    length = dimension_named(specimen, name)
    return name if length is None else length.alias or length.name


def _constant_input(name: str, history: History, specimen: Specimen) -> float:
    where = history.origin
    temperature = history.temperature_program().values
    if name in (MODULUS, TEMPERATURE) and np.ptp(temperature) > LARGEST_TEMPERATURE_CHANGE:
        raise SurrogateError(
            f"{where}: its temperature goes from {temperature.min():g} to {temperature.max():g} K; the surrogate was "
            "trained at temperatures that do not change, use the specimen itself"
        )
    if name == TEMPERATURE:
        return float(temperature.mean())
    if name == MODULUS:
        if history.elastic is None:
            raise SurrogateError(f"{where}: the surrogate needs the modulus; set elastic=Elastic(E=150e3), in MPa")
        return float(history.elastic.at(float(temperature.mean())).E)
    length = dimension_named(specimen, name)
    assert length is not None  # constant_inputs() has found it
    return length_of(history, length)


def _modulus_at(history: History, temperature_changes: Floats) -> Floats:
    """The modulus, MPa, at the temperature of a test and so many K more."""
    assert history.elastic is not None  # _constant has complained
    T = history.mean_temperature
    return np.array([float(history.elastic.at(T + float(step)).E) for step in temperature_changes])


def length_of(history: History, length: Dimension) -> float:
    """A length of a test, mm: its own, or the specimen's."""
    return float(history.geometry.get(length.name, length.default))


def imposed_program(history: History) -> Program:
    """What is imposed in a test, as data sets have it: a strain is the logarithmic one."""
    program = history.loading.program()
    if history.loading.quantity != "strain" or history.strain_measure == "logarithmic":
        return program
    return Program(program.times, np.log1p(program.values))


def _load_after_start(history: History, times: Floats) -> Floats:
    """The load from the first frame on that is loaded, in its unit."""
    load = imposed_program(history).at(times)
    loaded = np.flatnonzero(load > 0)
    return load[loaded[0] :] if loaded.size else load


def _deviation_from_jump(load: Floats) -> float:
    """Mean distance of a load from the nearest one that jumps from its first to its last value, over its largest.

    Zero below UNNOTICED: a recorded load is noisy, and a frame may lie on a ramp.
    """
    before, after = (np.abs(load - level) for level in (load[0], load[-1]))
    cost_before = np.concatenate([[0.0], np.cumsum(before)])
    cost_after = np.concatenate([np.cumsum(after[::-1])[::-1], [0.0]])
    deviation = float((cost_before + cost_after).min() / load.size / max(float(load.max()), 1e-300))
    return deviation if deviation > JUMP_TOLERANCE else 0.0


def _interval_means(program: Program, times: Floats) -> Floats:
    """Mean of a program since the time before, (times,); the first since zero, or the value at zero."""
    knots = np.union1d(program.times, times)
    after, before = program.at(np.nextafter(knots[:-1], np.inf)), program.at(np.nextafter(knots[1:], -np.inf))
    integral = np.concatenate([[0.0], np.cumsum(0.5 * (after + before) * np.diff(knots))])
    steps, increments = (np.diff(v, prepend=0.0) for v in (times, integral[np.searchsorted(knots, times)]))
    return np.where(steps > 0, increments / np.where(steps > 0, steps, 1.0), program.at(times))


_SERIES_FUNCTIONS: dict[str, Callable[[Program, Floats], Floats]] = {
    "load": lambda program, times: program.at(times),
    "mean_load": _interval_means,
    "time": lambda program, times: np.log10(1.0 + times),
    "step": lambda program, times: np.log10(1.0 + np.diff(times, prepend=0.0)),
}


LN10 = float(np.log(10.0))


@dataclass(frozen=True)
class LawInputs:
    """The columns that stand for the parameters of one law."""

    law: CreepLaw

    @cached_property
    def switchable(self) -> tuple[int, ...]:
        """Positions of the parameters that can be switched off and then have no logarithm."""
        return tuple(k for k, p in enumerate(self.law.params.values()) if p.scale == "log" and p.off == 0)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Of the columns."""
        columns = [f"log10 {name}" if p.scale == "log" else name for name, p in self.law.table.items()]
        return (*columns, *(f"{self.law.names[k]} is off" for k in self.switchable))

    @cached_property
    def _column_scales(self) -> Floats:
        """(parameters,) what a column grows by with its internal parameter."""
        return np.array([1.0 / LN10 if p.scale == "log" else 1.0 for p in self.law.params.values()])

    def input_rows(self, theta: Floats) -> Floats:
        """(rows, columns) of internal parameters theta (rows, parameters)."""
        off = np.isneginf(theta)
        return np.concatenate(
            [np.where(off, np.nan, theta * self._column_scales), off[:, list(self.switchable)]], axis=1
        )

    def derivatives(self, theta: Floats) -> Floats:
        """(rows, columns, parameters) derivatives of `input_rows` at theta (rows, parameters); zero where it is off."""
        count = theta.shape[1]
        derivatives = np.zeros((len(theta), len(self.names), count))
        derivatives[:, range(count), range(count)] = np.where(np.isneginf(theta), 0.0, self._column_scales)
        return derivatives


def complete_parameters(trained: CreepLaw, law: CreepLaw, theta: Floats) -> Floats:
    """Internal values of the trained law that make it `law` at `theta`; SurrogateError where it cannot be that law.

    Terms that `law` lacks are switched off by their coefficients; what else they have stands at the middle of its
    bounds, where it changes nothing.

    theta : (candidates, parameters of `law`). Returns (candidates, parameters of the trained law).
    """
    zero_names = zero_coefficients(trained, law)
    columns = []
    for name, param in trained.table.items():
        if name in law.names:
            columns.append(theta[:, law.names.index(name)])
        else:
            columns.append(np.full(len(theta), param.to_internal(0.0 if name in zero_names else param.center)))
    return np.stack(columns, axis=-1)


@lru_cache(maxsize=256)
def zero_coefficients(trained: CreepLaw, law: CreepLaw) -> frozenset[str]:
    """Names of the coefficients of the trained law that are zero in `law`; SurrogateError if it is no reduction."""
    if law.fingerprint == trained.fingerprint:
        return frozenset()
    terms = list(law.terms.values())
    missing_labels = [label for label, term in trained.terms.items() if term not in terms]
    is_reduction = all(term in trained.terms.values() for term in terms) and set(law.names) <= set(trained.names)
    coefficients = [_term_coefficient(trained, label) for label in missing_labels]
    if not is_reduction or None in coefficients or dict(law.states) != dict(trained.states):
        raise SurrogateError(
            f"a surrogate of law '{trained.name}' cannot predict law '{law.name}': it predicts its own law, and "
            f"that less some of its terms ({', '.join(trained.terms)}) by {trained.name}.without(...)"
        )
    return frozenset(name for name in coefficients if name is not None)


def _term_coefficient(law: CreepLaw, label: str) -> str | None:
    """The parameter that switches a term, and no other, off."""
    single = law.only(label)
    for k in log_form(single).coefficients[0]:
        name = single.names[k]
        uses = sum(law.symbol(name) in term.free_symbols for term in law.terms.values())
        if uses == 1 and law.table[name].off == 0:
            return name
    return None


def load_history_arrays(
    data: Dataset, history_inputs: LoadHistoryInputs, progress: ProgressCallback | None
) -> tuple[Floats, ...]:
    """Constants (n, C), series (n, frames, S) and inputs of the applicability domain (n, ...) of all tests."""
    parts = []
    for k in range(len(data)):
        plan, times = data.planned_test(k), data.times(k)
        parts.append(
            (
                history_inputs.constant_values(plan),
                history_inputs.series_values(plan, times),
                np.array([*history_inputs.domain_inputs(plan, times).values()]),
            )
        )
        if progress is not None and (k + 1) % 1000 == 0:
            progress("inputs", k + 1, len(data), "")
    constants, series, domain_rows = (np.stack(part) for part in zip(*parts, strict=True))
    if not np.isfinite(series).all():
        raise DatasetError("the load of some sample of this data set is not a number; the file is damaged")
    return constants, series, domain_rows


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


PAPER_BATCH, PAPER_RATE = 64, 1e-3


RATE_EXPONENT = 0.75
"""Of the batch: with the square root, 1024 histories in a step learn markedly less in as many epochs."""


LARGEST_GROWN_RATE = 1e-2


@checked
@dataclass(frozen=True)
class Training(Options, title="settings of a training"):
    """How a network is trained: with Adam, on batches of whole histories.

    epochs : passes over the training rows. batch : histories in a step. rate : Adam's, at the beginning; None takes
        1e-3 for 64 histories in a step, the paper's, which grows with their number to the power of 3/4, up to 0.01.
    schedule : of the rate: "constant"; "cosine", down to zero at the last epoch; "plateau", a tenth of it whenever the
        validation loss has not fallen by a ten-thousandth for `patience` epochs, as the paper has it.
    early_stop : stop when the validation loss has not fallen for so many epochs; None goes to the end.
    clip : largest norm of the gradient; None leaves it alone.
    validation : share of the rows that are set aside, drawn by the seed. samples : rows of the others that are learnt
    from, the first so many; None takes them all. The rows set aside are the same for every number of samples.
    """

    epochs: int = option(500, "Passes over the training rows.", limits.EPOCHS)
    batch: int = option(64, "Histories in a step.", limits.BATCH)
    rate: float | None = option(
        None, "Rate of Adam at the beginning; 0.001 (batch / 64)^0.75 by default, at most 0.01.", limits.LEARNING_RATE
    )
    schedule: Literal["plateau", "cosine", "constant"] = option("plateau", "Of the rate.")
    patience: int = option(15, "Epochs without gain after which a plateau lowers the rate.", limits.EPOCHS)
    early_stop: int | None = option(None, "Stop after so many epochs without gain.", limits.EPOCHS)
    clip: float | None = option(None, "Largest norm of the gradient.", limits.LARGEST_GRADIENT)
    validation: float = option(0.2, "Share of the rows that are set aside.", limits.numbers(0.001, 0.999))
    samples: int | None = option(None, "Rows of the others that are learnt from, the first so many.", limits.SAMPLES)

    @property
    def first_rate(self) -> float:
        """Of Adam at the beginning."""
        grown = min(PAPER_RATE * (self.batch / PAPER_BATCH) ** RATE_EXPONENT, LARGEST_GROWN_RATE)
        return grown if self.rate is None else self.rate


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


@checked
@dataclass(frozen=True)
class ParameterGru(Options, title="settings of a network"):
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
        columns_of_data = data.outputs, data.grid, data.parameter_names, data.condition_names
        return SurrogateMetadata(data.law, data.specimen, *columns_of_data, domain, scaling, notes=notes)

    def network(self, weights: Weights, metadata: SurrogateMetadata, precision: Precision) -> ParameterNetwork:
        """The trained network; SurrogateError where the weights are not those of this recipe."""
        sizes = len(metadata.scaling["inputs"]), len(metadata.scaling["series"]), len(metadata.outputs)
        shape, logarithm = (self.hidden, self.layers), self.target == "log"
        return ParameterNetwork.from_weights(weights, sizes, shape, logarithm=logarithm, precision=precision)

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


@checked
@dataclass(frozen=True)
class NetworkSizes(Options, title="sizes of networks"):
    """Values to be combined in a size study; what is () stays as the recipe has it.

    samples : numbers of samples to learn from.
    """

    layers: tuple[int, ...] = option((), "Numbers of layers.", limits.LAYERS)
    hidden: tuple[int, ...] = option((), "Units of a layer.", limits.HIDDEN)
    samples: tuple[int, ...] = option((), "Numbers of samples to learn from; all by default.", limits.SAMPLES)
