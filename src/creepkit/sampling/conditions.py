"""What describes the tests of a specimen in data sets: names, units and ranges of conditions, the time grid, the test.

Conditions of a specimen with the load `force` and the length `span`: modulus (MPa), force_1 and force_2 (the two levels
of the load, in its unit), jump_time (s, when the second begins), end_time (s), span (mm), temperature (K). A specimen
whose data sets call some of them otherwise says so in `dataset_names`, {general name: its own}. An absent condition has
its default: the last time of the grid, the lengths of the specimen, 293.15 K, no jump of the load.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from creepkit.arrays import Floats, frozen
from creepkit.checked_arguments import checked
from creepkit.errors import DatasetError, nearest, quoted, refuse_unknown
from creepkit.language import Elastic
from creepkit.records import (
    ROOM_TEMPERATURE,
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
            refuse_unknown(name, self.names, DatasetError, f"a {self.kind} test has no condition '{name}'")


def record_of(specimen: Predictor) -> Any:
    """The specimen itself, or the one that a reduced-order model or a surrogate stands for."""
    return specimen.specimen


def specimen_conditions(specimen: Predictor) -> SpecimenConditions:
    """The conditions of a specimen; DatasetError, with the attribute to add, where its record does not say them."""
    record = record_of(specimen)
    load, stated = _sampled_load(record)
    own: Mapping[str, str] = record.dataset_names
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
    loads, stated = loads_of(record), record.conditions
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
    own: Loading | None = record_of(specimen).planned_loading(levels, jump_time)
    if own is not None:
        return own
    first, second = levels
    if first == second:
        return constant_load(load.name, first)
    ramp = min(JUMP_RAMP, JUMP_RAMP_SHARE * jump_time)
    program = Program(np.array([0.0, jump_time, jump_time + ramp]), np.array([first, first, second]))
    return RecordedLoading(program, load.name)


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
    if not record.states(name):
        raise DatasetError(
            f"specimen '{record.name}' does not say {meaning}, which a data set needs: add the method "
            f"{name}(self, history)"
        )


def tested_piece(specimen: Predictor, plan: History, nuisances: Mapping[str, float]) -> tuple[Any, History]:
    """The specimen with the lengths that a test and its nuisances {kind: value} state, and the test as they say."""
    piece, test = record_of(specimen).of_test(plan, nuisances)
    return piece, test


def mean_reference_stress(piece: Any, test: History) -> float:
    """The reference stress of a test with a held load, MPa: the geometric mean where several are stated; 0 of none."""
    stresses = np.atleast_1d(np.asarray(piece.reference_stress(test), float))
    stresses = stresses[stresses > 0]
    return float(np.exp(np.log(stresses).mean())) if stresses.size else 0.0


PAPER_INTERVAL, PAPER_END = 150.0, 43200.0
"""s; Materials and Methods of the paper: 289 frames from 0 to 12 h."""


MOST_FRAMES = 100_000
"""Largest number of frames of a sample: a typing error should not ask for all the memory."""


@checked
@dataclass(frozen=True, eq=False)
class TimeGrid:
    """The times of all samples of a design.

    values : (frames,) s, or shares of each sample's end when `relative`; strictly increasing.
    """

    values: Floats
    relative: bool = False

    def __post_init__(self) -> None:
        values = frozen(self.values)
        if values.ndim != 1 or values.size < 2 or not np.isfinite(values).all():
            raise DatasetError(f"a time grid needs two or more finite times, found {quoted(values.tolist())}")
        if values[0] < 0 or (np.diff(values) <= 0).any():
            raise DatasetError("the times of a grid must start at or after 0 and increase")
        if self.relative and values[-1] > 1:
            raise DatasetError(f"a relative grid holds shares of the end, from 0 to 1; the last is {values[-1]:g}")
        object.__setattr__(self, "values", values)

    @classmethod
    def every(cls, interval: float = PAPER_INTERVAL, end: float = PAPER_END) -> TimeGrid:
        """Frames `interval` s apart from 0 to `end` s."""
        if not (0 < interval <= end < np.inf):
            raise DatasetError(f"frames every {interval:g} s until {end:g} s: the interval must lie from 0 to the end")
        if end / interval > MOST_FRAMES:
            raise DatasetError(
                f"frames every {interval:g} s until {end:g} s are {end / interval:.0f}; "
                f"at most {MOST_FRAMES} are simulated"
            )
        frames = int(np.floor(end / interval * (1 + 1e-12)))
        return cls(interval * np.arange(frames + 1, dtype=float))

    @property
    def frames(self) -> int:
        """How many times there are."""
        return int(self.values.size)

    @property
    def end(self) -> float:
        """The last time, s; a relative grid has none of its own (DatasetError)."""
        if self.relative:
            raise DatasetError("a relative grid has no end of its own; give the condition end_time")
        return float(self.values[-1])

    def times(self, end_time: float) -> Floats:
        """The times, s, of a test that ends at `end_time`, (frames,); those of an absolute grid may lie beyond it."""
        return self.values * end_time if self.relative else self.values

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, TimeGrid):
            return NotImplemented
        return self.relative == other.relative and np.array_equal(self.values, other.values)

    def __hash__(self) -> int:
        return hash((self.values.tobytes(), self.relative))


def planned_test(specimen: Predictor, conditions: Mapping[str, float], grid: TimeGrid, name: str = "sample") -> History:
    """Return the test that conditions describe, without outputs: all times of the grid up to its end."""
    known = specimen_conditions(specimen)
    known.check_names(conditions)
    for required in known.required:
        if required not in conditions:
            unit = known.unit(required)
            named = f"'{required}' ({unit})" if unit else f"'{required}'"
            raise DatasetError(f"a {known.kind} test needs the condition {named}; it is missing")
    end = float(conditions[END]) if END in conditions else grid.end
    times = grid.times(end)
    levels, jump = _load_levels(known, conditions, end)
    return History(
        name=name,
        times=times[times <= end * (1 + 1e-12)],
        outputs={},
        loading=planned_loading(specimen, known.load, levels, jump),
        temperature=conditions.get(TEMPERATURE, ROOM_TEMPERATURE),
        specimen=known.kind,
        elastic=Elastic(conditions[MODULUS]) if known.has_modulus else None,
        geometry={length.name: conditions[length.name] for length in known.lengths if length.name in conditions},
    )


def hold_times(test: History) -> Floats:
    """(4,) s, when the holds of a planned test begin and end: after the first ramp, before and after the jump, the end.

    Growth between two of them is creep: no elastic jump lies within a hold. Without a jump the second hold is empty.
    """
    end, program = float(test.times[-1]), test.loading.program()
    starts, ends = program.times, np.append(program.times[1:], np.inf)
    held = np.append(program.values[1:] == program.values[:-1], True) & (ends > starts)
    first, last = np.flatnonzero(held)[[0, -1]]
    instants = [starts[first], ends[first], *((ends[first], end) if first == last else (starts[last], end))]
    return np.minimum(instants, end)


def _load_levels(
    known: SpecimenConditions, conditions: Mapping[str, float], end: float
) -> tuple[tuple[float, float], float]:
    """Both levels, in the unit of the load, and when the second begins, s; without a jump the level stays."""
    (first_name, second_name), jump = known.levels, known.jump
    if (second_name in conditions) != (jump in conditions):
        raise DatasetError(f"a jump of a {known.kind} test needs both {second_name} and {jump}; give both or neither")
    first_level = float(conditions[first_name])
    return (first_level, float(conditions.get(second_name, first_level))), float(conditions.get(jump, 0.5 * end))


PAPER_JUMP_FRACTIONS = (1 / 6, 5 / 6)
"""When the load jumps: the paper's 2 to 10 h, as fractions of its 12 h."""


@dataclass(frozen=True)
class ConditionRange:
    """One number, uniform from `low` to `high`.

    fraction_of : the condition of which it is a fraction.
    """

    low: float
    high: float
    fraction_of: str = ""

    def values(self, unit_coordinates: Floats) -> Floats:
        """Values, (rows,) in the unit of the condition; unit_coordinates : (rows,) from 0 to 1."""
        return self.low + unit_coordinates * (self.high - self.low)


@dataclass(frozen=True)
class ConditionRanges:
    """Ranges from which the conditions of each test are drawn.

    kind : name of the specimen. levels : names of both levels of the load. ranges : (condition, its range), in the
        order of the columns. end : s, of tests whose end is not drawn.

    Both levels of the load are drawn alike and then sorted: over equal ranges that is uniform where the second is not
    below the first, what the paper asks for, and no row is wasted.
    """

    kind: str
    levels: tuple[str, str]
    ranges: tuple[tuple[str, ConditionRange], ...]
    end: float

    @property
    def names(self) -> tuple[str, ...]:
        """The conditions, in the order of the columns."""
        return tuple(name for name, _ in self.ranges)

    def draw(self, unit_coordinates: Floats) -> Floats:
        """Conditions, (rows, conditions) in their units; unit_coordinates : (rows, conditions) from 0 to 1."""
        drawn = {
            name: condition_range.values(u)
            for (name, condition_range), u in zip(self.ranges, unit_coordinates.T, strict=True)
        }
        for name, r in self.ranges:
            if r.fraction_of:
                drawn[name] = drawn[name] * drawn.get(r.fraction_of, self.end)
        first, second = self.levels
        drawn[first], drawn[second] = (f(drawn[first], drawn[second]) for f in (np.minimum, np.maximum))
        return np.stack([drawn[name] for name in self.names], axis=1)


def condition_ranges(
    specimen: Predictor, grid: TimeGrid, given: Mapping[str, Any], *, needs_temperature: bool
) -> ConditionRanges:
    """Return what is drawn: `given` in the place of the specimen's own ranges; a number fixes a condition.

    needs_temperature : whether the law depends on temperature, whose range must then be given.
    """
    known = specimen_conditions(specimen)
    given = _both_levels(known, given)
    known.check_names(given)
    drawn = {**dict(known.defaults), **given}
    if needs_temperature and TEMPERATURE not in drawn:
        raise DatasetError(
            "the law depends on temperature: give its range in K, such as temperature=(1000, 1100), or --range "
            "temperature=1000:1100"
        )
    for name in known.required:
        if name not in drawn:
            raise DatasetError(f"a {known.kind} test needs the condition '{name}'; give {name}=(low, high)")
    ranges = {name: condition_range(name, value, known.unit(name)) for name, value in drawn.items()}
    if END not in ranges and grid.relative:
        raise DatasetError("a relative grid needs the end of tests: give end_time in s, a number or (low, high)")
    end = ranges[END].high if END in ranges else grid.end
    ranges.setdefault(known.jump, ConditionRange(*PAPER_JUMP_FRACTIONS, fraction_of=END))
    _check_levels(known, ranges)
    _check_jump(known.jump, ranges[known.jump], ranges[END].low if END in ranges else grid.end)
    columns = tuple((name, ranges[name]) for name in known.names if name in ranges)
    return ConditionRanges(known.kind, known.levels, columns, end)


def _both_levels(known: SpecimenConditions, given: Mapping[str, Any]) -> dict[str, Any]:
    """Ranges {condition: (...)} with that of the load, by its own name, as the range of both its levels."""
    load, others = known.load.name, dict(given)
    if load not in others:
        return others
    for level in known.levels:
        if level in others:
            raise DatasetError(f"the range of {load} is that of both its levels, and {level} has one as well; keep one")
    both = others.pop(load)
    return {**others, **dict.fromkeys(known.levels, both)}


def condition_range(name: str, value: Any, unit: str) -> ConditionRange:
    """A range from a number, a pair or a ConditionRange; all conditions are positive."""
    if isinstance(value, ConditionRange):
        return value
    of_unit = f" {unit}" if unit else ""
    try:
        low, high = (float(v) for v in (value if np.size(value) > 1 else (value, value)))
    except (TypeError, ValueError):
        suffix = f" in {unit}" if unit else ""
        raise DatasetError(f"condition '{name}' is {value!r}; give a number or (low, high){suffix}") from None
    if not (np.isfinite([low, high]).all() and low > 0):
        raise DatasetError(f"condition '{name}' from {low:g} to {high:g}{of_unit}: it must be finite and above zero")
    if low > high:
        raise DatasetError(f"condition '{name}': the range ({low:g}, {high:g}) is reversed; write ({high:g}, {low:g})")
    return ConditionRange(low, high)


def _check_levels(known: SpecimenConditions, ranges: Mapping[str, ConditionRange]) -> None:
    first, second = known.levels
    reversed_levels = ranges[second].low < ranges[first].low or ranges[second].high < ranges[first].high
    if reversed_levels:
        unit = f" {known.load.unit}".rstrip()
        second_text = f"{second} from {ranges[second].low:g} to {ranges[second].high:g}{unit}"
        first_text = f"{first}, {ranges[first].low:g} to {ranges[first].high:g}{unit}"
        raise DatasetError(
            f"{second_text} reaches below {first_text}; the second level is never the lower one, so give both ranges"
        )


def _check_jump(name: str, jump: ConditionRange, end: float) -> None:
    if jump.high >= (1.0 if jump.fraction_of else end):
        raise DatasetError(
            f"{name} reaches {jump.high:g} s, and tests may end at {end:g} s; give {name}=(low, high) before the end"
        )
