"""From where the conditions of samples are drawn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from creepkit.arrays import Floats
from creepkit.dataset.conditions import LOAD_LEVELS, CONDITION_UNITS, check_condition_names
from creepkit.dataset.time_grid import TimeGrid
from creepkit.errors import DatasetError

PAPER_RANGES = {
    "bulge": {"modulus": (50e3, 300e3), "P1": (3.0, 25.0), "P2": (3.0, 25.0)},
    "uniaxial": {"stress_1": (40.0, 300.0), "stress_2": (40.0, 300.0)},
}
"""The paper's ranges of a bulge test, and for a bar what its dimple of .5 mm feels under them (about 12.5 P)."""

PAPER_JUMP_FRACTIONS = (1 / 6, 5 / 6)
"""The paper's Tj, 2 to 10 h, over its 12 h."""


@dataclass(frozen=True)
class ConditionRange:
    """One number, uniform from `low` to `high` on its scale; share_of : the condition of which it is a share."""

    low: float
    high: float
    scale: Literal["linear", "log"] = "linear"
    fraction_of: str = ""

    def values(self, unit_coordinates: Floats) -> Floats:
        """Values at coordinates from 0 to 1."""
        if self.scale == "log":
            return np.asarray(np.exp(np.log(self.low) + unit_coordinates * np.log(self.high / self.low)))
        return self.low + unit_coordinates * (self.high - self.low)


@dataclass(frozen=True)
class ConditionRanges:
    """What is drawn of each test.

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
        """Conditions at coordinates (rows, conditions) from 0 to 1."""
        drawn = {name: condition_range.values(u) for (name, condition_range), u in zip(self.ranges, unit_coordinates.T, strict=True)}
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
    """Return what is drawn: `defaults` with `given` in their place; a number holds a condition where it is.

    warm : whether the law depends on temperature, which must then be given.
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
    """A range from a number, a pair or a Range; all conditions are positive."""
    if isinstance(value, ConditionRange):
        return value
    try:
        low, high = (float(v) for v in (value if np.size(value) > 1 else (value, value)))
    except (TypeError, ValueError):
        raise DatasetError(f"condition '{name}' is {value!r}; give a number or (low, high) in {CONDITION_UNITS[name]}") from None
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
