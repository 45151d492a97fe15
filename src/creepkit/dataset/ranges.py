"""From where the conditions of samples are drawn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from creepkit.arrays import Floats
from creepkit.dataset.conditions import LEVELS, UNITS, check_names
from creepkit.dataset.time_grid import TimeGrid
from creepkit.errors import DatasetError

PAPER = {
    "bulge": {"modulus": (50e3, 300e3), "P1": (3.0, 25.0), "P2": (3.0, 25.0)},
    "uniaxial": {"stress_1": (40.0, 300.0), "stress_2": (40.0, 300.0)},
}
"""The paper's ranges of a bulge test, and for a bar what its dimple of .5 mm feels under them (about 12.5 P)."""

JUMP_SHARES = (1 / 6, 5 / 6)
"""The paper's Tj, 2 to 10 h, over its 12 h."""


@dataclass(frozen=True)
class Range:
    """One number, uniform from `low` to `high` on its scale; share_of : the condition of which it is a share."""

    low: float
    high: float
    scale: Literal["linear", "log"] = "linear"
    share_of: str = ""

    def at(self, unit: Floats) -> Floats:
        """Values at coordinates from 0 to 1."""
        if self.scale == "log":
            return np.asarray(np.exp(np.log(self.low) + unit * np.log(self.high / self.low)))
        return self.low + unit * (self.high - self.low)


@dataclass(frozen=True)
class Conditions:
    """What is drawn of each test.

    kind : of specimen. ranges : (condition, its range), in the order of the columns. end : s, of tests whose end is
        not drawn.

    Both levels of the load are drawn alike and then sorted: over equal ranges that is uniform on P2 >= P1, what the
    paper asks for, and no row is wasted.
    """

    kind: str
    ranges: tuple[tuple[str, Range], ...]
    end: float

    @property
    def names(self) -> tuple[str, ...]:
        """The conditions, in the order of the columns."""
        return tuple(name for name, _ in self.ranges)

    def draw(self, unit: Floats) -> Floats:
        """Conditions at coordinates (rows, conditions) from 0 to 1."""
        drawn = {name: r.at(u) for (name, r), u in zip(self.ranges, unit.T, strict=True)}
        for name, r in self.ranges:
            if r.share_of:
                drawn[name] = drawn[name] * drawn.get(r.share_of, self.end)
        first, second = LEVELS[self.kind]
        drawn[first], drawn[second] = (f(drawn[first], drawn[second]) for f in (np.minimum, np.maximum))
        return np.stack([drawn[name] for name in self.names], axis=1)

    def document(self) -> dict[str, Any]:
        """As JSON-able data."""
        return {"kind": self.kind, "end": self.end, "ranges": {name: vars(r) for name, r in self.ranges}}


def conditions(
    kind: str, grid: TimeGrid, given: Mapping[str, Any], defaults: Mapping[str, Any], *, warm: bool
) -> Conditions:
    """Return what is drawn: `defaults` with `given` in their place; a number holds a condition where it is.

    warm : whether the law depends on temperature, which must then be given.
    """
    check_names(kind, given)
    if warm and "temperature" not in {**defaults, **given}:
        raise DatasetError(
            "the law depends on temperature: give its range in K, such as temperature=(1000, 1100), or --range "
            "temperature=1000:1100"
        )
    made = {name: range_of(name, value) for name, value in {**defaults, **given}.items()}
    if "end_time" not in made and grid.relative:
        raise DatasetError("a relative grid needs the end of tests: give end_time in s, a number or (low, high)")
    end = made["end_time"].high if "end_time" in made else grid.end
    made.setdefault("Tj", Range(*JUMP_SHARES, share_of="end_time"))
    _check_levels(kind, made)
    _check_jump(made["Tj"], made["end_time"].low if "end_time" in made else grid.end)
    return Conditions(kind, tuple((name, made[name]) for name in UNITS if name in made), end)


def range_of(name: str, given: Any) -> Range:
    """A range from a number, a pair or a Range; all conditions are positive."""
    if isinstance(given, Range):
        return given
    try:
        low, high = (float(v) for v in (given if np.size(given) > 1 else (given, given)))
    except (TypeError, ValueError):
        raise DatasetError(f"condition '{name}' is {given!r}; give a number or (low, high) in {UNITS[name]}") from None
    if not (np.isfinite([low, high]).all() and low > 0):
        raise DatasetError(
            f"condition '{name}' from {low:g} to {high:g} {UNITS[name]}: it must be finite and above zero"
        )
    if low > high:
        raise DatasetError(f"condition '{name}': the range ({low:g}, {high:g}) is reversed; write ({high:g}, {low:g})")
    return Range(low, high)


def _check_levels(kind: str, made: Mapping[str, Range]) -> None:
    first, second = LEVELS[kind]
    below = made[second].low < made[first].low or made[second].high < made[first].high
    if below:
        found = f"{second} from {made[second].low:g} to {made[second].high:g} MPa"
        than = f"{first}, {made[first].low:g} to {made[first].high:g} MPa"
        raise DatasetError(
            f"{found} reaches below {than}; the second level is never the lower one, so give both ranges"
        )


def _check_jump(jump: Range, end: float) -> None:
    if jump.high >= (1.0 if jump.share_of else end):
        raise DatasetError(
            f"Tj reaches {jump.high:g} s, and tests may end at {end:g} s; give Tj=(low, high) before the end"
        )
