"""Inputs of ParameterGru: law parameters, load history, test conditions, and the values of a reduced law.

Parameters on a log scale enter as log10. A coefficient that is switched off (0) has a NaN column, standardised to
zero, and an indicator column equal to one. A law that lacks terms of the trained law is predicted with the
coefficients of these terms at zero.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import DatasetError, SurrogateError
from creepkit.jobs.progress import ProgressCallback
from creepkit.kernels.log_form import log_form
from creepkit.language import CreepLaw
from creepkit.records import Dimension, History, Program, Specimen, dimension_named, dimensions_of
from creepkit.sampling.conditions import MODULUS, TEMPERATURE

if TYPE_CHECKING:
    from creepkit.dataset.dataset import Dataset


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
