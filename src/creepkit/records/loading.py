"""Loading of a specimen: programs in time, steps of stress or strain, a pressure jump, components at a point."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from types import MappingProxyType
from typing import Any, Literal, Protocol, TypeAlias, runtime_checkable

import numpy as np

from creepkit.arrays import ArrayLike, Floats, frozen, set_fields
from creepkit.checked_arguments import checked
from creepkit.errors import SolveError, quoted

Quantity: TypeAlias = str
"""What a loading prescribes: the name of a load that a specimen takes, such as "stress", "pressure" or "force"."""


@checked
@dataclass(frozen=True)
class Program:
    """A piecewise linear function of time; a repeated time is a jump (the value after it holds from then on).

    times : (breakpoints,) s, non-decreasing, starting at 0.
    values : (breakpoints,).
    """

    times: Floats
    values: Floats

    def __post_init__(self) -> None:
        times, values = frozen(np.atleast_1d(self.times)), frozen(np.atleast_1d(self.values))
        if times.shape != values.shape or times.ndim != 1 or times.size == 0:
            raise SolveError(f"a program needs as many values as times, found {values.size} and {times.size}")
        if not (np.isfinite(times).all() and np.isfinite(values).all()):
            raise SolveError("a program of times and values must hold finite numbers only")
        if times[0] != 0.0 or (np.diff(times) < 0).any():
            raise SolveError("the times of a program must start at 0 and never decrease")
        set_fields(self, times=times, values=values)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Program):
            return NotImplemented
        return np.array_equal(self.times, other.times) and np.array_equal(self.values, other.values)

    def __hash__(self) -> int:
        return hash((self.times.tobytes(), self.values.tobytes()))

    @classmethod
    @checked
    def constant(cls, value: float) -> Program:
        """The program that holds one value for ever."""
        return cls(np.zeros(1), np.full(1, float(value)))

    @classmethod
    @checked
    def steps(cls, steps: Sequence[tuple[float, float]]) -> Program:
        """Constant pieces from (start time, value) pairs: [(0, 100), (3600, 120)]; SolveError for any other order."""
        starts = [start for start, _ in steps]
        if not starts or starts[0] != 0.0 or any(b <= a for a, b in pairwise(starts)):
            raise SolveError(f"steps of a program must start at 0 and follow one another, found {quoted(starts)}")
        times, values = [0.0], [float(steps[0][1])]
        for start, value in steps[1:]:
            times += [float(start)] * 2
            values += [values[-1], float(value)]
        return cls(np.array(times), np.array(values))

    def at(self, times: ArrayLike) -> Floats:
        """(...,) values at times (...,) s: the later one at a jump, the last one beyond the end."""
        return self._interpolated(times, "right")

    def before(self, times: ArrayLike) -> Floats:
        """(...,) values as times (...,) s are approached from the left: the earlier one at a jump."""
        return self._interpolated(times, "left")

    def _interpolated(self, times: ArrayLike, side: Literal["left", "right"]) -> Floats:
        t = np.asarray(times, dtype=float)
        if self.times.size == 1:
            return np.full(t.shape, self.values[0])
        index = np.maximum(np.searchsorted(self.times, t, side=side) - 1, 0)
        following = np.minimum(index + 1, self.times.size - 1)
        width = self.times[following] - self.times[index]
        fraction = np.divide(t - self.times[index], width, out=np.zeros_like(t), where=width > 0)
        return np.asarray(self.values[index] + fraction * (self.values[following] - self.values[index]))


@runtime_checkable
class Loading(Protocol):
    """What drives a specimen: one prescribed quantity as a piecewise linear program.

    One of a stress may say by `control` what is held, as StressSteps does; see held_of().
    """

    @property
    def quantity(self) -> Quantity:
        """What is prescribed."""

    def program(self) -> Program:
        """The prescribed quantity over time: MPa, or a strain."""


def held_of(loading: Loading) -> Literal["load", "stress"]:
    """What a loading of a stress holds: the load, or the true stress where it says so."""
    return "stress" if getattr(loading, "control", "load") == "stress" else "load"


def held_otherwise(loading: Loading) -> tuple[Loading, Literal["load", "stress"]] | None:
    """A loading of a stress that holds the load in place of the true stress, or the reverse, and which; or None."""
    if not isinstance(loading, StressSteps | RecordedLoading) or loading.quantity != "stress":
        return None
    other: Literal["load", "stress"] = "load" if loading.control == "stress" else "stress"
    return replace(loading, control=other), other


@checked
@dataclass(frozen=True)
class StressSteps:
    """Uniaxial loading by steps of stress: [(0, 100), (3600, 120)] is 100 MPa, then 120 MPa from one hour on.

    steps : (time in s, MPa), tension above zero and compression below.
    control : "load" when the load is constant in each step (stress is engineering stress and true stress grows as
        exp(strain)); "stress" when true stress is held.
    """

    steps: tuple[tuple[float, float], ...]
    control: Literal["load", "stress"] = "load"
    quantity: Quantity = field(default="stress", init=False)

    def __post_init__(self) -> None:
        steps = _checked_steps("stress steps", self.steps)
        if any(not abs(s) < 1e5 for _, s in steps):
            raise SolveError(f"stress must lie from -1e5 to 1e5 MPa in every step, found {[s for _, s in steps]}")
        object.__setattr__(self, "steps", steps)

    def program(self) -> Program:
        """Stress over time, MPa."""
        return Program.steps(self.steps)


@checked
def constant_stress(stress: float, control: Literal["load", "stress"] = "load") -> StressSteps:
    """One stress, MPa, from time zero: nominal under a constant load, as most rigs hold it, unless control = "stress".

    control : "load": the force is held, and the true stress grows as exp(strain); "stress": the true stress is held.
    """
    return StressSteps(((0.0, stress),), control)


@checked
@dataclass(frozen=True)
class StrainSteps:
    """Total strain of a bar by steps: [(0, 0.002), (3600, 0.003)] holds 0.2 %, then 0.3 % from one hour on.

    steps : (time in s, total strain), below zero where the bar is shortened.
    ramp : s, in which each strain is reached; 0 is at once.
    """

    steps: tuple[tuple[float, float], ...]
    ramp: float = 0.0
    quantity: Quantity = field(default="strain", init=False)

    def __post_init__(self) -> None:
        steps = _checked_steps("strain steps", self.steps)
        if any(not -0.99 <= e <= 1 for _, e in steps):
            raise SolveError(f"total strain must lie from -0.99 to 1 in every step, found {[e for _, e in steps]}")
        _check_ramp(self.ramp, steps)
        object.__setattr__(self, "steps", steps)

    def program(self) -> Program:
        """Total strain over time."""
        return _ramped_program(self.steps, self.ramp)


@checked
def constant_strain(strain: float, ramp: float = 0.0) -> StrainSteps:
    """One total strain, held from time zero, or from the end of a ramp (s) on."""
    return StrainSteps(((0.0, strain),), ramp)


@checked
@dataclass(frozen=True)
class PressureJump:
    """Gas pressure P1, then P2 from Tj on, each reached by a linear ramp; MPa and s."""

    P1: float
    P2: float
    Tj: float
    ramp: float = 5.0
    quantity: Quantity = field(default="pressure", init=False)

    def __post_init__(self) -> None:
        if not (self.P1 > 0 and self.P2 > 0 and self.ramp > 0 and self.Tj > self.ramp):
            raise SolveError("a pressure jump needs P1, P2 and ramp above zero and Tj after the first ramp")

    def program(self) -> Program:
        """Pressure over time, MPa."""
        times = np.array([0.0, self.ramp, self.Tj, self.Tj + self.ramp])
        return Program(times, np.array([0.0, self.P1, self.P1, self.P2]))


@checked
@dataclass(frozen=True)
class RecordedLoading:
    """A loading known as a program over time: a recorded column, or ramps that no simpler record describes.

    quantity : name of a load of the specimen, such as "pressure" or "force", in its unit.
    control : as in StressSteps; without meaning for another load than a stress.
    """

    record: Program
    quantity: Quantity
    control: Literal["load", "stress"] = "load"

    def __post_init__(self) -> None:
        if self.quantity == "components":
            raise SolveError("a loading of components is no single program; use PointLoading")

    def program(self) -> Program:
        """Stress, pressure or total strain over time."""
        return self.record


@checked
def constant_load(quantity: Quantity, value: float, ramp: float = 0.0) -> RecordedLoading:
    """A load, in its unit, held from time zero, or from the end of a ramp (s) on: constant_load("force", 250.0)."""
    return load_steps(quantity, [(0.0, value)], ramp)


@dataclass(frozen=True)
class TwoLevels:
    """Two levels of a load, and when the second begins, s."""

    first: float
    second: float
    time: float


def loading_of(
    quantity: Quantity,
    value: float | Sequence[tuple[float, float]] | Program | TwoLevels,
    *,
    control: Literal["load", "stress"] = "load",
    ramp: float | None = None,
    end: float = np.inf,
) -> Loading:
    """The loading by a quantity that is stated by a number, steps, a program or a jump.

    control : of a stress, as in StressSteps. ramp : s, in which each level is reached; by default that of a pressure is
    PressureJump's own, and others are imposed at once. end : s, when the test ends.
    """
    if isinstance(value, Program):
        return RecordedLoading(value, quantity, control)
    if quantity == "pressure" and not isinstance(value, Sequence):
        jump = value if isinstance(value, TwoLevels) else TwoLevels(value, value, end)
        given = {} if ramp is None else {"ramp": ramp}
        return PressureJump(jump.first, jump.second, jump.time, **given)
    steps: tuple[tuple[float, float], ...]
    if isinstance(value, TwoLevels):
        steps = ((0.0, value.first), (value.time, value.second))
    else:
        steps = tuple((t, v) for t, v in value) if isinstance(value, Sequence) else ((0.0, value),)
    if quantity == "stress":
        return StressSteps(steps, control)
    if quantity == "strain":
        return StrainSteps(steps, ramp or 0.0)
    return load_steps(quantity, steps, ramp or 0.0)


@checked
def load_steps(quantity: Quantity, steps: Sequence[tuple[float, float]], ramp: float = 0.0) -> RecordedLoading:
    """A load by steps: load_steps("force", [(0, 100), (3600, 120)]) is 100 N, then 120 N from one hour on.

    steps : (time in s, value in the unit of the load). ramp : s, in which each value is reached; 0 is at once.
    """
    pairs = _checked_steps(f"steps of {quantity}", steps)
    _check_ramp(ramp, pairs)
    return RecordedLoading(_ramped_program(pairs, ramp), quantity)


def _checked_steps(what: str, steps: Sequence[tuple[float, float]]) -> tuple[tuple[float, float], ...]:
    """Steps as pairs of float; SolveError unless they start at 0 and follow one another."""
    pairs = tuple((float(t), float(value)) for t, value in steps)
    if not pairs or pairs[0][0] != 0.0 or any(b[0] <= a[0] for a, b in pairwise(pairs)):
        raise SolveError(f"{what} must start at time 0 and follow one another in time")
    return pairs


def _check_ramp(ramp: float, steps: Sequence[tuple[float, float]]) -> None:
    shortest = min([b[0] - a[0] for a, b in pairwise(steps)], default=np.inf)
    if not 0 <= ramp <= shortest or not np.isfinite(ramp):
        raise SolveError(f"ramp is {ramp:g} s; it must not be negative nor outlast a step ({shortest:g} s)")


def _ramped_program(steps: Sequence[tuple[float, float]], ramp: float) -> Program:
    """Each value reached after a ramp, from 0 on; at once where the ramp is 0 s."""
    if ramp == 0.0:
        return Program.steps(steps)
    times = [t for start, _ in steps for t in (start, start + ramp)]
    values = [0.0, *(value for _, value in steps)]
    return Program(np.array(times), np.array([v for pair in pairwise(values) for v in pair]))


TENSOR_COMPONENTS = ("11", "22", "33", "12", "23", "13")
"""Names of the components of a stress or strain, in the order of every vector of six; shear strains of the tensor."""


ComponentHistory: TypeAlias = float | Program | Sequence[tuple[float, float]]
"""A constant, a program, or steps as (start time, value) pairs."""


@checked
@dataclass(frozen=True)
class PointLoading:
    """Stresses (MPa) and total strains (of the tensor) prescribed at a material point, by component "11" to "13".

    PointLoading(stress={"11": 100, "12": [(0, 0), (3600, 40)]}, strain={"33": 0.0}) is tension, torsion from one hour
    on, and no strain along 33. What is named in neither is free of stress.
    """

    stress: Mapping[str, Program] = field(default_factory=dict)
    strain: Mapping[str, Program] = field(default_factory=dict)
    quantity: Quantity = field(default="components", init=False)

    def __init__(
        self, stress: Mapping[str, ComponentHistory] | None = None, strain: Mapping[str, ComponentHistory] | None = None
    ) -> None:
        given = {"stress": dict(stress or {}), "strain": dict(strain or {})}
        for name in (*given["stress"], *given["strain"]):
            if name not in TENSOR_COMPONENTS:
                raise SolveError(f"there is no component '{name}' to load; allowed are {', '.join(TENSOR_COMPONENTS)}")
        for name in given["stress"].keys() & given["strain"].keys():
            raise SolveError(f"component {name} has both a stress and a strain prescribed; keep one of them")
        if not (given["stress"] or given["strain"]):
            raise SolveError(
                'a material point needs a stress or a strain of some component, such as stress={"11": 100}'
            )
        for kind, components in given.items():
            ordered = {name: _as_program(components[name]) for name in TENSOR_COMPONENTS if name in components}
            object.__setattr__(self, kind, MappingProxyType(ordered))
        object.__setattr__(self, "quantity", "components")

    def __reduce__(self) -> tuple[Any, ...]:
        return PointLoading, (dict(self.stress), dict(self.strain))

    def __hash__(self) -> int:
        return hash((tuple(self.stress.items()), tuple(self.strain.items())))

    def program(self) -> Program:
        """The first prescribed component over time; `stress` and `strain` hold them all."""
        return next(iter([*self.stress.values(), *self.strain.values()]))


def _as_program(given: ComponentHistory) -> Program:
    if isinstance(given, Program):
        return given
    if isinstance(given, Sequence):
        return Program.steps(given)
    return Program.constant(given)


MOST_LEVELS = 4
"""Of a load, that are all named; of more, the first and the last."""


RAMPED = 0.05
"""Of the largest load, with which a record that holds the loading ramp begins at most."""


def loading_text(loading: Loading, unit: str = "MPa") -> str:
    """What is imposed, as people say it: '43 MPa', '60 to 95 MPa', '0.2 % strain', '11 100 MPa, 12 40 MPa'.

    unit : of the load.
    """
    if isinstance(loading, PointLoading):
        parts = [f"{name} {_levels_text(p)} MPa" for name, p in loading.stress.items()]
        return ", ".join(parts + [f"strain {name} {_levels_text(p)}" for name, p in loading.strain.items()])
    if loading.quantity == "strain":
        return f"{_levels_text(loading.program(), 100.0)} % strain"
    return f"{_levels_text(loading.program())} {unit}"


def _levels_text(program: Program, factor: float = 1.0) -> str:
    held, values = _held_levels(program), program.values
    if 1 <= len(held) <= MOST_LEVELS and max(held) == values.max():
        return " to ".join(f"{factor * level:.{6 if factor == 1.0 else 4}g}" for level in held)
    if values[0] <= RAMPED * values.max() > 0.0:  # a load that was recorded from its ramp on
        return f"{factor * (values[-1] if values[-1] > 0.5 * values.max() else values.max()):.4g}"
    return f"{factor * values[0]:.6g} to {factor * values[-1]:.6g}"


def _held_levels(program: Program) -> list[float]:
    """The values that are held in turn, the last one beyond the end, without zeros before and after.

    [] of a program that begins and ends at other values than it holds.
    """
    values = [float(v) for v in program.values]
    held = [v for k, v in enumerate(values) if k == len(values) - 1 or v == values[k + 1]]
    levels = [v for v, _ in itertools.groupby(held)]
    while len(levels) > 1 and levels[0] == 0.0:
        del levels[0]
    while len(levels) > 1 and levels[-1] == 0.0:
        del levels[-1]
    return levels if values[0] in (0.0, levels[0]) else []
