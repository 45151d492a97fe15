"""What describes the tests of a specimen in data sets: names, units and default ranges of conditions, from its record.

Conditions of a specimen with the load `force` and the length `span`: modulus (MPa), force_1 and force_2 (the two levels
of the load, in its unit), jump_time (s, when the second begins), end_time (s), span (mm), temperature (K). A specimen
whose data sets call some of them otherwise says so in `dataset_names`, {general name: its own}.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from creepkit.errors import DatasetError, nearest
from creepkit.records import (
    Dimension,
    History,
    Load,
    Loading,
    Output,
    Predictor,
    Program,
    RecordedLoading,
    constant_load,
    dimensions_of,
    loads_of,
    outputs_of,
)

MODULUS, TEMPERATURE, END, JUMP = "modulus", "temperature", "end_time", "jump_time"
"""Conditions of any specimen, in MPa, K, s and s."""


Range = tuple[float, float]
"""Lowest and highest value of a condition, in its unit."""


@dataclass(frozen=True)
class SpecimenConditions:
    """The conditions that tests of a specimen have.

    kind : name of the specimen. load : what is imposed. levels : names of its two levels. jump : name of the time of
    the second. has_modulus : whether a test needs Young's modulus. lengths : of the test piece.
    defaults : (condition, (lowest, highest)) that are drawn unless a design says otherwise.
    """

    kind: str
    load: Load
    levels: tuple[str, str]
    jump: str
    has_modulus: bool
    lengths: tuple[Dimension, ...]
    defaults: tuple[tuple[str, Range], ...]

    @property
    def names(self) -> tuple[str, ...]:
        """All conditions, in the order of the columns of a data set."""
        lengths = (length.name for length in self.lengths)
        return (*((MODULUS,) if self.has_modulus else ()), *self.levels, self.jump, END, *lengths, TEMPERATURE)

    @property
    def required(self) -> tuple[str, ...]:
        """Conditions without which there is no test."""
        return (*((MODULUS,) if self.has_modulus else ()), self.levels[0])

    def unit(self, name: str) -> str:
        """The unit of a condition, "" for a number without one."""
        units = {MODULUS: "MPa", TEMPERATURE: "K", END: "s", self.jump: "s"}
        units |= dict.fromkeys(self.levels, self.load.unit) | {length.name: "mm" for length in self.lengths}
        return units.get(name, "")

    def check_names(self, names: Iterable[str]) -> None:
        """DatasetError where a name is none of a condition."""
        for name in names:
            if name not in self.names:
                raise DatasetError(f"a {self.kind} test has no condition '{name}': {nearest(name, self.names)}")


def record_of(specimen: Predictor) -> Any:
    """The specimen itself, or the one that a reduced-order model or a surrogate stands for."""
    return getattr(specimen, "specimen", specimen)


def specimen_conditions(specimen: Predictor) -> SpecimenConditions:
    """The conditions of a specimen; DatasetError, with the attribute to add, where its record does not say them."""
    record = record_of(specimen)
    load, stated = _sampled_load(record)
    own: Mapping[str, str] = getattr(record, "dataset_names", {})
    first, second, jump = (own.get(name, name) for name in (f"{load.name}_1", f"{load.name}_2", JUMP))
    lengths = dimensions_of(record)
    others = (MODULUS, TEMPERATURE, END, *(length.name for length in lengths))
    defaults: dict[str, Range] = {}
    for name, ends in stated.items():
        if name not in (load.name, *others):
            allowed = (load.name, *others)
            raise DatasetError(
                f"specimen '{record.name}': its `conditions` name '{name}', which no test of it has; "
                f"{nearest(name, allowed)}"
            )
        low, high = (float(v) for v in ends)
        defaults |= dict.fromkeys((first, second) if name == load.name else (name,), (low, high))
    return SpecimenConditions(
        record.name, load, (first, second), jump, MODULUS in stated, lengths, tuple(defaults.items())
    )


def _sampled_load(record: Any) -> tuple[Load, Mapping[str, Range]]:
    """The load that data sets draw, and the ranges that the specimen states."""
    loads, stated = loads_of(record), getattr(record, "conditions", None)
    if not loads:
        raise DatasetError(
            f"specimen '{record.name}' does not say what is imposed on it, which a data set draws: add the attribute "
            'loads = (ck.Load("force", "force"),)'
        )
    names = [load.name for load in loads]
    if not stated or not any(name in stated for name in names):
        of_unit = f" in {loads[0].unit}" if loads[0].unit else ""
        raise DatasetError(
            f"specimen '{record.name}' does not say between which values of its load a data set lies: add the "
            f'attribute conditions = {{"{names[0]}": (low, high)}},{of_unit or " numbers"}'
        )
    return next(load for load in loads if load.name in stated), stated


JUMP_RAMP, JUMP_RAMP_SHARE = 5.0, 1e-3
"""The second level is reached in 5 s, or in this share of the time before it where that is shorter."""


def planned_loading(specimen: Predictor, load: Load, levels: tuple[float, float], jump_time: float) -> Loading:
    """The loading of a test with two levels, in the unit of the load, the second from `jump_time`, s, on.

    The specimen's own where it states planned_loading(levels, jump_time). Else the first level is there at once, and a
    short ramp leads to the second, so that what jumps with the load is told from creep.
    """
    own = getattr(record_of(specimen), "planned_loading", None)
    if own is not None:
        loading: Loading = own(levels, jump_time)
        return loading
    first, second = levels
    if first == second:
        return constant_load(load.name, first)
    ramp = min(JUMP_RAMP, JUMP_RAMP_SHARE * jump_time)
    program = Program(np.array([0.0, jump_time, jump_time + ramp]), np.array([first, first, second]))
    return RecordedLoading(program, load.name)


def own_names(specimen: Predictor, given: Mapping[str, Any]) -> dict[str, Any]:
    """Conditions {name: (...)} by the names of the specimen's data sets, where some have the general ones."""
    own: Mapping[str, str] = getattr(record_of(specimen), "dataset_names", {})
    renamed = {own.get(name, name): value for name, value in given.items()}
    if len(renamed) < len(given):
        twice = next(name for name in given if name in own and own[name] in given)
        raise DatasetError(f"the conditions '{twice}' and '{own[twice]}' are the same one; keep one of them")
    return renamed


@dataclass(frozen=True)
class CreepOutput:
    """The output of a specimen by which its creep is judged.

    column : its position among the outputs. output : its record. falls : whether creep makes it smaller, as a stress
        that relaxes does. visible : how much of it plainly shows creep, in its unit.
    """

    column: int
    output: Output
    falls: bool
    visible: float

    def text(self, value: float) -> str:
        """A value with its unit."""
        return f"{value:g} {self.output.unit}".rstrip()


def creep_output(specimen: Predictor) -> CreepOutput:
    """The first output that grows with creep, else the first; DatasetError where nothing says how much is visible."""
    record = record_of(specimen)
    outputs = outputs_of(record)
    if not outputs:
        raise DatasetError(f"specimen '{record.name}' has no outputs; a data set needs one: add the attribute outputs")
    column = next((k for k, output in enumerate(outputs) if output.grows), 0)
    output = outputs[column]
    if output.visible is None:
        raise DatasetError(
            f"specimen '{record.name}' does not say how much of its output '{output}' shows creep: write "
            f'ck.Output("{output}", "{output.quantity}", noise=...) with the noise of its measurement, or visible=...'
        )
    return CreepOutput(column, output, not output.grows, output.visible)


def check_stated(specimen: Predictor, name: str, meaning: str) -> None:
    """DatasetError, with what it is to give, where the specimen's record has no such method."""
    record = record_of(specimen)
    if not hasattr(record, name):
        raise DatasetError(
            f"specimen '{record.name}' does not say {meaning}, which a data set needs: add the method "
            f"{name}(self, history)"
        )


def tested_piece(specimen: Predictor, plan: History, nuisances: Mapping[str, float]) -> tuple[Any, History]:
    """The specimen with the lengths that a test and its nuisances {kind: value} state, and the test as they say."""
    record = record_of(specimen)
    return record.of_test(plan, nuisances) if hasattr(record, "of_test") else (record, plan)


def mean_reference_stress(piece: Any, test: History) -> float:
    """The reference stress of a test with a held load, MPa: the geometric mean where several are stated; 0 of none."""
    stresses = np.atleast_1d(np.asarray(piece.reference_stress(test), float))
    stresses = stresses[stresses > 0]
    return float(np.exp(np.log(stresses).mean())) if stresses.size else 0.0
