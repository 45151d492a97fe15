"""Test conditions of a data set: the ranges they are drawn from, the time grid, and the test they describe.

Names and units are those of the specimen, see specimen_conditions. An absent condition has its default: the last time
of the grid, the lengths of the specimen, 293.15 K, no jump of the load.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from creepkit.arrays import Floats, frozen
from creepkit.checked_arguments import checked
from creepkit.errors import DatasetError, quoted
from creepkit.language import Elastic
from creepkit.records import ZERO_CELSIUS, History, Predictor
from creepkit.sampling.specimen_conditions import (
    END,
    MODULUS,
    TEMPERATURE,
    SpecimenConditions,
    own_names,
    planned_loading,
    specimen_conditions,
)

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


ROOM_TEMPERATURE = ZERO_CELSIUS + 20.0
"""K; the temperature of tests of laws that do not depend on it."""


def planned_test(specimen: Predictor, conditions: Mapping[str, float], grid: TimeGrid, name: str = "sample") -> History:
    """Return the test that conditions describe, without outputs: all times of the grid up to its end."""
    known, conditions = specimen_conditions(specimen), own_names(specimen, conditions)
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
    """One number, uniform from `low` to `high` on its scale.

    fraction_of : the condition of which it is a fraction.
    """

    low: float
    high: float
    scale: Literal["linear", "log"] = "linear"
    fraction_of: str = ""

    def values(self, unit_coordinates: Floats) -> Floats:
        """Values, (rows,) in the unit of the condition; unit_coordinates : (rows,) from 0 to 1."""
        if self.scale == "log":
            return np.asarray(np.exp(np.log(self.low) + unit_coordinates * np.log(self.high / self.low)))
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
    given = _both_levels(known, own_names(specimen, given))
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
