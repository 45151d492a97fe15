"""Test conditions of a data set: their names and units, the ranges they are drawn from, the time grid, and the test
they describe.

Bulge test: modulus, P1, P2 (MPa), Tj, end_time (s), apex_thickness (mm). Uniaxial test: stress_1, stress_2 (MPa), Tj,
end_time (s). Both: temperature (K). An absent condition has its default: the last time of the grid, the thickness of
the specimen, 293.15 K, no load jump.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from creepkit.arrays import Floats, frozen
from creepkit.errors import DatasetError, nearest
from creepkit.language import Elastic
from creepkit.records import ZERO_CELSIUS, History, PressureJump, Specimen, StressSteps

PAPER_INTERVAL, PAPER_END = 150.0, 43200.0
"""s; Materials and Methods of the paper: 289 frames from 0 to 12 h."""


MOST_FRAMES = 100_000
"""Largest number of frames of a sample: a typing error should not ask for all the memory."""


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
            raise DatasetError(f"a time grid needs two or more finite times, found {values.tolist()[:3]}")
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

    def document(self) -> dict[str, Any]:
        """As JSON-able data."""
        return {"values": self.values.tolist(), "relative": self.relative}

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, TimeGrid):
            return NotImplemented
        return self.relative == other.relative and np.array_equal(self.values, other.values)

    def __hash__(self) -> int:
        return hash((self.values.tobytes(), self.relative))


ROOM_TEMPERATURE = ZERO_CELSIUS + 20.0
"""K; the temperature of tests of laws that do not depend on it."""


BULGE, UNIAXIAL = "bulge", "uniaxial"


CONDITION_UNITS = {
    "modulus": "MPa",
    "P1": "MPa",
    "P2": "MPa",
    "stress_1": "MPa",
    "stress_2": "MPa",
    "Tj": "s",
    "end_time": "s",
    "apex_thickness": "mm",
    "temperature": "K",
}


CONDITIONS = {
    BULGE: ("modulus", "P1", "P2", "Tj", "end_time", "apex_thickness", "temperature"),
    UNIAXIAL: ("stress_1", "stress_2", "Tj", "end_time", "temperature"),
}
"""Conditions of each kind of specimen."""


REQUIRED = {BULGE: ("modulus", "P1"), UNIAXIAL: ("stress_1",)}


LOAD_LEVELS = {BULGE: ("P1", "P2"), UNIAXIAL: ("stress_1", "stress_2")}
"""The two levels of the load."""


def test_kind(specimen: Specimen) -> str:
    """Which kind of test a specimen is put through, bulge or uniaxial; a reduced-order model says so before a comma."""
    kind = specimen.name.split(",")[0]
    if kind not in CONDITIONS:
        raise DatasetError(f"no design knows how to load a specimen '{specimen.name}'; {nearest(kind, CONDITIONS)}")
    return kind


def planned_test(specimen: Specimen, conditions: Mapping[str, float], grid: TimeGrid, name: str = "sample") -> History:
    """Return the test that conditions describe, without outputs: all times of the grid up to its end."""
    kind = test_kind(specimen)
    check_condition_names(kind, conditions)
    for required in REQUIRED[kind]:
        if required not in conditions:
            raise DatasetError(
                f"a {kind} test needs the condition '{required}' ({CONDITION_UNITS[required]}); it is missing"
            )
    end = float(conditions["end_time"]) if "end_time" in conditions else grid.end
    times = grid.times(end)
    levels, jump = _load_levels(kind, conditions, end)
    geometry = {"apex_thickness": conditions["apex_thickness"]} if "apex_thickness" in conditions else {}
    return History(
        name=name,
        times=times[times <= end * (1 + 1e-12)],
        outputs={},
        loading=PressureJump(*levels, jump) if kind == BULGE else _stress_steps(levels, jump),
        temperature=conditions.get("temperature", ROOM_TEMPERATURE),
        specimen=kind,
        elastic=Elastic(conditions["modulus"]) if kind == BULGE else None,
        geometry=geometry,
    )


def hold_times(test: History) -> Floats:
    """(4,) s, when the holds of a planned test begin and end: after the first ramp, before and after the jump, the end.

    Growth between two of them is creep: no elastic jump lies within a hold.
    """
    end = float(test.times[-1])
    if isinstance(test.loading, PressureJump):
        ramp, jump_time = test.loading.ramp, test.loading.Tj
        return np.minimum([ramp, jump_time, jump_time + ramp, end], end)
    step_times = [t for t, _ in getattr(test.loading, "steps", ())]
    jump_time = step_times[1] if len(step_times) > 1 else end
    return np.minimum([0.0, jump_time, jump_time, end], end)


def check_condition_names(kind: str, names: Mapping[str, object]) -> None:
    """DatasetError where a condition is none of a kind of specimen."""
    for name in names:
        if name not in CONDITIONS[kind]:
            raise DatasetError(f"a {kind} test has no condition '{name}': {nearest(name, CONDITIONS[kind])}")


def _load_levels(kind: str, conditions: Mapping[str, float], end: float) -> tuple[tuple[float, float], float]:
    """Both levels, MPa, and when the second begins, s; without a jump the level stays."""
    first_name, second_name = LOAD_LEVELS[kind]
    if (second_name in conditions) != ("Tj" in conditions):
        raise DatasetError(f"a jump of a {kind} test needs both {second_name} and Tj; give both or neither")
    first_level = float(conditions[first_name])
    return (first_level, float(conditions.get(second_name, first_level))), float(conditions.get("Tj", 0.5 * end))


def _stress_steps(levels: tuple[float, float], jump_time: float) -> StressSteps:
    if levels[0] == levels[1]:
        return StressSteps(((0.0, levels[0]),))
    return StressSteps(((0.0, levels[0]), (jump_time, levels[1])))


PAPER_RANGES = {
    "bulge": {"modulus": (50e3, 300e3), "P1": (3.0, 25.0), "P2": (3.0, 25.0)},
    "uniaxial": {"stress_1": (40.0, 300.0), "stress_2": (40.0, 300.0)},
}
"""The paper's ranges of a bulge test, and for a bar the stresses of its dimple of 0.5 mm under them, about 12.5 P."""


PAPER_JUMP_FRACTIONS = (1 / 6, 5 / 6)
"""The paper's Tj, 2 to 10 h, as fractions of its 12 h."""


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

    kind : of specimen. ranges : (condition, its range), in the order of the columns. end : s, of tests whose end is
        not drawn.

    Both levels of the load are drawn alike and then sorted: over equal ranges that is uniform on P2 >= P1, what the
    paper asks for, and no row is wasted.
    """

    kind: str
    ranges: tuple[tuple[str, ConditionRange], ...]
    end: float

    @property
    def names(self) -> tuple[str, ...]:
        """The conditions, in the order of the columns."""
        return tuple(name for name, _ in self.ranges)

    def draw(self, unit_coordinates: Floats) -> Floats:
        """Conditions, (rows, conditions) in MPa, s, mm and K; unit_coordinates : (rows, conditions) from 0 to 1."""
        drawn = {
            name: condition_range.values(u)
            for (name, condition_range), u in zip(self.ranges, unit_coordinates.T, strict=True)
        }
        for name, r in self.ranges:
            if r.fraction_of:
                drawn[name] = drawn[name] * drawn.get(r.fraction_of, self.end)
        first, second = LOAD_LEVELS[self.kind]
        drawn[first], drawn[second] = (f(drawn[first], drawn[second]) for f in (np.minimum, np.maximum))
        return np.stack([drawn[name] for name in self.names], axis=1)

    def document(self) -> dict[str, Any]:
        """As JSON-able data."""
        return {"kind": self.kind, "end": self.end, "ranges": {name: vars(r) for name, r in self.ranges}}


def condition_ranges(
    kind: str, grid: TimeGrid, given: Mapping[str, Any], defaults: Mapping[str, Any], *, needs_temperature: bool
) -> ConditionRanges:
    """Return what is drawn: `given` in the place of `defaults`; a number fixes a condition.

    needs_temperature : whether the law depends on temperature, whose range must then be given.
    """
    check_condition_names(kind, given)
    if needs_temperature and "temperature" not in {**defaults, **given}:
        raise DatasetError(
            "the law depends on temperature: give its range in K, such as temperature=(1000, 1100), or --range "
            "temperature=1000:1100"
        )
    ranges = {name: condition_range(name, value) for name, value in {**defaults, **given}.items()}
    if "end_time" not in ranges and grid.relative:
        raise DatasetError("a relative grid needs the end of tests: give end_time in s, a number or (low, high)")
    end = ranges["end_time"].high if "end_time" in ranges else grid.end
    ranges.setdefault("Tj", ConditionRange(*PAPER_JUMP_FRACTIONS, fraction_of="end_time"))
    _check_levels(kind, ranges)
    _check_jump(ranges["Tj"], ranges["end_time"].low if "end_time" in ranges else grid.end)
    return ConditionRanges(kind, tuple((name, ranges[name]) for name in CONDITION_UNITS if name in ranges), end)


def condition_range(name: str, value: Any) -> ConditionRange:
    """A range from a number, a pair or a ConditionRange; all conditions are positive."""
    if isinstance(value, ConditionRange):
        return value
    try:
        low, high = (float(v) for v in (value if np.size(value) > 1 else (value, value)))
    except (TypeError, ValueError):
        raise DatasetError(
            f"condition '{name}' is {value!r}; give a number or (low, high) in {CONDITION_UNITS[name]}"
        ) from None
    if not (np.isfinite([low, high]).all() and low > 0):
        raise DatasetError(
            f"condition '{name}' from {low:g} to {high:g} {CONDITION_UNITS[name]}: it must be finite and above zero"
        )
    if low > high:
        raise DatasetError(f"condition '{name}': the range ({low:g}, {high:g}) is reversed; write ({high:g}, {low:g})")
    return ConditionRange(low, high)


def _check_levels(kind: str, ranges: Mapping[str, ConditionRange]) -> None:
    first, second = LOAD_LEVELS[kind]
    reversed_levels = ranges[second].low < ranges[first].low or ranges[second].high < ranges[first].high
    if reversed_levels:
        second_text = f"{second} from {ranges[second].low:g} to {ranges[second].high:g} MPa"
        first_text = f"{first}, {ranges[first].low:g} to {ranges[first].high:g} MPa"
        raise DatasetError(
            f"{second_text} reaches below {first_text}; the second level is never the lower one, so give both ranges"
        )


def _check_jump(jump: ConditionRange, end: float) -> None:
    if jump.high >= (1.0 if jump.fraction_of else end):
        raise DatasetError(
            f"Tj reaches {jump.high:g} s, and tests may end at {end:g} s; give Tj=(low, high) before the end"
        )


VISIBLE_CREEP = {"bulge": 0.02, "uniaxial": 2e-4}
"""Creep, in mm of amplitude and as strain, that an informative sample shows."""
